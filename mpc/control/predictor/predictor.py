"""Building and plant over a horizon, thermostats and terminals inside: roll-outs and their exact slopes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import Horizon, HorizonData
from mpc.errors import ControlError
from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT, SUPPLY_AIR, SUPPLY_WATER
from thermal._types import FloatArray
from thermal.model.modal import ModalModel
from thermal.model.step import IMPLICIT_EULER, Scheme
from thermal.system.smooth import SmoothHvac
from thermal.units import REFERENCE_TEMPERATURE

_SETTLED = 1e-5  # K: what thermostats go by is found to within this
_NARROW = 0.02  # K: width of a bracket from which on Newton's method is left alone
_MOST_TRIES = 30  # of Newton's method in a step; two or three are usual


@dataclass(frozen=True, eq=False)
class Rollout:
    """What a plan leads to.

    Parameters
    ----------
    plan : ndarray, shape (n_block, n_channel)
        Setpoints [unit of the channel].
    zone : ndarray, shape (N + 1, n_zone)
        Temperatures at the edges of the steps [K].
    seen : ndarray, shape (N, n_zone)
        What the thermostats go by [K].
    electric, fuel : ndarray, shape (N,)
        Powers, means over the steps [W].
    end_state : ndarray, shape (r,)
        Of the modes at the end [(W K)^0.5].
    inputs : ndarray, shape (N, n_input)
        States of the devices, such as the supply water, at the starts, and setpoints [K or Pa].
    sums : ndarray, shape (N, m)
        Of the system, where its derivatives are taken [as in `thermal.system.smooth.HvacJacobian`].
    heat : ndarray, shape (N, n_zone)
        From the plant into the zones [W].
    air : ndarray, shape (N, n_air_handler)
        Supply air as it leaves each air handler [K].
    water : ndarray, shape (N,)
        Supply water at the ends of the steps [K]; NaN where no state of the plant is its temperature.
    """

    plan: FloatArray
    zone: FloatArray
    seen: FloatArray
    electric: FloatArray
    fuel: FloatArray
    end_state: FloatArray
    inputs: FloatArray
    sums: FloatArray
    heat: FloatArray
    air: FloatArray
    water: FloatArray

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
    Thermostats are faster than a step. What they and the terminals go by is the zone's temperature at the *end* of the
    step, as far as the zone's own heat changes it over the step:

    ``T_seen = T_free + g Q(T_seen)``

    with T_free the end of the step without heat from the plant and g the response of a zone to its own heat. Taken at
    the start of the step instead, proportional thermostats of 1 K swing from step to step at 5 minutes already. The
    equations are solved by Newton's method with the zones' own slopes, each zone within a bracket. Slopes are forward
    sensitivities of the single shooting, exact by the implicit function theorem: one column a decision, through the
    modes (diagonal) and the plant (diagonal and low rank, `thermal.system.smooth.SmoothHvac`).
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
        ControlError.unless(hvac.n_zone == n_zone, "predictor", f"a plant of {n_zone} zones", f"one of {hvac.n_zone}")
        self.hvac, self.channels = hvac, tuple(channels)
        self.at = [channel.places(hvac) for channel in self.channels]
        used = np.concatenate(self.at) if self.at else np.zeros(0, dtype=np.intp)
        expected, found = "at least one channel, and one for each setpoint", f"{[c.name for c in self.channels]}"
        ControlError.unless(used.size and len(np.unique(used)) == used.size, "predictor", expected, found)
        self._prepare(modes, horizon, disturbance_time, scheme)
        self._design, self._scheduled = self._design_inputs(), self._undecided_setpoints(used)
        self._stepper, self._device = hvac.stepper(), np.array(list(hvac.system.start().values()))
        self._water = [k for k, key in enumerate(hvac.system.states) if key.endswith("/supply_water_temperature")]
        self._known: tuple[HorizonData | None, FloatArray, FloatArray] = (None, np.zeros(0), np.zeros(0))

    def _prepare(self, modes: ModalModel, horizon: Horizon, disturbance_time: float, scheme: Scheme) -> None:
        """Discretise the building on the horizon's steps."""
        self.modes, self.horizon, self.n_zone = modes, horizon, modes.output.shape[0]
        self.n_decision = horizon.n_block * len(self.channels)
        self._output = np.ascontiguousarray(modes.output)
        parts = {dt: modes.propagator(float(dt), scheme) for dt in np.unique(horizon.steps)}
        self._end = {dt: p.end for dt, p in parts.items()}
        emitted = modes.heated_by_devices
        self._push = {dt: np.ascontiguousarray(p.end_gain[:, None] * emitted) for dt, p in parts.items()}
        self._gain = {dt: p.end_gain[:, None] * modes.heating for dt, p in parts.items()}
        self._drive = {dt: p.end_gain[:, None] * modes.boundary for dt, p in parts.items()}
        self._response = {dt: np.ascontiguousarray(self._output @ push) for dt, push in self._push.items()}
        self._own = {dt: np.ascontiguousarray(np.diag(response)) for dt, response in self._response.items()}
        #: Share of the unmeasured heat that is left at the start of each step, shape (N,) [-].
        self.fading = np.exp(-horizon.edges[:-1] / disturbance_time)

    def _design_inputs(self) -> FloatArray:
        """Give the inputs that hold where no channel decides: design values, or usual ones where there are none."""
        system, inputs = self.hvac.system, np.zeros(self.hvac.n_input)
        usual = {SUPPLY_AIR: 288.15, SUPPLY_WATER: 333.15}
        for point, at in self.hvac.inputs.items():
            keys = system.by_point.get(point, ())
            inputs[at] = usual.get(point, [system.defaults.get(key, 0.0) for key in keys] if keys else 0.0)
        return inputs

    def _undecided_setpoints(self, used: NDArray[np.intp]) -> NDArray[np.intp]:
        """Thermostats' setpoints among the inputs that no channel sets: they follow their schedule."""
        at = self.hvac.inputs
        heating, cooling = (np.arange(s.start, s.stop) for s in
                            (at.get(kind, slice(0, 0)) for kind in (HEATING_SETPOINT, COOLING_SETPOINT)))  # fmt: skip
        if not heating.size:
            return heating
        highest, lowest = np.full(self.hvac.n_input, -np.inf), np.full(self.hvac.n_input, np.inf)
        for channel, mine in zip(self.channels, self.at, strict=True):
            highest[mine], lowest[mine] = channel.upper, channel.lower
        if (highest[heating] > lowest[cooling]).any():
            found = f"{highest[heating].max():g} and {lowest[cooling].min():g} K"
            expected = "ranges of heating setpoints below those of cooling setpoints"
            raise ControlError("predictor", expected, found)
        return np.setdiff1d(np.concatenate([heating, cooling]), used)

    def _given(self, data: HorizonData) -> tuple[FloatArray, FloatArray]:
        """Give what no plan changes: surroundings of the plant, and drive of the modes; kept for one horizon."""
        if self._known[0] is not data:
            exogenous = self.hvac.surroundings({
                HEATING_SETPOINT: data.heating_setpoint, COOLING_SETPOINT: data.cooling_setpoint,
                "outdoor_temperature": data.outdoor_temperature, "outdoor_humidity": data.outdoor_humidity,
                "fan_running": data.running, "ventilation": data.ventilation, "seconds": self.horizon.steps,
                **{key.rpartition("/")[2]: data.boiler for key in self.hvac.system.water_switches},
            })  # fmt: skip
            self._known = (data, exogenous, self._undecided(data))
        return self._known[1], self._known[2]

    def _undecided(self, data: HorizonData) -> FloatArray:
        """Give the drive of the modes by boundaries, gains and unmeasured heat, shape (N, r) [(W K)^0.5]."""
        free = data.gains + self.fading[:, None] * data.disturbance
        outside = data.boundary.copy()
        outside[:, : outside.shape[1] - self.modes.n_signal] -= REFERENCE_TEMPERATURE
        steps = zip(self.horizon.steps, outside, free, strict=True)
        return np.stack([self._drive[dt] @ o + self._gain[dt] @ f for dt, o, f in steps])

    def inputs(self, plan: FloatArray) -> FloatArray:
        """Spread a plan over the steps, shape (N, n_input) [K or Pa]; states and schedules are left for the roll-out.

        Parameters
        ----------
        plan : ndarray, shape (n_block, n_channel)
            Setpoints [unit of the channel].
        """
        inputs = np.tile(self._design, (len(self.horizon), 1))
        for c, at in enumerate(self.at):
            inputs[:, at] = plan[self.horizon.block_of, c][:, None]
        return inputs

    def rollout(self, data: HorizonData, plan: FloatArray, near: Rollout | None = None) -> Rollout:
        """Follow a plan.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        plan : ndarray, shape (n_block, n_channel)
            Setpoints [unit of the channel].
        near : Rollout, optional
            One that is likely to be like this, to start from.
        """
        n, count, stepper, n_state = self.n_zone, len(self.horizon), self._stepper, self.hvac.n_state
        exogenous, drive = self._given(data)
        inputs, x, device = self.inputs(plan), data.state, self._device.copy()
        device[self._water] = data.water
        if self._scheduled.size:
            first = self.hvac.inputs[HEATING_SETPOINT].start
            inputs[:, self._scheduled] = np.hstack([data.heating_setpoint, data.cooling_setpoint])[
                :, self._scheduled - first
            ]
        zone, seen, done = np.empty((count + 1, n)), np.empty((count, n)), np.empty((count, stepper.output.size))
        zone[0], ahead = self._output @ x + REFERENCE_TEMPERATURE, np.zeros(n)
        for k, dt in enumerate(self.horizon.steps):
            inputs[k, :n_state] = device
            stepper.inputs[:], stepper.exogenous[:] = inputs[k], exogenous[k]
            left = self._end[dt] * x + drive[k]
            free = self._output @ left + REFERENCE_TEMPERATURE
            if near is not None:
                ahead = near.seen[k] - near.zone[k]
            seen[k] = self._settle(free, self._own[dt], zone[k] + ahead)
            ahead = seen[k] - zone[k]
            done[k] = stepper.output
            device = done[k, n + 2 : n + 2 + n_state]
            x = left + self._push[dt] @ done[k, :n]
            zone[k + 1] = free + self._response[dt] @ done[k, :n]
        sums, air = np.split(done[:, n + 2 + n_state : -n], [self.hvac.n_sum], axis=1)
        return Rollout(
            plan, zone, seen, done[:, n], done[:, n + 1], x, inputs, np.ascontiguousarray(sums), done[:, :n], air,
            done[:, n + 2 + self._water[0]] if self._water else np.full(count, np.nan),
        )  # fmt: skip

    def reached(self, data: HorizonData, rollout: Rollout) -> FloatArray:
        """Plan with each supply temperature moved to where its device comes nearest to it, (n_block, n_channel).

        A setpoint beyond what a coil or the boiler reaches leads to the same, and has no slope; where it is reached, it
        has one. Every other decision stays as it is.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        rollout : Rollout
            Of a plan, with the same data.
        """
        plan = rollout.plan.copy()
        for c, channel in enumerate(self.channels):
            if channel.quantity == SUPPLY_AIR:
                which = self.at[c] - self.hvac.inputs[SUPPLY_AIR].start
                found, there = rollout.air[:, which], data.running[:, which] > 0.0
            elif channel.quantity == SUPPLY_WATER:
                found, there = rollout.water[:, None], data.boiler[:, None] > 0.0
            else:
                continue
            least, most = np.full(len(plan), np.inf), np.full(len(plan), -np.inf)
            np.minimum.at(least, self.horizon.block_of, np.where(there, found, np.inf).min(axis=1))
            np.maximum.at(most, self.horizon.block_of, np.where(there, found, -np.inf).max(axis=1))
            used = np.isfinite(least)
            near = np.clip(plan[used, c], least[used], most[used])
            plan[used, c] = np.clip(near, channel.lower, channel.upper)
        return plan

    def _settle(self, free: FloatArray, own: FloatArray, guess: FloatArray) -> FloatArray:
        """Solve ``T = T_free + g Q(T)``; the stepper is left with the step at T."""
        stepper, n = self._stepper, self.n_zone
        least, most = np.full(n, -np.inf), np.full(n, np.inf)
        seen = guess.copy()
        for _ in range(_MOST_TRIES):
            stepper.zone[:] = seen
            done = stepper.step()
            miss = seen - free - own * done[:n]
            worst = np.abs(miss).max()
            if not worst > _SETTLED:  # also where it is not a number: the caller looks at what comes out
                break
            above = miss > 0.0
            most, least = np.where(above, seen, most), np.where(above, least, seen)
            new = seen - miss / (1.0 - own * np.minimum(done[-n:], 0.0))
            # close to the root the bracket is let go: the other zones have moved it a little
            inside = ((new > least) & (new < most)) | (most - least < _NARROW)
            seen = np.where(inside, new, np.where(np.isfinite(least + most), 0.5 * (least + most), new))
        return seen

    def sensitivity(self, data: HorizonData, rollout: Rollout) -> Sensitivity:
        """Differentiate a roll-out by all decisions.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        rollout : Rollout
            Of `rollout`, with the same data.
        """
        exogenous, _ = self._given(data)
        count, n_channel, n_state = len(self.horizon), len(self.channels), self.hvac.n_state
        jacobian = self.hvac.jacobian(rollout.seen, rollout.inputs, exogenous, rollout.sums)
        heat_by = np.stack([jacobian.heat_by_inputs[:, :, at].sum(axis=2) for at in self.at], axis=2)
        total_by = np.stack([jacobian.totals_by_inputs[:, :, at].sum(axis=2) for at in self.at], axis=2)
        own = np.stack([self._own[dt] for dt in self.horizon.steps])
        # (I - g (local + heat_by_sums sums_by_zone))^-1 by the matrix inversion lemma: diagonal and rank m
        diagonal = 1.0 - own * jacobian.local
        spread = (own / diagonal)[:, :, None] * jacobian.heat_by_sums
        core = spread @ np.linalg.inv(np.eye(self.hvac.n_sum) - jacobian.sums_by_zone @ spread)
        zone = np.zeros((count + 1, self.n_zone, self.n_decision))
        totals = np.zeros((count, 2 + n_state, self.n_decision))
        states = np.zeros((self._output.shape[1], self.n_decision))
        device = np.zeros((n_state, self.n_decision))
        for k, dt in enumerate(self.horizon.steps):
            block = self.horizon.block_of[k]
            mine = slice(block * n_channel, (block + 1) * n_channel)
            acted = slice(0, mine.stop)  # later blocks have had no effect yet
            left = self._end[dt][:, None] * states[:, acted]
            free = self._output @ left
            moved = free + (own[k][:, None] * jacobian.heat_by_inputs[k, :, :n_state]) @ device[:, acted]
            moved[:, mine] += own[k][:, None] * heat_by[k]
            moved /= diagonal[k][:, None]
            moved += core[k] @ (jacobian.sums_by_zone[k] @ moved)
            heat = (moved - free) / own[k][:, None]
            total = jacobian.totals_by_zone[k] @ moved
            total += jacobian.totals_by_inputs[k, :, :n_state] @ device[:, acted]
            total[:, mine] += total_by[k]
            totals[k, :, acted], device[:, acted] = total, total[2:]
            states[:, acted] = left + self._push[dt] @ heat
            zone[k + 1, :, acted] = free + self._response[dt] @ heat
        return Sensitivity(zone, totals[:, 0], totals[:, 1], states)

    def heat_content(self, state: FloatArray) -> float:
        """Heat that the building holds above `thermal.units.REFERENCE_TEMPERATURE` [J].

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
