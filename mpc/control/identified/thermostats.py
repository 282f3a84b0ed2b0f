"""Setpoints as decisions: what a zone's own controller is told for a planned load, and how much heat it has at most."""

from __future__ import annotations

from collections import deque

import numpy as np
import pandas as pd

from calibration.estimation.state_space import REFERENCE
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.forecast_error import ForecastError
from mpc.identify.air_handler import WHOLE, RunningHours
from mpc.identify.limits import OUT_OF_REACH, HeatLimit
from mpc.identify.machines import as_heated, pairs_as_heated
from mpc.identify.model import PlantModel
from mpc.identify.shared import SharedLimit, out_of_reach
from mpc.identify.water import LATELY
from mpc.loop.plant import Measurements
from mpc.scenario.grid import hours_of_week
from thermal._types import BoolArray, FloatArray

#: A load below this is none [-], and one nearer than it to the largest is all.
_IDLE = 0.02

#: How far past the plan a setpoint is told where all heat is wanted [K]: beyond the difference of a thermostat.
_PUSH = 0.5

#: Part of what a source has for several machines that plans leave for later steps [-]: where all of it is taken,
#: nothing makes up for what model and forecast have wrong. Chosen on the office's cold weeks, where zones are 0.18 K h
#: below their band with it and 0.62 without, for 1.2 % more; the only size that was tried.
_RESERVE = 0.05


