"""Inputs of a model by name, unit and time: from telemetry, a scenario, a forecast, or a live feed of rows.

Values stand for the step that ends at their stamp. A source says what it can give (`InputProvider.gives`), and a signal
of a model what it is made of (`Signal.inputs`), so that nobody has to try.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.case import Case
from thermal.case.emitters import is_heater
from thermal.errors import EffectError, describe, nearest
from thermal.inputs.normalisation import (
    WIND,
    Normalisation,
    counted_people,
    filled,
    fit_normalisation,
    supply_air,
)
from thermal.inputs.sun import Sun, estimated_sun, suffices, sun_of
from thermal.inputs.windows import WindowLaw, on_one_side

#: Stefan-Boltzmann constant [W/m2/K4].
STEFAN_BOLTZMANN = 5.670374419e-8

#: Wind where none is measured [m/s].
_USUAL_WIND = 3.0

#: Hours of a working day unless occupancy is measured, and how long people take to come and go [h].
_WORK, _RAMP = (8.0, 18.0), 1.0

#: Hours in which people are awake at home, on working days and on days off [h].
_MORNING, _EVENING, _DAY_OFF = (6.0, 8.0), (17.0, 23.0), (7.0, 23.0)

#: Points of the weather station that inputs are made of.
IRRADIANCE, INFRARED = "direct_normal_irradiance_sensor", "horizontal_infrared_irradiance_sensor"

#: Telemetry from which what is not measured is estimated [s].
_LEAST_ESTIMATED = 172800.0

#: Inputs with their units; a ``_rate`` is a change by the hour, of several stamps.
INPUTS: dict[str, str] = {
    "outdoor": "K", "wind": "m/s", "sky": "W/m^2", "sun": "W/m^2", "occupancy": "1", "at_home": "1", "usual": "K",
    "openings": "1", "switched": "1", "through_windows": "K*m/s", "heat": "W", "airflow": "kg/s", "supply_flow": "kg/s",
    "supply_heat": "W", "radiant_gains": "W", "outdoor_rate": "K/h", "occupancy_rate": "1/h", "heat_rate": "W/h",
    "commanded": "1", "emitted": "W", "emitted_rate": "W/h",
}  # fmt: skip

#: Inputs that depend on what the HVAC system does: telemetry and a running plant know them, nobody else.
HVAC_INPUTS = frozenset(
    {"heat", "airflow", "supply_flow", "supply_heat", "heat_rate", "commanded", "emitted", "emitted_rate"}
)

#: Series that inputs are made of where these are not of the same name.
_SERIES: dict[str, tuple[str, ...]] = {
    "wind": (WIND,), "sky": (INFRARED, "outdoor"), "sun": (IRRADIANCE,), "through_windows": ("outdoor",),
    "occupancy": (), "at_home": (), "usual": (), "openings": (), "switched": (),
}  # fmt: skip


def _input(name: str, meaning: str) -> cached_property[FloatArray]:
    """Input as its source gives it; a rate of change by central differences."""

    def read(provider: InputProvider) -> FloatArray:
        provider.need(name)
        if name.endswith("_rate"):
            changing = getattr(provider, name.removesuffix("_rate"))
            return np.asarray(np.gradient(changing, provider.step / 3600.0, axis=0))
        return provider.series[name]

    read.__doc__ = meaning
    return cached_property(read)


class InputProvider:
    """Inputs of a building's models over some steps.

    Parameters
    ----------
    building : Building
        Zones and location.
    stamps : DatetimeIndex, length n_time
        Ends of the steps, in the building's time zone.
    step : float
        Their length [s].
    series : mapping of str to ndarray
        What the source knows, of shape (n_time,) or (n_time, n_zone): points of the weather station; ``outdoor``,
        ``people`` in the building, ``heat``, ``airflow``, ``supply_flow``, ``supply_heat``, ``radiant_gains`` [units
        of `INPUTS`]; ``commanded``, shape (n_time, n_commanded), [units of `thermal.case.commands.command_signals`];
        ``emitted``, shape (n_time, n_device) [W].
    normalisation : Normalisation
        Constants that some inputs are counted by.
    source : str
        What the series are, for messages.

    Attributes
    ----------
    openings : ndarray, shape (n_time, n_zone)
        Whether a window of each zone is seen to stand open: 1 where one is. Telemetry has no window contacts: windows
        are shut unless a diagnosis sees what they let out, and sets this.
    switched : ndarray, shape (n_time, n_zone)
        Whether heat that nobody meters is seen to be on in each zone: 1 while it is, set in the same way.
    """

    def __init__(
        self,
        building: Building,
        stamps: pd.DatetimeIndex,
        step: float,
        series: Mapping[str, FloatArray],
        normalisation: Normalisation,
        source: str = "telemetry",
    ) -> None:
        self.building, self.zones, self.step, self.source = building, building.zone_names, float(step), source
        self.stamps, self.series, self.normalisation = stamps, series, normalisation
        self.openings = np.zeros((len(stamps), len(self.zones)))
        self.switched = np.zeros_like(self.openings)

    def __repr__(self) -> str:
        known = [name for name in INPUTS if self.gives(name)]
        return f"{type(self).__name__}({self.source}, {len(self.stamps)} steps of {self.step:g} s, {', '.join(known)})"

    def measured(self, point: str) -> bool:
        """Whether the weather station has a point, or those that it follows from.

        Parameters
        ----------
        point : str
            Point type. Beam and diffuse irradiance follow from the global one, and from each other with it.
        """
        return suffices(self.weather) if point == IRRADIANCE else point in self.series

    def estimates(self, point: str) -> bool:
        """Whether a point of the weather station is not measured, and follows roughly from what is.

        Parameters
        ----------
        point : str
            Point type; irradiance follows from the daily range of the outdoor temperature, over two days at least.
        """
        known = "outdoor" in self.series and len(self.stamps) * self.step >= _LEAST_ESTIMATED
        return known and point == IRRADIANCE and not self.measured(point)

    def gives(self, name: str) -> bool:
        """Whether the source has what an input is made of.

        Parameters
        ----------
        name : str
            Of `INPUTS`.

        Raises
        ------
        EffectError
            When there is no such input.
        """
        if name not in INPUTS:
            raise EffectError("input", "a name of `INPUTS`", repr(name), nearest(name, INPUTS))
        if name.endswith("_rate"):
            return len(self.stamps) > 1 and self.gives(name.removesuffix("_rate"))
        if name in ("usual", "through_windows") and not self.normalisation.usual:
            return False
        if name == "sun" and self.estimates(IRRADIANCE):
            return True
        return all(self.measured(series) for series in _SERIES.get(name, (name,)))

    def lacks(self, names: Iterable[str]) -> tuple[str, ...]:
        """Name inputs that the source cannot give.

        Parameters
        ----------
        names : iterable of str
            Of `INPUTS`.
        """
        return tuple(name for name in names if not self.gives(name))

    def values(self, name: str, unit: str = "", at: pd.DatetimeIndex | None = None) -> FloatArray:
        """Give an input; of the sun that on the horizontal.

        Parameters
        ----------
        name : str
            Of `INPUTS`.
        unit : str
            Which unit it is expected in; any by default.
        at : DatetimeIndex, optional
            Stamps; all by default.

        Returns
        -------
        ndarray, shape (n_time,) or (n_time, n)
            Values [unit of `INPUTS`].

        Raises
        ------
        EffectError
            When the source does not have it, in this unit, or at these stamps.
        """
        self.need(name)
        if unit not in ("", INPUTS[name]):
            raise EffectError(f"input {name}", f"unit {INPUTS[name]}", repr(unit))
        found = self.sun.horizontal if name == "sun" else np.asarray(getattr(self, name))
        if at is None:
            return found
        rows = self.stamps.get_indexer(at)
        if (rows < 0).any():
            raise EffectError(f"input {name}", f"stamps of the {self.source}", f"{at[rows < 0][0]}")
        return np.asarray(found[rows])

    def why_not(self, name: str) -> str:
        """Say what the source lacks for an input; nothing where it gives it.

        Parameters
        ----------
        name : str
            Of `INPUTS`.
        """
        if self.gives(name):
            return ""
        lacking = next((s for s in _SERIES.get(name, (name,)) if not self.measured(s)), name)
        if lacking.endswith("_sensor"):
            return f"weather station: expected {lacking}, which an effect of the model needs, got none"
        if name == "radiant_gains":
            found = f"{self.source}, which knows presence only"
            return describe("radiant gains", "those of a plant's scenario", found, "use `internal_gains`")
        return describe(f"input {name}", f"a source that knows {lacking}", f"{self.source}, which does not")

    def need(self, *names: str) -> None:
        """Refuse to go on without some inputs.

        Parameters
        ----------
        *names : str
            Of `INPUTS`.

        Raises
        ------
        EffectError
            What is lacking, and in what.
        """
        for name in self.lacks(names):
            raise EffectError(self.why_not(name))

    @cached_property
    def weather(self) -> pd.DataFrame:
        """Points of the weather station, shape (n_time, n_point) [library's units]."""
        points = {name: values for name, values in self.series.items() if name.endswith("_sensor")}
        return pd.DataFrame(points, index=self.stamps)

    outdoor = _input("outdoor", "Outdoor temperature, shape (n_time,) [K].")
    heat = _input("heat", "Metered heat of the zones, shape (n_time, n_zone) [W].")
    airflow = _input("airflow", "Directed airflows from zone to zone, shape (n_time, n_airflow) [kg/s].")
    supply_flow = _input("supply_flow", "Supply air of the zones, shape (n_time, n_zone) [kg/s].")
    supply_heat = _input("supply_heat", "Heat of supply air above the zone's temperature, shape (n_time, n_zone) [W].")
    radiant_gains = _input("radiant_gains", "Part of the gains of the zones that radiates, shape (n_time, n_zone) [W].")

    commanded = _input("commanded", "What unmetered heat is in proportion to, (n_time, n_commanded) [each its own].")

    @cached_property
    def wind(self) -> FloatArray:
        """Wind speed at the station, shape (n_time,) [m/s]."""
        self.need("wind")
        return np.maximum(np.nan_to_num(self.series[WIND]), 0.0)

    @cached_property
    def sky(self) -> FloatArray:
        """Longwave from the sky less that of a black body at outdoor temperature, shape (n_time,) [W/m2]; negative."""
        self.need("sky")
        return np.asarray(np.nan_to_num(self.series[INFRARED]) - STEFAN_BOLTZMANN * self.outdoor**4)

    @cached_property
    def sun(self) -> Sun:
        """Sun's place and irradiances, estimated where none are measured."""
        self.need("sun")
        if self.estimates(IRRADIANCE):
            return estimated_sun(self.building.location, self.stamps, self.step, self.outdoor)
        return sun_of(self.building.location, self.stamps, self.step, self.weather)

    @cached_property
    def usual(self) -> FloatArray:
        """Zone temperatures as they usually are at that hour of a working day or a day off, (n_time, n_zone) [K]."""
        self.need("usual")
        slot = 24 * (self.stamps.day_of_week < 5) + np.asarray(self.stamps.hour)
        profile = self.normalisation.usual
        if lacking := [zone for zone in self.zones if zone not in profile]:
            raise EffectError("usual temperatures", f"zone {lacking[0]!r}", nearest(lacking[0], profile))
        return np.asarray(np.array([profile[zone] for zone in self.zones]).T[slot])

    @cached_property
    def largest_heat(self) -> FloatArray:
        """Metered heat, heating or cooling, that each zone exceeds 1 % of the time, shape (n_time, n_zone) [W].

        That of the normalisation at all times, unless a monitoring, which learns it as seasons come, sets it.
        """
        largest = [self.normalisation.heat.get(zone, 0.0) for zone in self.zones]
        return np.broadcast_to(largest, (len(self.stamps), len(self.zones)))

    @cached_property
    def _counted(self) -> FloatArray | None:
        """People counted over their largest number, shape (n_time,) [-]; None where nobody counts them."""
        most = self.normalisation.people
        if most is None or "people" not in self.series:
            return None
        people = self.series["people"]
        return np.asarray(people / most) if most > 0.0 else np.zeros(len(people))

    @cached_property
    def occupancy(self) -> FloatArray:
        """Presence of people, shape (n_time,): counted over their largest number, or working days from 8 to 18."""
        if self._counted is not None:
            return self._counted
        return np.where(self._middle.day_of_week < 5, self._within(*_WORK), 0.0)

    @property
    def awake(self) -> FloatArray:
        """Presence of people at work or at home, shape (n_time,): as counted, or where they are not, by day."""
        return self.occupancy if self._counted is not None else np.maximum(self.occupancy, self.at_home)

    @cached_property
    def at_home(self) -> FloatArray:
        """Presence of people in a home while they are awake, by the clock, shape (n_time,) [-]."""
        working = np.maximum(self._within(*_MORNING), self._within(*_EVENING))
        return np.where(self._middle.day_of_week < 5, working, self._within(*_DAY_OFF))

    def _within(self, first: float, last: float) -> FloatArray:
        """Whether the clock is between two hours, people coming and going within one."""
        rise = np.clip((self.clock - first) / _RAMP + 0.5, 0.0, 1.0)
        return np.asarray(rise * np.clip((last - self.clock) / _RAMP + 0.5, 0.0, 1.0))

    @property
    def _middle(self) -> pd.DatetimeIndex:
        return self.stamps - pd.Timedelta(seconds=self.step / 2.0)

    @property
    def clock(self) -> FloatArray:
        """Time of day in the middle of each step, by the building's clock, shape (n_time,) [h]."""
        middle = self._middle
        return np.asarray(middle.hour + middle.minute / 60.0 + middle.second / 3600.0, dtype=float)

    @cached_property
    def through_windows(self) -> FloatArray:
        """Air that passes an open window, times how much colder it is outdoor: shape (n_time, n_zone) [K*m/s]."""
        return self.windows_by(on_one_side)

    def windows_by(self, law: WindowLaw) -> FloatArray:
        """Give the same by another law, shape (n_time, n_zone) [K*m/s].

        Parameters
        ----------
        law : callable
            Of `thermal.inputs.windows`.
        """
        difference = self.outdoor[:, None] - self.usual
        wind = self.wind if self.gives("wind") else np.full(len(self.stamps), _USUAL_WIND)
        return np.asarray(law(wind[:, None], difference) * difference)

    outdoor_rate = _input("outdoor_rate", "Change of the outdoor temperature, shape (n_time,) [K/h].")
    occupancy_rate = _input("occupancy_rate", "Change of the presence of people, shape (n_time,) [1/h].")
    heat_rate = _input("heat_rate", "Change of the metered heat of the zones, shape (n_time, n_zone) [W/h].")
    emitted = _input("emitted", "Heat that devices report as power, part of `heat`, shape (n_time, n_device) [W].")
    emitted_rate = _input("emitted_rate", "Change of the heat of the devices, shape (n_time, n_device) [W/h].")


def telemetry_inputs(case: Case, normalisation: Normalisation | None = None) -> InputProvider:
    """Make inputs of a case's telemetry, gaps filled by straight lines.

    Parameters
    ----------
    case : Case
        With telemetry.
    normalisation : Normalisation, optional
        Of the calibration that its models belong to; fitted on all the telemetry by default, as for files of
        calibrations that have none.
    """
    weather, people, (flow, supplied) = case.weather(), counted_people(case), supply_air(case)
    series: dict[str, FloatArray] = {
        str(name): weather[name].interpolate(limit_direction="both").to_numpy(dtype=float)
        for name in weather
        if weather[name].notna().any()
    }
    series["outdoor"] = filled(case.boundary_temperatures()["outdoor"])
    series |= {"heat": filled(case.zone_heat_estimated()), "airflow": filled(case.airflow_rates_estimated())}
    series |= {"supply_flow": flow.to_numpy(), "supply_heat": supplied.to_numpy()}
    if people is not None:
        series["people"] = filled(people)
    if any(is_heater(device) for device in case.building.devices):
        series["emitted"] = filled(case.heating_power_estimated())
    if case.building.commanded:
        series["commanded"] = filled(case.command_signals())
    return InputProvider(case.building, case.stamps, case.step, series, normalisation or fit_normalisation(case))
