"""What a diagnosis leaves behind: its numbers, the final model, and a page for those who run the building."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.diagnosis.decide.levels import LARGEST_GROUP
from calibration.diagnosis.decide.verdict import Candidate, generic_from
from calibration.diagnosis.diagnosis import Diagnosis, Replay
from calibration.diagnosis.posterior import posterior_of
from calibration.diagnosis.refit.search import Round, accepted_from
from calibration.fit.ladder import GAINS
from calibration.results import Content, check_results_folder
from mpc.reports import diagnosis_words
from mpc.reports.correction_words import correction_sentence, driver_rows
from mpc.reports.diagnosis_words import accepted, alike, called, in_zones, rivals
from mpc.reports.display import write_results
from mpc.reports.drift_words import drift_sentence
from mpc.reports.evaluation import command, predictions_table, subtitle
from mpc.reports.figures.diagnosis import change_panels, drift_lines, hour_bars, missing_lines
from mpc.reports.figures.errors import series_of_runs
from mpc.reports.figures.plan import heat_maps
from mpc.reports.figures.style import CELSIUS, Picture
from mpc.reports.means_found import diagnosis_means
from mpc.reports.page import kelvin, listed, render, significant, sure, unit
from mpc.reports.warnings import case_warnings, windows_first
from thermal._types import FloatArray
from thermal.case.building import FloorPlans
from thermal.case.case import Case
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.gains import daily_course

#: Models of a diagnosis in its tables.
_MODELS = ("baseline", "with_effects")

#: Effects shown at the top: those at least so probable [-], and how many at least and at most.
_LIKELY, _FEWEST, _MOST = 0.05, 3, 6

#: Parameters of an effect that are spelled out.
_MOST_VALUES = 4

#: Rows of a table of zones, of parts of the day and the building, and zones whose missing heat is drawn over time.
_MOST_ZONES, _MOST_PARTS, _MOST_DRAWN = 24, 10, 4

#: Effects of a round that are listed, and those whose likeness is.
_MOST_GAINS, _MOST_ALIKE = 10, 6

#: Missing heat that the darkest colour of a plan stands for at least [W/m2]: people, light and equipment of an office
#: give about 10, and a few tenths are not to look alarming.
_NOTABLE = 3.0


def write_diagnosis(
    result: Diagnosis, case: Case, out: str | Path, force: bool = False, experiment: Mapping[str, Any] | None = None
) -> Path:
    """Write what a diagnosis found: numbers, series, the final model and a page.

    Files are ``diagnosis.json``, ``calibration.json`` of the model with all accepted effects, ``posterior.json`` of the
    models that are possible, ``missing_watts.parquet`` by zone and hour, ``predictions.parquet`` of the held-out runs
    without and with effects, and ``report.html``.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    case : Case
        The case it was made on.
    out : str or Path
        Folder, made if need be.
    force : bool
        Replace earlier results.
    experiment : mapping, optional
        What an experiment said that the telemetry holds, entry ``experiment`` of ``diagnosis.json``.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    """
    check_results_folder(out, force)
    files = diagnosis_files(result, case)
    if experiment is not None:
        files["diagnosis.json"] = diagnosis_summary(result) | {"experiment": dict(experiment)}
    return write_results(out, files, force) / "report.html"


def diagnosis_files(result: Diagnosis, case: Case) -> dict[str, Content]:
    """Files of a diagnosis by name, see `write_diagnosis`.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    case : Case
        The case it was made on.
    """
    models = result.replays()
    return {
        "diagnosis.json": diagnosis_summary(result),
        "calibration.json": result.calibration(),
        "posterior.json": posterior_of(result, case.building).to_dict(),
        "missing_watts.parquet": _missing_table(result, models),
        "predictions.parquet": _predictions(models),
        "report.html": render("diagnosis", _content(result, case, models)),
    }


def diagnosis_summary(result: Diagnosis) -> dict[str, Any]:
    """Contents of ``diagnosis.json``.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    numbers = result.to_dict()
    return numbers | {"where": {"sentence": diagnosis_words.where_sentence(result.where), **numbers["where"]}}


