"""Diagnosis of a case: where model and building disagree, which effect causes it, how far the gap shrinks with it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from typing import Any

from calibration.diagnosis.decide.evidence import gains_of
from calibration.diagnosis.decide.levels import p_value
from calibration.diagnosis.decide.verdict import Verdict, judge
from calibration.diagnosis.decide.where import Where, where_it_lies
from calibration.diagnosis.refit.comparison import Bench, Fit
from calibration.diagnosis.refit.held_out import elsewhere, held_out
from calibration.diagnosis.refit.how_far import Step, how_far
from calibration.diagnosis.refit.refit import ACCEPTED
from calibration.diagnosis.refit.search import Round, search
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Progress
from calibration.evaluation.settings import ModelSettings
from thermal.case.case import Case
from thermal.effects.catalogue import CATALOGUE

#: Subsystem that an effect belongs to.
SUBSYSTEMS = {
    **dict.fromkeys(("flow_gain", "duct_loss", "capacity_limit", "valve_leak"), "terminal"),
    **dict.fromkeys(("sensor_bias", "sensor_lag", "clock_shift", "wrong_station"), "sensor"),
    **dict.fromkeys(("internal_gains", "latent_load"), "use"),
}


@dataclass(frozen=True)
class Diagnosis:
    """Outcome of `diagnose`.

    Parameters
    ----------
    case : str
        Name of the case.
    verdict : Verdict
        Which effect.
    where : Where
        Where the calibrated baseline is wrong.
    steps : tuple of Step
        How far each accepted effect closes the gap.
    gap, floor : float
        Held-out mean absolute error of the calibrated baseline, and that below which nothing found lowers it [K].
    p_value : float
        Probability of as large a gain where nothing is missing [-].
    detectable : mapping of str to float
        Smallest constant heat that would have been found, by zone [W].
    rounds : tuple of Round
        Of the search.
    tuned, judged : tuple of Interval
        Where models were fitted, and where errors are measured.
    seconds : float
        Wall time [s].
    version : str
        Of the library.
    seed : int
        Of all resampling; it is fixed.
    settings : ModelSettings
        How the baseline was built and run.
    horizon : str
        Prediction horizon.
    last_third : float or None
        Held-out mean absolute error of a baseline tuned on the first two thirds [K], where that was so large that
        tuning and held-out days alternate instead.
    """

    case: str
    verdict: Verdict
    where: Where
    steps: tuple[Step, ...]
    gap: float
    floor: float
    p_value: float
    detectable: Mapping[str, float]
    rounds: tuple[Round, ...]
    tuned: tuple[Interval, ...]
    judged: tuple[Interval, ...]
    seconds: float
    version: str
    seed: int = field(default=0)
    settings: ModelSettings = field(default_factory=ModelSettings)
    horizon: str = "6h"
    last_third: float | None = None

    @property
    def final(self) -> Fit:
        """Model with all accepted effects."""
        return self.rounds[-1].after

    @property
    def subsystem(self) -> str:
        """Part of the building that the first accepted effect belongs to; ``none`` where nothing is accepted."""
        first = self.rounds[0].accepted
        if first is None:
            return "unknown" if self.verdict.name == "unexplained" else "none"
        return SUBSYSTEMS.get(first.screened.effect, "envelope")

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``diagnosis.json``."""
        w = self.where
        return {
            "verdict": self.verdict.name,
            "gap": {
                "mae": self.gap,
                "floor": self.floor,
                "p_value": self.p_value,
                "smallest_detectable_watts": dict(self.detectable),
            },
            "where": {
                "sentence": w.sentence,
                "zones": [
                    {
                        "zone": s.name,
                        "share": s.share,
                        "missing_watts_rms": w.missing_watts[s.name],
                        "missing_watts_rms_at_start": w.missing_watts_at_start[s.name],
                    }
                    for s in w.zones
                ],
                "hours": w.hours.tolist(),
                "subsystem": self.subsystem,
                "modes": {name: _share(s) for name, s in w.modes.items()},
                "drift": {
                    "seconds": w.drift.seconds.tolist(),
                    "rms": w.drift.rms.tolist(),
                    "slope": w.drift.slope,
                    "kind": w.drift.kind,
                },
                "groups": {s.name: _share(s) for s in w.groups},
            },
            "which": [s.to_dict() for s in self.verdict.suspects],
            "set90": list(self.verdict.set90),
            "combinations": [{"effects": list(e), "probability": p} for e, p in self.verdict.combinations.items()],
            "how_far": [_step(s) for s in self.steps],
            "rounds": [r.to_dict() | {"worth": gains_of(r)} for r in self.rounds],
            "intervals": {
                "tuning": [i.to_dict() for i in self.tuned],
                "held_out": [i.to_dict() for i in self.judged],
                "mae_of_last_third": self.last_third,
            },
            "seconds": self.seconds,
            "case": self.case,
            "version": self.version,
            "seed": self.seed,
        }


