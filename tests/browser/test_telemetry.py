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

from mpc.reports.units import converted_text

HERE = Path(__file__).parent
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MODULES = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "buildingmpc-browser" / "node_modules"
if CHROMIUM is None or shutil.which("node") is None or not (MODULES / "playwright-core").is_dir():
    pytest.skip("needs chromium and playwright-core: run tests/browser/install.sh", allow_module_level=True)


#: What the server may say, to be read in feet and °F.
SENTENCES = [
    "It falls from 0.46 to 0.32 K in 384 m², at 21 °C and 40 %.", "expected between 2 and 6 m, found 1 200 m",
    "usable 98 % of 1 200 W", "-10.5 °C; 12 kWh; 0.05 kg/s", "VAV_3 K: 2 of 4 m/s are 0 m/s",
]  # fmt: skip


@pytest.mark.long
def test_a_browser_gives_telemetry_and_makes_reports(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(HERE / "serve_stand_in.py"), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().strip()
            person = ["node", str(HERE / "telemetry.mjs"), address, str(tmp_path), str(MODULES), str(CHROMIUM)]
            person.append(json.dumps(SENTENCES))
            pictures = [os.environ["BUILDINGMPC_PICTURES"]] if "BUILDINGMPC_PICTURES" in os.environ else []
            done = subprocess.run([*person, *pictures], capture_output=True, text=True, timeout=300)
        finally:
            server.kill()
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert seen["matched"] == "export.csv: 37 of 38 columns are matched"
    assert seen["verdict"].startswith("Nothing speaks against a calibration")
    assert (seen["red_while_saving"], seen["red_when_saved"]) == (False, False)
    assert (seen["reports"], seen["report"]) == (1, "It fits, in ip.")  # what was stopped has left nothing
    own = tmp_path / "case" / "labelling"
    assert seen["told"] == [converted_text(text) for text in SENTENCES]
    assert (seen["height"], seen["area"].split()[1], seen["bar"].split()[1]) == ("10", "ft²", "ft")
    (height,) = {floor["height"] for floor in json.loads((own / "labelling.json").read_text(encoding="utf-8"))["floors"]}
    assert height == pytest.approx(3.048)
    assert "On a phone" in seen["phone"] and seen["overflow"] <= 0
    assert sorted(path.name for path in (own / "reports").iterdir()) == ["diagnose"]
    assert (own / "telemetry" / "points.csv").is_file()
