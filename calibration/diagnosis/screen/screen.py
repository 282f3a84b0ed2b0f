"""Every effect of the catalogue at once: what each could explain of the errors, by their tangents at the estimate.

Errors of the fitted model are ``e(p) = e + J_θ dθ + J_k p`` to first order, where J_k are the sensitivities to the
strengths of an effect that is not there. With θ free to follow, held by its priors, what remains of an effect is its
part that calibration cannot imitate; its gain in log-likelihood is a small quadratic programme in the Gram matrix of
all, so that zones, pairs and generic heat are compared without another run of the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from calibration.diagnosis.refit.comparison import Fit, ModelComparison, is_strength
from calibration.diagnosis.screen.alike import alike
from calibration.diagnosis.screen.equipment import always_on, at_times
from calibration.diagnosis.screen.gains import Gain, choice_of
from calibration.diagnosis.screen.generic import GENERIC, TIGHTNESS, ZONE_HEAT
from calibration.diagnosis.screen.programme import Programme
from thermal._types import BoolArray, FloatArray, IntArray
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.effect import ALIKE, Chosen, zones_of
from thermal.model.reduce import FEW_SHIFTS, SHIFTS, reduced_model
from thermal.parameters import Parameter

#: Share of its range that a strength has where it is asked what a level changes [-].
_LITTLE = 1e-3

#: Order of the reduced model of a large building.
_LARGEST_ORDER = 700

#: Most zones in which effects of single zones are sought.
_MOST_ZONES = 24


class Screening:
    """Gram matrix of all strengths that a fitted model lacks, the fitted parameters projected out.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        The model.
    candidates : sequence of str
        Effects to screen.
    """

    #: Sensitivities of the tuning errors to every strength, (n_error, n_parameter), until they are let go.
    jacobian: FloatArray | None

    def __init__(self, models: ModelComparison, fit: Fit, candidates: Sequence[str]) -> None:
        here = _worst_zones(fit)
        lacking = {e: here if CATALOGUE[e].zonal else () for e in candidates if e not in fit.effects}
        further = Chosen(GENERIC, here), *at_times(models.drivers, lacking, here)
        built = models.build({**fit.effects, **lacking}, further)
        self._total = len(built.network.zones)
        self.elsewhere = self._total - len(here) if here else 0
        own: tuple[Parameter, ...] = built.network.parameters
        self._levels = {p.effect: p for p in own if p.effect in lacking and p.name == CATALOGUE[p.effect].level}
        levels = {p.name: (p.lower, p.upper) for p in self._levels.values()}
        theta, other = (built.theta({**fit.values, **{name: ends[k] for name, ends in levels.items()}}) for k in (0, 1))
        # a Galerkin basis of a symmetric model is accurate for tangents too: gains are those of the grid within 0.02
        shifts, order = (FEW_SHIFTS, _LARGEST_ORDER) if here else (SHIFTS, None)
        model = reduced_model(built.grid, [theta], shifts=shifts, order=order)
        problem = models.problem(built, theta)
        jacobian = problem.residuals(model, theta)[1] * problem.slopes(theta)
        twice = [i for i, p in enumerate(own) if p.effect in self._levels and is_strength(p.name, p.effect)]
        for i in twice:
            little = _LITTLE * own[i].upper * (np.arange(len(own)) == i)
            low, high = (problem.residuals_only(model, end + little) for end in (theta, other))
            jacobian = np.column_stack([jacobian, jacobian[:, i] + (high - low) / little[i]])
        self._twins = {len(own) + k: i for k, i in enumerate(twice)}
        tied = {} if here else alike(own, [e for e in lacking if CATALOGUE[e].alike])
        alone = always_on(own, lacking)
        self._tied = range(len(own) + len(twice), len(own) + len(twice) + len(tied))
        sums = (jacobian[:, mine].sum(axis=1) for mine in tied.values())
        jacobian = np.column_stack([jacobian, *sums, jacobian[:, list(alone.values())]])
        at_the_end = (replace(own[i], name=f"{own[i].name} at the other end") for i in twice)
        self.parameters = (*own, *at_the_end, *tied, *alone)
        self.jacobian = jacobian
        error = fit.problem.residuals_only(fit.model, fit.theta)
        self.count = problem.effective_size()
        self.scale: float = self.count / float(np.sum(error**2))
        gram = self.scale * jacobian.T @ jacobian
        score = -self.scale * jacobian.T @ error
        self.prior = np.array([p.prior_deviation for p in self.parameters])
        self.lower = np.array([p.lower for p in self.parameters])
        self.upper = np.array([p.upper for p in self.parameters])
        self._start = np.array([p.transform(p.start) for p in self.parameters])
        self._point = np.concatenate([problem.point(theta), np.zeros(len(twice) + len(tied) + len(alone))])
        self._whole, self._slope = gram, score
        self._project(np.array([p.name in fit.values for p in self.parameters]))

    def _project(self, known: BoolArray) -> None:
        """Let the known parameters follow all others, held by their priors: (D2)."""
        away = (self._point - self._start)[known]
        hessian = self._whole[np.ix_(known, known)] + np.diag(self.prior[known] ** -2.0)
        turn = np.linalg.solve(hessian, self._whole[known])
        pull = self._slope[known] - away / self.prior[known] ** 2
        self._known, self._turn, self._home = known, turn, np.linalg.solve(hessian, pull)
        self.score = self._slope - turn.T @ pull
        self.gram = self._whole - self._whole[:, known] @ turn

    @property
    def programme(self) -> Programme:
        """Of all strengths, the fitted parameters projected out."""
        return Programme(self.gram, self.lower, self.upper, self.prior, self.count)

    def scores_of(self, errors: FloatArray) -> FloatArray:
        """Scores of other errors of the same runs, each as large as those of the fit, (n_draw, n_parameter) [-].

        Parameters
        ----------
        errors : ndarray, shape (n_draw, n_error)
            They [K].
        """
        if self.jacobian is None:
            raise ValueError("screening: the sensitivities have been let go")
        # each draw has the deviation that it is weighed by, as the fit has
        size = np.sqrt(self.count / self.scale / np.sum(errors**2, axis=1))
        slopes = -self.scale * (size[:, None] * errors) @ self.jacobian
        return np.asarray(slopes - slopes[:, self._known] @ self._turn)

    def without(self, effect: str) -> Screening:
        """Screening of the model less one of its effects, by tangents: what is left in it makes up for that.

        Parameters
        ----------
        effect : str
            Id of one that the model has.
        """
        left = self._known & np.array([p.effect != effect for p in self.parameters])
        move = np.zeros(len(self.parameters))
        strengths = self.strengths_of(effect)
        move[strengths] = -self._point[strengths]
        away = (self._point - self._start)[left]
        hessian = self._whole[np.ix_(left, left)] + np.diag(self.prior[left] ** -2.0)
        move[left] = np.linalg.solve(
            hessian, self._slope[left] - away / self.prior[left] ** 2 - self._whole[left] @ move
        )
        factor = self.count / float(self.count - 2.0 * self._slope @ move + move @ self._whole @ move)
        less = copy(self)
        less.scale = factor * self.scale
        less._whole, less._slope = factor * self._whole, factor * (self._slope - self._whole @ move)
        less._point = self._point + move
        less._project(left)
        return less

    def of(self, effect: str) -> Gain:
        """Gain of one effect: over the building, or in the zones where it explains most, or in all with one strength.

        Parameters
        ----------
        effect : str
            Its id.
        """
        return self._likeliest() if effect == GENERIC.id else self.ways(effect)[0]

    def ways(self, effect: str) -> list[Gain]:
        """Gains of an effect in each way in which it may be there, the best first.

        Parameters
        ----------
        effect : str
            Its id.
        """
        if not CATALOGUE[effect].takes_zones:
            return [self._gain(effect, self.strengths_of(effect), ())]
        members, everywhere = self.members_of(effect)
        found = [self._grow(effect, members)] if members else []
        found += [self._gain(effect, index, zones) for zones, index in everywhere.items()]
        if CATALOGUE[effect].courses:  # in all zones it is another
            found = [way for way in found if not self.is_everywhere(way.zones)] or found
        return sorted(found, key=lambda g: -g.gain)

    def is_everywhere(self, zones: Sequence[str]) -> bool:
        """Whether zones are all that the building has, by name; none stand for the whole building.

        Parameters
        ----------
        zones : sequence of str
            They.
        """
        return len(zones) == self._total

    def members_of(self, effect: str) -> tuple[dict[str, IntArray], dict[tuple[str, ...], IntArray]]:
        """Positions of an effect's strengths by zone or pair of zones, those that show nothing left out.

        Parameters
        ----------
        effect : str
            Id of one that may be in some zones only.

        Returns
        -------
        tuple
            By zone or pair; and those that all zones share, alone and with the zones' own made alike.
        """
        members: dict[str, list[int]] = {}
        tied = [int(i) for i in self.strengths_of(effect) if i in self._tied]
        for i in self.strengths_of(effect):
            if i not in self._tied:
                members.setdefault(self.parameters[i].member or "", []).append(int(i))
        shared = members.pop("", [])
        ways = {(): shared, ALIKE: [*shared, *tied] if tied else []}
        everywhere = {zones: np.array(index, dtype=np.int64) for zones, index in ways.items() if index}
        silent = [name for name, mine in members.items() if not self._whole[mine, mine].any()]
        shown = {n: np.array(i) for n, i in members.items() if n not in silent or len(silent) == len(members)}
        return shown, everywhere

    def apart(self, effect: str) -> list[Gain]:
        """Gains of an effect whose zones differ, where tangents see a sign of it and wherever it may be.

        Parameters
        ----------
        effect : str
            Its id.
        """
        found, members = [w for w in self.ways(effect) if w.zones != ALIKE], self.members_of(effect)[0]
        if not members or any(set(w.zones) == set(zones_of(members)) for w in found):
            return found
        index, count = np.concatenate(list(members.values())), len(members)
        return [*found, self._gain(effect, index, zones_of(members), choice_of(count, count), count)]

    def promised(self, *gains: Gain) -> dict[str, float]:
        """Parameters where the tangents point: the effects' strengths, and what the fitted ones then would be.

        Parameters
        ----------
        *gains : Gain
            Of the effect, or of several together.
        """
        moved = self._point.copy()
        moved[self._known] += self._home - self._turn @ np.sum([g.direction for g in gains], axis=0)
        known = [p for p, k in zip(self.parameters, self._known, strict=True) if k]
        values = {
            p.name: float(np.clip(p.inverse(v), p.lower, p.upper))
            for p, v in zip(known, moved[self._known], strict=True)
        }
        return values | {name: value for g in gains for name, value in g.strengths.items()}

    def reach(self, first: Gain, second: Gain) -> float:
        """Gain of two effects together were their strengths free of bounds [-].

        Parameters
        ----------
        first, second : Gain
            With their zones.
        """
        index = np.concatenate([first.index, second.index])
        hessian = self.gram[np.ix_(index, index)] + np.diag(self.prior[index] ** -2.0)
        free, there = np.linalg.solve(hessian, self.score[index]), np.ones((1, index.size), dtype=bool)
        gain = self.programme.weigh(index, free[None], self.score[None], there).gain[0]
        return float(gain) - first.choice - second.choice

    def together(self, first: Gain, second: Gain) -> tuple[Gain, Gain, float, float]:
        """Two effects with the strengths that they have together, what both gain and what they explain.

        Parameters
        ----------
        first, second : Gain
            With their zones.
        """
        parts = first.index, second.index
        both = self.programme.solve(np.concatenate(parts), self.score[None])
        split, found = np.split(both.strengths[0], [parts[0].size]), []
        for one, index, strengths in zip((first, second), parts, split, strict=True):
            direction = np.zeros(len(self.parameters))
            direction[index] = strengths
            named = self._named(one.effect, index, strengths, np.zeros((index.size, index.size)))[0]
            found.append(replace(one, strengths=named, direction=direction))
        gain = float(both.gain[0]) - first.choice - second.choice
        return found[0], found[1], gain, float(both.share[0])

    def cosine(self, first: Gain, second: Gain) -> float:
        """Cosine of the projected signatures of two effects at their estimates [-].

        Parameters
        ----------
        first, second : Gain
            With their strengths.
        """
        a, b = first.direction, second.direction
        size = np.sqrt((a @ self.gram @ a) * (b @ self.gram @ b))
        return float(a @ self.gram @ b / size) if size > 0 else 0.0

    def detectable(self, gain: float) -> dict[str, float]:
        """Constant heat of each zone that would gain so much, by zone [W/m2].

        Parameters
        ----------
        gain : float
            Logarithm of a Bayes factor [-].
        """
        found = {}
        for i, p in enumerate(self.parameters):
            if p.base == ZONE_HEAT and p.member is not None:
                information = max(float(self.gram[i, i]), 1e-12)
                occam = 0.5 * np.log1p(information * self.prior[i] ** 2)
                found[p.member] = float(np.sqrt(2.0 * (gain + occam) / information))
        return found

    def generic_families(self) -> list[IntArray]:
        """Positions of generic heat: of all of it, by zone, by outdoor temperature, by time."""
        index = self.strengths_of(GENERIC.id)
        kinds = np.array([self.parameters[i].base for i in index])
        families = [index, *(index[kinds == k] for k in np.unique(kinds) if not k.startswith("heat_from"))]
        families.append(index[np.char.startswith(kinds, "heat_from")])
        return families

    def _likeliest(self) -> Gain:
        """Find the likeliest generic heat, of any kind and size."""
        sizes = [self._gain(GENERIC.id, f, (), tightness=t) for f in self.generic_families() for t in TIGHTNESS]
        return max(sizes, key=lambda g: g.gain)

    def _named(
        self, effect: str, index: IntArray, x: FloatArray, covariance: FloatArray
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Parameters by name and their standard errors: strengths, and the level between its ends that they weigh."""
        own = np.array([self._twins.get(i, i) for i in index.tolist()])
        rows = {self.parameters[i].name: (own == i).astype(float) for i in dict.fromkeys(own.tolist())}
        most = {self.parameters[i].name: self.parameters[i].upper for i in own.tolist()}
        values = {name: min(float(row @ x), most[name]) for name, row in rows.items()}
        level, whole = self._levels.get(effect), float(x.sum())
        if level is not None:
            reach, upper = level.upper - level.lower, own != index
            share = float(x[upper].sum()) / whole if whole > 0.0 else (level.start - level.lower) / reach
            values[level.name] = level.lower + share * reach
            rows[level.name] = reach * (upper - share) / whole if whole > 0.0 else np.zeros(len(x))
        errors = {name: float(np.sqrt(row @ covariance @ row)) for name, row in rows.items()}
        return values, errors

    def strengths_of(self, effect: str) -> IntArray:
        """Positions of an effect's strengths.

        Parameters
        ----------
        effect : str
            Its id.
        """
        own = ((i, self.parameters[self._twins.get(i, i)]) for i in range(len(self.parameters)))
        return np.array([i for i, p in own if p.effect == effect and is_strength(p.name, effect)], dtype=np.int64)

    def _grow(self, effect: str, members: Mapping[str, IntArray]) -> Gain:
        """Add zones, or pairs of them, as long as each more than pays for having been chosen among all."""
        places, names = len(members) + self.elsewhere, list(members)
        grown = self.programme.grow(list(members.values()), self.score[None], places)
        chosen = [names[k] for k in grown.order[0] if grown.chosen[0, k]]
        index = np.concatenate([members[name] for name in chosen])
        return self._gain(effect, index, zones_of(chosen), choice_of(len(chosen), places), places)

    def _gain(
        self,
        effect: str,
        index: IntArray,
        zones: tuple[str, ...],
        choice: float = 0.0,
        places: int = 0,
        tightness: float = 1.0,
    ) -> Gain:
        found = self.programme.solve(index, self.score[None], tightness=tightness)
        x, gain, share = found.strengths[0], float(found.gain[0]), float(found.share[0])
        direction = np.zeros(len(self.parameters))
        direction[index] = x
        sharper = self.gram[np.ix_(index, index)] / (1.0 - share) + np.diag(self.prior[index] ** -2.0)
        along = direction if np.any(direction) else np.isin(np.arange(len(direction)), index).astype(float)
        whole = float(along @ self._whole @ along)
        kept = float(along @ self.gram @ along) / whole if whole > 0.0 else 0.0
        strengths, errors = self._named(effect, index, x, np.asarray(np.linalg.inv(sharper)))
        return Gain(effect, zones, gain - choice, share, strengths, errors, kept, direction, index, places, choice)


def _worst_zones(fit: Fit) -> tuple[str, ...]:
    """Zones with the largest errors, in which effects of single zones are sought; none where that is all of them."""
    zones = fit.built.network.zones
    if len(zones) <= _MOST_ZONES:
        return ()
    worst = set(np.argsort(-fit.by_zone, kind="stable")[:_MOST_ZONES].tolist())
    return tuple(z for k, z in enumerate(zones) if k in worst)


def screen(models: ModelComparison, fit: Fit, candidates: Sequence[str]) -> tuple[Screening, list[Gain], Gain]:
    """Screen all candidates; they come by what they gain, and the generic heat beside them.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        The model so far.
    candidates : sequence of str
        Effects that the case can tell.
    """
    made = Screening(models, fit, candidates)
    gains = [made.of(e) for e in candidates if e not in fit.effects and made.strengths_of(e).size]
    return made, sorted(gains, key=lambda g: -g.gain), made.of(GENERIC.id)
