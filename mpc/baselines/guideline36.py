"""ASHRAE Guideline 36-2021: supply air and hot water by the requests of zones and reheat valves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.control.controller.site import SitePoints, values_of
from mpc.errors import ControlError
from mpc.loop.actuators import (
    COOLING_SETPOINT,
    HEATING_SETPOINT,
    SUPPLY_AIR,
    SUPPLY_WATER,
    Actuator,
    need_actuator,
)
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray, IntArray
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE


@dataclass(frozen=True)
class TrimRespond:
    """Parameters of trim and respond under the guideline's names (Table 5.1.14.3).

    Every `time_step` the setpoint changes by `trim`; with more than `ignored` requests it changes back by `respond` for
    each one above, by no more than `most_response`.

    Parameters
    ----------
    initial : float
        SP0, held while the device is off and for `delay` after its start [K].
    lowest, highest : float
        SPmin and SPmax [K].
    trim, respond, most_response : float
        SPtrim, SPres and SPres-max [K]; the latter two have the sign that `trim` has not.
    delay, time_step : float
        Td and T [s].
    ignored : int
        I, requests that are left unanswered.

    Raises
    ------
    ControlError
        When a number is out of its range or a sign is wrong.
    """

    initial: float
    lowest: float
    highest: float
    trim: float
    respond: float
    most_response: float
    delay: float = 600.0
    time_step: float = 120.0
    ignored: int = 2

    def __post_init__(self) -> None:
        between = self.lowest <= self.initial <= self.highest
        against = self.trim * self.respond < 0.0 and self.respond * self.most_response > 0.0
        timed = self.delay >= 0.0 and self.time_step > 0.0 and self.ignored >= 0
        ControlError.unless(between, "trim and respond", "lowest <= initial <= highest", self)
        ControlError.unless(against, "trim and respond", "a response against the trim", self)
        ControlError.unless(timed, "trim and respond", "a delay, a positive time step, no negative count", self)

    def change(self, requests: int) -> float:
        """Give the change of the setpoint in a time step [K].

        Parameters
        ----------
        requests : int
            R.

        Examples
        --------
        >>> air = TrimRespond(291.15, 285.15, 291.15, 0.1, -0.2, -0.6)
        >>> [round(air.change(r), 1) for r in (0, 2, 3, 4, 9)]
        [0.1, 0.1, -0.1, -0.3, -0.5]
        """
        answered = max(requests - self.ignored, 0) * self.respond
        limit = self.most_response
        return self.trim + (max(answered, limit) if limit < 0.0 else min(answered, limit))


class TrimRespondLoop:
    """Trim and respond as it runs.

    Parameters
    ----------
    parameters : TrimRespond
        Its parameters.
    """

    def __init__(self, parameters: TrimRespond) -> None:
        self.parameters = parameters
        #: Setpoint now [K].
        self.setpoint = parameters.initial
        self._running = 0.0

    def advance(self, on: bool, requests: int, seconds: float) -> float:
        """Pass some time, with requests that stay as they are meanwhile.

        Parameters
        ----------
        on : bool
            Whether the device is proven on.
        requests : int
            R.
        seconds : float
            How long [s].

        Returns
        -------
        float
            Setpoint [K].
        """
        if not on:
            self.setpoint, self._running = self.parameters.initial, 0.0
            return self.setpoint
        ticks = self._ticks(self._running + seconds) - self._ticks(self._running)
        self._running += seconds
        for _ in range(ticks):
            moved = self.setpoint + self.parameters.change(requests)
            self.setpoint = min(max(moved, self.parameters.lowest), self.parameters.highest)
        return self.setpoint

    def _ticks(self, running: float) -> int:
        """Count the time steps that have come since the start: the first when the delay is over."""
        over = running - self.parameters.delay
        return 0 if over < 0.0 else 1 + int(over / self.parameters.time_step + 1e-9)


#: Share of a loop or valve above which it asks once, and below which it stops asking [-] (5.6.8.1.c, 5.6.8.3.c).
ASKING, CONTENT = 0.95, 0.85

#: Suppression after a change of a setpoint (5.1.20): time per kelvin [s/K], and the longest [s].
SUPPRESSION, LONGEST_SUPPRESSION = 540.0, 1800.0


class HysteresisRequests:
    """One request each from above 95 % until below 85 %; two and three for distances that last.

    Parameters
    ----------
    count : int
        Number of loops or valves.
    two, three : float
        Distances from the setpoint that are worth two and three requests [K].
    lasting : float
        How long such a distance must last [s].
    """

    def __init__(self, count: int, two: float, three: float, lasting: float) -> None:
        self.two, self.three, self.lasting = two, three, lasting
        self._asking = np.zeros(count, dtype=bool)
        self._since = np.zeros((2, count))

    def count(self, share: FloatArray, distance: FloatArray, seconds: float) -> IntArray:
        """Count the requests of each, shape (n,); what is not known asks for nothing.

        Parameters
        ----------
        share : ndarray, shape (n,)
            Output of the loop, or position of the valve [-].
        distance : ndarray, shape (n,)
            From the setpoint, positive where it is missed [K].
        seconds : float
            Time over which they were measured [s].
        """
        self._asking = np.where(share > ASKING, True, self._asking & (share >= CONTENT))
        beyond = np.stack([distance > self.two, distance > self.three])
        self._since = np.where(beyond, self._since + seconds, 0.0)
        lasts = self._since >= self.lasting
        return np.where(lasts[1], 3, np.where(lasts[0], 2, self._asking.astype(int))).astype(np.int64)


class SuppressedRequests:
    """Keeps distances quiet for a while after a setpoint has changed: 9 minutes a kelvin, up to half an hour.

    Parameters
    ----------
    count : int
        Number of setpoints.
    """

    def __init__(self, count: int) -> None:
        self._before = np.full(count, np.nan)
        self._quiet = np.zeros(count)

    def distance(self, distance: FloatArray, setpoint: FloatArray, seconds: float) -> FloatArray:
        """Give the distances that count, shape (n,) [K]: zero where a setpoint has just changed.

        Parameters
        ----------
        distance : ndarray, shape (n,)
            From the setpoint [K].
        setpoint : ndarray, shape (n,)
            Now [K].
        seconds : float
            Time since the last call [s].
        """
        change = np.nan_to_num(np.abs(setpoint - self._before))
        fresh = np.minimum(SUPPRESSION * change, LONGEST_SUPPRESSION)
        self._quiet = np.where(change > 0.0, fresh, np.maximum(self._quiet - seconds, 0.0))
        self._before = setpoint.copy()
        return np.where(self._quiet > 0.0, 0.0, distance)


_OF_TERMINALS = (
    ZONE_TEMPERATURE, HEATING_SETPOINT, COOLING_SETPOINT, "discharge_air_temperature_sensor",
    "heating_water_valve_percentage_command",
)  # fmt: skip


@dataclass(frozen=True)
class Guideline36Settings:
    """Parameters of the guideline's two resets, each with its section; the defaults are the guideline's.

    Parameters
    ----------
    air : TrimRespond
        T-max of the supply air, by cooling requests (5.16.2.2): 18 degC and down to 12 degC, +0.1 K every 2 minutes,
        -0.2 K a request above two, -0.6 K at most.
    coldest_air : float
        Min_ClgSAT [K] (5.16.2.2).
    outdoor : tuple of float
        OAT_Min and OAT_Max [K]: from T-max at the former down to Min_ClgSAT at the latter, in a line (5.16.2.2).
    water : TrimRespond
        Hot water, by reset requests of the coils (5.21.4): 80 degC and down to 32 degC for condensing boilers, -1.1 K
        every 5 minutes, +1.7 K a request above two, +3.9 K at most.
    two_cooling, three_cooling : float
        Excess of a zone over its cooling setpoint that is worth two and three requests [K] (5.6.8.1).
    cooling_lasting : float
        How long that must last [s] (5.6.8.1).
    two_water, three_water : float
        What discharge air lacks of its setpoint that is worth two and three requests [K] (5.6.8.3).
    water_lasting : float
        How long that must last [s] (5.6.8.3).
    throttling_range : float
        Distance from the setpoint at which a zone's loop counts as at its end [K]. The guideline's loops are integral
        and hold a zone at its setpoint until then; a proportional one lets it drift. The default is half of the
        thermostats' range, by which setpoints lie inside of the comfort band
        (`mpc.loop.operation.scheduled_operation`): zones
        ask when they reach the band's edge, and not half a kelvin beyond it.
    discharge_rise : float
        Warmest discharge air above the zone's heating setpoint [K] (5.6.5); the reheat reaches it at half of the
        heating loop.
    """

    air: TrimRespond = TrimRespond(291.15, 285.15, 291.15, 0.1, -0.2, -0.6)
    coldest_air: float = 285.15
    outdoor: tuple[float, float] = (289.15, 294.15)
    water: TrimRespond = TrimRespond(353.15, 305.37, 353.15, -1.1, 1.7, 3.9, time_step=300.0)
    two_cooling: float = 2.0
    three_cooling: float = 3.0
    cooling_lasting: float = 120.0
    two_water: float = 8.0
    three_water: float = 17.0
    water_lasting: float = 300.0
    throttling_range: float = 0.5
    discharge_rise: float = 11.0

    def __post_init__(self) -> None:
        rising = self.outdoor[0] < self.outdoor[1]
        ControlError.unless(rising, "Guideline 36: outdoor", "rising temperatures", f"{self.outdoor} K")


class Guideline36:
    """Trim and respond of supply air, one loop an air handler, and of hot water; from measured points only.

    Parameters
    ----------
    points : SitePoints
        Names of zones and devices.
    serving : sequence of int, shape (n_terminal,)
        Position of the air handler that supplies each terminal.
    actuators : sequence of Actuator
        Of the plant: those of supply air and supply water are set, within their ranges.
    settings : Guideline36Settings, optional
        Those of the guideline by default.

    Raises
    ------
    ControlError
        When there is no air handler for each terminal, or the plant lets none of these setpoints be set.

    Notes
    -----
    Fans and pumps count as proven on while their power is above zero, or not measured; off, setpoints return to SP0.
    Between two calls requests stay, and the loops take as many of their time steps as fit. Modes are those of occupied
    hours whenever a fan runs: the warm-up's 35 degC (5.16.2.2) are left out. Zones have one importance (5.1.14.2).
    Outputs of the zones' loops follow from temperature and setpoints.
    """

    def __init__(
        self,
        points: SitePoints,
        serving: Sequence[int],
        actuators: Sequence[Actuator],
        settings: Guideline36Settings | None = None,
    ) -> None:
        expected = f"an air handler for each of {len(points.terminals)} terminals"
        ControlError.unless(len(serving) == len(points.terminals), "Guideline 36", expected, f"{len(serving)}")
        water = f"{points.boiler}/{SUPPLY_WATER}"
        need_actuator("Guideline 36", [*(f"{name}/{SUPPLY_AIR}" for name in points.air_handlers), water], actuators)
        self.points, self.settings = points, settings or Guideline36Settings()
        self._serving, n = np.asarray(serving, dtype=int), len(points.terminals)
        self._range = {a.name: (a.lowest, a.highest) for a in actuators}
        s = self.settings
        self._cooling = HysteresisRequests(n, s.two_cooling, s.three_cooling, s.cooling_lasting)
        self._heating = HysteresisRequests(n, s.two_water, s.three_water, s.water_lasting)
        self._suppressed = SuppressedRequests(n)
        self._air = [TrimRespondLoop(s.air) for _ in points.air_handlers]
        self._water = TrimRespondLoop(s.water)
        self._last: pd.Timestamp | None = None

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Choose setpoints for the next control step [K].

        Parameters
        ----------
        measurements : Measurements
            Of the control step that has just ended.
        forecast : Forecast or None
            Without effect.
        """
        seconds = 0.0 if self._last is None else (measurements.stamp - self._last).total_seconds()
        self._last = measurements.stamp
        cooling, heating = self.requests(measurements, seconds)
        chosen: dict[str, float] = {}
        outdoor = values_of(measurements, [self.points.weather_station], OUTDOOR_TEMPERATURE)[0]
        for k, name in enumerate(self.points.air_handlers):
            on = not values_of(measurements, [name], "supply_fan_power_sensor")[0] <= 0.0
            warmest = self._air[k].advance(on, int(cooling[self._serving == k].sum()), seconds)
            chosen[f"{name}/{SUPPLY_AIR}"] = self._by_outdoor(warmest, float(outdoor))
        on = not values_of(measurements, [self.points.boiler], "pump_power_sensor")[0] <= 0.0
        chosen[f"{self.points.boiler}/{SUPPLY_WATER}"] = self._water.advance(on, int(heating.sum()), seconds)
        held = {name: self._range[name] for name in chosen if name in self._range}
        return {name: float(np.clip(chosen[name], *ends)) for name, ends in held.items()}

    def requests(self, measurements: Mapping[str, float], seconds: float) -> tuple[IntArray, ...]:
        """Count requests for cooler air and for warmer water, shape (n_terminal,) each.

        Parameters
        ----------
        measurements : mapping of str to float
            By ``ENTITY/POINT`` [library's units].
        seconds : float
            Time since the last call [s].
        """
        s, terminals = self.settings, self.points.terminals
        zone, low, high, discharge, valve = (values_of(measurements, terminals, point) for point in _OF_TERMINALS)
        excess = self._suppressed.distance(zone - high, high, seconds)
        cooling = self._cooling.count((zone - high) / s.throttling_range, excess, seconds)
        supply = values_of(measurements, self.points.air_handlers, SUPPLY_AIR)[self._serving]
        call = np.clip((low - zone) / s.throttling_range, 0.0, 1.0)
        wanted = supply + np.minimum(2.0 * call, 1.0) * np.maximum(low + s.discharge_rise - supply, 0.0)
        heating = self._heating.count(valve, np.where(call > 0.0, wanted - discharge, 0.0), seconds)
        return cooling, heating

    def _by_outdoor(self, warmest: float, outdoor: float) -> float:
        """Setpoint of the supply air at an outdoor temperature [K]; not known counts as cold."""
        low, high = self.settings.outdoor
        share = float(np.clip((outdoor - low) / (high - low), 0.0, 1.0)) if np.isfinite(outdoor) else 0.0
        return warmest + share * (self.settings.coldest_air - warmest)
