"""Replay of an interval of telemetry through the model: the simulated zones beside the measured ones."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.errors import ModelError
from thermal.model.case_replay import LEAST_SPIN_UP, SPIN_UP, free_runs, replay_inputs, spin_up
from thermal.model.matrices import SymbolicModel
from thermal.model.step import IMPLICIT_EULER, Scheme


@dataclass(frozen=True, repr=False)
class Simulation:
    """A replayed interval.

    Parameters
    ----------
    simulated : DataFrame, shape (n_time, n_zone)
        Zone temperatures, means over the steps that end at the stamps [K].
    measured : DataFrame, shape (n_time, n_zone)
        What the sensors reported [K].
    heat : DataFrame, shape (n_time, n_zone)
        Metered heat that drove the replay [W].
    start : Timestamp
        Where measured and simulated zones were matched.
    """

    simulated: pd.DataFrame
    measured: pd.DataFrame
    heat: pd.DataFrame
    start: pd.Timestamp

    @property
    def error(self) -> pd.DataFrame:
        """Simulated less measured temperatures, shape (n_time, n_zone) [K]."""
        return self.simulated - self.measured

    def __repr__(self) -> str:
        mean, span = self.error.abs().mean().mean(), f"{self.start} to {self.simulated.index[-1]}"
        return f"Simulation({span}, {self.simulated.shape[1]} zones, mean absolute error {mean:.2f} K)"

    def to_frame(self) -> pd.DataFrame:
        """Everything as a table, shape (n_time, 3 n_zone) [K], [K], [W]; columns of two levels, kind and zone."""
        return pd.concat({"simulated": self.simulated, "measured": self.measured, "heat": self.heat}, axis=1)

    def plot(self) -> Any:
        """Draw simulated and measured temperatures of every zone [degC]; returns a matplotlib figure."""
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(layout="constrained")
        for k, zone in enumerate(self.simulated):
            axes.plot(self.simulated.index, self.simulated[zone] - 273.15, color=f"C{k}", label=zone)
            axes.plot(self.measured.index, self.measured[zone] - 273.15, color=f"C{k}", linestyle=":")
        axes.set(ylabel="temperature (degC)", title="simulated, and measured (dotted)")
        axes.legend(frameon=False, ncols=4)
        return figure


def simulate(
    case: Case,
    model: SymbolicModel,
    theta: FloatArray,
    start: pd.Timestamp,
    end: pd.Timestamp,
    scheme: Scheme = IMPLICIT_EULER,
    spin_up_seconds: float = SPIN_UP,
    progress: Callable[[int], None] | None = None,
) -> Simulation:
    """Replay the building's inputs from ``start`` to ``end`` through the model.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    model : SymbolicModel
        On the grid or reduced.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    start, end : Timestamp
        Stamps; zones are matched at the first stamp at or after ``start``.
    scheme : Scheme
        Time stepping.
    spin_up_seconds : float
        Telemetry before the start that the spin-up uses [s]; what there is, but at least 12 hours.
    progress : callable, optional
        Called with the number of free steps done.

    Raises
    ------
    ModelError
        When the interval is outside of the telemetry, leaves no spin-up, or lacks inputs for over 30 minutes.
    """
    inputs = replay_inputs(case, model.network)
    stamps = inputs.stamps
    first, last = int(stamps.searchsorted(start)), int(stamps.searchsorted(end, side="right")) - 1
    if not (start < end and first < last and stamps[0] <= start and end <= stamps[-1]):
        within = f"the telemetry, which goes from {stamps[0]} to {stamps[-1]}"
        raise ModelError(f"interval {start} to {end}: expected two times in order within {within}")
    begin = max(0, first - round(spin_up_seconds / inputs.step))
    if (first - begin) * inputs.step < LEAST_SPIN_UP:
        earliest = stamps[0] + pd.Timedelta(seconds=LEAST_SPIN_UP)
        raise ModelError(
            f"start {start}: expected at least 12 h of telemetry before it for the spin-up; earliest is {earliest}"
        )
    lacking = np.flatnonzero(~inputs.complete[first + 1 : last + 1])
    if lacking.size:
        raise ModelError(
            f"inputs are missing for over 30 minutes from {stamps[first + 1 + lacking[0]]}; choose another interval"
        )
    matrices = model.matrices(theta)
    at = np.array([first])
    states, _ = spin_up(matrices, inputs, begin, at)
    means, _ = free_runs(matrices, inputs, at, last - first, states, scheme=scheme, progress=progress)
    rows = slice(first + 1, last + 1)
    zones = list(model.network.zones)

    def table(values: FloatArray) -> pd.DataFrame:
        return pd.DataFrame(values, index=stamps[rows], columns=zones)

    return Simulation(table(means[0]), table(inputs.zone[rows]), table(inputs.heat[rows]), stamps[first])
