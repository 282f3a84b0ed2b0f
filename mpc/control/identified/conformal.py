"""Back-off from comfort bands that keeps the share of violations that is asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpc.errors import ControlError
from thermal._types import BoolArray, FloatArray

#: Range of the back-off [K]: a third of a usual band of 3 K inwards, half of what people hardly feel outwards.
RANGE = (-0.5, 1.0)

#: Change of the back-off by a violation [K]: over a season of 5,000 occupied steps the share is then within 0.6 points
#: of what is asked for, whatever comes (range over η T), and a morning's violations change it by tenths of a kelvin.
RATE = 0.05


@dataclass(frozen=True)
class Guarantee:
    """What is asked for.

    Parameters
    ----------
    share : float
        α, of occupied steps outside of the band [-].
    lowest, highest : float
        Range of the back-off [K].

    Raises
    ------
    ControlError
        When the share is none, or the range is empty.
    """

    share: float
    lowest: float = RANGE[0]
    highest: float = RANGE[1]

    def __post_init__(self) -> None:
        fits = 0.0 < self.share < 1.0 and self.lowest < self.highest
        expected = "a share between 0 and 1, and a range of the back-off"
        ControlError.unless(fits, "violations", expected, f"{self.share:g}, {self.lowest:g} to {self.highest:g} K")


class ConformalBackOff:
    """Adaptive conformal inference on the misses of comfort: the back-off grows by each and shrinks without.

    ``b_{t+1} = clip(b_t + η (err_t - α))`` with ``err_t`` the share of zones outside of their band in an occupied step.
    Summed up, the share of violations differs from α by at most ``(range + η) / (η T)`` after T steps, whatever plant,
    model and weather do, as long as b is not held at an end of its range (Gibbs and Candès 2021, Adaptive conformal
    inference under distribution shift, doi:10.48550/arXiv.2106.00170, proposition 4.1; on the scale of the score
    rather than of its quantile as of Angelopoulos, Candès and Tibshirani 2023, doi:10.48550/arXiv.2307.16895, section
    2.1, as zones are at the edge of their band only in some hours, and a quantile would take months to move).

    Parameters
    ----------
    asked : Guarantee
        Share and range.
    start : float
        First back-off [K].

    Examples
    --------
    >>> import numpy as np
    >>> kept = ConformalBackOff(Guarantee(0.05))
    >>> for inside in (-0.1, 0.2):
    ...     kept.update(np.array([inside]), np.array([True]))
    >>> round(kept.value, 4), kept.outside, kept.count
    (0.045, 1.0, 2)
    """

    def __init__(self, asked: Guarantee, start: float = 0.0) -> None:
        self.asked, self.value = asked, float(np.clip(start, asked.lowest, asked.highest))
        self.outside, self.count = 0.0, 0

    def update(self, inside: FloatArray, occupied: BoolArray) -> None:
        """Learn from a step.

        Parameters
        ----------
        inside : ndarray, shape (n_zone,)
            Distance from the edge of the band, negative outside [K]; NaN where not measured.
        occupied : ndarray of bool, shape (n_zone,)
            Zones that count.
        """
        counted = occupied & np.isfinite(inside)
        if not counted.any():
            return
        error = float((inside[counted] < 0.0).mean())
        self.outside += error
        self.count += 1
        moved = self.value + RATE * (error - self.asked.share)
        self.value = float(np.clip(moved, self.asked.lowest, self.asked.highest))
