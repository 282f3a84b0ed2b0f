"""What drives a described plant from outside, as a scenario: weather, prices, emissions, people and comfort bands."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mpc.adapters.described.schema import Comfort, Emissions, PlantFile, Prices
from mpc.adapters.described.series import NamedSeries
from mpc.adapters.described.values import Hours, Signal, Value
from mpc.errors import PlantError, ScenarioError
from mpc.loop.conversion import conversion
from mpc.scenario.forecast import DAY_AHEAD_ERRORS, Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import ComfortBand, Occupancy, require_band
from mpc.scenario.rates import ConstantRate, HourlyRate, Rate
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import CarbonIntensity, DemandCharge, Tariff
from mpc.scenario.weather import WEATHER_POINTS, Weather
from mpc.scenario.weather_files import read_epw
from thermal._types import FloatArray
from thermal.case.building import Building, ZoneEntry, ZoneTable
from thermal.case.points import OUTDOOR_TEMPERATURE, POINT_TYPES, ZONE_TEMPERATURE
from thermal.errors import nearest

# Height of a zone whose volume is not given [m]: that of the test houses of ASHRAE Standard 140
_HEIGHT = 2.7


@dataclass(frozen=True, eq=False)
class SeriesSource:
    """Where named series are looked for.

    Parameters
    ----------
    tables : sequence of NamedSeries
        In this order.
    ahead : callable, optional
        Makes series of names that no table has, all at once, on the grid that is asked for; it is told where each name
        stands.
    """

    tables: Sequence[NamedSeries]
    ahead: Callable[[Mapping[str, str], StepGrid], NamedSeries] | None = None
    _run: dict[str, NamedSeries] = field(default_factory=dict, init=False)

    def prepare(self, names: Mapping[str, str], grid: StepGrid) -> None:
        """Run ahead once for all names that no table has.

        Parameters
        ----------
        names : mapping of str to str
            Where each that will be asked for stands.
        grid : StepGrid
            Steps.
        """
        missing = {name: where for name, where in names.items() if not any(name in t.values for t in self.tables)}
        if missing and self.ahead is not None:
            self._run.update(dict.fromkeys(missing, self.ahead(missing, grid)))

    def on(self, name: str, grid: StepGrid, where: str, *, lines: bool) -> FloatArray:
        """Average a series over the steps of a grid, shape (n_steps,) [unit of the series].

        Parameters
        ----------
        name : str
            Which series.
        grid : StepGrid
            Steps.
        where : str
            What asks, for the message.
        lines : bool
            Whether it lies on straight lines, rather than to hold until the next value.

        Raises
        ------
        PlantError
            When no source has it.
        """
        found = next((table for table in self.tables if name in table.values), self._run.get(name))
        if found is None:
            known = [known for table in self.tables for known in table.values]
            told = ", ".join(table.where for table in self.tables) or "no sources: name some in `series`"
            raise PlantError(where, f"a series of {told}", repr(name), nearest(name, known) if known else "")
        return found.on(name, grid, lines=lines)

    def of_point(self, point: str, signal: Signal, grid: StepGrid, where: str, *, lines: bool) -> FloatArray:
        """Average a series that stands for a point, shape (n_steps,) [library's unit].

        Parameters
        ----------
        point : str
            Of the case format.
        signal : Signal
            Which series; its unit, else that which is declared, is converted.
        grid, where, lines
            As of `on`.

        Raises
        ------
        PlantError
            When no source has it, or a value cannot be one of the point.
        """
        values, kind = self.on(signal.signal, grid, where, lines=lines), POINT_TYPES[point]
        tables = (*self.tables, *self._run.values())
        declared = next(table.units.get(signal.signal) for table in tables if signal.signal in table.values)
        line = conversion(point, signal.signal, signal.unit or declared)
        brought = np.asarray(line.offset + line.slope * values)
        wrong = brought[~kind.possible(brought)]
        expected = f"values from {kind.told(kind.lowest)} to {kind.told(kind.highest)}"
        found = f"{kind.told(wrong[0])} of {signal.signal!r}" if wrong.size else ""
        advice = "say its unit: {signal: ..., unit: ...}"
        PlantError.unless(not wrong.size, where, expected, found, advice)
        return brought


@dataclass(frozen=True, eq=False)
class NamedRate:
    """A value of a description over time, as a `Rate`.

    Parameters
    ----------
    source : SeriesSource
        Of series.
    name, where : str
        Which series, and where it stands.
    point : str, optional
        What it stands for, a point of the case format.
    """

    source: SeriesSource
    name: str
    where: str
    point: str = ""

    def on(self, grid: StepGrid) -> FloatArray:
        """Average over each step of a grid, shape (n_steps,) [unit of the series].

        Parameters
        ----------
        grid : StepGrid
            Steps.
        """
        if self.point:
            return self.source.of_point(self.point, Signal(signal=self.name), grid, self.where, lines=False)
        return self.source.on(self.name, grid, self.where, lines=False)


@dataclass(frozen=True, eq=False)
class SeriesBand(ComfortBand):
    """A comfort band whose edges are values over time.

    Parameters
    ----------
    lower, upper : Rate
        Edges [K].
    where : str
        Where they stand, for messages.
    """

    lower: Rate = field(default_factory=lambda: ConstantRate(294.15))
    upper: Rate = field(default_factory=lambda: ConstantRate(297.15))
    where: str = "comfort"

    def on(self, grid: StepGrid) -> tuple[FloatArray, FloatArray]:
        """Lower and upper edge over each step, shape (n_steps,) each [K].

        Parameters
        ----------
        grid : StepGrid
            Steps.

        Raises
        ------
        ScenarioError
            When they are no band at any time.
        """
        lower, upper = self.lower.on(grid), self.upper.on(grid)
        require_band(lower, upper, self.where)
        return lower, upper


@dataclass(frozen=True, eq=False)
class SeriesOccupancy(Occupancy):
    """People by zone as values over time.

    Parameters
    ----------
    assigned : mapping of str to float
        Largest number of each zone [-].
    by_zone : mapping of str to Rate
        Number of people of each zone [-].
    """

    by_zone: dict[str, Rate] = field(default_factory=dict)

    def expected(self, grid: StepGrid, zones: Sequence[str]) -> FloatArray:
        """Mean number of people in each zone over each step, shape (n_steps, n_zone) [-].

        Parameters
        ----------
        grid : StepGrid
            Steps.
        zones : sequence of str
            Names.
        """
        return np.column_stack([self.by_zone[zone].on(grid) for zone in zones])


@dataclass(frozen=True)
class SeriesGains(InternalGains):
    """Heat of people beside that of lights and equipment as values over time.

    Parameters
    ----------
    others : ndarray, shape (n_steps, n_zone)
        Heat of lights and equipment on the scenario's grid, none of which radiates [W].
    """

    equipment: float = 0.0
    lights: float = 0.0
    others: FloatArray = field(default_factory=lambda: np.zeros((1, 1)))

    def __post_init__(self) -> None:
        ScenarioError.unless((self.others >= 0.0).all(), "gains", "heat of 0 W or more", f"{self.others.min():g} W")

    def heat(self, occupancy: ArrayLike, people: ArrayLike, areas: ArrayLike, *, radiant: bool = False) -> FloatArray:
        """Sensible heat given to each zone, shape (n_steps, n_zone) [W].

        Parameters
        ----------
        occupancy, people, areas, radiant
            As of `InternalGains.heat`.
        """
        of_people = super().heat(occupancy, people, areas, radiant=radiant)
        return of_people if radiant else of_people + self.others


def described_building(file: PlantFile) -> Building:
    """Give what a description says of the building: zones without walls.

    Parameters
    ----------
    file : PlantFile
        The description.
    """
    zones = tuple(
        ZoneEntry(name=name, floor_area=zone.floor_area, volume=zone.volume or zone.floor_area * _HEIGHT)
        for name, zone in file.zones.items()
    )
    stations = [column.rpartition("/") for column in file.measurements]
    station = next((entity for entity, _, point in stations if point == OUTDOOR_TEMPERATURE), "weather_station")
    return Building(file.name, file.location, 0.0, ZoneTable(zones), weather_station=station)


def described_forecaster(
    file: PlantFile, folder: Path, source: SeriesSource, start: pd.Timestamp, actions: int
) -> Forecaster | None:
    """Make the forecaster of a described plant, on its control steps; None where no weather is described.

    Parameters
    ----------
    file : PlantFile
        The description.
    folder : Path
        Of the description.
    source : SeriesSource
        Of named series.
    start : Timestamp
        Of the run, local.
    actions : int
        Control steps of the run.

    Raises
    ------
    PlantError
        When a series is missing or does not cover run and forecasts, or weather is described without prices.
    """
    if file.weather is None:
        return None
    horizon = max(round(file.forecast.hours * 3600.0 / file.control_step), 1)
    grid = StepGrid(start, file.control_step, actions + horizon)
    scenario = _scenario(file, folder, source, grid)
    errors = DAY_AHEAD_ERRORS if file.forecast.errors == "day_ahead" else None
    return Forecaster(scenario, horizon, errors, seed=file.forecast.seed)


def _scenario(file: PlantFile, folder: Path, source: SeriesSource, grid: StepGrid) -> Scenario:
    prices = file.prices
    if prices is None:
        raise PlantError("prices", "those of electricity beside the weather", "none", "name a price, or drop `weather`")

    def rate(value: Value, where: str, point: str = "") -> Rate:
        if isinstance(value, Hours):
            return HourlyRate(value.weekday, value.weekend)
        return NamedRate(source, value, where, point) if isinstance(value, str) else ConstantRate(float(value))

    source.prepare(_names(file), grid)
    weather = _weather(file, folder, source, grid)
    demand = () if prices.demand is None else (DemandCharge([prices.demand]),)

    def of_district(part: Prices | Emissions, where: str) -> Rate | None:
        return None if part.district_heating is None else rate(part.district_heating, f"{where}.district_heating")

    tariff = Tariff(
        rate(prices.electricity, "prices.electricity"), rate(prices.gas, "prices.gas"), demand, prices.currency,
        district_heating=of_district(prices, "prices"),
    )  # fmt: skip
    carbon = None
    if file.emissions is not None:
        electricity, gas = (rate(getattr(file.emissions, kind), f"emissions.{kind}") for kind in ("electricity", "gas"))
        carbon = CarbonIntensity(electricity, file.emissions.kind, gas, of_district(file.emissions, "emissions"))
    people = {name: rate(zone.people, f"zones.{name}.people") for name, zone in file.zones.items()}
    most = {name: float(number.on(grid).max()) for name, number in people.items()}
    bands = {name: _band(zone.comfort, rate, f"zones.{name}.comfort") for name, zone in file.zones.items()}
    others = [rate(zone.gains, f"zones.{name}.gains").on(grid) for name, zone in file.zones.items()]
    return build_scenario(
        described_building(file), grid, weather, tariff, carbon=carbon, occupancy=SeriesOccupancy(most, by_zone=people),
        gains=SeriesGains(others=np.column_stack(others)), comfort=bands,
    )  # fmt: skip


def _band(comfort: Comfort | None, rate: Callable[[Value, str, str], Rate], where: str) -> ComfortBand:
    if comfort is None:
        return ComfortBand()
    if comfort.lower is not None and comfort.upper is not None:
        lower = rate(comfort.lower, f"{where}.lower", ZONE_TEMPERATURE)
        return SeriesBand(lower=lower, upper=rate(comfort.upper, f"{where}.upper", ZONE_TEMPERATURE), where=where)
    hours = {day: getattr(comfort, day) for day in ("weekday", "saturday", "sunday")}
    occupied, other = comfort.occupied or (0.0, 0.0), comfort.unoccupied or (0.0, 0.0)
    return ComfortBand(occupied, other, **hours)


def _weather(file: PlantFile, folder: Path, source: SeriesSource, grid: StepGrid) -> Weather:
    if isinstance(file.weather, str):
        return read_epw(folder / file.weather)
    columns = {}
    for point, signal in (file.weather or {}).items():
        PlantError.unless_known(point, WEATHER_POINTS, f"weather.{point}", "a point of the weather station")
        columns[point] = source.of_point(point, signal, grid, f"weather.{point}", lines=True)
    return Weather(pd.DataFrame(columns, index=grid.stamps), file.location, step=grid.step)


def _names(file: PlantFile) -> dict[str, str]:
    """Names of all series that a description asks for, and where each stands first."""
    asked: dict[str, object] = {}
    for name, zone in file.zones.items():
        edges = {} if zone.comfort is None else {"lower": zone.comfort.lower, "upper": zone.comfort.upper}
        asked |= {f"zones.{name}.comfort.{edge}": value for edge, value in edges.items()}
        asked |= {f"zones.{name}.people": zone.people, f"zones.{name}.gains": zone.gains}
    for key, part in (("prices", file.prices), ("emissions", file.emissions)):
        carriers = () if part is None else ("electricity", "gas", "district_heating")
        asked |= {f"{key}.{carrier}": getattr(part, carrier) for carrier in carriers}
    if isinstance(file.weather, dict):
        asked |= {f"weather.{point}": signal.signal for point, signal in file.weather.items()}
    found: dict[str, str] = {}
    for where, value in asked.items():
        if isinstance(value, str):
            found.setdefault(value, where)
    return found
