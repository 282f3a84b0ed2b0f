"""Search for what is determined: functionals of the parameters that the data know well, with few members."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from thermal._types import FloatArray

#: A parameter, or a combination, is determined when the data at least halve the deviation of its prior [-].
DETERMINED = 0.5

#: It is the priors that hold a parameter when its ratio of deviations would grow by the second factor, to where it is
#: not determined, if the priors of all others were wider by the first [-]. Of five that only occur as ratios to each
#: other each is known to 45 % of its prior, and the data tell nothing of it.
WIDENED, HELD = 2.0, 1.4

#: A further member of a combination must lower the ratio of deviations at least to this share [-].
WORTHWHILE = 0.5

#: Every member has at least this component of a named functional, a unit vector in units of the prior, and at least
#: this much of it is perpendicular to those named before [-].
LEAST_COMPONENT = 0.25

#: An eigenvector is told when at least this much of it is perpendicular to what is named already [-].
NEW = 0.5

#: Members of a combination whose exponents are this near to each other make a product or a ratio [-].
WHOLE = 0.15

#: Sets of parameters are tried up to this size, and as long as there are no more of one size than that.
MOST_MEMBERS, MOST_SETS = 4, 50_000


class InformationSearch:
    """Fisher information, prior and posterior of a linearised problem on the estimation scale z.

    Parameters
    ----------
    fisher : ndarray, shape (p, p)
        ``J'J`` of the weighted data [-].
    precision : ndarray, shape (p, p)
        Λ of the prior, positive definite [-].
    posterior : ndarray, shape (p, p), optional
        Posterior covariance; ``(J'J + Λ)^-1`` by default [-].

    Attributes
    ----------
    values, share : ndarray, shape (p,)
        Information in units of the prior, falling, and the share of the prior's variance that the data explain [-].
    vectors : ndarray, shape (p, p)
        Their unit vectors in columns [-].
    alone : ndarray of bool, shape (p,)
        Which parameters are determined by themselves.
    """

    def __init__(self, fisher: FloatArray, precision: FloatArray, posterior: FloatArray | None = None) -> None:
        self.root = np.linalg.cholesky(precision)
        half = solve_triangular(self.root, fisher, lower=True)
        values, vectors = np.linalg.eigh(solve_triangular(self.root, half.T, lower=True))
        self.values, self.vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
        self.share = self.values / (1.0 + self.values)
        self.prior = self._product(np.ones_like(self.values))
        # from its eigenvectors: inverting J'J + Λ loses the priors' digits when the data are very precise
        ours = self._product(1.0 / (1.0 + self.values))
        self.posterior = ours if posterior is None else posterior
        self.spread = np.sqrt(np.diag(self.prior))
        self.ratios = np.sqrt(np.diag(self.posterior)) / self.spread
        wide = np.diag(self._product(1.0 / (WIDENED**-2 + self.values))) / np.diag(self.prior)
        beside = 1.0 / np.sqrt(1.0 / wide + 1.0 - WIDENED**-2)  # its own prior as it was
        held = (beside >= DETERMINED) & (beside >= HELD * np.sqrt(np.diag(ours)) / self.spread)
        self.alone = (self.ratios < DETERMINED) & ~held

    def _product(self, variance: FloatArray) -> FloatArray:
        """Covariance on the estimation scale of given variances along the eigenvectors."""
        sides = solve_triangular(self.root, self.vectors, lower=True, trans="T") * np.sqrt(variance)
        return np.asarray(sides @ sides.T)

    def moves(self) -> FloatArray:
        """How far the parameters move along each direction, (p, p) in columns, in deviations of their priors [-]."""
        moved = solve_triangular(self.root, self.vectors, lower=True, trans="T")
        return np.asarray(moved / self.spread[:, None])

    def ratio(self, a: FloatArray) -> float:
        """Posterior over prior deviation of a functional ``a'z`` [-].

        Parameters
        ----------
        a : ndarray, shape (p,)
            Coefficients [-].
        """
        return float(np.sqrt((a @ self.posterior @ a) / (a @ self.prior @ a)))

    def combinations(self) -> list[FloatArray]:
        """Coefficients (p,) of what is determined beyond single parameters, fewest members first.

        None follows from those before it. What no small set tells is told by the eigenvectors, shortened to as many
        members as it takes.
        """
        known = [self._whitened(row) for row in np.eye(self.alone.size)[self.alone]]
        basis = np.linalg.qr(np.array(known).T)[0] if known else np.empty((self.alone.size, 0))
        found: list[FloatArray] = []
        for a in self._candidates():
            unit = self._whitened(a)
            rest = unit - basis @ (basis.T @ unit)
            if np.linalg.norm(rest) >= LEAST_COMPONENT:
                basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
                found.append(a)
        for u in self.vectors[:, self.share > 1.0 - DETERMINED**2].T:
            rest = u - basis @ (basis.T @ u)
            short = self._shortened(self.root @ rest) if np.linalg.norm(rest) >= NEW else None
            if short is not None:
                basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
                found.append(short)
        return [self._rounded(a) for a in found]

    def _whitened(self, a: FloatArray) -> FloatArray:
        """Express a functional as a unit vector in units of the prior."""
        w = solve_triangular(self.root, a, lower=True)
        return np.asarray(w / np.linalg.norm(w))

    def _candidates(self) -> Iterator[FloatArray]:
        """Best functional of each small set that gains from its last member, the best of each size first."""
        p = self.alone.size
        least: dict[tuple[int, ...], float] = {(i,): float(r) for i, r in enumerate(self.ratios)}
        for size in range(2, MOST_MEMBERS + 1):
            if comb(p, size) > MOST_SETS:
                return
            sets = np.array(list(combinations(range(p), size)), dtype=np.int64).reshape(-1, size)
            ratios, functionals = self._best(sets)
            for row in np.argsort(ratios, kind="stable"):
                members, ratio = tuple(map(int, sets[row])), float(ratios[row])
                fewer = min(least[s] for s in combinations(members, size - 1))
                least[members] = min(ratio, fewer)
                if ratio < min(DETERMINED, WORTHWHILE * fewer) and not self.alone[sets[row]].all():
                    a = np.zeros(p)
                    a[sets[row]] = functionals[row]
                    weight = np.abs(a) * self.spread
                    if weight[sets[row]].min() >= LEAST_COMPONENT * np.linalg.norm(weight):
                        yield a

    def _best(self, sets: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Least ratio (n,) of posterior to prior deviation within each set (n, k), and its functional (n, k)."""
        rows, columns = sets[:, :, None], sets[:, None, :]
        root = np.linalg.cholesky(self.prior[rows, columns])
        half = np.linalg.solve(root, self.posterior[rows, columns])
        values, vectors = np.linalg.eigh(np.linalg.solve(root, half.transpose(0, 2, 1)))
        functionals = np.linalg.solve(root.transpose(0, 2, 1), vectors[:, :, :1])[:, :, 0]
        return np.sqrt(np.maximum(values[:, 0], 0.0)), functionals

    def _shortened(self, a: FloatArray) -> FloatArray | None:
        """Keep the largest members of a functional, as few as leave it determined; None when it is not, or just one."""
        weight = np.abs(a) * self.spread
        order = np.argsort(-weight)
        for size in range(1, a.size + 1):
            short = np.zeros_like(a)
            short[order[:size]] = a[order[:size]]
            if self.ratio(short) < DETERMINED:
                return short if size > 1 else None
        return None

    def _rounded(self, a: FloatArray) -> FloatArray:
        """Scale to a largest exponent of one; whole exponents, or two decimals, where that is still determined."""
        members = a != 0.0
        scaled = a / a[np.argmax(np.abs(a))]
        whole: FloatArray = np.sign(scaled / scaled[members][0])
        short: FloatArray = np.round(scaled, 2)
        if np.abs(scaled[members]).min() >= 1.0 - WHOLE and self.ratio(whole) < DETERMINED:
            return whole
        return short if short[members].all() and self.ratio(short) < DETERMINED else scaled
