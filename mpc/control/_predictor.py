"""Building and plant over a horizon, thermostats and terminals inside: roll-outs and their exact slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mpc.control._channels import Channel
from mpc.control._data import HorizonData
from mpc.control._horizon import Horizon
from mpc.errors import ControlError
from thermal.errors import describe
from thermal.hvac import SmoothHvac
from thermal.model import IMPLICIT_EULER, ModalModel, Scheme
from thermal.signals import REFERENCE_TEMPERATURE

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rollout:
    """What a plan leads to.

    Parameters
    ----------
    plan : ndarray, shape (n_block, n_channel)
        Setpoints [unit of the channel].
    zone : ndarray, shape (N + 1, n_zone)
        Temperatures at the edges of the steps [K].
    electric, fuel : ndarray, shape (N,)
        Powers, means over the steps [W].
    end_state : ndarray, shape (r,)
        Of the modes at the end [(W K)^0.5].
    knobs : ndarray, shape (N, n_knob)
        Water at the starts, and setpoints [K, Pa].
    sums : ndarray, shape (N, m)
        Of the plant, where its slopes are taken [as in `thermal.hvac.HvacSlopes`].
    heat : ndarray, shape (N, n_zone)
        From the plant into the zones [W].
    """

    plan: FloatArray
    zone: FloatArray
    electric: FloatArray
    fuel: FloatArray
    end_state: FloatArray
    knobs: FloatArray
    sums: FloatArray
    heat: FloatArray

    @property
    def finite(self) -> bool:
        """Whether nothing overflowed."""
        return bool(np.isfinite(self.zone).all() and np.isfinite(self.electric).all() and np.isfinite(self.fuel).all())


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of a roll-out by its plan; D = n_block n_channel, blocks first.

    Parameters
    ----------
    zone : ndarray, shape (N + 1, n_zone, D)
        Of the temperatures [K per unit of the channel].
    electric, fuel : ndarray, shape (N, D)
        Of the powers [W per unit of the channel].
    end_state : ndarray, shape (r, D)
        Of the modes at the end [(W K)^0.5 per unit of the channel].
    """

    zone: FloatArray
    electric: FloatArray
    fuel: FloatArray
    end_state: FloatArray


