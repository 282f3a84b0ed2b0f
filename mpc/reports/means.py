"""What a page means for who runs the building: the answer, whether to trust it, what to do next, in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from calibration.evaluation.n_step import Evaluation
from calibration.fit.result import CalibrationResult, ParameterEstimate
from mpc.reports.page import counted, duration, kelvin, listed, percent, significant
from thermal.case.check import CaseCheck

if TYPE_CHECKING:  # closed loops take longer to import than all the rest of a report
    from mpc.studies.run import Comparison, ControlRun

#: Discomfort that nobody notices [K h]: a room a fifth of a degree off for quarter of an hour.
NOTICED = 0.05

#: Hours of a run below which savings are those of a day and not of a year [h].
_SHORT = 24.0 * 14

#: Days of telemetry from which a calibration has seen some weather [days]: as the tutorials advise.
_FEW_DAYS = 7.0


class Means(NamedTuple):
    """Three answers at the top of a page.

    Parameters
    ----------
    answer : str
        What was found.
    trust : str
        How far it holds, and why.
    next : str
        What to do.
    """

    answer: str
    trust: str
    next: str


def check_means(check: CaseCheck) -> Means:
    """Say what a check means.

    Parameters
    ----------
    check : CaseCheck
        Of a case.
    """
    errors = [a for a in check.anomalies if a.severity == "error"]
    columns = check.quality.columns
    usable = 1.0 - sum(c.unusable_share for c in columns) / max(1, len(columns))
    days = ((check.end - check.start).total_seconds() + check.step) / 86400.0
    blind = sum(not zone.measured_by for zone in check.zones)
    if errors:
        answer = f"Not yet: {counted(len(errors), 'thing')} in this data set cannot be true, and a model made with it "
        answer += "would be wrong."
    else:
        answer = "Yes, this data set can be used to model the building"
        answer += f", with {counted(len(check.anomalies), 'point')} to look at." if check.anomalies else "."
    trust = f"{percent(usable)} of all readings are usable, over {days:.3g} days."
    if blind:
        trust += f" {blind} of {counted(len(check.zones), 'zone')} have no "
        trust += "temperature sensor: nothing checks the model there."
    if not any("irradiance" in point.point for point in check.points):
        trust += " The sun is not measured: what it does can only be estimated."
    if days < _FEW_DAYS:
        trust += " That is little: a week or more of varied weather makes a model that can be relied on."
    first = [*errors, *check.anomalies]
    advice = f"{first[0].advice[:1].upper()}{first[0].advice[1:]}." if first else ""
    further = "Then run the check again." if errors else "Next step: fit a model, buildingmpc calibrate."
    return Means(answer, trust, f"{advice} {further}".strip())


def prediction_means(evaluation: Evaluation, unchanged: float, what: str = "The model") -> Means:
    """Say what the error of a model means.

    Parameters
    ----------
    evaluation : Evaluation
        With its runs.
    unchanged : float
        Error of assuming that nothing changes, on the same runs [K].
    what : str
        Is judged.
    """
    mae, ahead = evaluation.metrics.mae, duration(evaluation.steps * evaluation.step_seconds)
    answer = f"{what} predicts room temperatures {ahead} ahead to within about {kelvin(mae)} degrees C on average."
    beside = evaluation.yardsticks
    runs = sum(len(p.start) for p in evaluation.predictions)
    if beside is not None and not beside.useful(mae):
        better = min(error for error in beside.made.values())
        trust = f"Not yet: a simple forecast that needs no building model does as well or better ({kelvin(better)} "
        trust += "degrees C)."
        then = "Do not base decisions on it yet. Give it more days with heating that varies, and the sun where "
        return Means(answer, trust, then + "it is measured; then calibrate again.")
    ratio = unchanged / mae if mae > 0.0 else 1.0
    if ratio > 1.0:
        trust = f"It was tried {runs} times. Saying that nothing changes would be off by {kelvin(unchanged)} "
        trust += f"degrees C, {ratio:.1f} times as much."
    else:
        trust = f"No: in {runs} trials, saying that nothing changes is closer ({kelvin(unchanged)} degrees C)."
    if beside is not None:
        trust += " It also beats the simple forecasts that anyone can make in an hour."
    then = "See below which rooms are predicted worst, and check their sensors first."
    return Means(answer, trust, then)


def determined_words(estimated: Sequence[ParameterEstimate]) -> str:
    """Say what it means how many parameters the data determine.

    Parameters
    ----------
    estimated : sequence of ParameterEstimate
        Those that were estimated.
    """
    told, count = sum(p.identifiable for p in estimated), len(estimated)
    if not count:
        return ""
    if told == count:
        return f"These data fix all {count} building properties, so their values may be quoted with their intervals."
    begin = f"These data fix none of the {count} building properties one by one" if not told else (
        f"These data fix {told} of {count} building properties one by one")  # fmt: skip
    rest = "their values" if not told else "the other values"
    return f"{begin}: several combinations predict equally well. Use the model to predict, but do not quote {rest}."


def calibration_means(result: CalibrationResult, unchanged: float) -> Means:
    """Say what a calibration means.

    Parameters
    ----------
    result : CalibrationResult
        Of a case.
    unchanged : float
        Held-out error of assuming that nothing changes [K].
    """
    held_out, before = result.calibrated["held_out"], result.uncalibrated["held_out"].metrics.mae
    found = prediction_means(held_out, unchanged, "The fitted model")
    mae = held_out.metrics.mae
    answer = found.answer + (f" Before the fit it was {kelvin(before)}." if mae < before else
                             " The fit did not improve on the drawing.")  # fmt: skip
    trust = f"Judged on days that it had not seen. {found.trust} "
    trust += determined_words([p for p in result.parameters if p.standard_error is not None])
    if not result.solver.success:
        return Means(answer, f"No: the solver stopped early ({result.solver.status}).",
                     "Run it again with more starts (--starts 6), or look at the data: buildingmpc check.")  # fmt: skip
    useful = held_out.yardsticks is None or held_out.yardsticks.useful(mae)
    then = "Next step: buildingmpc diagnose, which looks for what the model still lacks"
    if not useful:
        advice = "Do not base decisions on it yet: the drawing does not say all that acts on the building. "
        then = f"{advice}{then}, such as the sun, leaks or people. Where it finds nothing, give it more days with "
        then += "heating that varies"
    return Means(answer, trust.strip(), f"{then}.")


def simulation_means(summary: Mapping[str, float]) -> Means:
    """Say what a replay means.

    Parameters
    ----------
    summary : mapping of str to float
        Of `mpc.reports.case.simulation_summary` [units of its keys].
    """
    length = duration(summary["steps"] * summary["step_seconds"])
    answer = f"Left alone for {length}, the model is {kelvin(summary['mae'])} degrees C off the sensors on average."
    lean = "warm" if summary["bias"] > 0 else "cold"
    size = abs(summary["bias"]) / max(summary["mae"], 1e-9)
    trust = f"Most of that is one way: the model is too {lean}, as when heat is missing or metered wrongly." if (
        size > 0.7) else "It errs in both directions, which a fit or better inputs may improve."  # fmt: skip
    return Means(answer, trust, "To judge predictions: buildingmpc evaluate; to improve them: buildingmpc calibrate.")


def control_means(run: ControlRun) -> Means:
    """Say what a run in closed loop means.

    Parameters
    ----------
    run : ControlRun
        Of a study.
    """
    k, title = run.kpis, run.entry.title.capitalize()
    answer = f"{title} ran the simulated building for {duration(3600.0 * k.hours)} at an energy cost of "
    answer += f"{run.cost:,.2f} {k.currency}. {comfort_words(run)}"
    trust = _simulated(run.kpis.hours)
    planned = run.sources.get("optimal plan", 0)
    if run.decisions and planned < len(run.decisions):
        trust += f" In {len(run.decisions) - planned} of {len(run.decisions)} decisions it had to fall back on rules."
    return Means(answer, trust, "Compare it with today's control on the same days: buildingmpc compare.")


def comparison_means(comparison: Comparison) -> Means:
    """Say what a comparison of controllers means.

    Parameters
    ----------
    comparison : Comparison
        Of a study.
    """
    best, mpc = comparison.best_rule, comparison.of("mpc")
    hours = comparison.runs[0].kpis.hours
    if best is None or mpc is None:
        cheapest = min(comparison.runs, key=lambda run: run.objective)
        answer = f"{cheapest.entry.title.capitalize()} costs least: {cheapest.cost:,.2f} {cheapest.kpis.currency}. "
        return Means(answer + comfort_words(cheapest), _simulated(hours), _NEXT)
    saved = 1.0 - mpc.cost / best.cost if best.cost > 0.0 else 0.0
    answer = f"Control that looks ahead spends {percent(abs(saved))} {'less' if saved >= 0 else 'more'} on energy than "
    answer += f"the best fixed rules ({mpc.cost:,.2f} against {best.cost:,.2f} {mpc.kpis.currency}). "
    answer += comfort_words(mpc)
    if comfort_words(best) != comfort_words(mpc):
        answer += f" With the rules, by contrast: {comfort_words(best)}"
        counted = comparison.saving(mpc)
        if counted is not None:
            answer += f" Counting discomfort, it is {percent(abs(counted))} {'better' if counted >= 0 else 'worse'}."
    return Means(answer, _simulated(hours), _NEXT)


_NEXT = (
    "Check the assumptions below (prices, hours, comfort) against your own, and repeat with at least two weeks of each "
    "season."
)


def _simulated(hours: float) -> str:
    text = "As far as the assumptions below fit your building: it is simulated, nothing was tried on the real one."
    if hours < _SHORT:
        text += f" A run of {duration(3600.0 * hours)} says little about a year."
    return text


def comfort_words(run: ControlRun) -> str:
    """Say how comfortable the rooms were.

    Parameters
    ----------
    run : ControlRun
        Of a study.
    """
    worst = max(run.kpis.zones, key=lambda z: z.below + z.above)
    if worst.below + worst.above < NOTICED:
        return "No room was noticeably too cold or too warm."
    outside = [z.zone for z in run.kpis.zones if z.below + z.above >= NOTICED]
    rooms = listed(outside) if len(outside) <= 3 else f"{len(outside)} of {len(run.kpis.zones)} rooms"
    cold = worst.below >= worst.above
    which = "it" if len(outside) == 1 else f"the worst, {worst.zone},"
    size = significant(worst.largest_below if cold else worst.largest_above, 2)
    return f"{rooms} left the comfort band; {which} was too {'cold' if cold else 'warm'} by up to {size} degrees C."
