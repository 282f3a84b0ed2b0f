"""What findings mean for who runs the building: a diagnosis, an experiment, a monitoring, and all of a demo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from calibration.diagnosis.diagnosis import Diagnosis
from calibration.evaluation.n_step import Evaluation
from calibration.experiment.design import Experiment
from calibration.experiment.outcome import Outcome
from calibration.monitoring.monitor import Monitoring
from mpc.reports.diagnosis_words import accepted, ahead, called, candidate, in_zones, rivals
from mpc.reports.means import Means, comfort_words
from mpc.reports.page import counted, kelvin, listed, percent, significant, sure
from thermal.effects.catalogue import CATALOGUE

if TYPE_CHECKING:
    from mpc.studies.run import Comparison

#: Probability below which a guess is not worth a measurement of its own [-].
_A_GUESS = 0.2


def diagnosis_means(result: Diagnosis) -> Means:
    """Say what a diagnosis means.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    found, name = accepted(result), result.verdict.name
    if result.faults:
        first = result.faults[0].seen
        answer = f"The measurements themselves are wrong: {first.what}."
        return Means(answer, "All that follows is about the data with that put right.", f"{_sentence(first.advice)}")
    if not found and name in ("named", "group"):  # a structure holds it
        best = result.verdict.candidates[0]
        answer = f"The plain model lacks {called(best.effect)}, at hours of its own in each zone."
        trust = f"It is {sure(best.probability)} sure. With it the model misses by {kelvin(result.gap)} degrees C "
        trust += f"{ahead(result)}, on days that it had not seen."
        use = "Use calibration.json, which has it, to predict and to control (buildingmpc compare)."
        return Means(answer, trust, use)
    if name == "no_gap":
        answer = "Nothing: the model explains this building as well as these data can show."
        trust = f"It misses by {kelvin(result.gap)} degrees C {ahead(result)}, on days that it had not seen. Small "
        trust += "effects may hide below what could be noticed (see the statistics)."
        return Means(answer, trust, "Use the model: buildingmpc compare shows what better control would save.")
    if name == "unexplained":
        best = result.verdict.candidates[0]
        answer = "Something is missing in the model, and none of the known causes explains it."
        least = result.floor if result.outdone is None else result.outdone
        trust = f"The gap is real ({kelvin(result.gap)} degrees C where {kelvin(least)} should be possible); "
        trust += f"its cause is not known. The best guess, {called(best.effect)}, has {sure(best.probability)}."
        advice = CATALOGUE[best.effect].separated_by if best.effect in CATALOGUE else ""
        then = "Measure before you change anything"
        if best.probability < _A_GUESS:
            then += ": what heats or cools the rooms that miss most, below, without a meter."
            return Means(answer, trust, then)
        return Means(answer, trust, f"{then}. Look at: {advice}." if advice else f"{then}.")
    effects = [(r.screened.effect, r.zones) for r in found]
    told = listed([f"{called(e, z)}" for e, z in effects])
    likely = rivals(result, effects[0][0])
    answer = f"The plain model lacks {told}."
    if len(likely) > 1:
        answer = f"The model lacks one of these, which look alike in the data: {listed(map(called, likely), 'or')}."
    chance = sure(candidate(result, effects[0][0]).probability)
    last = result.steps[-1] if result.steps else None
    trust = f"{'It' if len(found) == 1 else 'The first'} is {chance} sure."
    if last is not None and last.after < last.before:
        trust += f" On days that it had not seen, the model's error falls from {kelvin(last.before)} to "
        trust += f"{kelvin(last.after)} degrees C with it."
    elif last is not None:
        trust += " But on days that it had not seen the error does not fall, so do not rely on it yet."
    advice = CATALOGUE[effects[0][0]].separated_by if effects[0][0] in CATALOGUE else ""
    held = "a model that has" if result.better is None else "what predicts best with"
    use = f"Use calibration.json, {held} it, to predict and to control (buildingmpc compare)."
    return Means(answer, trust, f"{use} To be sure of the cause, look at: {advice}." if advice else use)


