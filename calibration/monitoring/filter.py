"""Filter over days: parameters that seasons teach, the usual error of every hour, and the innovations of each day.

    x = [θ; b; w; p],   y_d = J_d θ + b + [day off] w + J_d p + v_d,   v_d ~ N(0, s² R)                          (M1)

θ are the parameters and strengths that are always there, counted from where the model is, with the priors of a
calibration; b is what errors are usually like (a slow random walk, a season's), w what days off differ by, and p are
changes that were found, each while it lasts. A Kalman filter over days (Anderson and Moore 1979, Optimal Filtering,
ch. 3) carries them on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import solve_triangular

from calibration.monitoring.days import Days, coming
from thermal._types import BoolArray, FloatArray, IntArray

#: Growth of the usual error in a day over the deviation of a day's errors [-]: over a quarter of a year the level moves
#: by half of that, as seasons do that the model knows nothing of, and a lasting change is noticed long before it is
#: taken for one.
LEVEL_WALK = 0.05

#: Deviation of what days off differ by, over that of a day's errors [-].
_DAYS_OFF = 1.0

#: Growth of a parameter in a day over the deviation of its prior [-]: a tenth in a year, as things age. Strengths that
#: may jump do not: a window whose prior is 2 m² wide would age by the area of one left ajar, and hide it within days.
_AGEING = 0.1 / np.sqrt(365.0)

#: Squared innovation of a day over its expectation from which the day moves states by less [-]: a day unlike all others
#: is no reason to believe another building.
_OUTLYING = 2.0

#: Least size of the noise over what the reference days showed [-].
_FLOOR = 0.5

#: Least noise of an error [K], rounds in which the noise is found, and days that it takes at least.
_LEAST_NOISE, _ROUNDS, _FEWEST = 0.01, 3, 7

#: Days over whose innovations the size of the noise is taken, and of these the last that have no say yet [d].
_MEMORY, _LAG = 28, 4


@dataclass(frozen=True)
class Found:
    """A change that was found, as a state of the filter.

    Parameters
    ----------
    column : int
        Of `Days.columns`.
    start : int
        First day.
    end : int or None
        First day on which it is over; None while it lasts.
    over : int
        Days over which it came; 0 is at once [d].
    deviation : float
        Standard deviation of its size before the data [estimation scale].
    """

    column: int
    start: int
    end: int | None
    over: int
    deviation: float

    def shown(self, days: Days, day: int) -> FloatArray:
        """Return the derivatives of a day's errors by the size of the change, shape (n_error,) [K].

        Parameters
        ----------
        days : Days
            The telemetry.
        day : int
            Which.
        """
        moved = np.zeros(days.errors.shape[1])
        for sign, first, over in ((1.0, self.start, self.over), (-1.0, self.end, 0)):
            if first is not None and first <= day:
                shares, added = coming(over, days.onset[..., self.column])
                begun = day - first < len(shares)
                share, onset = (shares[day - first], added[day - first]) if begun else (1.0, 0.0)
                moved += sign * (share * days.slopes[day, :, self.column] + onset)
        return moved


@dataclass(frozen=True)
class Innovation:
    """What a day says beyond what was expected of it.

    Parameters
    ----------
    seen : ndarray of bool, shape (n_error,)
        Errors that there are.
    observe : ndarray, shape (n_seen, n_state)
        What states do to them [K].
    gain : ndarray, shape (n_state, n_seen)
        What they do to the states [units of the states per K].
    root : ndarray, shape (n_seen, n_seen)
        Lower Cholesky factor of the covariance of the innovations, the size of the noise in it [K].
    white : ndarray, shape (n_seen,)
        Innovations, whitened [-].
    left : ndarray, shape (n_seen,)
        Innovations [K].
    """

    seen: BoolArray
    observe: FloatArray
    gain: FloatArray
    root: FloatArray
    white: FloatArray
    left: FloatArray


@dataclass(frozen=True)
class State:
    """What the filter knows at the beginning of a day.

    Parameters
    ----------
    mean : ndarray, shape (n_state,)
        States [estimation scale and K].
    covariance : ndarray, shape (n_state, n_state)
        Of them [products of their units].
    """

    mean: FloatArray
    covariance: FloatArray


@dataclass
class DayFilter:
    """Filter over days.

    Parameters
    ----------
    days : Days
        The telemetry.
    noise : ndarray, shape (n_error, n_error)
        Covariance R of a day's errors about what is expected [K²].
    walk : float
        See `LEVEL_WALK` [-].
    changes : sequence of Found
        That were found, in order.
    sizes : dict of int to float
        Mean square of each day's innovations over what the reference days have [-]; filled as days are taken in.
    """

    days: Days
    noise: FloatArray
    walk: float = LEVEL_WALK
    changes: Sequence[Found] = ()
    sizes: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        columns = self.days.columns
        self.deviation = np.sqrt(np.diag(self.noise))
        prior = np.array([c.spread for c in columns])
        one = np.ones(self.days.errors.shape[1])
        ages = np.where([c.may_change for c in columns], 0.0, _AGEING * prior)
        self._drift = np.concatenate([ages**2, (self.walk * self.deviation) ** 2, 0.0 * one])
        away = np.array([c.away for c in columns])
        spread = np.concatenate([prior**2, self.deviation**2, (_DAYS_OFF * self.deviation) ** 2])
        self._first = State(np.concatenate([away, 0.0 * one, 0.0 * one]), np.diag(spread))

    def start(self) -> State:
        """Return what is known before the first day."""
        return self._first

    def with_changes(self, changes: Sequence[Found]) -> DayFilter:
        """Return the filter with other changes in its state; noise sizes of earlier days are kept.

        Parameters
        ----------
        changes : sequence of Found
            In order; the first ones as before, but for their ends.
        """
        return replace(self, changes=tuple(changes))

    def grown(self, state: State) -> State:
        """Give a state the changes that it does not have yet.

        Parameters
        ----------
        state : State
            Of a filter with fewer changes.
        """
        have = state.mean.size - self._drift.size
        new = [c.deviation**2 for c in self.changes[have:]]
        n, m = state.mean.size, len(new)
        covariance = np.zeros((n + m, n + m))
        covariance[:n, :n] = state.covariance
        covariance[range(n, n + m), range(n, n + m)] = new
        return State(np.concatenate([state.mean, np.zeros(m)]), covariance)

    def scale(self, day: int) -> float:
        """Size of the noise by what the days before were like, a half at least [-].

        Parameters
        ----------
        day : int
            Days from four before it count no more.
        """
        before = [self.sizes[d] for d in range(day - _MEMORY - _LAG, day - _LAG) if d in self.sizes]
        return max(_FLOOR, float(np.median(before))) if len(before) > _MEMORY // 2 else 1.0

    def step(self, state: State, day: int) -> tuple[State, Innovation | None]:
        """Take in a day.

        Parameters
        ----------
        state : State
            At its beginning.
        day : int
            Number of the day.

        Returns
        -------
        tuple
            State at the beginning of the next day, and the innovation; None where nothing was measured.
        """
        days, n = self.days, self._drift.size
        seen = np.isfinite(days.errors[day])
        covariance = state.covariance
        innovation = None
        mean = state.mean
        if seen.any():
            slopes, one = days.slopes[day][seen], np.eye(seen.size)[seen]
            off = float(days.days_off[day])
            found = [c.shown(days, day)[seen, None] for c in self.changes]
            # e(θ) = e + J dθ: errors of the model as it is are what dθ, the level and the changes leave of zero
            observe = np.hstack([-slopes, one, off * one, *(-f for f in found)])
            scale = self.scale(day)
            noise = scale * self.noise[np.ix_(seen, seen)]
            left = days.errors[day][seen] - observe @ mean
            spread = observe @ covariance
            known = spread @ observe.T
            white = solve_triangular(np.linalg.cholesky(known + noise), left, lower=True)
            size = float(np.mean(white**2))
            self.sizes[day] = size * scale
            # a day unlike all others counts as if its noise were as large as it shows
            root = np.linalg.cholesky(known + max(1.0, size / _OUTLYING) * noise)
            white = solve_triangular(root, left, lower=True)
            gain = solve_triangular(root, solve_triangular(root, spread, lower=True), lower=True, trans="T").T
            innovation = Innovation(seen, observe, gain, root, white, left)
            mean = mean + gain @ left
            covariance = covariance - gain @ spread
            covariance = 0.5 * (covariance + covariance.T)
        covariance = covariance.copy()
        covariance[range(n), range(n)] += self._drift
        return State(mean, covariance), innovation


def is_told(days: Days, until: int) -> BoolArray:
    """Which errors the reference days show often enough to tell what is usual of them, shape (n_error,).

    Parameters
    ----------
    days : Days
        The telemetry.
    until : int
        Days before this one are the reference.
    """
    return np.asarray(np.isfinite(days.errors[:until]).sum(axis=0) > _FEWEST)


def noise_of(days: Days, until: int) -> FloatArray:
    """Covariance of a day's errors about what is expected of it (n_error, n_error) [K²].

    Expectation-maximisation by the filter (Shumway and Stoffer 1982, doi:10.1111/j.1467-9892.1982.tb00349.x): what is
    left of a day's errors after its own correction, and what the states are unsure of; correlations are shrunk towards
    none by as much as the number of days asks for (Schäfer and Strimmer 2005, doi:10.2202/1544-6115.1175). Each error
    counts on the days that have it: variances are those of these days, and correlations are lowered by the share of
    days on which only one of two was seen, so that the matrix stays positive definite.

    Parameters
    ----------
    days : Days
        The telemetry.
    until : int
        Days before this one are used.
    """
    errors = days.errors[:until]
    counts = np.isfinite(errors).sum(axis=0)
    variance = np.nanvar(np.where(counts > 0, errors, 0.0), axis=0)
    found = np.diag(np.maximum(variance, _LEAST_NOISE**2))
    for _ in range(_ROUNDS):
        filtered, left, unsure = DayFilter(days, found), np.zeros_like(errors), np.zeros_like(found)
        state = filtered.start()
        for day in range(until):
            ahead, innovation = filtered.step(state, day)
            if innovation is not None:
                seen = innovation.seen
                left[day, seen] = innovation.left - innovation.observe @ (innovation.gain @ innovation.left)
                known = innovation.observe @ state.covariance @ innovation.observe.T
                unsure[np.ix_(seen, seen)] += known - innovation.observe @ innovation.gain @ known
            state = ahead
        if counts.max() > _FEWEST:
            found = _shrunk(left, unsure, counts)
    return found


def _shrunk(left: FloatArray, unsure: FloatArray, counts: IntArray) -> FloatArray:
    """Covariance about zero with the sum of what is unsure beside, correlations shrunk towards none.

    What is left is 0 where nothing was seen; errors were seen on as many days as `counts` says.
    """
    n = int(counts.max())
    days = np.sqrt(np.maximum(counts, 1))
    covariance = (left.T @ left + unsure) / np.outer(days, days)
    spread = np.sqrt(np.maximum(np.diag(covariance), _LEAST_NOISE**2))
    standard, correlation = left / spread, covariance / np.outer(spread, spread)
    products = standard[:, :, None] * standard[:, None, :]
    middle = products.sum(axis=0) / n
    squares = (products**2).sum(axis=0) - n * middle**2
    variance = squares * n / ((n - 1) * np.outer(days, days) ** 2)
    apart = ~np.eye(len(spread), dtype=bool)
    share = float(np.clip(variance[apart].sum() / max((correlation[apart] ** 2).sum(), 1e-12), 0.0, 1.0))
    shrunk = np.where(apart, (1.0 - share) * correlation, 1.0)
    return np.asarray(shrunk * np.outer(spread, spread))
