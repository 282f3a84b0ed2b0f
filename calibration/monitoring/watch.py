"""Watch over innovations: for everything that may change, and every day since when, how much likelier the days are.

A change of p since day τ moves the innovations of later days by G p, where G follows from the filter: what it has made
of the change so far is in its states (Willsky and Jones 1976, doi:10.1109/TAC.1976.1101146),

    G_d = J_d - H_d F_d,   F_d+1 = F_d + K_d G_d,   S = Σ Gᵀ V⁻¹ ν,   I = Σ Gᵀ V⁻¹ G                             (M2)

With p ~ N(0, σ²) before the data the likelihood ratio has the mean ``E = (1 + σ² I)^-½ exp(½ S² / (I + σ^-2))``, whose
expectation is 1 while nothing changes. A strength v that is positive stays so: where v + p cannot be less than 0, E
takes the factor ``P(v + p > 0 | data) / P(v + p > 0)``, before the data by v ~ N(u, s²) as the filter has it on day τ,
after them by its estimate v̂ with the variance P and what it has made of the change, F, with mean m and variance q of p,

    Φ((v̂ + (1 - F) m) / (P + (1 - F)² q)^½) / Φ(u / (σ² + s²)^½)                                               (M4)

and likewise where v + p is bounded elsewhere, as a share by 1.

The sum of the ratios over all τ, weighted over all that may change, is the e-detector of Shiryaev and Roberts, and an
alarm where it exceeds A comes on average after A days or more while nothing has changed (Shin, Ramdas and Rinaldo 2024,
doi:10.51387/23-NEJSDS51), whatever the number of changes that are sought.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import log_ndtr, logsumexp

from calibration.monitoring.days import NO_CAUSE, Column, Days, coming
from calibration.monitoring.dispersion import Dispersion
from calibration.monitoring.filter import Found, Innovation, State
from thermal._types import BoolArray, FloatArray, IntArray

#: Days since when a change is sought: each of the last ones, then one in three, up to the longest [d].
_EACH, _THIRD, _LONGEST = 14, 3, 21

#: Sizes of a change over the deviation of its prior [-]; their evidence is averaged. A window's prior is 2 m² wide,
#: one left ajar has a thirtieth of it and would count as far-fetched. Half decades, so that none is far from one.
_SIZES = (1.0, 0.3, 0.1, 0.03)

#: Prior weight of heat that names no cause, beside all that have a name [-].
_UNKNOWN = 0.01

#: Effects that rarely begin from one day to the next, and their prior weight beside others [-]: stations are moved,
#: rooms are furnished, sensors wrapped and ducts come apart far less often than valves leak and windows stay open.
RARELY, _RARE = ("wrong_station", "hidden_mass", "sensor_lag", "duct_loss"), 0.1

#: Effects that may come over days, and the days that these are tried with beside at once [d]: sensors drift; heat that
#: names no cause may come as slowly, or the course alone would tell a sensor. All slow courses of an effect have as
#: much prior weight as its sudden one.
SLOWLY, OVER = ("sensor_bias", *NO_CAUSE), (3, 6, 12)

#: Prior weight of the end of each change that was found, beside all that may begin [-].
_ENDS = 0.5


@dataclass(frozen=True)
class Sought:
    """What may change.

    Parameters
    ----------
    columns : tuple of Column
        All columns of the days.
    which : ndarray of int, shape (n_sought,)
        Those that may change, each once for every course that it may take.
    over : ndarray of int, shape (n_sought,)
        Days over which each comes; 0 is at once [d].
    weight : ndarray, shape (n_sought,)
        Probability of each before the data [-], in sum 1.
    shares : ndarray, shape (n_age, n_sought)
        Share of each that has come by its first days [-].
    onset : ndarray, shape (n_age, n_error, n_sought)
        What is added to the derivatives on these days [K].
    """

    columns: tuple[Column, ...]
    which: IntArray
    over: IntArray
    weight: FloatArray
    shares: FloatArray
    onset: FloatArray

    def shown(self, days: Days, day: int, innovation: Innovation) -> FloatArray:
        """Show what a unit of each change does to a day's errors once all of it has come, (n_seen, n_sought) [K].

        Parameters
        ----------
        days : Days
            With their derivatives.
        day : int
            Which.
        innovation : Innovation
            Of the day.
        """
        return np.asarray(-days.slopes[day][innovation.seen][:, self.which])


def sought(days: Days) -> Sought:
    """Share the probability before the data among effects, and in each among its zones, strengths and courses.

    Parameters
    ----------
    days : Days
        With their columns.
    """
    columns = days.columns
    courses = [(k, over) for k, c in enumerate(columns) if c.may_change
               for over in ((0, *OVER) if c.effect in SLOWLY else (0,))]  # fmt: skip
    which, over = np.array(courses, dtype=np.int64).reshape(-1, 2).T
    effects = np.array([columns[k].effect for k in which])
    unknown = np.array([columns[k].is_unknown for k in which], dtype=bool)
    weight = np.zeros(len(which))
    for known, whole in ((~unknown, 1.0 - _UNKNOWN), (unknown, _UNKNOWN)):
        for effect in np.unique(effects[known]):
            of = effects == effect
            often = np.where(over[of] > 0, 1.0 / len(OVER), 1.0)
            weight[of] = whole * (_RARE if effect in RARELY else 1.0) * often / often.sum()
        weight[known] *= whole / max(weight[known].sum(), 1e-300)
    shares = np.ones((len(days.onset) + max(OVER), which.size))
    onset = np.zeros((len(shares), days.onset.shape[1], which.size))
    for number, (column, length) in enumerate(courses):
        begun, added = coming(length, days.onset[..., column])
        shares[: len(begun), number], onset[: len(begun), :, number] = begun, added
    return Sought(columns, which, over, weight / weight.sum(), shares, onset)


@dataclass(frozen=True)
class Alarm:
    """What the evidence says on a day.

    Parameters
    ----------
    log_evidence : float
        Logarithm of the e-detector [-].
    starts : ndarray of int, shape (n_sought + n_end,)
        Day since when, of each change and, after these, of each end: the median by its likelihood.
    share : ndarray, shape (n_sought,)
        Probability of each change, given that there is one [-].
    ends : ndarray, shape (n_end,)
        That of the end of each change that was found [-].
    """

    log_evidence: float
    starts: IntArray
    share: FloatArray
    ends: FloatArray


class Watch:
    """Evidence for changes, day by day.

    Parameters
    ----------
    what : Sought
        What may change.
    n_state : int
        States of the filter, the changes that were found last.
    cap : float
        Most that a single day may add to the logarithm of the evidence of a change [-].
    dispersion : Dispersion
        What scores and information are divided by.
    ends : sequence of (int, float)
        Changes that were found, by their place among what is sought, with their sizes [estimation scale].
    found : sequence of Found
        All changes that were found.
    """

    def __init__(
        self,
        what: Sought,
        n_state: int,
        dispersion: Dispersion,
        cap: float = np.inf,
        ends: Sequence[tuple[int, float]] = (),
        found: Sequence[Found] = (),
    ) -> None:
        self.what, self.cap, self.dispersion, self.ends = what, cap, dispersion, list(ends)
        self.starts = np.zeros(0, dtype=np.int64)
        k = what.which.size
        self._moved = np.zeros((n_state, 0, k))
        self._score, self._information = np.zeros((0, k)), np.zeros((0, k))
        self._top = np.zeros((0, k + len(self.ends)))
        self._deviation = np.array([what.columns[i].deviation for i in what.which])
        self._lost = np.concatenate([np.zeros(k), [size for _, size in self.ends]])
        self._least, self._most = np.array([what.columns[i].limits for i in what.which]).reshape(-1, 2).T
        self._bounded = np.isfinite(self._least)
        self._parts = [self._parts_of(i, n_state, found) for i in what.which]
        self._room, self._unsure, self._kept = np.zeros((0, k)), np.zeros((0, k)), np.ones((0, k))
        self._left = np.zeros(k), np.zeros(k)
        self._square, self._seen = np.zeros((0, 1)), np.zeros((0, 1))
        self.log_ratio = np.zeros((0, k + len(self.ends)))

    def take(
        self, day: int, days: Days, innovation: Innovation, states: tuple[State, State], noticed: int | None = None
    ) -> Alarm:
        """Take in a day.

        Parameters
        ----------
        day : int
            Its number.
        days : Days
            With the derivatives of its errors.
        innovation : Innovation
            Of the filter.
        states : tuple of State
            Of the filter before the day and after it.
        noticed : int, optional
            Day of an alarm that waits for its name: starts that were sought then are kept, and name it.
        """
        self._renew(day, day if noticed is None else noticed, states[0])
        n, t, k = self._moved.shape
        own = self.what.shown(days, day, innovation)
        self.dispersion.put(day, own, innovation)
        shown = own[:, None, :] - (innovation.observe @ self._moved.reshape(n, -1)).reshape(-1, t, k)
        for number, age in enumerate(day - self.starts):
            if age < len(self.what.shares):
                shown[:, number] += own * (self.what.shares[age] - 1.0) - self.what.onset[age][innovation.seen]
        flat = shown.reshape(len(own), -1)
        self._moved += (innovation.gain @ flat).reshape(n, t, k)
        white = solve_triangular(innovation.root, flat, lower=True)
        self._score += (innovation.white @ white).reshape(t, k)
        self._information += (white**2).sum(axis=0).reshape(t, k)
        self._square += innovation.white @ innovation.white
        self._seen += innovation.white.size
        self._left = self._strengths(states[1])
        for i in np.flatnonzero(self._bounded):
            self._kept[:, i] = 1.0 - self._moved[self._parts[i], :, i].sum(axis=0)
        before = self.log_ratio
        which = np.arange(self.log_ratio.shape[1])
        varies = self.dispersion.at(day)[self._place(which)]
        self.log_ratio = self._ratios(which, np.maximum(varies, self._left_by(which)))
        self._top = np.maximum(self._top, self.log_ratio - before)
        return self._judge(varies, self.starts <= (day if noticed is None else noticed))

    def size(self, start: int, number: int) -> float:
        """Likeliest size of a change since a day [estimation scale].

        Parameters
        ----------
        start : int
            Since when.
        number : int
            Which of those that are sought.
        """
        row = int(np.argmin(np.abs(self.starts - start)))
        sharp = self._information[row, number] + self._deviation[number] ** -2.0
        return float(self._score[row, number] / sharp)

    def _parts_of(self, number: int, n_state: int, found: Sequence[Found]) -> IntArray:
        """States that make up a strength: its own where the model has it, and the changes of it that last."""
        columns, first = self.what.columns, n_state - len(found)
        same = [k for k, c in enumerate(columns) if c.name == columns[number].name]
        own = [k for k in same if columns[k].present]
        return np.array(own + [first + k for k, c in enumerate(found) if c.column in same and c.end is None], dtype=int)

    def _strengths(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Mean and variance of the strengths that have limits, by the filter; 0 of what is absent."""
        mean, variance = np.zeros(len(self._parts)), np.zeros(len(self._parts))
        for i in np.flatnonzero(self._bounded):
            column, parts = self.what.columns[self.what.which[i]], self._parts[i]
            mean[i] = column.value * column.present + state.mean[parts].sum()
            variance[i] = state.covariance[np.ix_(parts, parts)].sum()
        return mean, np.maximum(variance, 0.0)

    def _renew(self, day: int, by: int, state: State) -> None:
        """Let go of starts that are too long ago by some day, and begin a new one."""
        age = by - self.starts
        kept = (age < _EACH) | ((self.starts % _THIRD == 0) & (age < _LONGEST))
        self.starts = np.append(self.starts[kept], day)
        new = np.zeros((self._moved.shape[0], 1, self._moved.shape[2]))
        self._moved = np.concatenate([self._moved[:, kept], new], axis=1)
        room, unsure = self._strengths(state)
        begun = {"_room": room, "_unsure": unsure, "_kept": np.ones_like(room)}
        for name in ("_score", "_information", "_top", "log_ratio", "_room", "_unsure", "_kept", "_square", "_seen"):
            held = getattr(self, name)
            setattr(self, name, np.vstack([held[kept], begun.get(name, np.zeros(held.shape[1]))]))

    def _ratios(self, which: IntArray, varies: FloatArray) -> FloatArray:
        """Logarithms of the likelihood ratios by start, of changes and, after them, ends of those that were found.

        Each with a ratio of variances of its own, by change or by start and change.
        """
        at, k = self._place(which), self.what.which.size
        score, information = self._score[:, at] / varies, self._information[:, at] / varies
        parts = []
        for size in _SIZES:
            spread = size * self._deviation[at]
            sharp = information + spread**-2.0
            ratio = 0.5 * score**2 / sharp - 0.5 * np.log1p(information * spread**2)
            kept, (left, unsure), room = self._kept[:, at], self._left, self._room[:, at]
            bounded, most = self._bounded[at], (self._most - self._least)[at]
            least = np.where(bounded, self._least[at], 0.0)
            after = _log_within(most, left[at] + kept * score / sharp - least, unsure[at] + kept**2 / sharp)
            before = _log_within(most, room - least, spread**2 + self._unsure[:, at])
            parts.append(ratio + np.where(bounded, after - before, 0.0))
        begun = logsumexp(np.array(parts), axis=0) - np.log(len(parts))
        lost = self._lost[which]
        return np.asarray(np.where(which < k, begun, -lost * score - 0.5 * lost**2 * information))

    def _left_by(self, which: IntArray) -> FloatArray:
        """Mean square of what changes and ends leave of the innovations since each start, shape (n_start, n) [-]."""
        at, lost = self._place(which), self._lost[which]
        score, information = self._score[:, at], self._information[:, at]
        begun = score**2 / np.maximum(information, 1e-300)
        explained = np.where(which < self.what.which.size, begun, -2.0 * lost * score - lost**2 * information)
        return np.asarray((self._square - explained) / np.maximum(self._seen, 1.0))

    def _place(self, which: IntArray) -> IntArray:
        """Place among what is sought of changes and ends."""
        return np.array([*range(self.what.which.size), *(i for i, _ in self.ends)], dtype=np.int64)[which]

    def _judge(self, varies: FloatArray, begun: BoolArray) -> Alarm:
        """Weigh all changes and starts that there were when an alarm was raised.

        Names are told apart in pairs with the likeliest change, each pair by one noise, the larger of the two and of
        what the likeliest leaves: a change whose direction varies a little more from day to day is no less likely to be
        the name, and where no change is as the model says, a little more of a large evidence names none. What is no
        likelier than nothing by its own noise is no name, though a large noise makes all alike.
        """
        share = _ENDS if self.ends else 0.0
        ends = np.full(len(self.ends), share / max(1, len(self.ends)))
        with np.errstate(divide="ignore"):
            weight = np.log(np.concatenate([(1.0 - share) * self.what.weight, ends]))
        told = (self.log_ratio - np.maximum(0.0, self._top - self.cap) + weight)[begun]
        likeliest = int(np.argmax(logsumexp(told, axis=0)))
        which, k = np.arange(weight.size), self.what.which.size
        since = int(np.flatnonzero(begun)[np.argmax(told[:, likeliest])])
        left = self._left_by(np.array([likeliest]))[since, 0]
        pair = np.maximum(np.maximum(varies, varies[likeliest]), left)
        beside = logsumexp(self._ratios(np.full_like(which, likeliest), pair)[begun], axis=0)
        shows = np.log(-np.expm1(-np.maximum(1e-12, self.log_ratio[begun].max(axis=0))))
        ratios = self._ratios(which, pair)[begun]
        named = ratios - beside + weight + shows
        probability = np.exp(logsumexp(named, axis=0) - logsumexp(named))
        starts = dated(self.starts[begun], ratios)
        return Alarm(float(logsumexp(told)), starts, probability[:k], probability[k:])