def experiment_means(found: Experiment, outcome: Outcome | None) -> Means:
    """Say what an experiment means.

    Parameters
    ----------
    found : Experiment
        From `design_experiment`.
    outcome : Outcome or None
        Where it was carried out.
    """
    names = listed([called(m.effect) for m in found.members], "or")
    if outcome is not None and outcome.named is not None:
        chance = percent(outcome.probability[outcome.named])
        return Means(f"It is {called(outcome.named)}.", f"{chance} sure, from the days of the experiment alone.",
                     "The diagnosis beside it goes on from there.")  # fmt: skip
    if outcome is not None:
        then = f"Measure instead: {'; or '.join(found.instead)}." if found.instead else "Measure more."
        return Means(f"It was carried out and does not say whether it is {names}.", "The evidence is too weak.", then)
    if found.verdict == "hopeless":
        trust = f"Of {found.tried} plans the best would tell with a chance of {percent(found.chance)}, reckoned with a "
        trust += "model of each cause. Longer plans were not tried, nor any with more discomfort."
        then = f"Measure instead: {'; or '.join(found.instead)}. Or allow more: --hours, --discomfort."
        return Means(f"No change of setpoints that was tried would tell whether it is {names}.", trust, then)
    worst = float(found.best.discomfort.max())
    answer = f"{found.schedule.hours:.3g} hours of planned setpoints can tell whether it is {names}."
    trust = f"The chance that it does is {percent(found.chance)}; running as usual has {percent(found.usual_chance)}. "
    trust += "It is reckoned with the model, not tried."
    then = f"Follow the list below. It costs about {significant(found.best.cost, 2)} in heat and cold, and no zone "
    return Means(answer, trust, then + f"leaves its comfort by more than {kelvin(worst)} K h beyond usual.")


def monitoring_means(found: Monitoring) -> Means:
    """Say what a monitoring means.

    Parameters
    ----------
    found : Monitoring
        From `monitor`.
    """
    lasting = [e for e in found.events if e.end is None]
    watched = counted(int(found.is_watched.sum()), "day")
    trust = f"{watched} were watched against the first {found.settings.reference_days}, which are taken for sound."
    if found.course.withdrawn:
        trust += f" {counted(len(found.course.withdrawn), 'alarm')} proved to be a few unusual days."
    if found.course.waiting is not None:
        trust += f" An alarm of {found.date(found.course.waiting):%Y-%m-%d} is not decided yet."
    if not found.events:
        return Means("The building behaves as it did.", trust, "Nothing to do; run it again in a week.")
    shown = lasting[-1] if lasting else found.events[-1]
    date = found.date(shown.since)
    since = f"{date.day} {date:%B %Y}"
    over = "" if lasting else " It is over by now."
    answer = f"The building has changed since {since}: {called(shown.effect)}, {in_zones(shown.zones)}.{over}"
    trust += f" That it is this cause is {sure(shown.probability)} sure."
    advice = CATALOGUE[shown.effect].separated_by if shown.effect in CATALOGUE else ""
    then = "Ask what was done there at that time."
    then += " If it stays, calibrate again on days since then." if lasting else ""
    then += f" To be sure of the cause, look at: {advice}." if advice else ""
    return Means(answer, trust, then)


def demo_means(errors: Mapping[str, Evaluation], effects: Sequence[str], comparison: Comparison) -> Means:
    """Say what the whole of a demo means.

    Parameters
    ----------
    errors : mapping of str to Evaluation
        On held-out days by name of the model, before calibration first, with all that was found last.
    effects : sequence of str
        That the diagnosis put into the model.
    comparison : Comparison
        Of controllers.
    """
    first, last = (list(errors.values())[k].metrics.mae for k in (0, -1))
    answer = f"The model of this building now predicts rooms six hours ahead to {kelvin(last)} degrees C, where the "
    answer += f"drawing alone gave {kelvin(first)}."
    if effects:
        answer += f" What the drawing lacked: {listed(map(called, effects))}."
    mpc, best = comparison.of("mpc"), comparison.best_rule
    if mpc is not None and best is not None and best.cost > 0.0:
        answer += f" Control that looks ahead cost {percent(1.0 - mpc.cost / best.cost)} less on one day. "
        answer += comfort_words(mpc)
    trust = "Errors are those of days that the model had not seen. Costs are of one simulated day, with the prices and "
    trust += "comfort below: they show how it works, not what a year saves."
    then = "Try it on a building of your own: buildingmpc label makes a case from plans and a list of devices."
    return Means(answer, trust, then)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}." if text else ""
