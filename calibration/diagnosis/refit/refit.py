"""An effect fitted together with all that was accepted before, and whether it may be accepted too.

When a window stood open is seen beyond a model that lacks what windows let out, and a poor guess lets another effect
win that takes heat at like times. So it is looked for again with that effect's parameters, and without its heat.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.screen.gains import MATTERS, Gain, choice_of
from calibration.diagnosis.screen.screen import Screening
from calibration.diagnosis.screen.seen import WINDOWS, seen_beyond
from calibration.evaluation.n_step import Predictions
from calibration.fit.problem import Problem
from calibration.fit.starts import FAILURES
from thermal._types import FloatArray, IntArray
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.effect import zones_of

#: Evaluations of a fit from one start.
_EVALUATIONS = 10

#: Share of that fall which tangents must promise for a fit to pay for its time [-]: of a hundred zones a fit takes
#: half a minute, and their evidence is in the tens for what no prediction shows.
_PROMISING = 0.25

#: By how much the mean of the held-out errors may grow [K], and by how many standard errors of that more [-]: what
#: differs from day to day by chance disproves nothing.
NO_WORSE, CHANCE = 0.005, 1.645

#: Gain of the fit from which an effect is accepted [-], unless the case's own nulls show more. They hold what is random
#: in a case, and not what its structure lacks: of 60 EnergyPlus offices without any effect one has more, and counts.
ACCEPTED = 6.0

#: Held-out mean absolute error over the root mean square of the tuning errors above which they are errors of other
#: days [-]; 0.7 is usual.
_ELSEWHERE = 1.2

#: Most times that a round looks again.
_LOOKS = 2


@dataclass(frozen=True)
class HeldOut:
    """Held-out errors of the N-step predictions of one model.

    Parameters
    ----------
    days : ndarray of int, shape (n_day,)
        Midnights, as numbers that grow with time [-].
    daily : ndarray, shape (n_day,)
        Mean over runs and zones of their size, by day [K].
    weight : ndarray, shape (n_day,)
        Number of runs of each day [-].
    """

    days: IntArray
    daily: FloatArray
    weight: FloatArray

    @property
    def mae(self) -> float:
        """Mean absolute error [K]."""
        return float(np.average(self.daily, weights=self.weight))


def held_out(models: ModelComparison, fit: Fit, horizon: str | None = None) -> HeldOut:
    """Held-out errors of a fitted model, by day.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        The model.
    horizon : str, optional
        That of the comparison by default.
    """
    predictions = fit.evaluate(models.judged, horizon or models.horizon).predictions
    return by_day(predictions, [p.error for p in predictions], fit.built.inputs.step)


def by_day(predictions: Sequence[Predictions], errors: Sequence[FloatArray], step: float) -> HeldOut:
    """Errors of some predictions, by the days of their ends.

    Parameters
    ----------
    predictions : sequence of Predictions
        Whose runs they are.
    errors : sequence of ndarray, shape (n_run, n_zone)
        At the end of the horizon, by prediction [K].
    step : float
        Of the telemetry [s].
    """
    size, day = [], []
    for p, error in zip(predictions, errors, strict=True):
        size.append(np.nanmean(np.abs(error), axis=1))
        # a stamp ends its step
        day.append((p.start + (int(p.steps[-1]) - 1) * pd.Timedelta(seconds=step)).normalize().asi8)
    sizes, days = np.concatenate(size), np.concatenate(day)
    known = np.isfinite(sizes)
    there, index = np.unique(days[known], return_inverse=True)
    weight = np.bincount(index).astype(float)
    return HeldOut(there, np.bincount(index, sizes[known]) / weight, weight)


def elsewhere(fit: Fit, errors: HeldOut) -> bool:
    """Whether a model errs so much more where it is held out than where it was fitted that it was fitted elsewhere.

    What is missing then acts in the weather or the use of the held-out days, and hardly in those that could show it.

    Parameters
    ----------
    fit : Fit
        The calibrated baseline.
    errors : HeldOut
        Its held-out errors.
    """
    return errors.mae > _ELSEWHERE * float(np.sqrt(fit.found.mean_square))


def growth(before: HeldOut, after: HeldOut) -> tuple[float, float]:
    """How far a mean absolute error grows from one model to another on the same days, and the standard error of that.

    Parameters
    ----------
    before, after : HeldOut
        Errors of the two models.

    Returns
    -------
    tuple of float
        Growth, and its standard error from the differences of days [K]; 0 where there is one day only.
    """
    _, one, other = np.intersect1d(before.days, after.days, return_indices=True)
    change, share = after.daily[other] - before.daily[one], before.weight[one] / before.weight[one].sum()
    mean = float(share @ change)
    if change.size < 2:
        return mean, 0.0
    return mean, float(np.sqrt(change.size / (change.size - 1) * share**2 @ (change - mean) ** 2))


@dataclass(frozen=True)
class Refit:
    """An effect fitted together with all that was accepted before.

    Parameters
    ----------
    screened : Gain
        What its tangents promised.
    fit : Fit
        The model with it.
    gain : float
        Logarithm of its Bayes factor against the model without it [-].
    fall : float
        How far the root mean square of the tuning errors falls with it [K].
    held_out : HeldOut
        Held-out errors with it.
    worse : bool
        Whether held-out errors grow with it by more than chance.
    counts : bool
        Whether it may be accepted: beyond doubt, of some size, and no worse where it was not fitted.
    """

    screened: Gain
    fit: Fit
    gain: float
    fall: float
    held_out: HeldOut
    worse: bool
    counts: bool

    @property
    def zones(self) -> tuple[str, ...]:
        """Zones of which the fit surely has it, with a strength beyond chance; all that it was fitted in if none."""
        sure = zones_of(m for m, beyond in self.fit.members(self.screened.effect).items() if beyond > CHANCE)
        return tuple(zone for zone in self.screened.zones if zone in sure) or self.screened.zones


@dataclass(frozen=True)
class Work:
    """What a round's fits start from.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        The model so far.
    held_out : HeldOut
        Its held-out errors.
    made : Screening
        All effects by tangents.
    level : float
        Gain from which an effect is accepted [-].
    """

    models: ModelComparison
    fit: Fit
    held_out: HeldOut
    made: Screening
    level: float = ACCEPTED

    @property
    def accepted(self) -> dict[str, float]:
        """Parameters of the effects that are in the model."""
        parameters = self.fit.built.network.parameters
        return {p.name: self.fit.values[p.name] for p in parameters if p.effect is not None}

    def refit(self, gains: Sequence[Gain], start: Mapping[str, float]) -> Refit | None:
        """Fit with some effects more; None where the fit fails, which costs those effects only.

        Parameters
        ----------
        gains : sequence of Gain
            Of these effects.
        start : mapping of str to float
            Values by name [parameter units].
        """
        try:
            effects = {**self.fit.effects, **{g.effect: g.zones for g in gains}}
            anew = self.models.fit(effects, [start], evaluations=_EVALUATIONS)
        except FAILURES:
            return None
        return self.weighed(gains, anew)

    def weighed(self, gains: Sequence[Gain], anew: Fit) -> Refit:
        """Compare a model with some effects more with the one without them.

        Parameters
        ----------
        gains : sequence of Gain
            Of these effects; the last is what the comparison is told of.
        anew : Fit
            The model with them.
        """
        choice = sum(choice_of(len(anew.members(g.effect)), g.places) for g in gains if g.places)
        gain = float(anew.evidence - self.fit.evidence - choice)
        fall = float(np.sqrt(self.fit.found.mean_square) - np.sqrt(anew.found.mean_square))
        errors = held_out(self.models, anew)
        grown, error = growth(self.held_out, errors)
        worse = grown > NO_WORSE + CHANCE * error
        counts = gain > self.level * len(gains) and not worse and max(fall, -grown) > MATTERS
        counts = counts and all(
            beyond_a_step(anew.problem, anew.theta, anew.deviations, CATALOGUE[g.effect].shifts) for g in gains
        )
        return Refit(gains[-1], anew, gain, fall, errors, worse, counts)


def promising(fit: Fit, share: float) -> bool:
    """Whether what tangents promise justifies a fit.

    Parameters
    ----------
    fit : Fit
        The model so far.
    share : float
        Of its squared error that they would explain [-].
    """
    return float(np.sqrt(fit.found.mean_square) * (1.0 - np.sqrt(1.0 - share))) > _PROMISING * MATTERS


def beyond_a_step(problem: Problem, theta: FloatArray, deviations: FloatArray, shifts: Sequence[str]) -> bool:
    """Whether what is moved in time, if anything, is moved by more than a step of telemetry, and surely so.

    Parameters
    ----------
    problem : Problem
        Of a model with the effect.
    theta : ndarray, shape (n_parameter,)
        Estimate [parameter units].
    deviations : ndarray, shape (n_free,)
        Its standard errors on the estimation scale [-].
    shifts : sequence of str
        Parameters that move it.
    """
    step = problem.inputs.step / 3600.0
    at = [k for k, p in enumerate(problem.parameters) if p.name in shifts]
    moved = np.abs(theta[[problem.free[k] for k in at]]) - CHANCE * deviations[at]
    return not at or bool(np.any(moved > step))


def look_again(work: Work, gains: Sequence[Gain], refits: Sequence[Refit], best: Refit | None) -> list[Refit]:
    """Fit open windows anew as they are seen beyond the best model, where that is confounded with them.

    The new openings are those of the case from then on where the fit with them gains more than any before; else the
    old ones stay.

    Parameters
    ----------
    work : Work
        Of the round; the openings of its drivers may change.
    gains : sequence of Gain
        Of all effects by tangents.
    refits : sequence of Refit
        Those fitted.
    best : Refit or None
        The one that would be accepted.

    Returns
    -------
    list of Refit
        The refits, the best first, with at most one of open windows.
    """
    screened = next((g for g in gains if g.effect == WINDOWS), None)
    own = "" if best is None else best.screened.effect
    if screened is None or best is None or WINDOWS not in (own, *CATALOGUE[own].confounders):
        return list(refits)
    found, drivers = next((r for r in refits if r.screened.effect == WINDOWS), None), work.models.drivers
    exposed = {p.member for p in work.made.parameters if p.effect == WINDOWS}
    fit = best.fit
    for _ in range(_LOOKS):
        opened = seen_beyond(fit.built.grid, _without(fit, own), drivers, fit.built.inputs).openings
        zones = tuple(z for k, z in enumerate(drivers.zones) if z in exposed and opened[:, k].any())
        if not zones or np.array_equal(opened, drivers.openings):
            break
        before, drivers.openings = drivers.openings, opened
        start = {p.name: fit.values[p.name] for p in fit.built.network.parameters if p.effect != own}
        again = work.refit([replace(screened, zones=zones, places=len(zones))], start)
        if again is None or again.gain <= (screened.gain if found is None else found.gain):
            drivers.openings = before
            break
        found, fit, own = again, again.fit, WINDOWS
    others = [r for r in refits if r.screened.effect != WINDOWS]
    return sorted([*others, *([] if found is None else [found])], key=lambda r: -r.gain)


def _without(fit: Fit, effect: str) -> FloatArray:
    """Parameters of a fit with one effect absent [parameter units]."""
    parameters = fit.built.network.parameters
    return np.array([p.start if p.effect == effect else fit.values[p.name] for p in parameters])
