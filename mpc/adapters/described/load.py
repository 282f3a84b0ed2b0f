"""A plant of its description."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from mpc.adapters.boptest.mapping import BoptestSignals
from mpc.adapters.boptest.plant import BoptestPlant, BoptestSettings, BoptestTime
from mpc.adapters.boptest.scenario import DAY, PRICE_POINTS, YearClock
from mpc.adapters.described.conditions import SeriesSource, described_forecaster
from mpc.adapters.described.programs import EnergyPlusProgram, ServerProgram, SiteProgram, UnitProgram
from mpc.adapters.described.read import place_of, read_description
from mpc.adapters.described.schema import Period, PlantFile
from mpc.adapters.described.series import NamedSeries, read_table, run_ahead, unit_period, unit_tables
from mpc.adapters.described.values import Value
from mpc.adapters.energyplus.input import building_path, weather_path
from mpc.adapters.energyplus.signals import EnergyPlusRun, EnergyPlusSignalPlant, EnergyPlusSignals
from mpc.adapters.fmu.plant import FmuPlant, FmuSignals, FmuTime
from mpc.adapters.fmu.unit import Unit
from mpc.errors import PlantError
from mpc.scenario.grid import StepGrid
from thermal.case.years import EXPECTED, within_years


class _Span(NamedTuple):
    """When a plant runs: start in seconds of the year, length and warm-up [s]."""

    start: float
    duration: float
    warm_up: float


def load_plant(
    path: str | Path, *, at: str | Path | None = None, changes: Mapping[str, Any] | None = None
) -> FmuPlant | BoptestPlant | EnergyPlusSignalPlant:
    """Make the plant that a description names.

    Parameters
    ----------
    path : str or Path
        A ``plant.yaml``, or a name of `ready_plants`.
    at : str or Path, optional
        A unit's file, or the address of a BOPTEST server, in the place of the description's own.
    changes : mapping of str to object, optional
        Keys of the file in the place of its own, such as ``period`` or ``control_step``.

    Returns
    -------
    FmuPlant, BoptestPlant or EnergyPlusSignalPlant
        To be reset. Leaving a ``with`` block frees it.

    Raises
    ------
    PlantError
        When the description does not fit its schema, or the plant lacks what it names.

    Examples
    --------
    >>> plant = load_plant("bestest_hydronic_heat_pump", at="http://127.0.0.1:5000")  # doctest: +SKIP
    """
    parsed, place = read_description(path, at=at, changes=changes), place_of(path)
    if isinstance(parsed.plant, ServerProgram):
        return _server_plant(parsed, parsed.plant)
    if isinstance(parsed.plant, SiteProgram):
        advice = "run it with: buildingmpc operate site.yaml"
        raise PlantError("plant.kind", "a program that stands for the building", "'site', a real one", advice)
    if isinstance(parsed.plant, EnergyPlusProgram):
        return _energyplus(parsed, parsed.plant, place.parent)
    return _unit_plant(parsed, parsed.plant, place.parent)


def period_of(path: str | Path, file: PlantFile) -> tuple[pd.Timestamp, float]:
    """Tell when a description's period begins, local, and how long it is [d].

    Parameters
    ----------
    path : str or Path
        The description.
    file : PlantFile
        As read.

    Raises
    ------
    PlantError
        When only a server knows.
    """
    if isinstance(file.period, Period):
        clock, span = _span(file.period, file.location.timezone)
    elif isinstance(file.plant, UnitProgram):
        unit = place_of(path).parent / file.plant.file
        clock, span = YearClock(file.year, file.location.timezone), _Span(*unit_period(unit, file.period))
    else:
        found = f"{file.period!r}, which a server knows"
        raise PlantError("period", "its start and days", found, "give --start and --end")
    return clock.stamp(span.start), span.duration / DAY


def _mappings(file: PlantFile) -> dict[str, Any]:
    """Collect what all kinds of signals have in common."""
    inputs = file.actuators
    signals = [*file.measurements.values(), *inputs.values(), *(zone.temperature for zone in file.zones.values())]
    units: dict[str, str] = {}
    for signal in signals:
        if signal.unit is not None:
            unit = units.setdefault(signal.signal, signal.unit)
            where, expected = f"signal {signal.signal!r}", f"one unit, {unit!r}"
            PlantError.unless(unit == signal.unit, where, expected, repr(signal.unit))
    return {
        "measurements": {column: signal.signal for column, signal in file.measurements.items()},
        "actuators": {name: entry.signal for name, entry in inputs.items()},
        "zones": {name: zone.temperature.signal for name, zone in file.zones.items()},
        **file.energy.model_dump(),
        "units": units,
        "limits": {name: entry.range for name, entry in inputs.items() if entry.range is not None},
        "kinds": {name: entry.kind for name, entry in inputs.items() if entry.kind is not None},
        "minimums": {name: entry.minimum for name, entry in inputs.items() if entry.minimum is not None},
        "releases": {name: entry.release for name, entry in inputs.items() if entry.release is not None},
    }


def _span(period: Period, timezone: str) -> tuple[YearClock, _Span]:
    """Tell the clock and the run of a period that is given by its start."""
    try:
        stamp = pd.Timestamp(period.start)
        if not within_years(pd.DatetimeIndex([stamp]))[0]:
            raise ValueError(EXPECTED)
        start = stamp.tz_convert(timezone) if stamp.tzinfo else stamp.tz_localize(timezone)
    except (ValueError, TypeError) as error:
        expected = f"a local time such as 2023-01-09 00:00, of the {EXPECTED.partition('of the ')[2]}"
        raise PlantError("period.start", expected, repr(period.start)) from error
    clock = YearClock(start.year, timezone)
    begin = clock.time(start.timestamp())
    return clock, _Span(begin, period.days * DAY, min(period.warm_up_days * DAY, max(begin, 0.0)))


def _unit_plant(file: PlantFile, program: UnitProgram, folder: Path) -> FmuPlant:
    path, zone = folder / program.file, file.location.timezone
    PlantError.unless(path.is_file(), f"plant.file {program.file}", "a functional mock-up unit", "no such file")
    if isinstance(file.period, str):
        clock, span = YearClock(file.year, zone), _Span(*unit_period(path, file.period))
    else:
        clock, span = _span(file.period, zone)
    parts = math.ceil(file.control_step / program.communication_step - 1e-9)
    start, actions = clock.stamp(span.start), int(span.duration / file.control_step + 1e-9)
    plant = FmuPlant(
        path, FmuSignals(**_mappings(file)), file.control_step,
        FmuTime(start, span.duration, parts, span.start, span.warm_up),
        parameters=program.parameters, interface=program.interface,
    )  # fmt: skip
    try:
        source = _source(file, program, path, folder, clock, file.control_step / parts)
        plant.forecaster = described_forecaster(file, folder, source, start, actions)
    except BaseException:
        plant.close()
        raise
    return plant


def _energyplus(file: PlantFile, program: EnergyPlusProgram, folder: Path) -> EnergyPlusSignalPlant:
    if isinstance(file.period, str):
        raise PlantError("period", "its start and days", repr(file.period))
    clock, span = _span(file.period, file.location.timezone)
    weather = _file(folder, program.weather, weather_path)
    PlantError.unless("outputs" not in file.series, "series", ".csv files", "'outputs', which are those of a unit")
    run = EnergyPlusRun(
        _file(folder, program.model, building_path), weather, clock.stamp(span.start), round(file.period.days),
        program.steps_per_hour, max(round(file.period.warm_up_days), 1),
    )  # fmt: skip
    tables = [read_table(folder / name, name, clock) for name in file.series]
    known = file.model_copy(update={"weather": str(weather)}) if file.weather is None and file.prices else file
    actions = int(span.duration / file.control_step + 1e-9)
    forecaster = described_forecaster(known, folder, SeriesSource(tables), run.start, actions)
    return EnergyPlusSignalPlant(run, EnergyPlusSignals(**_mappings(file)), file.control_step, forecaster)


def _file(folder: Path, name: str, brought: Callable[[str], Path]) -> Path:
    """Find a file of the description's folder, or one that EnergyPlus brings."""
    return (folder / name).resolve() if (folder / name).is_file() else brought(name)


