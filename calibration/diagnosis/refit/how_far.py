"""How far the gap shrinks: held-out errors by effect, the floor, permutation test, runner-up, halves of the days."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from calibration.diagnosis.refit.comparison import Built, Fit, ModelComparison
from calibration.diagnosis.refit.fit import solve
from calibration.diagnosis.refit.refit import HeldOut, held_out
from calibration.diagnosis.refit.repeat import Repeats, agreement
from calibration.diagnosis.refit.search import Round
from calibration.diagnosis.screen.generic import GENERIC
from calibration.errors import HorizonError, NotEnoughDataError
from thermal.effects.effect import Chosen
from thermal.model.case_replay import Inputs
from thermal.model.reduce import reduced_model

#: Resamples of days for intervals, and the share of them that an interval holds [-].
_RESAMPLES, _LEVEL = 1000, 0.9

#: Horizon at which missing heat is hardly felt yet.
_SOON = pd.Timedelta("1h")

#: Evaluations of the fit of a permutation test.
_EVALUATIONS = 6


@dataclass(frozen=True)
class Step:
    """What the effects up to one round close of the gap.

    Parameters
    ----------
    effects : tuple of str
        Those accepted so far; what the baseline has already is none of them.
    before, after, floor : float
        Held-out mean absolute error of the calibrated baseline, with the effects, and that which nothing that is
        smooth in time of day and outdoor temperature would lower [K].
    share_closed : float or None
        ``(before - after) / (before - floor)`` [-]; None where there is no gap to close within two standard errors.
    interval : tuple of float or None
        90 % interval of it, from resampled days [-].
    shuffled, runner_up : float or None
        Held-out error with the signals of the last effect permuted by days, and with the effect that came next in its
        place [K]; None where there is no such test.
    halves : Repeats or None
        The last effect in the two halves of the tuning days; None where these cannot be halved.
    bounds : tuple of str
        Baseline parameters on a bound with the effects.
    """

    effects: tuple[str, ...]
    before: float
    after: float
    floor: float
    share_closed: float | None
    interval: tuple[float, float] | None
    shuffled: float | None
    runner_up: float | None
    halves: Repeats | None
    bounds: tuple[str, ...]

    @property
    def void(self) -> bool:
        """Whether the last effect explains as much on other days, or is another in each half of the tuning days."""
        permuted = self.shuffled is not None and self.shuffled <= self.after
        return permuted or not self.repeats

    @property
    def repeats(self) -> bool:
        """Whether the halves of the tuning days agree on the last effect, or cannot tell."""
        return self.halves is None or self.halves.agrees

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``how_far`` in ``diagnosis.json``."""
        return {
            "effects": self.effects,
            "held_out_mae_before": self.before,
            "held_out_mae_after": self.after,
            "floor": self.floor,
            "share_closed": self.share_closed,
            "interval": self.interval,
            "placebo": {"shuffled": self.shuffled, "runner_up": self.runner_up},
            "on_bound": self.bounds,
        }


def how_far(models: ModelComparison, rounds: Sequence[Round]) -> tuple[tuple[Step, ...], HeldOut]:
    """Measure what each accepted effect closes of the gap.

    Parameters
    ----------
    models : ModelComparison
        The case.
    rounds : sequence of Round
        Of the search.

    Returns
    -------
    tuple
        The steps, and the floor under the held-out errors of the calibrated baseline.
    """
    before, floor, agree = rounds[0].held_out, _floor_of(models, rounds[-1]), agreement(rounds[-1].after)
    steps = []
    for r in rounds:
        if r.accepted is None:
            break
        after, fit = r.accepted.held_out, r.accepted.fit
        runner_up = next((x.held_out.mae for x in r.refits if x is not r.accepted), None)
        share, interval = closed(before, after, floor)
        found = tuple(e for e in fit.effects if e not in rounds[0].before.effects)
        steps.append(Step(
            found, before.mae, after.mae, floor.mae, share, interval, _permutation_test(models, r, fit), runner_up,
            agree.get(r.accepted.screened.effect), _on_bound(fit),
        ))  # fmt: skip
    return tuple(steps), floor


