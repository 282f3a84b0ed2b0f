"""Pairs of effects: what two explain together, where the best single one may be neither of them.

Two effects may hide each other, and what is none of them may look like their sum. Both show in the Gram matrix of all
signatures at once, so that every pair is weighed before any model is run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from calibration.diagnosis.screen.gains import Gain
from calibration.diagnosis.screen.screen import Screening


@dataclass(frozen=True)
class Pair:
    """What two effects could explain together.

    Parameters
    ----------
    first, second : Gain
        The two, with the strengths that they have together; the first gains more alone.
    gain : float
        Logarithm of the Bayes factor of both against neither, by tangents [-].
    share : float
        Of the squared error that both explain [-].
    """

    first: Gain
    second: Gain
    gain: float
    share: float


def nominate(made: Screening, gains: Sequence[Gain], least: float) -> list[Pair]:
    """Pairs that gain more than the best single effect by tangents, the best first.

    Parameters
    ----------
    made : Screening
        Gram matrix of all.
    gains : sequence of Gain
        Single effects, the best first.
    least : float
        By how much a pair must gain more than the best single effect [-].
    """
    if len(gains) < 2:
        return []
    least += max(gains[0].gain, 0.0)
    found = []
    for first, second in combinations(gains, 2):
        if made.reach(first, second) > least:
            pair = Pair(*made.together(first, second))
            if pair.gain > least and all(np.any(g.direction) for g in (pair.first, pair.second)):
                found.append(pair)
    return sorted(found, key=lambda p: -p.gain)