def _missing_table(result: Diagnosis, models: Sequence[Replay]) -> pd.DataFrame:
    """Tabulate missing heat with its band, one row an hour and zone.

    Index ``timestamp``, where hours begin; ``zone``; heat that the model lacks, ``uncalibrated`` with parameters at
    their starts, ``baseline`` calibrated, and ``with_effects``; each also as ``.._low`` and ``.._high``, ends of its
    90 % band [W].
    """
    heat = (result.where.missing_at_start, *(r.missing for r in models))
    parts = {
        name + end: values.stack(future_stack=True)
        for name, missing in zip(("uncalibrated", *_MODELS), heat, strict=False)
        for end, values in zip(("", "_low", "_high"), (missing.watts, *missing.band(0.9)), strict=True)
    }
    table = pd.DataFrame(parts).rename_axis(["timestamp", "zone"]).reset_index("zone")
    table.attrs["units"] = dict.fromkeys(parts, "W")
    return table


def _predictions(models: Sequence[Replay]) -> pd.DataFrame:
    """Tabulate the predictions of the models, one row a run, step and measured zone.

    Index ``timestamp``; ``run_start``, ``zone``, ``measured``, ``baseline`` and ``with_effects`` [degC].
    """
    named = zip(_MODELS, models, strict=False)
    table, *others = (predictions_table(r.evaluation).rename(columns={"simulated": name}) for name, r in named)
    keys = ["timestamp", "run_start", "zone"]
    for other in others:
        further = other.reset_index().drop(columns="measured")
        table = table.reset_index().merge(further, on=keys, how="left").set_index("timestamp")
    table.attrs["units"] = {c: "degC" for c in ("measured", *_MODELS) if c in table}
    return table


def _content(result: Diagnosis, case: Case, replayed: Sequence[Replay]) -> dict[str, Any]:
    found, inside = diagnosis_words.final_name(result), accepted(result)
    evaluations = [r.evaluation for r in replayed]
    models = dict(zip(("calibrated model", found), map(series_of_runs, evaluations), strict=False))
    errors = [{z: e["mae"] for z, e in one.by_zone().items()} for one in evaluations]
    return {
        "result": result,
        "subtitle": subtitle(case, evaluations[0]),
        "verdict": diagnosis_words.diagnosis_verdict(result),
        "means": windows_first(diagnosis_means(result), case),
        "warnings": case_warnings(case),
        "fine": result.verdict.name != "unexplained",
        "found": found,
        "ahead": diagnosis_words.ahead(result),
        "accepted": inside,
        "called": called,
        "best": diagnosis_words.candidate(result, inside[0].screened.effect)
        if inside
        else result.verdict.candidates[0],
        "candidates": [_candidate_entry(result, c) for c in _shown(result)],
        "next": _measure_next(result),
        "untestable": [c for c in result.verdict.candidates if not c.testable],
        **_where(result, case, replayed),
        "waterfall": _waterfall(result),
        "tests": _test_sentences(result),
        "drivers": driver_rows(result),
        "corrected": correction_sentence(result),
        "panels": change_panels(models, evaluations[0].zones, errors),
        **_statistics(result),
        "span": (case.stamps[0], case.stamps[-1], case.step),
        "pandas": pd.__version__,
        "command": command("diagnose", (result.tuned, result.judged), result.horizon, result.settings.dx),
    }


def _shown(result: Diagnosis) -> list[Candidate]:
    inside = {r.screened.effect for r in accepted(result)}
    testable = [c for c in result.verdict.candidates if c.testable]
    likely = [c for c in testable if c.probability >= _LIKELY or c.effect in inside][:_MOST]
    return likely if len(likely) >= _FEWEST else testable[:_FEWEST]


def _candidate_entry(result: Diagnosis, c: Candidate) -> dict[str, Any]:
    fitted = next((r for r in accepted(result) if r.screened.effect == c.effect), None)
    shown = fitted is not None or result.verdict.name == "unexplained"
    group = rivals(result, c.effect) if fitted is not None else alike(result, c.effect)
    others = [called(e) for e in group[:LARGEST_GROUP] if e != c.effect] if shown else []
    return {
        "name": called(c.effect).capitalize(),
        "probability": c.probability,
        "accepted": fitted is not None,
        "where": in_zones(c.zones if fitted is None else fitted.zones),
        "acts_on": CATALOGUE[c.effect].acts_on if c.effect in CATALOGUE else "readings",
        "values": [] if fitted is None else _values(result, c.effect),
        "alike": listed(others, "or") if others else "",
        "separate_by": c.separate_by,
    }


def _courses(by_zone: Mapping[str, FloatArray]) -> list[str]:
    """Spell the heat of people with hours of their own, the zones in which it swings most first."""
    most = sorted(by_zone, key=lambda zone: -float(np.ptp(by_zone[zone])))
    told = [
        f"{zone}: {by_zone[zone].mean():.1f} W/m² in the mean, most at {int(np.argmax(by_zone[zone]))}:00 "
        f"({by_zone[zone].max():.1f})"
        for zone in most[:_MOST_VALUES]
    ]
    return _with_more(told, len(most))


