"""Pictures of ``docs/gallery.md``: reports of the bundled case and of small buildings that are made here.

Run: ``python benchmarks/gallery.py --out results/gallery``, with the extra ``[energyplus]`` and, for a page's picture,
chromium; a quarter of an hour. A run whose results are there is not run again, so that one of them is made anew
by removing its folder. ``--only NAME`` makes one picture. They go into ``docs/images``, as ``gallery_NAME.png``.
"""

from __future__ import annotations

import argparse
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from _monitored_years import make_year
from PIL import Image

from thermal import save_case
from thermal.data import bundled_case_path
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinSettings, generate_twin

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
#: The year of the monitoring's benchmark that is shown: its seed, one without a table, and days that are kept of it.
YEAR_SEED, YEAR_DAYS, STEPS_A_DAY = 150, 140, 48
#: Width of a picture, and colours that it keeps: text stays sharp, a picture stays below some 100 kB.
WIDTH, COLOURS = 1400, 255


@dataclass(frozen=True)
class Picture:
    """A picture: the run that it is of, and which of its figures, or how much of its page."""

    run: str
    figure: str = ""
    page: tuple[int, int] = (0, 0)


def bundled(folder: Path) -> None:
    """Copy the bundled case."""
    shutil.copytree(str(bundled_case_path()), folder)


def year(folder: Path) -> None:
    """Make half a year of an office in which something changes."""
    case, _ = make_year(YEAR_SEED, True)
    frame = case.telemetry.frame.iloc[: YEAR_DAYS * STEPS_A_DAY]
    save_case(replace(case, telemetry=replace(case.telemetry, frame=frame)), folder)


def fleet(folder: Path) -> None:
    """Make offices with parameters drawn from their priors."""
    for seed in range(6):
        office = pilot_building(seed, floor_area=150.0, zones=4, floors=1, name=f"office {seed + 1}")
        save_case(generate_twin(office, seed, TwinSettings(days=7.0, dx=1.0))[0], folder / f"office_{seed + 1}")


def house(folder: Path) -> None:
    """Make the house with a heat pump of the plants to develop on."""
    script = ROOT / "benchmarks" / "make_foreign_plants.py"
    subprocess.run([sys.executable, str(script), "--out", str(folder), "--plants", "house"], check=True)


INPUTS: dict[str, Callable[[Path], None]] = {"case": bundled, "year": year, "fleet": fleet, "plants": house}

#: Commands, in order; words in braces are folders of what is made before.
RUNS = {
    "calibrate": "calibrate {case}",
    "diagnose": "diagnose {case}",
    "compare": "compare {case} --parameters {diagnose}/calibration.json --controllers schedule,guideline36,mpc "
    "--start 2023-03-02 --end 2023-03-09",
    "control": "control {case} --parameters {diagnose}/calibration.json --controller mpc "
    "--start 2023-03-06 --end 2023-03-08",
    "monitor": "monitor {year}",
    "identify": "identify {plants}/house/plant.yaml --days 14",
    "many": "calibrate {fleet} --workers 1 --dx 1",
}

PICTURES = {
    "calibration": Picture("calibrate", "mean_absolute_error_over_the_horizon"),
    "opening": Picture("diagnose", page=(0, 680)),
    "where": Picture("diagnose", "missing_heat_on_floor_f1"),
    "how_far": Picture("diagnose", "zone_f1_s"),
    "monitoring": Picture("monitor", "changes"),
    "costs": Picture("compare", "energy_cost_and_discomfort"),
    "compare": Picture("compare", "cost"),
    "closed_loop": Picture("control", "optimal_control"),
    "heat_pump": Picture("identify", "power_and_efficiency"),
    "many": Picture("many", "errors_of_each_building"),
}


def ready(name: str, out: Path) -> Path:
    """Folder of an input or of a run's results, made where it is not there."""
    folder = out / name
    if folder.exists():
        return folder
    if name in INPUTS:
        INPUTS[name](folder)
        return folder
    made = {part: str(ready(part, out)) for part in (*INPUTS, *RUNS) if f"{{{part}}}" in RUNS[name]}
    words = RUNS[name].format(**made).split()
    print("buildingmpc", *words, flush=True)
    subprocess.run([sys.executable, "-m", "mpc.cli", *words, "--figures", "png", "--out", str(folder)], check=True)
    return folder


def drawn(picture: Picture, folder: Path) -> Image.Image:
    """Open a figure of a run, or take a picture of a part of its page."""
    if picture.figure:
        found = sorted(folder.rglob(f"figure_??_{picture.figure}*.png"))
        if not found:
            names = ", ".join(sorted(p.name for p in folder.glob("*.png")))
            raise SystemExit(f"{folder}: expected a figure '{picture.figure}', found {names}")
        return Image.open(found[0])
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        raise SystemExit(f"{folder}: a picture of a page needs chromium")
    top, bottom = picture.page
    with tempfile.TemporaryDirectory() as temporary:
        shot = Path(temporary) / "page.png"
        sizes = [f"--window-size=1100,{bottom}", "--force-device-scale-factor=1.5", "--hide-scrollbars"]
        page = (folder / "report.html").resolve().as_uri()
        subprocess.run(
            [browser, "--headless", "--no-sandbox", *sizes, f"--screenshot={shot}", page],
            check=True,
            capture_output=True,
        )
        image = Image.open(io.BytesIO(shot.read_bytes()))
    return image.crop((0, round(1.5 * top), image.width, round(1.5 * bottom)))


def main() -> None:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--only", choices=list(PICTURES), help="one picture")
    options = parser.parse_args()
    for name in [options.only] if options.only else PICTURES:
        image = drawn(PICTURES[name], ready(PICTURES[name].run, options.out)).convert("RGB")
        if image.width > WIDTH:
            image = image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS)
        path = IMAGES / f"gallery_{name}.png"
        image.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
