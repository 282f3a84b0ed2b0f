"""The problem: cost of a plan and its derivatives, its bounds and its limits on changes."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mpc.control.predictor.predictor import Predictor, Rollout, Sensitivity
from mpc.control.problem.horizon import HorizonData
from mpc.errors import ControlError
from mpc.scenario.rates import HOUR, KILOWATT_HOUR
from thermal._types import FloatArray, IntArray

KILOWATT = 1000.0  # W


class CostTerms(NamedTuple):
    """What a plan costs over the horizon, in the currency of the prices.

    Parameters
    ----------
    electricity, gas : float
        Energy, emissions at their price [currency].
    demand : float
        What peaks rise above those of the month so far [currency].
    comfort : float
        Time outside of the bands, at the end of the horizon prolonged by the terminal time [currency].
    moves : float
        Squared changes of the setpoints, which decide what costs nothing else [currency].
    storage : float
        Minus the value of the heat that the building holds at the end [currency].
    """

    electricity: float
    gas: float
    demand: float
    comfort: float
    moves: float
    storage: float

    @property
    def total(self) -> float:
        """Sum of the terms [currency]."""
        return float(sum(self))


class Penalty(NamedTuple):
    """Comfort's cost of each step and zone, and its first and second derivative by temperature.

    Parameters
    ----------
    value, gradient, curvature : ndarray, shape (N, n_zone)
        [currency], [currency/K], [currency/K2].
    """

    value: FloatArray
    gradient: FloatArray
    curvature: FloatArray


@dataclass(frozen=True, eq=False)
class ControlProblem:
    """Economic cost, carbon at its price, soft comfort and demand charges over a horizon; built once.

    Parameters
    ----------
    predictor : Predictor
        Building and plant.
    softness : float
        Excess of a band at which comfort has its full price [K], positive: below it the penalty is a parabola, above
        it a straight line, as that of a slack with a linear and a quadratic price.
    terminal_time : float
        Time for which the state at the end of the horizon is taken to last, for comfort [s]: without it the last steps
        would be cheap to neglect.
    move_weight : float
        Price of a change by the whole range of a channel between two blocks, squared [currency]. Small: it chooses
        among setpoints that cost the same.
    paths : ndarray of int, shape (n_path, n_block of the horizon), optional
        Blocks of a plan that follow each other, by scenario where there are several; by default those of the horizon.

    Raises
    ------
    ControlError
        When a number is out of its range.
    """

    predictor: Predictor
    softness: float = 0.2
    terminal_time: float = 1800.0
    move_weight: float = 1e-3
    paths: IntArray | None = None

    def __post_init__(self) -> None:
        possible = 0.0 < self.softness <= 5.0 and self.terminal_time >= 0.0 and self.move_weight >= 0.0
        found = f"{self.softness} K, {self.terminal_time} s, {self.move_weight}"
        ControlError.unless(possible, "control problem", "a softness of 0 to 5 K, no negative number", found)

    @cached_property
    def _paths(self) -> IntArray:
        return np.arange(self.predictor.horizon.n_block)[None] if self.paths is None else self.paths

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Shape of a plan, (n_block, n_channel)."""
        return int(self._paths.max()) + 1, len(self.predictor.channels)

    @cached_property
    def lower(self) -> FloatArray:
        """Lower ends of the ranges, shape (D,) [unit of the channel]."""
        return np.tile([c.lower for c in self.predictor.channels], self.shape[0])

    @cached_property
    def span(self) -> FloatArray:
        """Widths of the ranges, shape (D,) [unit of the channel]: decisions are counted in shares of them."""
        return np.tile([c.upper - c.lower for c in self.predictor.channels], self.shape[0])

    def plan(self, shares: FloatArray) -> FloatArray:
        """Plan of decisions in shares of their ranges, shape (n_block, n_channel) [unit of the channel].

        Parameters
        ----------
        shares : ndarray, shape (D,)
            0 to 1 [-].
        """
        return (self.lower + self.span * shares).reshape(self.shape)

    def shares(self, plan: FloatArray) -> FloatArray:
        """Decisions of a plan in shares of their ranges, shape (D,), moved into them [-].

        Parameters
        ----------
        plan : ndarray, shape (n_block, n_channel)
            Setpoints [unit of the channel].
        """
        return np.clip((plan.ravel() - self.lower) / self.span, 0.0, 1.0)

    @cached_property
    def differences(self) -> FloatArray:
        """From decisions to their changes between blocks, first that against what stands now, shape (D, D) [-]."""
        follows = self.predecessors[:, None] == np.arange(self.shape[0])
        return np.eye(self.span.size) - np.kron(follows, np.eye(self.shape[1]))

    def standing(self, data: HorizonData) -> FloatArray:
        """Give what the first changes count from, shape (D,): setpoints that stand now, then zeros [-].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        """
        before = np.zeros(self.span.size)
        before[: self.shape[1]] = (data.previous - self.lower[: self.shape[1]]) / self.span[: self.shape[1]]
        return np.clip(before, 0.0, 1.0)

    @cached_property
    def most_change(self) -> FloatArray:
        """Largest change between blocks, shape (D,) [-]; infinite where there is no limit."""
        horizon, most = self.predictor.horizon, np.empty(self.shape)
        hours = np.concatenate([[horizon.control_step], np.diff(horizon.block_starts)]) / HOUR
        for path in self._paths:
            most[path] = np.outer(hours, [c.rate for c in self.predictor.channels])
        return most.ravel() / self.span

    @cached_property
    def predecessors(self) -> IntArray:
        """Block that each block follows, shape (n_block,); -1 is what stands now."""
        before = np.full(self.shape[0], -1, dtype=np.int64)
        for path in self._paths:
            before[path[1:]] = path[:-1]
        return before

    def admitted(self, data: HorizonData, shares: FloatArray) -> FloatArray:
        """Move decisions to where limits on changes allow them, shape (D,) [-].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        shares : ndarray, shape (D,)
            Decisions [-].
        """
        if not np.isfinite(self.most_change).any():
            return shares
        n = self.shape[1]
        moved, most = shares.reshape(-1, n).copy(), self.most_change.reshape(-1, n)
        for k, last in enumerate(self.predecessors):
            before = moved[last] if last >= 0 else self.standing(data)[:n]
            moved[k] = np.clip(moved[k], before - most[k], before + most[k])
        return np.clip(moved.ravel(), 0.0, 1.0)

    @cached_property
    def hours(self) -> FloatArray:
        """Length of each step, shape (N,) [h]."""
        return self.predictor.horizon.steps / HOUR

    @cached_property
    def _comfort_hours(self) -> FloatArray:
        hours = self.hours.copy()
        hours[-1] += self.terminal_time / HOUR
        return hours[:, None]

    def penalty(self, data: HorizonData, zone: FloatArray) -> Penalty:
        """Comfort's cost.

        Parameters
        ----------
        data : HorizonData
            Bands and prices.
        zone : ndarray, shape (N, n_zone)
            Temperatures at the ends of the steps [K].
        """
        outside = np.minimum(zone - data.lower, 0.0) + np.maximum(zone - data.upper, 0.0)
        size, weight, soft = np.abs(outside), data.comfort_price * self._comfort_hours, self.softness
        curved = size < soft
        value = weight * np.where(curved, 0.5 * size**2 / soft, size - 0.5 * soft)
        gradient = weight * np.clip(outside / soft, -1.0, 1.0)
        return Penalty(value, gradient, np.where(curved & (size > 0.0), weight / soft, 0.0))

    def terms(self, data: HorizonData, rollout: Rollout) -> CostTerms:
        """Cost of a roll-out.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        rollout : Rollout
            Of the predictor, with the same data.
        """
        electricity, fuel = self.energy_prices(data)
        changes = self.differences @ self.shares(rollout.plan) - self.standing(data)
        return CostTerms(
            electricity=float(electricity @ rollout.electric),
            gas=float(fuel @ rollout.fuel),
            demand=self.demand_charge(data, rollout.electric),
            comfort=float(self.penalty(data, rollout.zone[1:]).value.sum()),
            moves=self.move_weight * float(changes @ changes),
            storage=-data.heat_value * self.predictor.heat_content(rollout.end_state) / KILOWATT_HOUR,
        )

    def energy_prices(self, data: HorizonData) -> tuple[FloatArray, FloatArray]:
        """Cost of a watt of electricity and of fuel over each step, shape (n_steps,) [currency/W].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        """
        return data.electricity_price * self.hours / KILOWATT, data.gas_price * self.hours / KILOWATT

    def demand_charge(self, data: HorizonData, electric: FloatArray) -> float:
        """Cost of rising above the peaks so far [currency].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        electric : ndarray, shape (n_steps,)
            Electricity [W].
        """
        return float(data.peaks.rate @ (data.peaks.peaks(electric) - data.peaks.so_far)) / KILOWATT

    def energy_gradient(self, data: HorizonData, sensitivity: Sensitivity) -> FloatArray:
        """Gradient of energy and storage by the decisions, shape (D,) [currency].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        sensitivity : Sensitivity
            Of the roll-out.
        """
        electricity, fuel = self.energy_prices(data)
        by_plan = electricity @ sensitivity.electric + fuel @ sensitivity.fuel
        if data.heat_value:
            by_plan -= data.heat_value / KILOWATT_HOUR * (self.predictor.heat_row @ sensitivity.end_state)
        return np.asarray(by_plan * self.span)

    def move_gradient(self, data: HorizonData, shares: FloatArray) -> FloatArray:
        """Gradient of the price of changes, shape (D,) [currency].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        shares : ndarray, shape (D,)
            Decisions [-].
        """
        changes = self.differences @ shares - self.standing(data)
        return np.asarray(2.0 * self.move_weight * (self.differences.T @ changes))

    def gradient(self, data: HorizonData, rollout: Rollout, sensitivity: Sensitivity) -> FloatArray:
        """Gradient of everything but demand charges, shape (D,) [currency].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        rollout : Rollout
            Where.
        sensitivity : Sensitivity
            Of it.
        """
        zone = sensitivity.zone[1:].reshape(-1, self.span.size)
        comfort = self.penalty(data, rollout.zone[1:]).gradient.ravel() @ zone
        moves = self.move_gradient(data, self.shares(rollout.plan))
        return np.asarray(self.energy_gradient(data, sensitivity) + comfort * self.span + moves)

    def explain_limits(self, data: HorizonData) -> list[str]:
        """Say which ranges and rates contradict what stands now: such a plan begins at the edge of its range.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        """
        said = []
        for channel, value in zip(self.predictor.channels, data.previous, strict=True):
            if not channel.lower - 1e-6 <= value <= channel.upper + 1e-6:
                said.append(
                    f"{channel.name} stands at {value:g} {channel.unit}, outside of its range of {channel.lower:g} to "
                    f"{channel.upper:g} {channel.unit}; its changes count from the edge"
                )
        return said
