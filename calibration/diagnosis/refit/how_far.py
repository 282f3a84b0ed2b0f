"""How far the gap shrinks: held-out errors before and after each effect, the floor, and two placebos."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from calibration.diagnosis.refit.comparison import Bench, Built, Fit
from calibration.diagnosis.refit.fit import settle
from calibration.diagnosis.refit.held_out import HeldOut, held_out
from calibration.diagnosis.refit.refit import Refit
from calibration.diagnosis.refit.search import Round
from calibration.diagnosis.screen.generic import GENERIC
from calibration.errors import HorizonError, NotEnoughDataError
from thermal.effects.effect import Chosen
from thermal.model.reduce import reduced_model
from thermal.model.replay import Inputs

#: Resamples of days for intervals, and the share of them that an interval holds [-].
_RESAMPLES, _LEVEL = 1000, 0.9

#: Horizon at which missing heat is hardly felt yet.
_SOON = pd.Timedelta("1h")

#: Evaluations of the fit of a placebo.
_EVALUATIONS = 6


@dataclass(frozen=True)
class Step:
    """What the effects up to one round close of the gap.

    Parameters
    ----------
    effects : tuple of str
        Those in the model.
    before, after, floor : float
        Held-out mean absolute error of the calibrated baseline, with the effects, and that which nothing that is
        smooth in time of day and outdoor temperature would lower [K].
    share_closed : float or None
        ``(before - after) / (before - floor)`` [-]; None where there is no gap to close within two standard errors.
    interval : tuple of float or None
        90 % interval of it, from resampled days [-].
    shuffled, runner_up : float or None
        Held-out error with the signals of the last effect permuted by days, and with the effect that came next in its
        place [K]; None where there is no such placebo.
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
    bounds: tuple[str, ...]


def how_far(bench: Bench, rounds: Sequence[Round]) -> tuple[tuple[Step, ...], float, float]:
    """Measure what each accepted effect closes of the gap.

    Parameters
    ----------
    bench : Bench
        The case.
    rounds : sequence of Round
        Of the search.

    Returns
    -------
    tuple
        The steps, the held-out error of the calibrated baseline, and the floor under it [K].
    """
    before = rounds[0].held_out
    floor = _floor_of(bench, rounds[-1])
    steps = []
    for r in rounds:
        if r.accepted is None:
            break
        after = r.accepted.held_out
        others = [x for x in r.refits if x is not r.accepted]
        runner = others[0].held_out.mae if others else None
        share, interval = _closed(before, after, floor)
        effects = tuple(r.accepted.fit.effects)
        steps.append(
            Step(
                effects,
                before.mae,
                after.mae,
                floor.mae,
                share,
                interval,
                _shuffled(bench, r, r.accepted),
                runner,
                _on_bound(r.accepted.fit),
            )
        )
    return tuple(steps), before.mae, floor.mae


def _floor_of(bench: Bench, last: Round) -> HeldOut:
    """Held-out errors below which nothing regular that is missing would take the last model.

    The least of three: the model's own; those with generic heat added, zone by zone, by time of day and outdoor
    temperature, its strengths from the tuning intervals; and those one hour ahead, for what is missing steadily takes
    hours to be felt, while sensors' noise and random heat are felt at once.

    Parameters
    ----------
    bench : Bench
        The case.
    last : Round
        The last of the search.
    """
    final = last.after
    found = [last.after_held_out]
    if _SOON < pd.Timedelta(bench.horizon):
        with suppress(HorizonError, NotEnoughDataError):  # an hour may be no multiple of the step
            found.append(held_out(bench, final, "1h"))
    if last.accepted is None and last.generic.gain > 0.0:
        built = bench.build(final.effects, (Chosen(GENERIC),))
        theta = built.theta({**final.values, **last.screening.promised(last.generic)})
        problem = bench.problem(built, theta)
        fit = replace(final, built=built, problem=problem, model=reduced_model(built.grid, [theta]))
        found.append(held_out(bench, replace(fit, found=replace(final.found, point=problem.point(theta)))))
    return min(found, key=lambda e: e.mae)


def _on_bound(fit: Fit) -> tuple[str, ...]:
    """Baseline parameters that lie on a bound of their range."""
    lower, upper = fit.problem.bounds
    close = np.minimum(fit.found.point - lower, upper - fit.found.point) < 0.01 * (upper - lower)
    names = ((p.name, p.effect) for p in fit.problem.parameters)
    return tuple(name for (name, effect), c in zip(names, close, strict=True) if c and effect is None)


def _closed(before: HeldOut, after: HeldOut, floor: HeldOut) -> tuple[float | None, tuple[float, float] | None]:
    """Share of the gap that is closed with its interval; None where the gap is within two standard errors."""
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


def _shuffled(bench: Bench, r: Round, accepted: Refit) -> float | None:
    """Held-out error with the signals of the round's effect permuted by days; None where it has none that vary."""
    fit = accepted.fit
    built = fit.built
    earlier = {s.name for s in r.before.built.network.signals}
    first = len(built.network.boundaries)
    columns = [first + i for i, s in enumerate(built.network.signals) if s.name not in earlier]
    varying = [c for c in columns if float(np.std(built.inputs.boundary[:, c])) > 0.0]
    if not varying:
        return None
    permuted = Built(built.network, built.grid, _permuted(built.inputs, varying))
    problem = bench.problem(permuted, fit.theta)
    model, found = settle(problem, built.grid, fit.theta, _EVALUATIONS, fit.model)
    return held_out(bench, replace(fit, built=permuted, problem=problem, model=model, found=found)).mae


def _permuted(inputs: Inputs, columns: Sequence[int]) -> Inputs:
    """Put whole days of some columns of the inputs in another order."""
    day = max(1, round(86400.0 / inputs.step))
    whole = len(inputs) // day
    order = np.random.default_rng(0).permutation(whole)
    boundary = inputs.boundary.copy()
    part = boundary[: whole * day, columns].reshape(whole, day, len(columns))
    boundary[: whole * day, columns] = part[order].reshape(whole * day, len(columns))
    return replace(inputs, boundary=boundary)
