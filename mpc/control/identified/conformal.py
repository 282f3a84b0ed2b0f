"""Back-off from comfort bands that keeps the share of violations that is asked for."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from thermal._types import FloatArray

#: Range of the back-off [K]: wider than what a day's misses of a fair model are, narrower than half of a usual band.
RANGE = (-0.5, 1.0)

#: Step of the adaptation γ [-]: of Gibbs and Candès' experiments (2021, section 4), which follows a change within days.
RATE = 0.005

#: Misses that the quantile is taken of, and fewest before there is one [steps].
_KEPT, _FEWEST = 672, 24


@dataclass(frozen=True)
class Guarantee:
    """What is asked for.

    Parameters
    ----------
    share : float
        α, of occupied steps outside of the band [-].
    lowest, highest : float
        Range of the back-off [K].
    """

    share: float
    lowest: float = RANGE[0]
    highest: float = RANGE[1]


class ConformalBackOff:
    """Adaptive conformal inference on the misses of comfort.

    The score of a step is by how much more than was planned a zone came out on the side that the band was planned
    against: planned distance inside of the band less the realised one. The back-off is the ``1 - α_t`` quantile of the
    scores seen; with ``err_t`` 1 where a zone was outside of its band in an occupied step and 0 otherwise,
    ``α_{t+1} = α_t + γ (α - err_t)``, so that the share of violations tends to α whatever the scores are (Gibbs and
    Candès 2021, Adaptive conformal inference under distribution shift, doi:10.48550/arXiv.2106.00170, proposition 4.1),
    as long as the clipped range allows it. Beyond the largest or below the smallest score, where α_t leaves 0 to 1, the
    back-off goes on by the spread of the scores.

    Parameters
    ----------
    asked : Guarantee
        Share and range.
    start : float
        Back-off until there are scores [K].
    """

    def __init__(self, asked: Guarantee, start: float = 0.0) -> None:
        self.asked, self.start = asked, start
        self.level = asked.share
        self._scores: deque[float] = deque(maxlen=_KEPT)
        self.outside, self.count = 0, 0

    @property
    def value(self) -> float:
        """Back-off now [K]."""
        if len(self._scores) < _FEWEST:
            return float(np.clip(self.start, self.asked.lowest, self.asked.highest))
        scores = np.array(self._scores)
        wanted = 1.0 - self.level
        found = float(np.quantile(scores, np.clip(wanted, 0.0, 1.0)))
        spread = max(float(np.ptp(np.quantile(scores, [0.1, 0.9]))), 0.02)
        beyond = max(wanted - 1.0, 0.0) + min(wanted, 0.0)
        return float(np.clip(found + beyond / RATE * 0.01 * spread, self.asked.lowest, self.asked.highest))

    def update(self, planned: FloatArray, realised: FloatArray, occupied: np.ndarray) -> None:
        """Learn from a step.

        Parameters
        ----------
        planned, realised : ndarray, shape (n_zone,)
            Distance inside of the band that was planned and came, negative outside [K].
        occupied : ndarray of bool, shape (n_zone,)
            Zones that count.
        """
        counted = occupied & np.isfinite(planned) & np.isfinite(realised)
        for plan, came in zip(planned[counted], realised[counted], strict=True):
            error = bool(came < 0.0)
            self.outside += error
            self.count += 1
            self.level += RATE * (self.asked.share - error)
            self._scores.append(float(plan - came))