def _with_more(spelled: list[str], count: int) -> list[str]:
    """Say how many are not spelled."""
    more = count - len(spelled)
    return [*spelled, f"and {more} more"] if more > 0 else spelled


def _values(result: Diagnosis, effect: str) -> list[str]:
    """Spell the parameters of an effect as the final model has them."""
    if effect not in CATALOGUE:
        return []
    own = {p.name for p in CATALOGUE[effect].parameters}
    zones = result.final.effects.get(effect, ())
    if effect == GAINS and len(zones) == len(result.final.built.network.zones):
        return _courses({zone: daily_course(zone, result.final.values) for zone in zones})
    known = result.final.told
    found = [p for p in result.final.describe() if p.name.partition("@")[0] in own and p.name in known]
    spelled = []
    for p in found[:_MOST_VALUES]:
        base, _, member = p.name.partition("@")
        shift, of = (CELSIUS, "°C") if p.unit == "K" and "temperature" in base else (0.0, unit(p.unit))
        place = f" ({member.replace('facade:', 'facade at ').replace(' deg', '°')})" if member else ""
        told = significant(p.value - shift) + ("" if of == "–" else f" {of.replace('*', '·')}")
        if p.interval90 is not None:
            ends = sorted((*p.interval90, p.value))  # at the end of a range the estimate may lie outside
            low, high = (significant(end - shift) for end in (ends[0], ends[-1]))
            told += f" (90 %: up to {high})" if p.value == 0.0 else f" (90 %: {low} to {high})"
        if p.at_bound and p.value != 0.0:
            told += ", at the end of its range"
        spelled.append(f"{base.replace('_', ' ').replace('u value', 'U-value')}{place}: {told}")
    return _with_more(spelled, len(found))


def _measure_next(result: Diagnosis) -> list[tuple[str, str]]:
    """List what would tell effects of the verdict apart, or confirm the one that was named."""
    if result.verdict.name == "no_gap":
        return []
    names = [r.screened.effect for r in accepted(result)]
    faults = [(called(f.effect, f.zones).capitalize(), f.seen.advice) for f in result.faults]
    for name in list(names) or ([] if faults else [result.verdict.candidates[0].effect]):
        names += [name, *rivals(result, name)[:LARGEST_GROUP]]
    once = [e for e in dict.fromkeys(names) if CATALOGUE[e].separated_by]
    told = [(called(e).capitalize(), CATALOGUE[e].separated_by) for e in once]
    return [*faults, *told]


def _waterfall(result: Diagnosis) -> list[tuple[str, float, float]]:
    """List held-out errors, from the baseline by each effect to the floor, each with the one before."""
    values = [result.gap, *(s.after for s in result.steps)]
    steps = [(f"+ {called(s.effects[-1])}", s.after, before) for s, before in zip(result.steps, values, strict=False)]
    floor = ("Floor: with regular heat of any kind added", result.floor, result.floor)
    return [("The calibrated model", result.gap, result.gap), *steps, floor]


def _test_sentences(result: Diagnosis) -> list[str]:
    """Say what permuted signals, halves of the days and the runner-up make of the effects."""
    sentences = []
    for i, (step, r) in enumerate(zip(result.steps, result.rounds, strict=False)):
        name = called(step.effects[-1])
        real = step.shuffled is None or step.shuffled > step.after
        if step.shuffled is not None and (i == 0 or not real):
            verdict = "their course over these very days is what explains" if real else "be careful with this effect"
            sentences.append(
                f"With the signals behind {name} put on other days the error is {kelvin(step.shuffled)} K instead of "
                f"{kelvin(step.after)} K: {verdict}."
            )
        if not step.repeats:
            sentences.append(
                f"The two halves of the tuning days do not agree on {name}: be careful with this effect; what is there "
                "in one half only is no part of the building, or acts in another way."
            )
        others = [x for x in r.refits if x is not r.accepted]
        if step.runner_up is not None and others and (i == 0 or step.runner_up < step.after):
            other = called(others[0].screened.effect)
            sentences.append(f"In place of {name}, the next best, {other}, reaches {kelvin(step.runner_up)} K.")
    return sentences