class Thermostats:
    """Tells zones' own controllers where the air shall be at the end of the step, and learns where they cannot follow.

    Their feedback is quicker than the control step, so that they take up what the model has wrong: the value is the
    planned temperature, rather than one that is thought to cause the planned heat.

    What is known of heating holds of cooling in temperatures that are mirrored (`as_heated`).

    Parameters
    ----------
    model : PlantModel
        Identified; of its machines those that are led by a setpoint.
    """

    def __init__(self, model: PlantModel) -> None:
        self._model, self._sign = model, model.sign
        told = [[pairs_as_heated(pairs, self._sign) for pairs in (found.limits, found.sheet)] for found in model.maps]
        self._limits = [HeatLimit(limits, sheet) for limits, sheet in told]
        shared, sheet = (pairs_as_heated(pairs, self._sign) for pairs in (model.shared, model.sheet))
        self._shared = SharedLimit(model.led_heat, model.step, shared, sheet)
        self._is_led = np.array([found.operation == "setpoint" for found in model.maps], dtype=bool)
        self._error = ForecastError(model.step)
        self._told, self._zone = np.full(len(model.maps), np.nan), np.full(len(model.box.zones), np.nan)
        self._served, self._water = model.box.serves, np.nan
        self._hours = RunningHours(() if model.air_handler is None else model.air_handler.hours)
        self._supplied = deque[float](maxlen=max(round(LATELY / model.step), 1) + 1)

    def most(self, outdoor: FloatArray) -> FloatArray:
        """Largest loads, shape (N, n_machine) [-]: 1 of machines that are commanded.

        Parameters
        ----------
        outdoor : ndarray, shape (N,)
            Outdoor air that is forecast for the coming steps [K].
        """
        most, water = self.with_hottest(outdoor), self._model.water
        if water is None or not np.isfinite(self._zone).all():
            return most
        return np.asarray(most * water.share(self._model.air(as_heated(self._zone, self._sign))))

    def spent(self, levels: FloatArray, ahead: Ahead) -> BoolArray:
        """Tell the zones all of whose machines, or whose source, give all that they have in the first step, (n_zone,).

        Parameters
        ----------
        levels : ndarray, shape (n_machine,)
            Planned loads [-].
        ahead : Ahead
            Of the coming steps.
        """
        full = levels >= self.most(ahead.outdoor[:1])[0] - _IDLE
        full |= (self._shared.shares > 0.0) & self.shares_all(levels, ahead.outdoor[:1])
        return np.asarray(~(self._served & ~full[:, None]).any(axis=0))

    def with_hottest(self, outdoor: FloatArray) -> FloatArray:
        """Largest loads with the hottest water that a model knows, whatever the plant has, shape (N, n_machine) [-].

        Parameters
        ----------
        outdoor : ndarray, shape (N,)
            Outdoor air that is forecast for the coming steps [K].
        """
        error, weather = self._error.ahead(len(outdoor)), as_heated(outdoor, self._sign)
        return np.column_stack(
            [
                limit.at(weather, error) if led else np.ones(len(outdoor))
                for limit, led in zip(self._limits, self._is_led, strict=True)
            ]
        )

    def together(self, outdoor: FloatArray) -> FloatArray:
        """Largest load of all machines that are led by a setpoint, shape (N,): a share of their full loads [-].

        Of all steps but the first a twentieth less than is relied on; infinite where the machines reach no more alone.

        Parameters
        ----------
        outdoor : ndarray, shape (N,)
            Outdoor air that is forecast for the coming steps [K].
        """
        kept = np.where(np.arange(len(outdoor)) > 0, 1.0 - _RESERVE, 1.0)
        weather, error = as_heated(outdoor, self._sign), self._error.ahead(len(outdoor))
        limit = kept * self._shared.at(weather, error)
        return np.where(limit < self.most(outdoor) @ self._shared.shares, limit, np.inf)

    def expect(self, outdoor: FloatArray) -> None:
        """Take a forecast, so that its error is known when its steps have come.

        Parameters
        ----------
        outdoor : ndarray, shape (N,)
            Outdoor air of the coming steps [K].
        """
        self._error.made(outdoor)

    def learn(self, measurements: Measurements, zone: FloatArray, outdoor: float) -> None:
        """Take a step that has ended: how it was forecast, and what was given where a setpoint was out of reach.

        Parameters
        ----------
        measurements : Measurements
            Of the step.
        zone : ndarray, shape (n_zone,)
            Temperatures over the step [K].
        outdoor : float
            Outdoor air over the step [K].
        """
        self._error.came(outdoor)
        weather, air = as_heated(outdoor, self._sign), as_heated(zone, self._sign)
        end = air + 0.5 * np.nan_to_num(np.maximum(air - self._zone, 0.0))
        self._zone = air
        count, step = len(self._model.maps), self._model.step
        loads, missing = np.full(count, np.nan), np.full(count, -np.inf)
        for k in np.flatnonzero(self._is_led & np.isfinite(self._told)):
            found = self._model.maps[k]
            given = found.machine.given(measurements)
            if np.isfinite(given) and np.isfinite(end[self._served[k]]).any():
                loads[k] = given / float(found.at(found.heat, 1.0, outdoor, REFERENCE))
                missing[k] = self._told[k] - float(np.nanmean(end[self._served[k]]))
        if (handler := self._model.air_handler) is not None:
            _, ran = handler.measured(measurements, [found.machine for found in self._model.maps])
            if np.isfinite(ran) and (loads <= _IDLE).all() and (missing < -OUT_OF_REACH).all():
                self._hours.learn(int(hours_of_week(pd.DatetimeIndex([measurements.stamp]), step)[0]), ran > 0.5)
            if not ran >= WHOLE:  # of a part of a step nothing tells what boxes have at most, nor without its flows
                missing[:] = -np.inf
        full = np.array([found.above[1] for found in self._model.maps])
        wanted, reached = (loads > _IDLE) & out_of_reach(missing, full), loads
        if (water := self._model.water) is not None:
            # as it is measured, else as the plant has its setpoint, else as it was told
            has = _known(measurements, water.actuator.name, self._water)
            supply = _known(measurements, water.sensor, has)
            self._supplied.append(float(as_heated(supply, self._sign)))
            lately = as_heated(max(w for w in (*self._supplied, -np.inf) if not np.isnan(w)), self._sign)
            wanted &= water.missed(has, supply)  # cold water is no limit of its source
            reached = water.reached(loads, supply, self._model.air(zone), lately)
        alone = self._shared.learn(weather, loads, wanted, self._limits)
        for k in np.flatnonzero((loads > _IDLE) & np.isfinite(reached)):
            # what several at their limit give at once says nothing of one of them alone
            if (alone[k] and missing[k] > OUT_OF_REACH) or reached[k] > self._limits[k].at(np.array([weather]))[0]:
                self._limits[k].learn(weather, float(reached[k]))

    def runs_by_itself(self, ahead: Ahead) -> FloatArray:
        """Where an air handler runs whoever heats, shape (N,): 1 or 0; 0 without one [-].

        Parameters
        ----------
        ahead : Ahead
            Of the coming steps.
        """
        if self._model.air_handler is None:
            return np.zeros(len(ahead.hours))
        return self._hours.at(ahead.hours, np.asarray(ahead.occupied.any(axis=1)))

    def shares_all(self, levels: FloatArray, outdoor: FloatArray) -> bool:
        """Tell whether a step's loads take all that is relied on of a shared source.

        Parameters
        ----------
        levels : ndarray, shape (n_machine,)
            Planned loads [-].
        outdoor : ndarray, shape (1,)
            Outdoor air [K].
        """
        return bool(self._shared.shares @ levels > self._shared.at(as_heated(outdoor, self._sign))[0] - _IDLE)

    def tell(
        self, k: int, level: float, most: float, zone: FloatArray, edges: tuple[float, float], shared: bool = False
    ) -> float:
        """Choose a setpoint [K].

        Where all heat is wanted it is the highest temperature that is planned, out of reach for now: a machine that
        has more than was thought, or a zone that takes less, is not held back by the error. Where a source gives all
        that is relied on, it is half a kelvin more than is planned, for the same reason.

        Parameters
        ----------
        k : int
            Which machine.
        level, most : float
            Planned load, and the largest [-].
        zone : ndarray, shape (n, n_zone)
            Planned air at the ends of the coming steps [K].
        edges : tuple of float
            Temperatures that the zone shall not fall below, and that it is never told to rise above; where machines
            cool, that it shall not rise above, and is never told to fall below [K].
        shared : bool
            Whether the plan takes all of a shared source, see `shares_all`.
        """
        idle, full = self._model.maps[k].above
        air = as_heated(zone[:, self._served[k]].mean(axis=1), self._sign)
        near, far = (as_heated(edge, self._sign) for edge in edges)
        value = float(air[0]) + idle + min(level, 1.0) * (full - idle)
        if level > most - _IDLE:
            value = max(value + _PUSH, float(air.max()))
        elif shared:
            value += _PUSH
        # a thermostat holds what it is told: within the edges it keeps the band where the model is wrong, or where the
        # plan leaves the band for hours that it fears not to keep
        self._told[k] = near if level <= _IDLE else max(min(value, far), near)
        return float(as_heated(self._told[k], self._sign))

    def water(self, levels: FloatArray, outdoor: FloatArray, zone: FloatArray) -> FloatArray | None:
        """Supply water for loads, shape (N,) [K]; None where it is not decided.

        Parameters
        ----------
        levels : ndarray, shape (N, n_machine)
            Planned loads [-].
        outdoor : ndarray, shape (N,)
            Outdoor air [K].
        zone : ndarray, shape (n_zone,)
            Air of the zones [K].
        """
        if self._model.water is None:
            return None
        return self._model.water.needed(levels, self.with_hottest(outdoor), self._model.air(zone))

    def leave_water(self) -> None:
        """Know that the plant itself has the water in the coming step."""
        self._water = np.nan

    def tell_water(self, levels: FloatArray, outdoor: FloatArray, zone: FloatArray) -> dict[str, float]:
        """Choose the setpoint of supply water for the coming step, where it is decided [K].

        Parameters
        ----------
        levels : ndarray, shape (n_machine,)
            Planned loads [-].
        outdoor : ndarray, shape (1,)
            Outdoor air [K].
        zone : ndarray, shape (n_zone,)
            Air of the zones at the end of the step [K].
        """
        found = self.water(levels[None], outdoor, zone)
        if self._model.water is None or found is None:
            return {}
        self._water = float(found[0])
        return {self._model.water.actuator.name: self._water}


def _known(measurements: Measurements, name: str, otherwise: float) -> float:
    """Take a measurement, or something else while it is unknown [K]."""
    return float(measurements[name]) if name in measurements and np.isfinite(measurements[name]) else otherwise