def _floor_of(models: ModelComparison, last: Round) -> HeldOut:
    """Held-out errors below which nothing regular that is missing would take the last model.

    The least of three: the model's own; those with generic heat added, zone by zone, by time of day and outdoor
    temperature, its strengths from the tuning intervals; and those one hour ahead, for what is missing steadily takes
    hours to be felt, while sensors' noise and random heat are felt at once.

    Parameters
    ----------
    models : ModelComparison
        The case.
    last : Round
        The last of the search.
    """
    final = last.after
    found = [last.after_held_out]
    if _SOON < pd.Timedelta(models.horizon):
        with suppress(HorizonError, NotEnoughDataError):  # an hour may be no multiple of the step
            found.append(held_out(models, final, "1h"))
    if last.accepted is None and last.generic.gain > 0.0:
        built = models.build(final.effects, (Chosen(GENERIC),))
        theta = built.theta({**final.values, **last.screening.promised(last.generic)})
        problem = models.problem(built, theta)
        fit = replace(final, built=built, problem=problem, model=reduced_model(built.grid, [theta]))
        found.append(held_out(models, replace(fit, found=replace(final.found, point=problem.point(theta)))))
    return min(found, key=lambda e: e.mae)


def _on_bound(fit: Fit) -> tuple[str, ...]:
    """Baseline parameters that lie on a bound of their range."""
    lower, upper = fit.problem.bounds
    close = np.minimum(fit.found.point - lower, upper - fit.found.point) < 0.01 * (upper - lower)
    names = ((p.name, p.effect) for p in fit.problem.parameters)
    return tuple(name for (name, effect), c in zip(names, close, strict=True) if c and effect is None)


def closed(before: HeldOut, after: HeldOut, floor: HeldOut) -> tuple[float | None, tuple[float, float] | None]:
    """Share of the gap that is closed with its interval; None where the gap is within two standard errors.

    Parameters
    ----------
    before, after, floor : HeldOut
        Errors without and with what closes it, and those that cannot be helped.
    """
    common = np.intersect1d(np.intersect1d(before.days, after.days), floor.days)
    parts = [(e.daily[np.isin(e.days, common)], e.weight[np.isin(e.days, common)]) for e in (before, after, floor)]
    drawn = np.random.default_rng(0).integers(common.size, size=(_RESAMPLES, common.size))
    means = [(daily[drawn] * weight[drawn]).sum(axis=1) / weight[drawn].sum(axis=1) for daily, weight in parts]
    gap = means[0] - means[2]
    if before.mae - floor.mae < 2.0 * float(gap.std()) or before.mae <= floor.mae:
        return None, None
    shares = (means[0] - means[1]) / np.where(np.abs(gap) > 1e-9, gap, 1e-9)
    ends = np.quantile(shares, [(1.0 - _LEVEL) / 2.0, (1.0 + _LEVEL) / 2.0])
    return (before.mae - after.mae) / (before.mae - floor.mae), (float(ends[0]), float(ends[1]))


def _permutation_test(models: ModelComparison, r: Round, fit: Fit) -> float | None:
    """Held-out error with the signals of the round's effect permuted by days.

    None where it has none that vary, or acts by conductances too, which other days do not take from it.
    """
    built = fit.built
    joined = [sum(not c.source for c in b.network.conductances) for b in (r.before.built, built)]
    if joined[0] != joined[1]:
        return None
    earlier = {s.name for s in r.before.built.network.signals}
    first = len(built.network.boundaries)
    columns = [first + i for i, s in enumerate(built.network.signals) if s.name not in earlier]
    varying = [c for c in columns if float(np.ptp(built.inputs.boundary[:, c])) > 0.0]
    if not varying:
        return None
    others = _permuted(built.inputs, varying)
    if np.allclose(others.boundary, built.inputs.boundary):  # the same every day
        return None
    permuted = Built(built.network, built.grid, others)
    problem = models.problem(permuted, fit.theta)
    model, found = solve(problem, built.grid, fit.theta, _EVALUATIONS, fit.model)
    return held_out(models, replace(fit, built=permuted, problem=problem, model=model, found=found)).mae


def _permuted(inputs: Inputs, columns: Sequence[int]) -> Inputs:
    """Put whole days of some columns of the inputs in another order."""
    day = max(1, round(86400.0 / inputs.step))
    whole = len(inputs) // day
    order = np.random.default_rng(0).permutation(whole)
    boundary = inputs.boundary.copy()
    part = boundary[: whole * day, columns].reshape(whole, day, len(columns))
    boundary[: whole * day, columns] = part[order].reshape(whole * day, len(columns))
    return replace(inputs, boundary=boundary)