def _log_within(most: FloatArray, mean: FloatArray, variance: FloatArray) -> FloatArray:
    """Logarithm of the probability that what is normal is between 0 and the most that it can be [-].

    In the tail that is the smaller one, where the difference of two probabilities is not lost.
    """
    deviation, above = np.sqrt(np.maximum(variance, 1e-300)), mean > 0.5 * most
    near = log_ndtr(np.where(above, most - mean, mean) / deviation)
    far = log_ndtr(np.where(above, -mean, mean - most) / deviation)
    return np.asarray(near + np.log1p(-np.exp(np.minimum(far - near, -1e-300))))


def dated(starts: IntArray, ratios: FloatArray) -> IntArray:
    """Find the medians of the days since when changes may be there, by their likelihood, shape (n,).

    Where nothing asked for what has changed, many days are as likely, and the likeliest is chance.

    Parameters
    ----------
    starts : ndarray of int, shape (n_start,)
        Days that are sought, in order; each counts for those after the one before it, on which nothing was measured or
        which are not sought.
    ratios : ndarray, shape (n_start, n)
        Logarithms of the likelihood ratios of each change since these days [-].

    Examples
    --------
    >>> dated(np.array([3, 6, 7, 8, 9]), np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 9.0], [0.0, 0.0], [-9.0, 0.0]]))
    array([6, 7])
    """
    days = np.diff(starts, prepend=starts[0] - 1)[:, None]
    share = np.cumsum(days * np.exp(ratios - ratios.max(axis=0)), axis=0)
    return np.asarray(starts[np.argmax(share >= 0.5 * share[-1], axis=0)])
