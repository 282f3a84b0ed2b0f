"""The models of a diagnosis on the telemetry: their runs, their heat, and the final one as a ``calibration.json``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from calibration.diagnosis.decide.drift import DriftCurve, drift_of
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.refit.comparison import Fit
from calibration.diagnosis.screen.missing import Missing, at_start, missing_heat
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation, EvaluationSettings, evaluate_model
from calibration.fit.result import ParameterEstimate, SolverReport, describe_parameters, effect_entries
from mpc.reports.evaluation import predictions_table


@dataclass(frozen=True)
class Replay:
    """A fitted model on the held-out intervals.

    Parameters
    ----------
    evaluation : Evaluation
        Its predictions, with every step.
    missing : Missing
        Heat that it lacks by hour and zone.
    drift : DriftCurve
        How the error of its free runs grows.
    """

    evaluation: Evaluation
    missing: Missing
    drift: DriftCurve


def replays(result: Diagnosis) -> tuple[Replay, Replay | None]:
    """Replay the calibrated baseline, and the final model where it has an effect.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    baseline = result.rounds[0].before
    before = Replay(
        _evaluated(result, baseline, result.judged, trajectories=True), result.where.missing, result.where.drift
    )
    final = result.final
    if not final.effects:
        return before, None
    how = result.judged, result.settings.stepping, result.settings.spin_up_seconds
    evaluation = _evaluated(result, final, result.judged, trajectories=True)
    return before, Replay(evaluation, missing_heat(final, *how), drift_of(final, *how))


def missing_table(result: Diagnosis, after: Replay | None) -> pd.DataFrame:
    """Tabulate missing heat with its band, one row an hour and zone.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    after : Replay or None
        Of the final model.

    Returns
    -------
    DataFrame
        Index ``timestamp``, where hours begin; ``zone``; heat that the model lacks, ``uncalibrated`` with parameters at
        their starts, ``baseline`` calibrated, and ``with_effects``; each also as ``.._low`` and ``.._high``, ends of
        its 90 % band [W].
    """
    models = {"uncalibrated": result.where.missing_at_start, "baseline": result.where.missing}
    if after is not None:
        models["with_effects"] = after.missing
    parts = {}
    for name, missing in models.items():
        low, high = missing.band(0.9)
        for column, values in ((name, missing.watts), (f"{name}_low", low), (f"{name}_high", high)):
            parts[column] = values.stack(future_stack=True)
    table = pd.DataFrame(parts).rename_axis(["timestamp", "zone"]).reset_index("zone")
    table.attrs["units"] = {name: "W" for name in parts}
    return table


def both_predictions(before: Replay, after: Replay | None) -> pd.DataFrame:
    """Tabulate the predictions of both models, one row a run, step and measured zone.

    Parameters
    ----------
    before : Replay
        Of the baseline.
    after : Replay or None
        Of the final model.

    Returns
    -------
    DataFrame
        Index ``timestamp``; ``run_start``, ``zone``, ``measured``, ``baseline`` and ``with_effects`` [degC].
    """
    table = predictions_table(before.evaluation).rename(columns={"simulated": "baseline"})
    units = {"measured": "degC", "baseline": "degC"}
    if after is not None:
        other = predictions_table(after.evaluation).rename(columns={"simulated": "with_effects"})
        keys = ["timestamp", "run_start", "zone"]
        other = other.reset_index()[[*keys, "with_effects"]]
        table = table.reset_index().merge(other, on=keys, how="left").set_index("timestamp")
        units["with_effects"] = "degC"
    table.attrs["units"] = units
    return table


def final_calibration(result: Diagnosis) -> dict[str, Any]:
    """Contents of the ``calibration.json`` of the final model.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    final, network = result.final, result.final.built.network
    described = describe_fit(final)
    baseline = result.rounds[0].before
    found = final.found
    solver = SolverReport(
        "gauss_newton", "settled" if found.settled else "evaluations used up", found.settled, found.evaluations,
        result.seconds, 1, (), found.evaluations, found.settled,
    )  # fmt: skip
    intervals = {"tuning": result.tuned, "held_out": result.judged}
    before, after = (
        {name: _mae(result, fit, part) for name, part in intervals.items()} for fit in (at_start(baseline), final)
    )
    return {
        "parameters": {p.name: p.to_dict() for p in described},
        "uncalibrated": before,
        "calibrated": after,
        "effects": effect_entries(final.effects, described),
        "solver": solver.to_dict(),
        "intervals": {name: [i.to_dict() for i in part] for name, part in intervals.items()},
        "objective": "multi_step",
        "horizon": result.horizon,
        "settings": replace(result.settings, effects=dict(final.effects)).to_dict(),
        "zones": list(network.zones),
        "case": result.case,
        "version": result.version,
        "seed": result.seed,
    }


def describe_fit(fit: Fit) -> tuple[ParameterEstimate, ...]:
    """Parameters of a fitted model with what is known of each.

    Parameters
    ----------
    fit : Fit
        With the Jacobian of its errors and priors.
    """
    known = dict(zip(fit.problem.free, fit.deviations.tolist(), strict=True))
    network = fit.built.network
    return describe_parameters(network.parameters, fit.theta, known, network.nominal)


def _mae(result: Diagnosis, fit: Fit, intervals: Sequence[Interval]) -> dict[str, float]:
    return _evaluated(result, fit, intervals).metrics.to_dict()


def _evaluated(result: Diagnosis, fit: Fit, intervals: Sequence[Interval], trajectories: bool = False) -> Evaluation:
    settings = result.settings
    runs = EvaluationSettings(
        result.horizon, trajectories, scheme=settings.stepping, spin_up_seconds=settings.spin_up_seconds
    )
    return evaluate_model(fit.model, fit.theta, fit.built.inputs, intervals, runs)