def diagnose(
    case: Case,
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    *,
    dx: float | None = None,
    horizon: str = "6h",
    progress: Progress | None = None,
) -> Diagnosis:
    """Say where model and building disagree, which unmodelled effect causes it, and how far the gap shrinks with it.

    The baseline is calibrated; every effect of the catalogue that the case can tell is then screened by its tangents,
    with the calibrated parameters free to follow, and the few best are fitted anew. The best is accepted where its
    evidence exceeds what cases without any missing effect show, and the next is sought with it in the model.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out : sequence of Interval
        First two thirds and last third of the telemetry when both are empty, or days that alternate where the baseline
        errs so much more in the last third that it shows other weather or use; what the other leaves when one is.
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    horizon : str
        Prediction horizon, such as ``6h``.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    CalibrationError
        When an interval has no usable run.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> diagnose(load_bundled_case(), dx=1.0).verdict.suspects[0].effect
    'solar_gain'
    """
    began = time.perf_counter()
    bench = Bench(case, ModelSettings(dx=dx), tune, hold_out, horizon)
    untestable = bench.untestable()
    baseline = bench.fit({}, [{}])
    first = errors = held_out(bench, baseline)
    turns = elsewhere(baseline, first) and bench.alternate(baseline.built.inputs)
    if turns:
        baseline = bench.fit({}, [{}], baseline.built)
        errors = held_out(bench, baseline)
    where = where_it_lies(bench, baseline)
    rounds = search(bench, baseline, errors, [e for e in CATALOGUE if e not in untestable], progress)
    steps, gap, floor = how_far(bench, rounds)
    areas = {name: room.floor_area for name, room in bench.anatomy.rooms.items()}
    watts = rounds[0].screening.detectable(ACCEPTED)
    return Diagnosis(
        case=case.building.name,
        verdict=judge(rounds, untestable),
        where=where,
        steps=steps,
        gap=gap,
        floor=floor,
        p_value=p_value(max(gains_of(rounds[0]).values())),
        detectable={zone: w * areas[zone] for zone, w in watts.items()},
        rounds=rounds,
        tuned=tuple(bench.tuned),
        judged=tuple(bench.judged),
        seconds=time.perf_counter() - began,
        version=version("buildingmpc"),
        settings=replace(bench.settings, normalisation=bench.drivers.normalisation),
        horizon=horizon,
        last_third=first.mae if turns else None,
    )


def _share(share: Any) -> dict[str, Any]:
    return {"share": share.share, "predictions": share.predictions, "interval": list(share.interval)}


def _step(step: Step) -> dict[str, Any]:
    return {
        "effects": list(step.effects),
        "held_out_mae_before": step.before,
        "held_out_mae_after": step.after,
        "floor": step.floor,
        "share_closed": step.share_closed,
        "interval": None if step.interval is None else list(step.interval),
        "placebo": {"shuffled": step.shuffled, "runner_up": step.runner_up},
        "on_bound": list(step.bounds),
    }


def baseline_gap(
    case: Case,
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    *,
    dx: float | None = None,
    horizon: str = "6h",
) -> float:
    """Calibrate the baseline and give its held-out error, by which `diagnose` chooses its days [K].

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out : sequence of Interval
        As in `diagnose`.
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    horizon : str
        Prediction horizon, such as ``6h``.

    Raises
    ------
    CalibrationError
        When an interval has no usable run.
    """
    bench = Bench(case, ModelSettings(dx=dx), tune, hold_out, horizon)
    return float(held_out(bench, bench.fit({}, [{}])).mae)