def _source(
    file: PlantFile, program: UnitProgram, path: Path, folder: Path, clock: YearClock, step: float
) -> SeriesSource:
    """Where the named series of a unit's description are."""
    tables: list[NamedSeries] = []
    for name in file.series:
        if name == "unit":
            tables += unit_tables(path, clock)
        elif name != "outputs":
            expected = "'unit', 'outputs' or a .csv file"
            PlantError.unless(name.endswith(".csv"), "series", expected, repr(name))
            tables.append(read_table(folder / name, name, clock))

    def ahead(names: Mapping[str, str], grid: StepGrid) -> NamedSeries:
        unit, kinds = Unit(path, program.interface), ("output", "local", "input", "calculatedParameter", "parameter")
        try:
            for name, where in names.items():
                unit.variable(name, kinds, f"series of {where}")
            return run_ahead(unit, names, grid, clock, step, program.parameters)
        finally:
            unit.close()

    return SeriesSource(tables, ahead if "outputs" in file.series else None)


def _server_plant(file: PlantFile, program: ServerProgram) -> BoptestPlant:
    zone, period, year = file.location.timezone, file.period, file.year
    when: str | BoptestTime
    if isinstance(period, str):
        when = period
    else:
        clock, span = _span(period, zone)
        when, year = BoptestTime(*span), clock.year
    settings = BoptestSettings(
        electricity_price=_price(file), horizon=max(round(file.forecast.hours * 3600.0 / file.control_step), 1),
        year=year, timezone=zone, timeout=program.timeout,
    )  # fmt: skip
    brackets = {name: zone.comfort.lower for name, zone in file.zones.items() if zone.comfort}
    indices = {name: _index(edge, f"zones.{name}.comfort.lower") for name, edge in brackets.items()}
    signals = BoptestSignals(**_mappings(file), forecast_zones=indices)
    name = program.testcase or file.name
    return BoptestPlant(program.url, name, when, file.control_step, settings, signals=signals)


def _price(file: PlantFile) -> str:
    """Which of BOPTEST's prices of electricity a description asks for."""
    if file.prices is None:
        return "constant"
    named, points = file.prices.electricity, {point: kind for kind, point in PRICE_POINTS.items()}
    advice = "a server's prices are its own"
    PlantError.unless(named in points, "prices.electricity", f"one of {', '.join(points)}", repr(named), advice)
    return points[str(named)]


def _index(edge: Value | None, where: str) -> str:
    """Take what stands in the brackets of a zone's forecast points."""
    text = edge if isinstance(edge, str) else ""
    advice = "a server's comfort bands are its own"
    fits = text.startswith("LowerSetp[") and text.endswith("]")
    PlantError.unless(fits, where, "a forecast point of the server such as LowerSetp[1]", repr(edge), advice)
    return text.removeprefix("LowerSetp[").removesuffix("]")
