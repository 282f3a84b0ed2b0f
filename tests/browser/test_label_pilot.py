"""A browser labels the pilot building from PNGs and a CSV; run ``tests/browser/install.sh`` first.

The pilot with its 127 devices takes a minute or two of one core and runs with ``BUILDINGMPC_BROWSER=full``; otherwise a
building of 12 zones is labelled. ``BUILDINGMPC_PICTURES=DIR`` writes pictures and numbers; the picture of the
documentation is made by::

    BUILDINGMPC_BROWSER=full BUILDINGMPC_PICTURES=pictures pytest tests/browser
    cp pictures/labelling.png docs/images
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="needs the extra [pages]")
pytest.importorskip("skimage", reason="needs the extra [plan]")

HERE = Path(__file__).parent
FULL = os.environ.get("BUILDINGMPC_BROWSER") == "full"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MODULES = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "buildingmpc-browser" / "node_modules"
if CHROMIUM is None or shutil.which("node") is None or not (MODULES / "playwright-core").is_dir():
    pytest.skip("needs chromium and playwright-core: run tests/browser/install.sh", allow_module_level=True)


def shrink(picture: Path) -> None:
    """Make a picture small enough for the documentation."""
    from PIL import Image

    with Image.open(picture) as image:
        image.convert("RGB").resize((1152, 720), Image.Resampling.LANCZOS).quantize(64).save(picture, optimize=True)


@pytest.fixture
def truth(tmp_path: Path) -> dict[str, Any]:
    """Drawings, list of devices, and what is true of them."""
    from importlib.util import module_from_spec, spec_from_file_location

    spec = spec_from_file_location("pilot_drawings", HERE / "pilot.py")
    assert spec is not None and spec.loader is not None
    pilot = module_from_spec(spec)
    spec.loader.exec_module(pilot)
    (tmp_path / "drawings").mkdir()
    pilot.write_bomb(tmp_path / "drawings")
    size = {} if FULL else {"seed": 1, "zones": 12, "floor_area": 600.0, "pixel": 0.05}
    return pilot.draw_pilot(tmp_path / "drawings", **size)  # type: ignore[no-any-return]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A server of a new case, and its address."""
    command = [sys.executable, "-m", "mpc.cli", "label", str(tmp_path / "case"), "--no-browser"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        try:
            assert process.stdout is not None
            lines = [process.stdout.readline(), process.stdout.readline()]
            address = re.search(r"http://127\.0\.0\.1:\d+/\S+/", "".join(lines))
            assert address is not None, lines
            yield address[0], process
        finally:
            process.kill()


@pytest.mark.long
def test_a_browser_labels_a_building(truth: dict[str, Any], server: tuple[str, Any], tmp_path: Path) -> None:
    pictures = Path(os.environ["BUILDINGMPC_PICTURES"]) if "BUILDINGMPC_PICTURES" in os.environ else None
    command = [
        "node",
        str(HERE / "label_pilot.mjs"),
        server[0],
        str(tmp_path / "drawings"),
        str(MODULES),
        str(CHROMIUM),
    ]
    done = subprocess.run(
        [*command, *([str(pictures)] if pictures else [])], capture_output=True, text=True, timeout=1800
    )
    assert done.returncode == 0, done.stderr
    numbers = json.loads(done.stdout)
    if pictures is not None:
        (pictures / "numbers.json").write_text(json.dumps(numbers, indent=2), encoding="utf-8")
        shrink(pictures / "labelling.png")
    assert numbers["slowest_placement"] < 15.0 and numbers["seconds_per_device"] < 15.0
    assert numbers["told"].startswith("This case is open in another window")
    assert "bomb.png" in numbers["refusal"]

    server[1].send_signal(signal.SIGINT)
    assert server[1].wait(timeout=10) == 0
    check = subprocess.run(
        [sys.executable, "-m", "mpc.cli", "check", str(tmp_path / "case"), "--json"], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, timeout=120,
    )  # fmt: skip
    assert check.returncode == 0, check.stderr
    found = json.loads(check.stdout)
    assert {d["name"]: d["zone"] for d in found["devices"]} == truth["devices"]
    areas = {zone["name"]: zone["floor_area"] for zone in found["zones"]}
    assert areas == pytest.approx(truth["areas"], rel=0.02)
    own = json.loads((tmp_path / "case" / "labelling" / "labelling.json").read_text(encoding="utf-8"))
    assert own["seconds"] > 1.0
    assert "minutes of work" in (tmp_path / "case" / "building.yaml").read_text(encoding="utf-8")
    assert {p.name for p in tmp_path.iterdir()} == {"drawings", "case"}
