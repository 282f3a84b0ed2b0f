"""Telemetry of a described plant: what was measured, set, forecast for the step itself, and bought."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import Actuator
from mpc.loop.plant import Controller, Measurements, Plant
from mpc.loop.run import ClosedLoopRun, run_closed_loop
from mpc.scenario.forecast import Forecast
from mpc.scenario.weather import WEATHER_POINTS
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE, POINT_TYPES, ZONE_TEMPERATURE
from thermal.inputs.sun import suffices, sun_of
from thermal.units import QUANTITIES, from_si, to_si

#: What is bought, as columns [W].
CARRIERS = ("electricity", "gas", "district_heating")

#: Before the name of an actuator: what was set [its unit].
SET = "set/"

#: Facades whose sun is told apart, and where they look [deg].
FACADES: Mapping[str, float] = {"sun from east": 90.0, "sun from south": 180.0, "sun from west": 270.0}

#: Longest gap of an input that is bridged by a straight line [s].
_BRIDGED = 7200.0


@dataclass(frozen=True)
class Site:
    """What of a description a model needs.

    Parameters
    ----------
    name : str
        Of the plant.
    areas : mapping of str to float
        Floor area of each zone [m2].
    location : Location
        Where it stands.
    capacity : tuple of tuple of float
        Of one source that feeds all zones' terminals, by its data sheet: outdoor air [K], rising, and the most heat
        that it gives there, or takes where it cools [W].
    water : Actuator or None
        Setpoint of the water that it supplies, where that is decided.
    """

    name: str
    areas: Mapping[str, float]
    location: Location
    capacity: tuple[tuple[float, float], ...] = ()
    water: Actuator | None = None


@dataclass(frozen=True, eq=False)
class PlantTelemetry:
    """A run of a plant on its control steps.

    Parameters
    ----------
    frame : DataFrame, shape (n_time, n_column)
        By the ends of the steps: points ``ENTITY/POINT`` in the library's units, what was set as ``set/ENTITY/POINT``
        (NaN while the plant's own control has it), the columns of a forecast, and `CARRIERS` [W].
    step : float
        Length of a step [s].
    site : Site
        Where it was.
    """

    frame: pd.DataFrame
    step: float
    site: Site

    @property
    def zone(self) -> FloatArray:
        """Measured temperatures, shape (n_time, n_zone) [K].

        Raises
        ------
        PlantError
            When a zone is not measured.
        """
        names = [f"{zone}/{ZONE_TEMPERATURE}" for zone in self.site.areas]
        for name in names:
            PlantError.unless(name in self.frame, f"telemetry: {name}", "a measurement of each zone", "none")
        return self.frame[names].to_numpy(dtype=float)

    def column(self, name: str) -> FloatArray:
        """Take a column, gaps bridged where they are short; zeros where there is none, shape (n_time,).

        Parameters
        ----------
        name : str
            Of the column.
        """
        return self.bridged(self.frame[name]) if name in self.frame else np.zeros(len(self.frame))

    def bridged(self, values: pd.Series, beyond: float = 0.0) -> FloatArray:
        """Bridge short gaps by straight lines, and fill others, with zeros by default, shape (n_time,).

        Parameters
        ----------
        values : Series, shape (n_time,)
            On the steps [any unit].
        beyond : float
            Of longer gaps, such as NaN [the same unit].
        """
        limit = max(round(_BRIDGED / self.step), 1)
        filled = values.astype(float).interpolate(limit=limit, limit_direction="both")
        return np.asarray(filled.fillna(beyond), dtype=float)

    @property
    def weather(self) -> pd.DataFrame:
        """Weather as measured, else as it was forecast for the step itself."""
        measured = {c.rpartition("/")[2]: c for c in self.frame.columns if "/" in c and not c.startswith(SET)}
        found = {p: measured.get(p, p) for p in WEATHER_POINTS if measured.get(p, p) in self.frame}
        return pd.DataFrame({p: self.column(c) for p, c in found.items()}, index=self.frame.index)

    @property
    def outdoor(self) -> FloatArray:
        """Outdoor air, shape (n_time,) [K].

        Raises
        ------
        PlantError
            When nothing says it.
        """
        weather = self.weather
        there = OUTDOOR_TEMPERATURE in weather
        advice = "name it in `measurements` or `weather`"
        PlantError.unless(there, "telemetry", f"a column {OUTDOOR_TEMPERATURE}", "none", advice)
        return weather[OUTDOOR_TEMPERATURE].to_numpy()

    @property
    def suns(self) -> dict[str, FloatArray]:
        """Irradiance behind the glass of each facade, shape (n_time,) [W/m2]; none where it is not known."""
        return facade_sun(self.site.location, self.step, self.weather)

    @property
    def gain(self) -> FloatArray:
        """Heat of people, shape (n_time, n_zone) [W]; 0 where nothing says it."""
        return np.column_stack([self.column(f"{zone}/internal_gain") for zone in self.site.areas])

    @property
    def bought(self) -> FloatArray:
        """All that is bought, shape (n_time,) [W]."""
        return np.asarray(np.sum([self.column(name) for name in CARRIERS], axis=0), dtype=float)

    def to_frame(self) -> pd.DataFrame:
        """Table for a file, in the units of case folders."""
        return pd.DataFrame({c: _converted(str(c), self.frame[c], from_si) for c in self.frame}, index=self.frame.index)


def facade_sun(location: Location, step: float, weather: pd.DataFrame) -> dict[str, FloatArray]:
    """Irradiance behind the glass of each facade, shape (n_time,) [W/m2]; none where weather does not tell.

    Parameters
    ----------
    location : Location
        Where.
    step : float
        Length of a step [s].
    weather : DataFrame
        Points of the weather station by the ends of the steps [W/m2].
    """
    if not suffices(weather):
        return {}
    sun = sun_of(location, pd.DatetimeIndex(weather.index), step, weather)
    return {name: sun.through_glass(azimuth, 90.0) for name, azimuth in FACADES.items()}


def _converted(column: str, values: pd.Series, how: Callable[..., FloatArray]) -> FloatArray:
    """Bring a column from or to the units of case folders."""
    kind = POINT_TYPES.get(column.rpartition("/")[2])
    array = values.to_numpy(dtype=float)
    if kind is None or not ("/" in column or column in WEATHER_POINTS):
        return array
    return np.asarray(how(array, QUANTITIES[kind.quantity].file_unit, kind.quantity))


def read_telemetry(path: Path, site: Site) -> PlantTelemetry:
    """Read telemetry that is there already, such as the ``trajectory.parquet`` of a run.

    Parameters
    ----------
    path : Path
        ``.parquet`` or ``.csv`` with regular stamps with a time zone in ``timestamp``; the columns of `PlantTelemetry`
        in the units of case folders.
    site : Site
        Where it is from.

    Raises
    ------
    PlantError
        When it cannot be read, or stamps are irregular.
    """
    try:
        frame = pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path, index_col="timestamp")
        index = pd.DatetimeIndex(pd.to_datetime(frame.index, utc=True)).tz_convert(site.location.timezone)
        values = frame.apply(pd.to_numeric, errors="coerce").set_axis(index)
    except (OSError, ValueError, TypeError, KeyError) as error:
        expected = "a .parquet or .csv file with a column 'timestamp'"
        raise PlantError(f"telemetry {path.name}", expected, " ".join(str(error).split())) from error
    steps = np.unique(np.diff(index.asi8))
    PlantError.unless(
        len(steps) == 1 and steps[0] > 0, f"telemetry {path.name}", "regular stamps", f"{len(steps)} steps"
    )
    step = float(steps[0] / np.timedelta64(1, "s").astype(f"timedelta64[{index.unit}]").astype(int))
    library = pd.DataFrame({str(c): _converted(str(c), values[c], to_si) for c in values}, index=index)
    return PlantTelemetry(library, step, site)


@dataclass
class Watched:
    """A controller whose forecasts for the step itself are kept.

    Parameters
    ----------
    controller : Controller
        That decides.
    """

    controller: Controller
    rows: list[pd.Series] = field(default_factory=list, init=False)

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Pass on.

        Parameters
        ----------
        measurements : Measurements
            Of the last step.
        forecast : Forecast or None
            Of what comes.
        """
        if forecast is not None:
            self.rows.append(forecast.table.iloc[0])
        return self.controller.step(measurements, forecast)


def run_recorded(
    plant: Plant,
    controller: Controller,
    site: Site,
    steps: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[ClosedLoopRun, PlantTelemetry]:
    """Close a loop with forecasts, and keep its telemetry.

    Parameters
    ----------
    plant : Plant
        To be reset.
    controller : Controller
        That decides.
    site : Site
        Of the plant.
    steps : int, optional
        Control steps; until it is finished by default.
    progress : callable, optional
        Called with done and total.
    """
    watched = Watched(controller)
    run = run_closed_loop(plant, watched, forecasts=True, steps=steps, progress=progress)
    index = run.measurements.index
    tables = [run.measurements, run.actions.reindex(columns=[a.name for a in plant.actuators]).add_prefix(SET)]
    known = pd.DataFrame(watched.rows).set_axis(index) if watched.rows else pd.DataFrame(index=index)
    powers = on_control_steps(run.record, plant.control_step)
    bought = {name: getattr(powers, name) for name in CARRIERS if getattr(powers, name) is not None}
    tables += [known.drop(columns=[c for c in known if c in run.measurements]), pd.DataFrame(bought, index=index)]
    return run, PlantTelemetry(pd.concat(tables, axis=1), plant.control_step, site)


def on_control_steps(record: PlantRecord, step: float) -> PlantRecord:
    """Average a record over longer steps.

    Parameters
    ----------
    record : PlantRecord
        On the plant's own steps.
    step : float
        Whole steps of the record [s].
    """
    parts = round(step / record.step)

    def mean(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values.reshape(-1, parts).mean(axis=1)

    whole = parts >= 1 and record.n_steps % parts == 0
    PlantError.unless(whole, "record", f"whole control steps of {step:g} s", f"{record.n_steps} of {record.step:g} s")
    return PlantRecord(
        step, record.zone_temperature[::parts], np.asarray(mean(record.electricity)), mean(record.gas),
        mean(record.district_heating),
        controller_seconds=record.controller_seconds,
    )  # fmt: skip
