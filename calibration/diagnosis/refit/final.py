"""The models of a diagnosis on the telemetry: their runs, their heat, and the final one as a ``calibration.json``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from calibration.diagnosis.decide.drift import DriftCurve, drift_of
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.refit.comparison import Fit
from calibration.diagnosis.screen.missing import Missing, at_start, missing_heat
from calibration.evaluation.n_step import Evaluation
from calibration.fit.describe import describe_parameters
from calibration.fit.result import ParameterEstimate, SolverReport, effect_entries


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
    baseline, final, judged = result.rounds[0].before, result.final, result.judged
    evaluation = baseline.evaluate(judged, result.horizon, trajectories=True)
    before = Replay(evaluation, result.where.missing, result.where.drift)
    if not final.effects:
        return before, None
    evaluation = final.evaluate(judged, result.horizon, trajectories=True)
    return before, Replay(evaluation, missing_heat(final, judged), drift_of(final, judged))


def final_calibration(result: Diagnosis) -> dict[str, Any]:
    """Contents of the ``calibration.json`` of the final model.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    final, network = result.final, result.final.built.network
    described = describe_fit(final)
    found = final.found
    solver = SolverReport(
        "gauss_newton", "settled" if found.converged else "evaluations used up", found.converged, found.evaluations,
        result.seconds, 1, (), found.evaluations, found.converged,
    )  # fmt: skip
    intervals = {"tuning": result.tuned, "held_out": result.judged}
    before, after = (
        {name: fit.evaluate(part, result.horizon).metrics.to_dict() for name, part in intervals.items()}
        for fit in (at_start(result.rounds[0].before), final)
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
