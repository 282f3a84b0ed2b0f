"""Water that one source supplies to all terminals, where its temperature is decided: how hot it is, at what cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpc.identify.curves import OUTDOOR, PER, Curve
from mpc.identify.limits import RUNS
from mpc.identify.machines import as_heated
from mpc.identify.telemetry import CARRIERS
from mpc.loop.actuators import Actuator
from thermal._types import BoolArray, FloatArray

#: What is regressed on beside the loads: their sum times the water's temperature over 10 K, and by how much warmer the
#: water has become in a step, over 10 K: a loop stores heat (the office's in 10 K that of 13 min of its heat pump).
WATER, STORED = "water", "stored"

#: Share of the full load that water is kept hotter for than planned [-]: what model and forecast have wrong, zones'
#: own controllers ask for within a step.
_MARGIN = 0.1

#: Least share of the way from a zone's air to the hottest water at which a load says what that would give [-].
_TELLS = 0.2

#: Share of the way of the hottest water of the last hour below which what a terminal gives is not yet that of its water
#: [-]: radiators give heat late.
_STEADY = 0.9

#: Time over which a terminal may still give the heat of hotter water [s].
LATELY = 3600.0

#: How much farther below its setpoint than usual water stays where its source gives all that it can [K].
_MISSED = 2.0

#: Least difference of the hottest water and a zone's air that is counted with [K].
_APART = 1.0

#: How far the corner is rounded at which terminals ask for hotter water than the coldest [K].
_ROUND = 1.0

#: A load that is none [-].
_NOTHING = 1e-6


@dataclass(frozen=True)
class SupplyWater:
    """Temperature of the water of a heat pump, boiler or chiller that feeds all terminals.

    A terminal gives heat in proportion to how far the water is from the zone's air, so that the coldest water that does
    is that of the terminal which asks most. A source buys the more the hotter its water is,

    ``P = ... + g Q (T_w - T) / 10 K``

    with Q the load of all. What holds of heating holds of cooling in temperatures that are mirrored (`as_heated`): its
    hottest water is the coldest that the actuator takes.

    Parameters
    ----------
    actuator : Actuator
        Setpoint of the water.
    sign : float
        1 where it heats, -1 where it cools [-].
    shares : tuple of float
        Of each machine in the load of all [-].
    powers : mapping of str to Curve
        Of each kind that is bought g, called ``water``, and what water takes that becomes 10 K warmer in a step,
        ``stored`` [W].
    temperature : float
        T, the mean of the telemetry by load [K].
    own : tuple of float
        Setpoint that the plant itself has at 7 degC outdoors [K], and what it has more for a kelvin outdoors [K/K].
    hottest : float
        Hottest water, that largest loads are told with: where it was identified, whatever the plant's range is now [K].
    below : float
        How far water usually lies below its setpoint, above it where it cools, as sensors and controllers have it [K].
    """

    actuator: Actuator
    sign: float
    shares: tuple[float, ...]
    powers: Mapping[str, Curve]
    temperature: float
    own: tuple[float, float]
    hottest: float
    below: float = 0.0

    @property
    def sensor(self) -> str:
        """Column with its measured temperature."""
        return sensor_of(self.actuator.name)

    @property
    def ends(self) -> tuple[float, float]:
        """Coldest and hottest water, as `as_heated` [K]."""
        low, high = sorted(as_heated(end, self.sign) for end in (self.actuator.lowest, self.actuator.highest))
        return low, high

    def reached(
        self, load: FloatArray, water: FloatArray | float, air: FloatArray, lately: FloatArray | float
    ) -> FloatArray:
        """Tell what the hottest water would have given where a terminal gave all that it has, as loads [-].

        NaN where water is too near to the air to tell, or was much hotter within the hour.

        Parameters
        ----------
        load : ndarray, shape (..., n_machine)
            Given [-].
        water : ndarray or float
            Measured supply [K].
        air : ndarray, shape (..., n_machine)
            Of the machines' zones [K].
        lately : ndarray or float
            Hottest supply of the last hour, the coldest where it cools [K].
        """
        way, before = self._way(water, air), self._way(lately, air)
        tells = (way >= _TELLS) & (way >= _STEADY * before)
        return np.where(tells, load / np.maximum(way, _TELLS), np.nan)

    def _way(self, water: FloatArray | float, air: FloatArray) -> FloatArray:
        """Share of the way from the air to the hottest water [-]."""
        cold = as_heated(air, self.sign)
        return np.asarray((as_heated(water, self.sign) - cold) / self._whole(cold))

    def _whole(self, cold: FloatArray) -> FloatArray:
        """Way from the air to the hottest water [K]."""
        return np.asarray(np.maximum(as_heated(self.hottest, self.sign) - cold, _APART))

    def share(self, air: FloatArray) -> FloatArray:
        """Tell what part of the largest loads the plant's own range of water leaves, shape (n_machine,) [-].

        Parameters
        ----------
        air : ndarray, shape (n_machine,)
            Of the machines' zones [K].
        """
        return np.clip(self._way(float(as_heated(self.ends[1], self.sign)), air), 0.0, 1.0)

    def missed(self, told: FloatArray | float, water: FloatArray | float) -> BoolArray:
        """Tell where the source cannot hold the water.

        Parameters
        ----------
        told, water : ndarray or float
            Setpoint and measured supply [K].
        """
        return np.asarray(as_heated(told, self.sign) - as_heated(water, self.sign) > self.below + _MISSED)

    def needed(self, loads: FloatArray, most: FloatArray, air: FloatArray) -> FloatArray:
        """Choose the coldest water that gives loads and a tenth of the largest more, shape (...) [K].

        Parameters
        ----------
        loads, most : ndarray, shape (..., n_machine)
            Planned, and the largest with the hottest water [-].
        air : ndarray, shape (n_machine,)
            Of the machines' zones [K].
        """
        ask, cold = loads / np.maximum(most, _NOTHING) + _MARGIN, as_heated(air, self.sign)
        low, high = self.ends
        wanted = cold + np.minimum(ask, 1.0) * self._whole(cold)
        wanted = np.where(np.asarray(loads) > RUNS * _MARGIN, wanted, low).max(axis=-1)
        return np.asarray(as_heated(np.clip(wanted, low, high), self.sign))

    def bought(self, loads: FloatArray, water: FloatArray | float) -> FloatArray:
        """Power by machine and kind beyond that of water at `temperature`, shape (..., n_machine, n_carrier) [W].

        Parameters
        ----------
        loads : ndarray, shape (..., n_machine)
            Given [-].
        water : ndarray, shape (...), or float
            Supply [K].
        """
        hotter = self._hotter(as_heated(water, self.sign))
        return np.asarray((loads * self.shares * hotter[..., None])[..., None] * self._by(WATER))

    def of_plant(self, outdoor: FloatArray | float) -> FloatArray:
        """Give the water of the plant's own control, shape (...) [K].

        Parameters
        ----------
        outdoor : ndarray or float
            Outdoor air [K].
        """
        level, slope = self.own
        return np.clip(level + slope * (np.asarray(outdoor) - OUTDOOR), self.actuator.lowest, self.actuator.highest)

    def stored(self, water: FloatArray) -> FloatArray:
        """Power of each kind that warms the water, negative where it cools down, shape (n_time, n_carrier) [W].

        Parameters
        ----------
        water : ndarray, shape (n_time,)
            Measured supply [K].
        """
        return stored(water, self.sign)[:, None] * self._by(STORED)

    def apart(self, loads: FloatArray, water: FloatArray) -> FloatArray:
        """Power of each kind by the temperature of the water and into it, shape (n_time, n_carrier) [W].

        Parameters
        ----------
        loads : ndarray, shape (n_time, n_machine)
            Given [-].
        water : ndarray, shape (n_time,)
            Measured supply [K].
        """
        return np.asarray(self.bought(loads, water).sum(axis=1) + self.stored(water))

    def _hotter(self, water: FloatArray | float) -> FloatArray:
        return np.asarray((water - as_heated(self.temperature, self.sign)) / PER)

    @property
    def by_kelvin(self) -> FloatArray:
        """What a kelvin of all terminals' full load costs of each of `CARRIERS`, shape (n_carrier,) [W/K]."""
        return self._by(WATER) / PER

    def _by(self, feature: str) -> FloatArray:
        """Coefficient of each of `CARRIERS`, shape (n_carrier,) [W]."""
        return np.array([self.powers[kind].coefficients[feature] if kind in self.powers else 0.0 for kind in CARRIERS])

    def line(self, planned: FloatArray | None, most: FloatArray, air: FloatArray) -> FloatArray:
        """Parameters of `hotter` about a plan, shape (N, 3): at no load and by load [K], and of the plan [-].

        Parameters
        ----------
        planned : ndarray, shape (N, n_machine), or None
            Loads [-]; None where there is no plan.
        most : ndarray, shape (N, n_machine)
            Largest loads with the hottest water [-].
        air : ndarray, shape (n_machine,)
            Of the machines' zones [K].
        """
        cold = float(as_heated(air, self.sign) @ np.array(self.shares))
        whole = float(self._whole(np.array(cold)))
        line = np.tile([cold + _MARGIN * whole - self.ends[0], whole, 1.0], (len(most), 1))
        if planned is not None:
            shares = np.array(self.shares)
            above = np.maximum(line[:, :1] + line[:, 1:2] * planned / most, 0.0)
            all_pay, each_pays = above.max(axis=-1) * (planned @ shares), (above * planned) @ shares
            line[:, 2] = np.where(each_pays > _NOTHING, all_pay / np.maximum(each_pays, _NOTHING), 1.0)
        return line

    def hotter(self, load: Any, part: Any, line: Any) -> Any:
        """Give what loads cost by hot water, with numbers or symbols: kelvins over `temperature` times loads [K].

        ``Σ w_k q_k (T_low - T + e (T_k - T_low))`` with w the shares and T_k the water that terminal k asks for
        itself, on a line over its load, ``T_low`` at least. So each terminal pays for its own water, and e makes the
        sum what it is at the plan, where all have that of the one which asks most. It is convex.

        Parameters
        ----------
        load, part : indexable of length n_machine
            Loads, and as parts of the largest [-].
        line : indexable of length 3
            Of `line`.
        """
        begin, by_load, uneven = line[0], line[1], line[2]
        least = self.ends[0] - as_heated(self.temperature, self.sign)
        total = 0.0
        for k, share in enumerate(self.shares):
            asked = begin + by_load * part[k]
            above = 0.5 * (asked + (asked * asked + _ROUND**2) ** 0.5)
            total = total + share * load[k] * (least + uneven * above)
        return total


def sensor_of(setpoint: str) -> str:
    """Name the measured temperature beside a setpoint.

    Parameters
    ----------
    setpoint : str
        ``ENTITY/POINT`` of the actuator.

    Examples
    --------
    >>> sensor_of("heat_pump/supply_water_temperature_setpoint")
    'heat_pump/supply_water_temperature_sensor'
    """
    return setpoint.removesuffix("setpoint") + "sensor"


def stored(water: FloatArray, sign: float) -> FloatArray:
    """By how much water has become warmer in each step, colder where it cools, over 10 K, shape (n_time,) [-].

    Parameters
    ----------
    water : ndarray, shape (n_time,)
        Supply [K].
    sign : float
        As of `SupplyWater` [-].
    """
    return np.asarray(sign * np.diff(water, prepend=water[:1]) / PER)
