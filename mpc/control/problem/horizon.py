"""The time that a controller looks ahead, and everything about it that changes from solve to solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import pandas as pd

from mpc.errors import ControlError
from thermal._types import FloatArray, IntArray

#: Longest step of the predictor [s]: the water of the loop and the air's mixing are lost in longer ones.
LONGEST_STEP = 1800.0


@dataclass(frozen=True, eq=False)
class Horizon:
    """Steps of the predictor, blocks of the decisions, and the time between two actions.

    Parameters
    ----------
    steps : ndarray, shape (N,)
        Lengths of the model's steps [s], positive, up to `LONGEST_STEP`; they need not be equal.
    first_steps : ndarray of int, shape (n_block,)
        Step with which each block begins: 0, then rising.
    control_step : float
        Time after which the next action is due [s]; a number of steps from the start, and no longer than the first
        block.

    Raises
    ------
    ControlError
        When a number is out of its range, or steps, blocks and control step do not fit.

    Examples
    --------
    >>> ahead = Horizon.regular(6.0, 300.0, blocks=12)
    >>> len(ahead), ahead.n_block, ahead.block_starts[:3].tolist()
    (72, 12, [0.0, 1800.0, 3600.0])
    """

    steps: FloatArray
    first_steps: IntArray
    control_step: float

    def __post_init__(self) -> None:
        steps, first = np.atleast_1d(np.asarray(self.steps, dtype=float)), np.atleast_1d(np.asarray(self.first_steps))
        possible = steps.ndim == 1 and bool(((steps > 0) & (steps <= LONGEST_STEP)).all())
        ControlError.unless(possible, "horizon: steps", f"steps above 0 and up to {LONGEST_STEP:g} s", self.steps)
        rising = first[0] == 0 and (np.diff(first) > 0).all() and first[-1] < len(steps)
        expected = f"numbers of steps that rise from 0, below {len(steps)}"
        whole = np.issubdtype(first.dtype, np.integer)
        ControlError.unless(rising and whole, "horizon: first_steps", expected, repr(self.first_steps))
        object.__setattr__(self, "steps", steps)
        object.__setattr__(self, "first_steps", first.astype(np.int64))
        first_end = self.edges[first[1]] if len(first) > 1 else self.edges[-1]
        whole = bool(np.isclose(self.edges, self.control_step).any()) and 0.0 < self.control_step <= first_end
        expected = f"a whole number of steps, up to the first block's {first_end:g} s"
        ControlError.unless(whole, "horizon: control_step", expected, f"{self.control_step!r} s")

    @classmethod
    def regular(cls, hours: float, step: float, blocks: int, control_step: float | None = None) -> Horizon:
        """Make equal steps and blocks.

        Parameters
        ----------
        hours : float
            Length [h].
        step : float
            Of the model [s].
        blocks : int
            Number of blocks, as long as each other up to a step.
        control_step : float, optional
            Time between two actions [s]; one step by default.
        """
        count = round(hours * 3600.0 / step) if step > 0 else 0
        whole = 1 <= blocks <= count and abs(count * step - hours * 3600.0) <= 1e-6
        expected, found = "a whole number of steps, and at most as many blocks", f"{hours} h, {step} s, {blocks} blocks"
        ControlError.unless(whole, "horizon", expected, found)
        first = np.floor(np.arange(blocks) * count / blocks).astype(np.int64)
        return cls(np.full(count, float(step)), first, step if control_step is None else control_step)

    @classmethod
    def growing(
        cls, parts: Sequence[tuple[float, float]], block_hours: Sequence[float], control_step: float | None = None
    ) -> Horizon:
        """Make fine steps first and coarse ones later.

        Parameters
        ----------
        parts : sequence of tuple of float
            Length [h] and step [s] of each part.
        block_hours : sequence of float
            Lengths of the blocks [h]; what is left of the horizon belongs to the last one.
        control_step : float, optional
            Time between two actions [s]; the first step by default.

        Examples
        --------
        >>> day = Horizon.growing([(1.0, 300.0), (23.0, 900.0)], [1.0, 1.0, 2.0, 2.0, 2.0, 4.0, 6.0])
        >>> len(day), day.n_block, float(day.edges[-1]) / 3600.0
        (104, 7, 24.0)
        """
        steps = np.concatenate([np.full(max(round(hours * 3600.0 / step), 1), float(step)) for hours, step in parts])
        starts = np.concatenate([[0.0], np.cumsum(np.asarray(block_hours, dtype=float) * 3600.0)[:-1]])
        edges = np.concatenate([[0.0], np.cumsum(steps)])
        first = np.unique(np.searchsorted(edges[:-1], starts[starts < edges[-1]] - 1e-6))
        return cls(steps, first.astype(np.int64), float(steps[0]) if control_step is None else control_step)

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def n_block(self) -> int:
        """Number of blocks."""
        return len(self.first_steps)

    @cached_property
    def edges(self) -> FloatArray:
        """Starts and ends of the steps, shape (N + 1,), from now [s]."""
        return np.concatenate([[0.0], np.cumsum(self.steps)])

    @cached_property
    def block_of(self) -> IntArray:
        """Block of each step, shape (N,)."""
        return np.searchsorted(self.first_steps, np.arange(len(self)), side="right") - 1

    @property
    def block_starts(self) -> FloatArray:
        """Starts of the blocks, shape (n_block,), from now [s]."""
        return np.asarray(self.edges[self.first_steps])

    def shifted(self, plan: FloatArray, seconds: float) -> FloatArray:
        """Carry a plan over to a later start: each block takes the mean of what was planned for its time.

        Parameters
        ----------
        plan : ndarray, shape (n_block, n_channel)
            Setpoints of the blocks [unit of the channel]; the last block's last for ever.
        seconds : float
            How much later [s], 0 or more.

        Returns
        -------
        ndarray, shape (n_block, n_channel)
            On the blocks of the new start [unit of the channel].
        """
        edges = np.append(self.block_starts, self.edges[-1])
        held = np.append(self.block_starts, self.edges[-1] + seconds)
        summed = np.vstack([np.zeros(plan.shape[1]), np.cumsum(plan * np.diff(held)[:, None], axis=0)])
        at = np.stack([np.interp(edges + seconds, held, column) for column in summed.T], axis=1)
        return np.asarray(np.diff(at, axis=0) / np.diff(edges)[:, None])

    def stamps(self, now: pd.Timestamp) -> pd.DatetimeIndex:
        """Give the ends of the steps.

        Parameters
        ----------
        now : pandas.Timestamp
            Start of the horizon, with a time zone.
        """
        return pd.DatetimeIndex(now + pd.to_timedelta(self.edges[1:], unit="s"), name="timestamp")


@dataclass(frozen=True, eq=False)
class PeakData:
    """Windows of demand charges over a horizon.

    Parameters
    ----------
    weights : ndarray, shape (n_window, N)
        Share of each window's mean power that each step has [-]; rows of zeros are no window.
    offset : ndarray, shape (n_window,)
        What was used of it before the horizon began [W].
    bucket : ndarray of int, shape (n_window,)
        Peak that each window belongs to.
    rate : ndarray, shape (n_bucket,)
        Charge [currency/kW].
    so_far : ndarray, shape (n_bucket,)
        Highest mean of the month up to now: what is below it is free [W].
    """

    weights: FloatArray
    offset: FloatArray
    bucket: IntArray
    rate: FloatArray
    so_far: FloatArray

    @classmethod
    def none(cls, n_steps: int) -> PeakData:
        """No demand charge.

        Parameters
        ----------
        n_steps : int
            N.
        """
        return cls(np.zeros((0, n_steps)), np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))

    def means(self, power: FloatArray) -> FloatArray:
        """Mean power over each window, shape (n_window,) [W].

        Parameters
        ----------
        power : ndarray, shape (N,)
            Electricity [W].
        """
        return self.weights @ power + self.offset

    def peaks(self, power: FloatArray) -> FloatArray:
        """Highest mean of each bucket, not below what it was, shape (n_bucket,) [W].

        Parameters
        ----------
        power : ndarray, shape (N,)
            Electricity [W].
        """
        highest = self.so_far.copy()
        np.maximum.at(highest, self.bucket, self.means(power))
        return highest


@dataclass(frozen=True, eq=False)
class HorizonData:
    """State, forecasts, prices, bands and schedules of one solve; N steps of the horizon.

    Parameters
    ----------
    state : ndarray, shape (r,)
        Of the modes, as `calibration.StateSpace` counts it [(W K)^0.5].
    water : float
        Supply water now [K].
    disturbance : ndarray, shape (n_zone,)
        Unmeasured heat now [W].
    previous : ndarray, shape (n_channel,)
        Setpoints that stand now [unit of the channel].
    boundary : ndarray, shape (N, n_boundary)
        Boundary temperatures, then signals of effects, counted from `thermal.units.REFERENCE_TEMPERATURE`
        [signal unit].
    outdoor_temperature, outdoor_humidity : ndarray, shape (N,)
        Of the air that is drawn in [K], [kg/kg].
    gains : ndarray, shape (N, n_zone)
        Expected heat of people and equipment [W].
    lower, upper : ndarray, shape (N, n_zone)
        Comfort band at the end of each step [K].
    heating_setpoint, cooling_setpoint : ndarray, shape (N, n_zone)
        Of the local thermostats [K].
    running, ventilation : ndarray, shape (N, n_air_handler)
        As in `thermal.system.system.HvacSystem.actions` [-].
    boiler : ndarray, shape (N,)
        As there [-].
    electricity_price, gas_price : ndarray, shape (N,)
        Emissions included, at their price [currency/kWh].
    comfort_price : ndarray, shape (N, n_zone)
        Of a kelvin outside of the band for an hour [currency/K/h].
    peaks : PeakData
        Demand charges.
    heat_value : float
        Of a kilowatt-hour of heat that the building holds at the end [currency/kWh]; negative where it is a burden.

    Raises
    ------
    ControlError
        Which of them has the wrong shape, or is not finite and where.
    """

    state: FloatArray
    water: float
    disturbance: FloatArray
    previous: FloatArray
    boundary: FloatArray
    outdoor_temperature: FloatArray
    outdoor_humidity: FloatArray
    gains: FloatArray
    lower: FloatArray
    upper: FloatArray
    heating_setpoint: FloatArray
    cooling_setpoint: FloatArray
    running: FloatArray
    ventilation: FloatArray
    boiler: FloatArray
    electricity_price: FloatArray
    gas_price: FloatArray
    comfort_price: FloatArray
    peaks: PeakData
    heat_value: float = 0.0

    def __post_init__(self) -> None:
        n_steps, n_zone = self.gains.shape
        each, zones = (n_steps,), (n_steps, n_zone)
        air = (n_steps, self.running.shape[-1])
        shapes = {
            "state": self.state.shape, "disturbance": (n_zone,), "previous": self.previous.shape,
            "boundary": (n_steps, self.boundary.shape[-1]), "outdoor_temperature": each, "outdoor_humidity": each,
            "gains": zones, "lower": zones, "upper": zones, "heating_setpoint": zones, "cooling_setpoint": zones,
            "running": air, "ventilation": air, "boiler": each, "electricity_price": each, "gas_price": each,
            "comfort_price": zones, "water": (), "heat_value": (),
        }  # fmt: skip
        for name in (f.name for f in fields(self) if f.name in shapes):
            values = np.asarray(getattr(self, name), dtype=float)
            fit, lost = values.shape == shapes[name], np.argwhere(~np.isfinite(np.atleast_1d(values))).tolist()
            ControlError.unless(fit, f"horizon data: {name}", f"shape {shapes[name]}", f"{values.shape}")
            ControlError.unless(not lost, f"horizon data: {name}", "finite numbers", f"others at {lost[:1]}")
        expected, found = f"weights of {n_steps} steps", f"{self.peaks.weights.shape}"
        ControlError.unless(self.peaks.weights.shape[1:] == each, "horizon data: peaks", expected, found)

    @property
    def n_zone(self) -> int:
        """Number of zones."""
        return int(self.gains.shape[1])
