"""Faults of the telemetry that it shows itself: clocks of the weather or of heat, two zones' sensors exchanged.

No term of a model can put them right, and no model is needed to see them. They are mended in the telemetry, one after
another. Light at night needs no model to be a fault; what is likely only counts where the mended case predicts days
better that its calibration has not seen.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from calibration.diagnosis.decide.verdict import Candidate, Estimate, Verdict
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import EvaluationSettings
from calibration.evaluation.settings import CalibrationSettings, ModelSettings, calibration_settings
from calibration.fit.fitted_case import FittedCase, fit_case, is_large
from calibration.fit.ladder import climb_from
from calibration.fit.left_out import left_out
from calibration.progress import Forward, Progress
from thermal.case.case import Case
from thermal.case.plausibility.anomaly import Anomaly
from thermal.case.plausibility.exchanged import exchanged_zones
from thermal.case.plausibility.heat_clock import heat_clock_errors
from thermal.case.plausibility.irradiance import clock_errors
from thermal.case.points import ZONE_TEMPERATURE

#: Share by which the mended case must predict left-out tuning days better, where the fault is likely only [-]. Of 34
#: trials on three measured buildings the seven clocks that were shifted and can be seen fall by 10 to 30 % on the
#: building with zones; the one clock that is wrong by nature by 8 %; on two days and on nothing else none.
LEAST = 0.05

#: How sure a fault is that telemetry shows, and where it is likely only that a fit confirms [-].
_PROBABILITY = {"certain": 0.99, "likely": 0.95}

#: Half of the distance between errors of the weather's clock that are looked for [h]; of heat's it is half a step.
_HALF_AN_ERROR = 0.25


class Errors(NamedTuple):
    """Mean absolute errors of a calibrated model: of left-out tuning days, and of held-out ones [K]."""

    left_out: float = float("nan")
    held_out: float = float("nan")


_UNKNOWN = Errors()


@dataclass(frozen=True)
class Fault:
    """A fault of the telemetry, and the case without it.

    Parameters
    ----------
    effect : str
        ``clock_shift`` or ``swapped_sensors``.
    zones : tuple of str
        Whose sensors are exchanged.
    moved : str
        What has to be moved in time: ``weather``, ``heat``, or nothing.
    hours : float
        By how much [h].
    seen : Anomaly
        What the telemetry shows.
    mended : Case
        The case without it.
    before, after : Errors
        Of the calibrated model with it and without.
    """

    effect: str
    zones: tuple[str, ...]
    moved: str
    hours: float
    seen: Anomaly
    mended: Case
    before: Errors = _UNKNOWN
    after: Errors = _UNKNOWN

    @property
    def probability(self) -> float:
        """That it is there [-]."""
        return _PROBABILITY[self.seen.certainty]

    @property
    def is_certain(self) -> bool:
        """Whether no model is needed to see it."""
        return self.seen.certainty == "certain"

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``faults`` in ``diagnosis.json``."""
        return {
            "effect": self.effect, "zones": list(self.zones), "moved": self.moved, "hours": self.hours,
            "what": self.seen.what,
            "advice": self.seen.advice, "left_out_mae_before": self.before.left_out,
            "left_out_mae_after": self.after.left_out,
        }  # fmt: skip

    def how_far(self, floor: float) -> dict[str, Any]:
        """Entry of ``how_far`` in ``diagnosis.json``.

        Parameters
        ----------
        floor : float
            Under the errors of the mended case as drawn [K]; another structure may have less.
        """
        before, after = self.before.held_out, self.after.held_out
        share = (before - after) / (before - min(floor, after)) if before > floor else None
        return {
            "effects": [self.effect], "held_out_mae_before": before, "held_out_mae_after": after,
            "floor": floor, "share_closed": share, "interval": None,
            "placebo": {"shuffled": None, "runner_up": None}, "on_bound": [],
        }  # fmt: skip


def suspected(case: Case) -> Iterator[Fault]:
    """Find faults that telemetry shows and that can be mended in it.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    """
    for seen in clock_errors(case):
        if seen.moved and seen.certainty in _PROBABILITY:
            yield Fault("clock_shift", (), "weather", seen.moved, seen, case.with_weather_moved(seen.moved))
    for seen in heat_clock_errors(case):
        yield Fault("clock_shift", (), "heat", seen.moved, seen, case.with_heat_moved(seen.moved))
    for seen in exchanged_zones(case):
        columns = [c for c in seen.columns if c.endswith(f"/{ZONE_TEMPERATURE}")]
        if len(columns) == 2 and seen.certainty in _PROBABILITY:
            yield Fault("swapped_sensors", _zones_of(case, columns), "", 0.0, seen, _exchanged(case, columns))


