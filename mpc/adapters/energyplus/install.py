"""Where EnergyPlus is, and the reference buildings and weather files that it brings."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

from mpc.errors import EnergyPlusError
from thermal.errors import describe, nearest

#: Weather that the reference buildings were sized for.
CHICAGO = "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3"


@cache
def data_folder() -> Path:
    """Find the data that EnergyPlus' package brings.

    Raises
    ------
    EnergyPlusError
        When it is not installed.
    """
    spec = find_spec("pyenergyplus")
    if spec is None or spec.origin is None:
        advice = "pip install 'buildingmpc[energyplus]'"
        raise EnergyPlusError(describe("EnergyPlus", "the package pyenergyplus-lbnl", "none", advice))
    return Path(spec.origin).parent / "data"


def reference_buildings() -> tuple[str, ...]:
    """List the reference buildings, by the names of their files without ``.idf``.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus is not installed.
    """
    return tuple(sorted(path.stem for path in (data_folder() / "model").glob("*.idf")))


def weather_files() -> tuple[str, ...]:
    """List the weather files, by their names without ``.epw``.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus is not installed.
    """
    return tuple(sorted(path.stem for path in (data_folder() / "weather").glob("*.epw")))


def building_path(name: str | Path) -> Path:
    """Find an input file.

    Parameters
    ----------
    name : str or Path
        A file, or one of `reference_buildings`.

    Raises
    ------
    EnergyPlusError
        When there is none.
    """
    return _path(name, ".idf", "model", "building")


def weather_path(name: str | Path) -> Path:
    """Find a weather file.

    Parameters
    ----------
    name : str or Path
        A file, or one of `weather_files`.

    Raises
    ------
    EnergyPlusError
        When there is none.
    """
    return _path(name, ".epw", "weather", "weather")


def _path(name: str | Path, ending: str, folder: str, what: str) -> Path:
    given = Path(name)
    if given.suffix.lower() == ending:
        if given.is_file():
            return given.resolve()
        raise EnergyPlusError(describe(what, f"a file {ending}", f"none at {given}"))
    known = {path.stem: path for path in (data_folder() / folder).glob(f"*{ending}")}
    if str(name) not in known:
        expected = f"a file {ending} or one that EnergyPlus brings"
        raise EnergyPlusError(describe(what, expected, repr(str(name)), nearest(str(name), known)))
    return known[str(name)]
