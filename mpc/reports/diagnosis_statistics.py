"""The statistics behind a diagnosis's page: rounds, likeness, placebos, bounds and what would have been found."""

from __future__ import annotations

from typing import Any

import numpy as np

from calibration.diagnosis.decide.levels import GENERIC_GAP
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.refit.final import describe_fit
from calibration.diagnosis.refit.refit import ACCEPTED
from calibration.diagnosis.refit.search import Round
from calibration.fit.result import ParameterEstimate
from mpc.reports.diagnosis_words import called, in_zones, listed, sure
from mpc.reports.page import clock, kelvin, plain, significant, unit, watts

#: Effects of a round that are listed, and those whose likeness is.
_MOST_GAINS, _MOST_ALIKE = 10, 6


def statistics_content(result: Diagnosis) -> dict[str, Any]:
    """Entries of the fold of the page.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    baseline, final = describe_fit(result.rounds[0].before), describe_fit(result.final)
    return {
        "p_value": "under 0.001" if result.p_value < 0.001 else significant(result.p_value, 2),
        "accepted": plain(ACCEPTED),
        "generic": plain(GENERIC_GAP),
        "set90": listed([called(e) for e in result.verdict.set90]) if result.verdict.set90 else "",
        "rounds": [_round(i, r) for i, r in enumerate(result.rounds, 1)],
        "effects": _effects(result),
        "placebos": _placebos(result),
        "detectable": [(zone, watts(w)) for zone, w in result.detectable.items()],
        "parameters": _parameters(baseline, final if result.final.effects else ()),
        "bounds": _bounds(baseline, final if result.final.effects else ()),
        "elsewhere": ""
        if result.last_third is None
        else (
            "The telemetry's last third shows other weather or use than the days before it: a baseline tuned on these "
            f"misses it by {kelvin(result.last_third)} K. So tuning and held-out days alternate."
        ),
        "intervals": [
            (name, clock(i.start), clock(i.end))
            for name, part in (("tuning", result.tuned), ("held out", result.judged))
            for i in part
        ],
    }


def _round(number: int, r: Round) -> dict[str, Any]:
    fitted = {x.screened.effect: x for x in r.refits}
    rows = [
        [
            called(g.effect), in_zones(g.zones), _gain(g.gain),
            _gain(fitted[g.effect].gain) if g.effect in fitted else "–",
            f"{100 * g.share:.0f} %", f"{100 * g.retained:.0f} %",
        ]
        for g in r.gains[:_MOST_GAINS]
    ]  # fmt: skip
    generic = r.generic
    rows.append(["heat of any regular kind", "–", _gain(generic.gain), "–", f"{100 * generic.share:.0f} %", "–"])
    best = [g for g in r.gains if g.share > 0.0][:_MOST_ALIKE]
    inside = [called(e) for e in r.before.effects]
    return {
        "title": f"Round {number}: " + (f"with {listed(inside)}" if inside else "the calibrated model"),
        "outcome": "nothing gains enough" if r.accepted is None else f"accepted: {called(r.accepted.screened.effect)}",
        "rows": rows,
        "alike_names": [called(g.effect) for g in best],
        "alike": [
            [called(a.effect), *(f"{abs(r.screening.cosine(a, b)):.2f}" for b in best)] for a in best
        ] if len(best) > 1 else [],
    }  # fmt: skip


def _gain(value: float) -> str:
    return f"{value:.1f}".replace("-", "−") if np.isfinite(value) else "–"


def _effects(result: Diagnosis) -> list[list[str]]:
    return [
        [
            called(s.effect), s.effect, in_zones(s.zones) if s.testable else "–",
            sure(s.probability) if s.testable else "not testable", _gain(s.score) if s.testable else "–",
            f"{100 * s.retained_share:.0f} %" if s.testable else "–",
        ]
        for s in result.verdict.suspects
    ]  # fmt: skip


def _placebos(result: Diagnosis) -> list[list[str]]:
    return [
        [
            listed([called(e) for e in s.effects]), f"{s.before:.3f}", f"{s.after:.3f}", f"{s.floor:.3f}",
            "–" if s.share_closed is None else f"{100 * s.share_closed:.0f} %",
            "–" if s.interval is None else f"{100 * s.interval[0]:.0f} to {100 * s.interval[1]:.0f} %",
            "–" if s.shuffled is None else kelvin(s.shuffled), "–" if s.runner_up is None else kelvin(s.runner_up),
        ]
        for s in result.steps
    ]  # fmt: skip


def _parameters(before: tuple[ParameterEstimate, ...], after: tuple[ParameterEstimate, ...]) -> list[list[str]]:
    first = {p.name: p for p in before}
    estimated = [p for p in (after or before) if p.standard_error is not None]
    return [
        [
            p.name.replace("_", " "), unit(p.unit).replace("*", "·"),
            significant(first[p.name].value) if p.name in first else "absent",
            significant(p.value) if after else "–",
            " to ".join(significant(end) for end in p.interval90) if p.interval90 else "–",
        ]
        for p in estimated
    ]  # fmt: skip


def _bounds(before: tuple[ParameterEstimate, ...], after: tuple[ParameterEstimate, ...]) -> str:
    """Say which parameters lie on a bound of their range, in the calibrated and the final model."""

    def on(parameters: tuple[ParameterEstimate, ...]) -> str:
        names = [p.name.replace("_", " ") for p in parameters if p.at_bound]
        return listed(names) if names else "none"

    return f"On a bound of their range: {on(before)}" + (f"; in the final model: {on(after)}." if after else ".")
