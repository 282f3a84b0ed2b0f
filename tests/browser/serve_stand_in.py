"""Labelling page of a small building whose reports are quick stand-ins: ``python serve_stand_in.py FOLDER``.

Writes the page's address to stdout. FOLDER gets the case and ``export.csv``, telemetry under the names of an automation
system.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from thermal.pilot.building import pilot_building
from thermal.plan.folder import save_plan_case
from thermal.plan.page.desk import LabelDesk
from thermal.plan.page.serve import serve_page

Progress = Callable[[str, int, int], None]
STEPS = 288 * 3  # three days of five minutes


def export(zones: list[str], path: Path) -> None:
    """Write temperatures and air flows of zones, outdoor temperature, and a column that nobody knows."""
    hours, random = np.arange(STEPS) / 12.0, np.random.default_rng(0)
    stamps = pd.date_range("2024-01-10", periods=STEPS, freq="5min").strftime("%Y-%m-%dT%H:%M:%S-08:00")
    wave = np.sin(2.0 * np.pi * hours / 24.0)
    means = {"ZAT": (21.0, 1.0, 0.05), "Airflow": (0.1, 0.05, 0.002), "DAT": (22.0, 6.0, 0.1)}  # mean, swing, noise
    columns = {
        f"VAV-{zone.replace('_', '-')} {word}": mean + swing * wave + noise * random.standard_normal(STEPS)
        for zone in zones
        for word, (mean, swing, noise) in means.items()
    }
    columns |= {"OAT": 5.0 + 4.0 * wave + 0.05 * random.standard_normal(STEPS), "Lift alarm": np.zeros(STEPS)}
    pd.DataFrame({"timestamp": stamps, **columns}).to_csv(path, index=False)


def diagnose(case: Path, out: Path, progress: Progress, units: str) -> None:
    """Take a moment, and write a page at the end."""
    for done in range(20):
        progress("fitting", done, 20)
        time.sleep(0.1)
    out.mkdir(parents=True, exist_ok=True)
    (out / "diagnosis.json").write_text("{}", encoding="utf-8")
    (out / "report.html").write_text(f'<p class="verdict">It fits, in {units}.</p>', encoding="utf-8")


def calibrate(case: Path, out: Path, progress: Progress, units: str) -> None:
    """Go on until stopped, however slow the machine and its browser are; it never gets past a half."""
    for done in range(1000):
        progress("fitting", min(done, 10), 20)
        time.sleep(0.5)
    raise TimeoutError("nobody has stopped it")


def main() -> None:
    """Serve until interrupted."""
    folder = Path(sys.argv[1])
    building = pilot_building(1, floor_area=600.0, zones=12, floors=1)
    save_plan_case(building, folder / "case")
    export(list(building.zone_names), folder / "export.csv")
    desk = LabelDesk(folder / "case", makers={"calibrate": calibrate, "diagnose": diagnose})
    serve_page(desk, ready=lambda address: sys.stdout.write(f"{address}\n") and sys.stdout.flush())


if __name__ == "__main__":
    main()
