"""Strengths within their ranges that explain most of some errors: small quadratic programmes, for many draws at once.

To first order an effect's strengths x lower the squared errors by ``2 sᵀ x - xᵀ G x``, with the Gram matrix G of their
projected signatures and the score s of the errors, which alone differs from draw to draw. The gain is that of (D3) in
``docs/diagnosis_method.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.diagnosis.screen.gains import choice_of
from thermal._types import BoolArray, FloatArray, IntArray

#: Sweeps of coordinate descent, and the change of an estimate in prior deviations that ends them [-].
_SWEEPS, _TOLERANCE = 200, 1e-6


@dataclass(frozen=True)
class Explained:
    """What strengths explain of the errors of every draw.

    Parameters
    ----------
    strengths : ndarray, shape (n_draw, n)
        They [parameter units].
    gain : ndarray, shape (n_draw,)
        Logarithm of the Bayes factor against none of them [-].
    share : ndarray, shape (n_draw,)
        Of the squared error [-].
    """

    strengths: FloatArray
    gain: FloatArray
    share: FloatArray


@dataclass(frozen=True)
class Grown:
    """Places chosen one after another in every draw.

    Parameters
    ----------
    chosen : ndarray of bool, shape (n_draw, n_place)
        Where.
    order : ndarray of int, shape (n_draw, n_place)
        Places by what each gains alone, the best first.
    gain : ndarray, shape (n_draw,)
        Logarithm of the Bayes factor, the choice of the places paid for [-].
    share : ndarray, shape (n_draw,)
        Of the squared error [-].
    """

    chosen: BoolArray
    order: IntArray
    gain: FloatArray
    share: FloatArray


@dataclass(frozen=True)
class Programme:
    """Quadratic programme of all strengths.

    Parameters
    ----------
    gram : ndarray, shape (n_parameter, n_parameter)
        G, of the projected signatures [-].
    lower, upper, prior : ndarray, shape (n_parameter,)
        Ranges, and prior deviations [parameter units].
    count : float
        Effective number of errors [-].
    """

    gram: FloatArray
    lower: FloatArray
    upper: FloatArray
    prior: FloatArray
    count: float

    def solve(
        self, index: IntArray, scores: FloatArray, active: BoolArray | None = None, tightness: float = 1.0
    ) -> Explained:
        """Find some strengths in every draw by coordinate descent within their ranges.

        Parameters
        ----------
        index : ndarray of int, shape (n,)
            Their positions.
        scores : ndarray, shape (n_draw, n_parameter)
            s of the draws [-].
        active : ndarray of bool, shape (n_draw, n), optional
            Strengths that may be there in a draw; all by default.
        tightness : float
            Spread of the priors over their own [-].
        """
        score, prior = scores[:, index], tightness * self.prior[index]
        hessian = self.gram[np.ix_(index, index)] + np.diag(prior**-2.0)
        lower, upper = self.lower[index], self.upper[index]
        there = np.ones(score.shape, dtype=bool) if active is None else active
        x, moving = np.zeros_like(score), np.flatnonzero(there.any(axis=0))
        for _ in range(_SWEEPS):
            moved = 0.0
            for j in moving:
                best = x[:, j] + (score[:, j] - x @ hessian[j]) / hessian[j, j]
                new = np.clip(best, lower[j], upper[j]) * there[:, j]
                moved = max(moved, float(np.max(np.abs(new - x[:, j]))) / float(prior[j]))
                x[:, j] = new
            if moved < _TOLERANCE:
                break
        return self.weigh(index, x, scores, there, tightness)

    def weigh(
        self, index: IntArray, x: FloatArray, scores: FloatArray, there: BoolArray, tightness: float = 1.0
    ) -> Explained:
        """Gain of given strengths, and the share of the squared error that they explain: (D3).

        Parameters
        ----------
        index : ndarray of int, shape (n,)
            Their positions.
        x : ndarray, shape (n_draw, n)
            They [parameter units].
        scores : ndarray, shape (n_draw, n_parameter)
            s of the draws [-].
        there : ndarray of bool, shape (n_draw, n)
            Those that a draw has, and pays for.
        tightness : float
            Spread of the priors over their own [-].
        """
        gram, prior = self.gram[np.ix_(index, index)], tightness * self.prior[index]
        explained = 2.0 * np.sum(scores[:, index] * x, axis=1) - np.sum((x @ gram) * x, axis=1)
        share = np.clip(explained / self.count, 0.0, 0.999)
        on = there / np.sqrt(1.0 - share)[:, None] * prior
        occam = np.linalg.slogdet(np.eye(index.size) + on[:, :, None] * gram * on[:, None, :])[1]
        halves = np.count_nonzero((self.lower[index] == 0.0) & (x > 0.0), axis=1)
        pull = np.sum((x / prior) ** 2, axis=1)
        gain = -0.5 * self.count * np.log1p(-share) - 0.5 * pull - 0.5 * occam + np.log(2.0) * halves
        return Explained(x, np.asarray(gain), np.asarray(share))

    def grow(self, members: Sequence[IntArray], scores: FloatArray, places: int) -> Grown:
        """Add places in every draw as long as each more than pays for having been chosen among all.

        Parameters
        ----------
        members : sequence of ndarray of int
            Positions of the strengths of each place.
        scores : ndarray, shape (n_draw, n_parameter)
            s of the draws [-].
        places : int
            How many there are to choose from.
        """
        index, count, rows = np.concatenate(members), len(members), np.arange(len(scores))
        owner = np.repeat(np.arange(count), [m.size for m in members])
        alone = np.array([self.solve(m, scores).gain for m in members]).T
        order = np.argsort(-alone, axis=1, kind="stable")
        price = np.array([choice_of(k, places) for k in range(1, count + 1)])
        chosen = np.zeros((len(scores), count), dtype=bool)
        best, explained = np.full(len(scores), -np.inf), np.zeros(len(scores))
        for turn in range(count):
            trial = chosen.copy()
            trial[rows, order[:, turn]] = True
            found = self.solve(index, scores, trial[:, owner])
            gain = found.gain - price[trial.sum(axis=1) - 1]
            better = gain > best
            chosen[better], best[better], explained[better] = trial[better], gain[better], found.share[better]
        return Grown(chosen, order, best, explained)
