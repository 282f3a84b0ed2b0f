"""Back-off from comfort bands that keeps the share of violations that is asked for, by zone and kind of hour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpc.errors import ControlError
from thermal._types import BoolArray, FloatArray

#: Share of violations [-]: on the plants to develop on, steps below the band then sum up to less than 0.5 K h in two
#: weeks, as most of them miss it by some hundredths of a kelvin.
SHARE = 0.01

#: Range of the back-off [K]: a third of a usual band of 3 K inwards, half of what people hardly feel outwards.
RANGE = (-0.5, 1.0)

#: Time after a rise of the lower edge that is a kind of its own [s], and the least rise [K]: when people come, what was
#: planned for hours is put to the test, and zones miss by more than while their temperature is only kept.
AFTER, RISE = 3600.0, 0.5

#: Change of the back-off by a violation [K]: over a season of 5,000 occupied steps the share is then within 0.6 points
#: of what is asked for, whatever comes (range over η T), and a morning's violations change it by tenths of a kelvin.
RATE = 0.05

#: Kind of steps in which nobody is in.
_EMPTY = 2


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

    share: float = SHARE
    lowest: float = RANGE[0]
    highest: float = RANGE[1]

    def __post_init__(self) -> None:
        fits = 0.0 < self.share < 1.0 and self.lowest < self.highest
        expected = "a share between 0 and 1, and a range of the back-off"
        ControlError.unless(fits, "violations", expected, f"{self.share:g}, {self.lowest:g} to {self.highest:g} K")


class ConformalBackOff:
    """Adaptive conformal inference on the misses of comfort: the back-off grows by each and shrinks without.

    ``b_{t+1} = clip(b_t + η (err_t - α))`` with ``err_t`` 1 where a zone is outside of its band in an occupied step,
    else 0; of each zone one b for the hour `AFTER` its lower edge has risen, and one for all others. Steps in which
    nobody is in have a third, which is never outwards of the band nor less than the one of steps with people: a
    thermostat that holds a zone a little under what it is told does so at night too. It learns by all of them in which
    more heat was to be had, and by where a zone ends, on a straight line from the end of the step before: what goes on
    and off at night lets a zone dip within steps. Summed up, the
    share of violations of each differs from α by at most ``(range + η) / (η T)`` after its T steps, whatever plant,
    model and weather do, as long as b is not held at an end of its range (Gibbs and Candès 2021, Adaptive conformal
    inference under distribution shift, doi:10.48550/arXiv.2106.00170, proposition 4.1; on the scale of the score
    rather than of its quantile as of Angelopoulos, Candès and Tibshirani 2023, doi:10.48550/arXiv.2307.16895, section
    2.1, as zones are at the edge of their band only in some hours, and a quantile would take months to move).

    Parameters
    ----------
    asked : Guarantee
        Share and range.
    zones : int
        Number of zones.
    start : float
        First back-off [K].

    Examples
    --------
    >>> import numpy as np
    >>> kept = ConformalBackOff(Guarantee(0.05), 1)
    >>> for inside in (-0.1, 0.2):
    ...     kept.update(np.array([inside]), np.array([True]), np.array([False]))
    >>> kept.values.round(4).tolist(), kept.outside, kept.count
    ([[0.045, 0.0, 0.0]], 1, 2)
    """

    def __init__(self, asked: Guarantee, zones: int, start: float = 0.0) -> None:
        self.asked = asked
        self._lowest, self._highest = (np.array([end, end, max(end, 0.0)]) for end in (asked.lowest, asked.highest))
        self.values: FloatArray = np.clip(np.full((zones, 3), start), self._lowest, self._highest)
        self.outside, self.count = 0, 0
        self._before, self._fell = np.full(zones, np.nan), np.zeros(zones)

    def update(self, inside: FloatArray, occupied: BoolArray, risen: BoolArray, spent: BoolArray | None = None) -> None:
        """Learn from a step.

        Parameters
        ----------
        inside : ndarray, shape (n_zone,)
            Distance from the edge of the band, negative outside [K]; NaN where not measured.
        occupied : ndarray of bool, shape (n_zone,)
            Zones with people, which count.
        risen : ndarray of bool, shape (n_zone,)
            Zones whose lower edge has risen within the hour.
        spent : ndarray of bool, shape (n_zone,), optional
            Zones that had all heat that there is; none by default.
        """
        seen, missed = np.isfinite(inside), inside < 0.0
        self.outside += int((missed & seen & occupied).sum())
        self.count += int((seen & occupied).sum())
        kind = _kinds(occupied, risen)
        # a straight line from where the step before ended has its mean halfway to where this one ends
        falls, empty = np.nan_to_num(np.maximum(self._before - inside, 0.0)), kind == _EMPTY
        missed[empty] = (inside - np.maximum(falls - 0.5 * self._fell, 0.0))[empty] < 0.0
        self._fell = falls
        more = empty if spent is None else empty & ~spent
        learns, self._before = np.flatnonzero(seen & (occupied | more)), inside
        at = learns, kind[learns]
        moved = self.values[at] + RATE * (missed[learns] - self.asked.share)
        self.values[at] = np.clip(moved, self._lowest[kind[learns]], self._highest[kind[learns]])

    def along(self, risen: BoolArray, occupied: BoolArray) -> FloatArray:
        """Back-off of steps, shape (N, n_zone) [K].

        Parameters
        ----------
        risen : ndarray of bool, shape (N, n_zone)
            Whether the lower edge has risen within the hour.
        occupied : ndarray of bool, shape (N, n_zone)
            Whether people are expected.
        """
        kept = self.values.copy()
        kept[:, _EMPTY] = kept[:, [0, _EMPTY]].max(axis=1)  # a building that is let go comes back late
        return np.asarray(kept[np.arange(len(kept)), _kinds(occupied, risen)])


def _kinds(occupied: BoolArray, risen: BoolArray) -> np.ndarray:
    """Give the kind of each step: 1 after a rise of the edge, else 0 with people and `_EMPTY` without."""
    return np.where(risen, 1, np.where(occupied, 0, _EMPTY))


def risen(lower: FloatArray, step: float, before: FloatArray | None = None) -> BoolArray:
    """Tell the steps within the hour after a rise of the lower edge, shape (N, n_zone).

    Parameters
    ----------
    lower : ndarray, shape (N, n_zone)
        Lower edges [K].
    step : float
        Length of a step [s].
    before : ndarray, shape (n, n_zone), optional
        Lower edges of the steps before [K].
    """
    count = max(round(AFTER / step), 1)
    past = np.repeat(lower[:1], count, axis=0)
    if before is not None and len(before):
        past = np.vstack([past, before])[-count:]
    windows = np.lib.stride_tricks.sliding_window_view(np.vstack([past, lower]), count + 1, axis=0)
    return np.asarray(lower - windows.min(axis=-1) > RISE)