def _where(result: Diagnosis, case: Case, replayed: Sequence[Replay]) -> dict[str, Any]:
    """Lay out where the gap lies: plans, zones, parts of the building and of the day, growth of the error."""
    where, geometry, before = result.where, case.building.geometry, replayed[0]
    names = ("calibrated", diagnosis_words.final_name(result))
    maps: list[Picture] = []
    if isinstance(geometry, FloorPlans):
        cells = [np.count_nonzero(floor.tokens == zone) for floor in geometry.floors for zone in floor.zone_names]
        area = float(np.median(cells)) * geometry.cell_size**2
        top = max(float(np.nanmax(before.missing.rms, initial=1.0)), _NOTABLE * area)
        for r, title in zip(replayed, ("calibrated model", names[1]), strict=False):
            zones = list(r.missing.watts.columns)
            maps += heat_maps(geometry, case.building.orientation, zones, r.missing.rms, title, top)
    missing = {"uncalibrated": where.missing_at_start, **dict(zip(names, (r.missing for r in replayed), strict=False))}
    sizes = dict(zip(before.missing.watts, np.column_stack([m.rms for m in missing.values()]).tolist(), strict=True))
    known = {zone: size for zone, size in before.missing.by_zone.items() if size > 0.0}
    worst = sorted(known, key=lambda zone: -known[zone])[:_MOST_DRAWN]
    means = before.missing.watts.mean()
    parts = [p for p in (*where.groups, *where.modes) if p.share > p.predictions > 0.0]
    drifts = {name: (r.drift.seconds, r.drift.rms) for name, r in zip(names, replayed, strict=False)}
    return {
        "sentence": diagnosis_words.where_sentence(where).replace("%", " %"),
        "maps": maps,
        "missing": missing_lines(worst, {n: (m.watts, *m.band(0.9)) for n, m in missing.items()}) if worst else [],
        "zones": [
            {"zone": s.name, "share": s.share, "mean": float(means[s.name]), "sizes": sizes[s.name]}
            for s in sorted(where.zones, key=lambda s: -s.share)[:_MOST_ZONES]
        ],
        "parts": [
            vars(p) | {"name": diagnosis_words.part(p.name)}
            for p in sorted(parts, key=lambda p: p.predictions - p.share)[:_MOST_PARTS]
        ],
        "hours": hour_bars(where.hours),
        "drift_sentence": drift_sentence(names[1], *(r.drift for r in replayed)),
        "drift": drift_lines(drifts),
    }


def _statistics(result: Diagnosis) -> dict[str, Any]:
    """Lay out the fold of the page: rounds, likeness, permutation tests, bounds and what would have been found."""
    first, final = ({p.name: p for p in f.describe()} for f in (result.rounds[0].before, result.final))
    nothing = dict.fromkeys(("where", "score", "retained_share"))
    return {
        "limits": (accepted_from(result.rounds[0].own), generic_from(result.rounds[0])),
        "rounds": [_round(r) for r in result.rounds],
        "effects": [
            vars(c) | {"name": called(c.effect), "where": in_zones(c.zones), "sure": sure(c.probability)}
            | ({} if c.testable else nothing | {"sure": "not testable"})
            for c in result.verdict.candidates
        ],
        "closed": [vars(s) | {"names": listed([called(e) for e in s.effects])} for s in result.steps],
        "parameters": [vars(p) | {"first": first.get(p.name)} for p in final.values() if p.standard_error is not None],
        "bounds": [[n.replace("_", " ") for n, p in fit.items() if p.at_bound] or ["none"] for fit in (first, final)],
        "alternating": diagnosis_words.alternating_sentence(result),
        "intervals": [
            vars(i) | {"part": name}
            for name, part in (("tuning", result.tuned), ("held out", result.judged)) for i in part
        ],
    }  # fmt: skip


def _round(r: Round) -> dict[str, Any]:
    fitted = {x.screened.effect: x.gain for x in r.refits}
    rows = [
        vars(g) | {"name": called(g.effect), "where": in_zones(g.zones), "fitted": fitted.get(g.effect)}
        for g in r.gains[:_MOST_GAINS]
    ]
    generic = {"name": "heat of any regular kind", "where": None, "fitted": None, "retained": None}
    best = [g for g in r.gains if g.share > 0.0][:_MOST_ALIKE]
    return {
        "inside": [called(e) for e in r.before.effects],
        "accepted": None if r.accepted is None else r.accepted.screened.effect,
        "rows": [*rows, vars(r.generic) | generic],
        "names": [called(g.effect) for g in best],
        "alike": [[called(a.effect), *(f"{abs(r.screening.cosine(a, b)):.2f}" for b in best)] for a in best],
    }