def mend(
    case: Case, tune: Sequence[Interval], hold_out: Sequence[Interval], settings: ModelSettings | Mapping[str, Any],
    progress: Progress | None = None,
) -> tuple[Fault, ...]:  # fmt: skip
    """Mend what the telemetry shows: what is certain, and what is likely where left-out days are predicted better.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out : sequence of Interval
        As in `calibrate`.
    settings : ModelSettings, or mapping of str to Any
        Of the calibrations; or these by name.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    tuple of Fault
        Each with the case that is mended of it and of those before; none in a large building, where calibrations take
        minutes: `buildingmpc check` says what the telemetry shows.
    """
    if is_large(case.building.zone_names):
        return ()
    whole, chosen = Forward(progress), calibration_settings(settings)
    found: list[Fault] = []
    drawn: FittedCase | None = None
    kept: FittedCase | None = None
    tried: set[tuple[str, tuple[str, ...], str]] = set()

    def fitted(of: Case, like: CalibrationSettings) -> FittedCase:
        fit = fit_case(of, tune, hold_out, like, whole.part(0.5))
        return replace(fit, left=left_out(fit.best, fit.tuned, chosen.spin_up_seconds))

    while True:
        of = found[-1].mended if found else case
        left = [f for f in suspected(of) if (f.effect, f.zones, f.moved) not in tried]
        fault = min(left, key=lambda f: not f.is_certain, default=None)  # what is certain first
        if fault is None:
            return tuple(found)
        tried.add((fault.effect, fault.zones, fault.moved))
        drawn = drawn or fitted(of, chosen)
        if fault.is_certain:
            kept = kept or _climbed(drawn, whole.part(0.5))
            without = fitted(fault.mended, kept.settings)
        else:
            mended = fitted(fault.mended, chosen)
            if not mended.left_out_mae < drawn.left_out_mae:  # most are none, and structures take ten times as long
                continue
            # a true fault can keep any structure from being better than the drawing: each telemetry has its own
            kept, without = kept or _climbed(drawn, whole.part(0.5)), _climbed(mended, whole.part(0.5))
            if not without.left_out_mae < (1.0 - LEAST) * kept.left_out_mae:
                continue
        found.append(replace(fault, before=_errors(kept), after=_errors(without)))
        drawn, kept = None, without


def _climbed(drawn: FittedCase, progress: Progress) -> FittedCase:
    """Fit a case in the structure that predicts left-out days best."""
    _, kept, left = climb_from("drawn", drawn.best, drawn, progress)
    return replace(drawn, left=left) if kept is None else kept


def _errors(fitted: FittedCase) -> Errors:
    """Errors of a fit."""
    model, settings = replace(fitted.model, theta=fitted.best.theta), EvaluationSettings(fitted.settings.horizon)
    return Errors(fitted.left_out_mae, model.evaluate(fitted.best.model, fitted.judged, settings).metrics.mae)


def with_faults(verdict: Verdict, faults: Sequence[Fault]) -> Verdict:
    """Put faults of the telemetry first in a verdict about the mended case.

    Parameters
    ----------
    verdict : Verdict
        From `judge`.
    faults : sequence of Fault
        From `mend`.
    """
    if not faults:
        return verdict
    first: dict[tuple[str, tuple[str, ...]], Candidate] = {}
    for f in faults:
        own = Candidate(f.effect, f.probability, float("inf"), (f.effect,), f.zones, _parameters(f), 1.0, f.seen.advice)
        if (known := first.get((f.effect, f.zones))) is not None:  # clocks of weather and of heat are one effect
            parameters, advice = {**known.parameters, **own.parameters}, f"{known.separate_by}; {own.separate_by}"
            own = replace(known, parameters=parameters, separate_by=advice)
        first[f.effect, f.zones] = own
    names = tuple(dict.fromkeys(f.effect for f in faults))
    rest = [c for c in verdict.candidates if c.effect not in names]
    return replace(
        verdict, name="named" if verdict.name == "no_gap" else verdict.name, candidates=(*first.values(), *rest),
        set90=(*names, *(e for e in verdict.set90 if e not in names)),
    )  # fmt: skip


def _parameters(fault: Fault) -> dict[str, Estimate]:
    if not fault.hours:
        return {}
    half = 0.5 * fault.mended.step / 3600.0 if fault.moved == "heat" else _HALF_AN_ERROR
    return {f"{fault.moved}_moved": Estimate(fault.hours, "h", (fault.hours - half, fault.hours + half))}


def _zones_of(case: Case, columns: Sequence[str]) -> tuple[str, ...]:
    names = {c.partition("/")[0] for c in columns}
    return tuple(z for z in case.building.zone_names if names & {z, *(d.name for d in case.building.devices_of(z))})


def _exchanged(case: Case, columns: list[str]) -> Case:
    frame = case.telemetry.frame.copy()
    frame[columns] = frame[columns[::-1]].to_numpy()
    return Case(case.building, replace(case.telemetry, frame=frame))
