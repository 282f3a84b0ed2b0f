"""Make the bundled case `thermal/data/bundled_case` with EnergyPlus 25.2.

Run from the repository's root, in an environment with Python 3.11 or newer::

    pip install -e .[energyplus]
    python benchmarks/make_bundled_case.py --force

The case is one floor with five zones, ten days at five minutes. What the building holds besides walls, windows, slabs
and heat is written to `bundled_case_truth.json` beside this script (for another `--out`: to `OUT_truth.json`).
`--effects none --out DIR` writes its twin without sun inside: everything else, the weather station's sun included,
is the same. The run is seeded: two runs give the same values.
"""

import argparse
import logging
import tempfile
from datetime import date, timedelta
from pathlib import Path

import pandas as pd
from energyplus_case import folder, model, run, sensors
from energyplus_trials.frame import SITE_OUTPUTS, STEPS_PER_HOUR
from rich.logging import RichHandler

from thermal.case.load import load_case

HERE = Path(__file__).resolve().parent
VERSION = "25.2"  # of EnergyPlus, as pyenergyplus-lbnl 26.1.0 brings it
OUT = HERE.parent / "thermal" / "data" / "bundled_case"
TRUTH = HERE / "bundled_case_truth.json"
WEATHER = "USA_NJ_Newark.Intl.AP.725020_TMY3.epw"  # one of the 16 weather files that pyenergyplus-lbnl brings
TIMEZONE = "Etc/GMT+5"  # its standard time; POSIX sign: five hours behind UTC
LOCATION = {"latitude": 40.72, "longitude": -74.18, "elevation": 3.0, "timezone": TIMEZONE}  # of that file
FIRST = date(2023, 3, 1)  # a typical year has no year: 2023 stands for it
DAYS = 10  # sunny, broken and overcast days take turns; -11 to 12 degC outdoors
RUN_IN_DAYS = 14
SEED = 20230301
SIZE_LIMIT = 1_500_000  # [byte], of the whole folder
EFFECTS = {"solar_gain": ["solar_gain"], "none": []}

logger = logging.getLogger("make_bundled_case")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=OUT, help="case folder to write (default: the bundled one)")
    parser.add_argument("--effects", choices=list(EFFECTS), default="solar_gain", help="what the building holds")
    parser.add_argument("--seed", type=int, default=SEED, help="of set points and noise")
    parser.add_argument("--force", action="store_true", help="replace an existing case folder")
    arguments = parser.parse_args()
    if arguments.out.resolve() == OUT and arguments.effects != "solar_gain":
        parser.error("--effects none needs another --out: the bundled case has solar gain")
    if arguments.out.exists() and not arguments.force:
        parser.error(f"{arguments.out} exists; pass --force to replace it")
    return arguments


def _weather_file() -> Path:
    try:
        import pyenergyplus
    except ImportError as error:
        raise run.EnergyPlusError("EnergyPlus is not installed: pip install -e .[energyplus]") from error
    return Path(pyenergyplus.__file__).parent / "data" / "weather" / WEATHER


def _simulate(effects: str, seed: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the saved stretch of the building's outputs and what the weather station sees."""
    first, last = FIRST - timedelta(days=RUN_IN_DAYS), FIRST + timedelta(days=DAYS - 1)
    weather = _weather_file()
    logger.info("EnergyPlus from %s to %s", first, last)
    results = run.simulate(weather, first, last, seed)
    site = pd.DataFrame({point: results["site", point] for point in SITE_OUTPUTS})
    if effects == "none":
        with tempfile.TemporaryDirectory(prefix="weather_") as name:
            run.without_sun(weather, Path(name) / WEATHER)
            logger.info("EnergyPlus again, without sun")
            results = run.simulate(Path(name) / WEATHER, first, last, seed)
    saved = results.index > pd.Timestamp(FIRST)
    expected = DAYS * 24 * STEPS_PER_HOUR
    if saved.sum() != expected:
        raise run.EnergyPlusError(f"expected {expected} rows to save, found {saved.sum()}")
    return results[saved], site[saved]


def main() -> None:
    """Simulate, check, write, and load what was written."""
    logging.basicConfig(level=logging.INFO, format="%(message)s", handlers=[RichHandler(show_path=False)])
    arguments = _arguments()
    out = arguments.out.resolve()
    results, weather = _simulate(arguments.effects, arguments.seed)
    heat = sensors.check_heat(results)
    telemetry = sensors.telemetry(results, weather, TIMEZONE, arguments.seed)
    last = FIRST + timedelta(days=DAYS - 1)
    readme = folder.README.format(
        version=VERSION,
        truth=f"benchmarks/{TRUTH.name}" if out == OUT else f"{out.name}_truth.json",
        arguments=" --force" if out == OUT else f" --effects {arguments.effects} --out {out.name}",
        weather=WEATHER,
        first=FIRST,
        last=last,
        seed=arguments.seed,
        run_in=RUN_IN_DAYS,
        hot=model.SUPPLY_TEMPERATURE_HEATING,
        cold=model.SUPPLY_TEMPERATURE_COOLING,
        noise=sensors.TEMPERATURE_NOISE,
        resolution=sensors.TEMPERATURE_RESOLUTION,
        discharge=sensors.DISCHARGE_NOISE,
        flow=100.0 * sensors.FLOW_NOISE,
    )
    site = {"name": out.name, "location": LOCATION}
    folder.write_case(out, telemetry, site, readme, force=arguments.force)
    span = {"first": str(FIRST), "last": str(last), "run_in_days": str(RUN_IN_DAYS), "seed": str(arguments.seed)}
    truth = folder.truth(EFFECTS[arguments.effects], results, heat, energyplus=VERSION, weather=WEATHER, **span)
    (TRUTH if out == OUT else out.with_name(f"{out.name}_truth.json")).write_text(truth, encoding="utf-8")
    _check(out)


def _check(out: Path) -> None:
    size = sum(path.stat().st_size for path in out.iterdir())
    if size > SIZE_LIMIT:
        raise run.EnergyPlusError(f"{out} has {size} bytes; at most {SIZE_LIMIT} are allowed")
    case = load_case(out)
    logger.info("%s: %d zones, %d bytes", out, len(case.building.zone_names), size)


if __name__ == "__main__":
    main()
