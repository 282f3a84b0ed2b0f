"""What a plan cannot do, in words: zone, time, constraint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mpc.control.problem.data import HorizonData
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.solution import Solution

_WORTH_SAYING = 0.3  # K outside of a band
_MOST = 3  # zones that are named


def explain_comfort(
    problem: ControlProblem, data: HorizonData, solution: Solution, zones: Sequence[str], now: pd.Timestamp
) -> list[str]:
    """Name the zones that a plan leaves outside of their band, the worst first, and the ranges that it exhausts then.

    Parameters
    ----------
    problem : ControlProblem
        What was solved.
    data : HorizonData
        With these parameters.
    solution : Solution
        Its outcome.
    zones : sequence of str
        Names of the zones.
    now : pandas.Timestamp
        Start of the horizon.
    """
    zone = solution.rollout.zone[1:]
    lack, excess = data.lower - zone, zone - data.upper
    outside = np.maximum(lack, excess)
    stamps, block_of = problem.predictor.horizon.stamps(now), problem.predictor.horizon.block_of
    said = []
    for k in np.argsort(-outside.max(axis=0))[:_MOST]:
        row = int(outside[:, k].argmax())
        if outside[row, k] < _WORTH_SAYING:
            break
        cold = lack[row, k] > excess[row, k]
        edge = float((data.lower if cold else data.upper)[row, k])
        limits = _exhausted(problem, solution.plan[block_of[row]])
        why = f"; {' and '.join(limits)}" if limits else "; more would cost more than comfort is worth"
        said.append(
            f"zone {zones[k]!r} stays {outside[row, k]:.1f} K {'below' if cold else 'above'} {edge - 273.15:.1f} degC "
            f"at {stamps[row]:%Y-%m-%d %H:%M}{why}"
        )
    return said


def _exhausted(problem: ControlProblem, values: np.ndarray) -> list[str]:
    said = []
    for channel, value in zip(problem.predictor.channels, values, strict=True):
        near = 1e-3 * (channel.upper - channel.lower)
        if value >= channel.upper - near:
            said.append(f"{channel.name} is at its upper limit of {channel.upper:g} {channel.unit}")
        elif value <= channel.lower + near:
            said.append(f"{channel.name} is at its lower limit of {channel.lower:g} {channel.unit}")
    return said
