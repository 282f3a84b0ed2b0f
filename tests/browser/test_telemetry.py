"""A browser gives a case its telemetry and makes reports; run ``tests/browser/install.sh`` first.

Reports are stand-ins of seconds; `benchmarks/newcomer_path.py` makes real ones. ``BUILDINGMPC_PICTURES=DIR`` keeps
pictures.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="needs the extra [pages]")

HERE = Path(__file__).parent
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MODULES = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "buildingmpc-browser" / "node_modules"
if CHROMIUM is None or shutil.which("node") is None or not (MODULES / "playwright-core").is_dir():
    pytest.skip("needs chromium and playwright-core: run tests/browser/install.sh", allow_module_level=True)


def test_a_browser_gives_telemetry_and_makes_reports(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(HERE / "serve_stand_in.py"), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().strip()
            person = ["node", str(HERE / "telemetry.mjs"), address, str(tmp_path), str(MODULES), str(CHROMIUM)]
            pictures = [os.environ["BUILDINGMPC_PICTURES"]] if "BUILDINGMPC_PICTURES" in os.environ else []
            done = subprocess.run([*person, *pictures], capture_output=True, text=True, timeout=300)
        finally:
            server.kill()
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert seen["matched"] == "export.csv: 37 of 38 columns are matched"
    assert seen["verdict"].startswith("Nothing speaks against a calibration")
    assert (seen["red_while_saving"], seen["red_when_saved"]) == (False, False)
    assert (seen["reports"], seen["report"]) == (1, "It fits.")  # what was stopped has left nothing
    assert "On a phone" in seen["phone"] and seen["overflow"] <= 0
    own = tmp_path / "case" / "labelling"
    assert sorted(path.name for path in (own / "reports").iterdir()) == ["diagnose"]
    assert (own / "telemetry" / "points.csv").is_file()
