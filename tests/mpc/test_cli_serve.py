"""``buildingmpc serve`` as a process: what it says, who may reach it, how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from mpc.cli.serve import serve
from mpc.errors import BoptestError
from thermal.data import bundled_case_path

COMMAND = [sys.executable, "-m", "mpc.cli", "serve"]


@contextmanager
def running(*arguments: str) -> Iterator[tuple[dict[str, Any], subprocess.Popen[str]]]:
    """The command once it listens, with what it said."""
    process = subprocess.Popen(
        [*COMMAND, "--port", "0", "--json", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        lines = []
        assert process.stdout is not None
        while not lines or lines[-1] != "}\n":
            lines.append(process.stdout.readline())
            assert lines[-1], process.communicate()
        yield json.loads("".join(lines)), process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT")
def test_the_bundled_case_is_served_until_it_is_interrupted() -> None:
    with running(str(bundled_case_path()), "--dx", "1.0") as (said, process):
        assert said["testcases"]["bundled_case"]["zones"] == 5
        assert "peak_heat_day" in said["testcases"]["bundled_case"]["periods"]
        url = said["url"]
        assert url.startswith("http://127.0.0.1:")
        testid = httpx.post(f"{url}/testcases/bundled_case/select", timeout=120.0, trust_env=False).json()["testid"]
        begun = httpx.put(f"{url}/initialize/{testid}", json={"start_time": 61 * 86_400, "warmup_period": 3600},
                          timeout=120.0, trust_env=False).json()  # fmt: skip
        assert begun["payload"]["time"] == 61 * 86_400
        assert 280.0 < begun["payload"]["reaTZon_F1_N_y"] < 305.0
        late = httpx.put(
            f"{url}/initialize/{testid}", json={"start_time": 0, "warmup_period": 0}, timeout=120.0, trust_env=False
        )
        assert late.status_code == 400 and "weather" in late.json()["message"]
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
        assert (process.returncode, errors) == (0, "")


def test_what_is_refused() -> None:
    with pytest.raises(BoptestError, match="--allow-remote"):
        serve(host="0.0.0.0")
    with pytest.raises(BoptestError, match="serve it alone"):
        serve([Path("a"), Path("b")], parameters=Path("calibration.json"))