class Predictor:
    """A building's modes and its smooth plant, step by step, with the local thermostats and terminals inside.

    Parameters
    ----------
    modes : ModalModel
        Of a reduced model, at one θ.
    hvac : SmoothHvac
        The plant.
    horizon : Horizon
        Steps and blocks.
    channels : sequence of Channel
        What is decided; what is not stays at its design value.
    disturbance_time : float
        Time constant with which the unmeasured heat fades [s]; infinite by default: it stays.
    scheme : Scheme
        Of time; by default implicit Euler, as the model is calibrated, filtered and stepped as a plant.

    Raises
    ------
    ControlError
        When plant and building have not the same zones, or two channels set the same.

    Notes
    -----
    At the start of a step the thermostats look at the zones; flows, valves and the heat into the zones follow and are
    held over it, as `thermal.hvac.HvacPlant` does. Slopes are forward sensitivities of the single shooting: one column
    a decision, through the modes (diagonal) and the plant (diagonal and low rank, `thermal.hvac.SmoothHvac`).
    """

    def __init__(
        self,
        modes: ModalModel,
        hvac: SmoothHvac,
        horizon: Horizon,
        channels: Sequence[Channel],
        disturbance_time: float = np.inf,
        scheme: Scheme = IMPLICIT_EULER,
    ) -> None:
        n_zone = modes.output.shape[0]
        if hvac.n_zone != n_zone:
            raise ControlError(describe("predictor", f"a plant of {n_zone} zones", f"one of {hvac.n_zone}"))
        self.modes, self.hvac, self.horizon, self.channels = modes, hvac, horizon, tuple(channels)
        self.at = [channel.knobs(hvac) for channel in self.channels]
        used = np.concatenate(self.at) if self.at else np.zeros(0, dtype=np.intp)
        if not used.size or len(np.unique(used)) != used.size:
            expected = "at least one channel, and one for each setpoint"
            raise ControlError(describe("predictor", expected, f"{[c.name for c in self.channels]}"))
        self.n_zone, self.n_decision = n_zone, horizon.n_block * len(self.channels)
        self._output = np.ascontiguousarray(modes.output)
        parts = {dt: modes.propagator(float(dt), scheme) for dt in np.unique(horizon.steps)}
        self._end = {dt: p.end for dt, p in parts.items()}
        self._push = {dt: np.ascontiguousarray(p.end_gain[:, None] * modes.heating) for dt, p in parts.items()}
        self._drive = {dt: p.end_gain[:, None] * modes.boundary for dt, p in parts.items()}
        self._fading = np.exp(-horizon.edges[:-1] / disturbance_time)
        self._design = self._design_knobs()
        self._stepper = hvac.stepper()
        self._known: tuple[HorizonData | None, FloatArray, FloatArray] = (None, np.zeros(0), np.zeros(0))

    def _design_knobs(self) -> FloatArray:
        at, system = self.hvac.knobs, self.hvac.system
        knobs = np.zeros(at.size)
        knobs[at.supply_air], knobs[at.supply_water] = 288.15, 333.15
        knobs[at.static_pressure] = system.static_pressures
        knobs[at.differential_pressure] = system.loop.pump.differential_pressure
        return knobs

    def _given(self, data: HorizonData) -> tuple[FloatArray, FloatArray]:
        """What does not depend on the plan: surroundings of the plant, and drive of the modes; kept for one horizon."""
        if self._known[0] is not data:
            around = self.hvac.around(
                data.heating_setpoint, data.cooling_setpoint, data.outdoor_temperature, data.outdoor_humidity,
                data.running, data.boiler, data.ventilation, self.horizon.steps,
            )  # fmt: skip
            free = data.gains + self._fading[:, None] * data.disturbance
            outside = data.boundary.copy()
            n_temperature = outside.shape[1] - self.modes.n_signal
            outside[:, :n_temperature] -= REFERENCE_TEMPERATURE
            steps = self.horizon.steps
            drive = np.stack([self._drive[dt] @ o + self._push[dt] @ f for dt, o, f in zip(steps, outside, free, strict=True)])
            self._known = (data, around, drive)
        return self._known[1], self._known[2]

    def knobs(self, plan: FloatArray) -> FloatArray:
        """Spread a plan over the steps, shape (N, n_knob) [K, Pa]; water is left for the roll-out.

        Parameters
        ----------
        plan : ndarray, shape (n_block, n_channel)
            Setpoints [unit of the channel].
        """
        knobs = np.tile(self._design, (len(self.horizon), 1))
        for c, at in enumerate(self.at):
            knobs[:, at] = plan[self.horizon.block_of, c][:, None]
        return knobs

    def rollout(self, data: HorizonData, plan: FloatArray) -> Rollout:
        """Follow a plan.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        plan : ndarray, shape (n_block, n_channel)
            Setpoints [unit of the channel].
        """
        n, count, stepper, water_at = self.n_zone, len(self.horizon), self._stepper, self.hvac.knobs.water
        around, drive = self._given(data)
        knobs, x, water = self.knobs(plan), data.state, data.water
        zone, done = np.empty((count + 1, n)), np.empty((count, stepper.output.size))
        for k, dt in enumerate(self.horizon.steps):
            zone[k] = self._output @ x
            zone[k] += REFERENCE_TEMPERATURE
            knobs[k, water_at] = water
            stepper.zone[:], stepper.knobs[:], stepper.around[:] = zone[k], knobs[k], around[k]
            done[k] = stepper.step()
            water = done[k, n + 2]
            x = self._end[dt] * x + self._push[dt] @ done[k, :n] + drive[k]
        zone[count] = self._output @ x + REFERENCE_TEMPERATURE
        return Rollout(
            plan, zone, done[:, n], done[:, n + 1], x, knobs, np.ascontiguousarray(done[:, n + 3 :]), done[:, :n]
        )

    def sensitivity(self, data: HorizonData, rollout: Rollout) -> Sensitivity:
        """Differentiate a roll-out by all decisions.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        rollout : Rollout
            Of `rollout`, with the same data.
        """
        around, _ = self._given(data)
        count, n_channel, water_at = len(self.horizon), len(self.channels), self.hvac.knobs.water
        slopes = self.hvac.slopes(rollout.zone[:-1], rollout.knobs, around, rollout.sums)
        heat_by = np.stack([slopes.heat_by_knobs[:, :, at].sum(axis=2) for at in self.at], axis=2)
        total_by = np.stack([slopes.totals_by_knobs[:, :, at].sum(axis=2) for at in self.at], axis=2)
        zone, totals = np.zeros((count + 1, self.n_zone, self.n_decision)), np.zeros((count, 3, self.n_decision))
        states, water = np.zeros((self._output.shape[1], self.n_decision)), np.zeros(self.n_decision)
        for k, dt in enumerate(self.horizon.steps):
            block = self.horizon.block_of[k]
            own = slice(block * n_channel, (block + 1) * n_channel)
            seen = slice(0, own.stop)  # later blocks have had no effect yet
            moved = self._output @ states[:, seen]
            heat = slopes.local[k][:, None] * moved
            heat += slopes.reach[k] @ (slopes.pull[k] @ moved)
            heat += np.outer(slopes.heat_by_knobs[k, :, water_at], water[seen])
            heat[:, own] += heat_by[k]
            total = slopes.totals_by_zone[k] @ moved + np.outer(slopes.totals_by_knobs[k, :, water_at], water[seen])
            total[:, own] += total_by[k]
            zone[k, :, seen], totals[k, :, seen], water[seen] = moved, total, total[2]
            states[:, seen] = self._end[dt][:, None] * states[:, seen] + self._push[dt] @ heat
        zone[count] = self._output @ states
        return Sensitivity(zone, totals[:, 0], totals[:, 1], states)

    def heat_content(self, state: FloatArray) -> float:
        """Heat that the building holds above `thermal.signals.REFERENCE_TEMPERATURE` [J].

        Parameters
        ----------
        state : ndarray, shape (r,)
            Of the modes [(W K)^0.5].
        """
        return float(self.heat_row @ state)

    @property
    def heat_row(self) -> FloatArray:
        """Heat per modal state, shape (r,) [J per (W K)^0.5]."""
        return np.asarray(self.modes.uniform * self.modes.capacity)
