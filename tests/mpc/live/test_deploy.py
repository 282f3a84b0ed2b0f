"""The units of systemd: each is one that systemd takes, and there is one for each part."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from mpc.cli.operate import _PARTS

UNITS = sorted((Path(__file__).parents[3] / "deploy").glob("*.service"))


def test_units_are_taken_by_systemd(tmp_path: Path) -> None:
    texts = {path.name: path.read_text(encoding="utf-8") for path in UNITS}
    assert {re.search(r"--part (\w+)", text)[1] for text in texts.values()} == set(_PARTS)  # type: ignore[index]
    program = shutil.which("systemd-analyze")
    if program is None:
        pytest.skip("needs systemd-analyze (Debian: systemd)")
    for name, text in texts.items():
        (tmp_path / name).write_text(re.sub(r"/opt/\S+/buildingmpc", "/bin/true", text), encoding="utf-8")
    told = subprocess.run(
        [program, "verify", *map(str, sorted(tmp_path.iterdir()))], capture_output=True, text=True, check=False
    )  # fmt: skip
    assert (told.returncode, told.stderr) == (0, "")
