"""A diagnosis in plain words: the verdict, effects and where they are, and what would tell them apart."""

from collections.abc import Sequence

import numpy as np

from calibration.diagnosis.decide.levels import LARGEST_GROUP
from calibration.diagnosis.decide.verdict import Candidate, group_of
from calibration.diagnosis.decide.where import Where
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.refit.refit import Refit
from calibration.diagnosis.screen.seen import WINDOWS
from mpc.reports.correction_words import correction_sentence, faults_sentence
from mpc.reports.evaluation import beside_sentence, carried_sentence, structure_words
from mpc.reports.free_words import comes_back, free_sentence, known_effects
from mpc.reports.page import duration, estimated_sentences, kelvin, listed, percent, significant, sure, watts
from thermal.effects.catalogue import CATALOGUE, effect_of, is_effect
from thermal.effects.gains import SWITCHED_HEAT
from thermal.inputs.provider import IRRADIANCE
from thermal.network.structure import MAY_DIFFER

#: What an effect is called where its title would read oddly after "leaves out".
_CALLED = {"hidden_mass": "mass that stores heat"}

#: What parameters that zones have of their own belong to, by the beginnings of their names.
_OWN = {"slab": "slabs", "furniture": "furniture", "exterior_wall": "outer walls", "window": "windows"}

#: Probability from which an effect is said to be left out, rather than perhaps [-].
_LIKELY = 0.5

#: Probability from which another effect of a group is worth telling from the likeliest [-].
_RIVAL = 0.05

#: More zones than this are counted, not named.
_MOST_NAMED = 4


def diagnosis_verdict(result: Diagnosis) -> str:
    """Say in plain words what a diagnosis found.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    text = faults_sentence(result) + free_sentence(result) + _verdict(result)
    if result.outdone is not None:
        text += (
            " A regression on the same telemetry, which knows nothing of buildings, misses the same days by "
            f"{kelvin(result.outdone)} K only: something is missing beyond what was found."
        )
    if known := known_effects(result):
        text += f" {listed([called(e) for e in known]).capitalize()}, known to be there, is part of the baseline."
    if "solar_gain" in result.final.effects and any(IRRADIANCE in c.reason for c in result.verdict.candidates):
        text += (
            " No irradiance is measured: how bright a day was is estimated from the range of the outdoor temperature, "
            "so that the sun's size is rough."
        )
    if turned := result.settings.structure.turned:
        side = "clockwise" if turned > 0.0 else "counterclockwise"
        text += (
            f" The sun comes as if the building stood {abs(turned):.0f}° {side} of how it is drawn: check where north "
            "is (`orientation`, `azimuth`)."
        )
    if result.settings.structure.light_contents:
        times = significant(result.final.values["air_capacity_multiplier"])
        text += (
            f" Rooms hold {times} times the heat that their air does, by light things that follow it within minutes; "
            "sensors that lag would look alike."
        )
    for effect in result.settings.structure.uneven:
        shares = [v for n, v in result.final.values.items() if n.startswith(f"{MAY_DIFFER[effect]}@")]
        if shares:
            low, high = (significant(end) for end in (min(shares), max(shares)))
            text += (
                f" Rooms differ in {called(effect)}: they have {low} to {high} times what is usual in this building "
                f"({MAY_DIFFER[effect]} in calibration.json)."
            )
    if zoned := [name for name, scope in result.settings.scopes.items() if scope == "zone"]:
        what = [words for part, words in _OWN.items() if any(name.startswith(part) for name in zoned)]
        text += (
            f" {listed(what or zoned).capitalize()} have values of each zone's own here: they explain what looked like "
            "another effect while all zones shared one."
        )
    if result.better is not None and not result.drawing_fails:
        own, beside = next(r.left_out_mae for r in result.rungs if r.chosen), result.rungs[0].left_out_mae
        text += (
            f" For prediction and control take the building {structure_words(result.rungs)}, which calibration.json "
            "holds: it misses tuning days that "
            f"were left out by {kelvin(own)} K, this one by {kelvin(beside)} K; and held-out days by "
            f"{kelvin(result.predicts)} K."
        )
    text += carried_sentence(result.prediction.carried)
    if result.prediction.yardsticks is not None:
        text += f" {beside_sentence(result.predicts, result.prediction.yardsticks)}"
    return " ".join([text, *estimated_sentences(result.estimated)])


def _verdict(result: Diagnosis) -> str:
    """Say which effect is missing, and how far the error falls with it."""
    if result.verdict.name == "unexplained":
        return _unexplained(result) + correction_sentence(result)
    if result.verdict.name == "no_gap" or not accepted(result):  # a fault of the telemetry may be named
        return _no_gap(result)
    found = accepted(result)
    if result.verdict.name == "group":
        first, *others = found
        text = _either(result, first)
        if others:
            text += f" {_named(result, others, 'Besides, it leaves out', 'Perhaps it also leaves out')}"
    else:
        text = _named(result, found, "The model leaves out", "Most likely the model leaves out")
    return f"{text} {_how_far(result, len(found))}"


def accepted(result: Diagnosis) -> list[Refit]:
    """Effects that the rounds accepted, in order.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    return [r.accepted for r in result.rounds if r.accepted is not None]


def rivals(result: Diagnosis, effect: str) -> tuple[str, ...]:
    """Effects that could be there in place of an accepted one, itself first.

    As `alike`, but for what is unlikely, or was accepted as well.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    effect : str
        Its id.
    """
    inside = {r.screened.effect for r in accepted(result)}
    others = (e for e in alike(result, effect) if e not in inside and candidate(result, e).probability >= _RIVAL)
    return (effect, *others)


def candidate(result: Diagnosis, effect: str) -> Candidate:
    """Candidate of an id.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    effect : str
        Its id.
    """
    return next(s for s in result.verdict.candidates if s.effect == effect)


def alike(result: Diagnosis, effect: str) -> tuple[str, ...]:
    """Effects that the data cannot tell from an accepted one, itself first; or what its candidate says of another.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    effect : str
        Its id.
    """
    for r in result.rounds:
        if r.accepted is not None and r.accepted.screened.effect == effect:
            return group_of(r, effect)
    return candidate(result, effect).group


def called(effect: str, zones: Sequence[str] = ()) -> str:
    """Call an effect by what it is, and where.

    Parameters
    ----------
    effect : str
        Its id.
    zones : sequence of str
        Where; none is the whole building.

    Examples
    --------
    >>> called("sensor_bias", ["F1_N"]), called("an_effect_of_ones_own")
    ('a zone sensor that reads wrong, in zone F1_N', 'an effect of ones own')
    """
    title = effect_of(effect).title if is_effect(effect) else ""
    name = _CALLED.get(effect, title) or effect.replace("_", " ")
    return f"{name}, {in_zones(zones)}" if zones else name


def in_zones(zones: Sequence[str]) -> str:
    """Say where an effect is.

    Parameters
    ----------
    zones : sequence of str
        Zones; none is the whole building.

    Examples
    --------
    >>> in_zones([]), in_zones(["A", "B"]), in_zones(list("ABCDE"))
    ('the whole building', 'in zones A and B', 'in 5 zones')
    """
    if not zones:
        return "the whole building"
    if len(zones) > _MOST_NAMED:
        return f"in {len(zones)} zones"
    return f"in zone{'s' if len(zones) > 1 else ''} {listed(zones)}"


def final_name(result: Diagnosis) -> str:
    """Call the final model beside the baseline; nothing where it has no effect.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    count = len(accepted(result))
    return f"with the effect{'s' if count > 1 else ''} found" if count else ""


def ahead(result: Diagnosis) -> str:
    """Spell how far ahead predictions are judged, such as ``6 hours ahead``.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    problem = result.rounds[0].before.problem
    return f"{duration(problem.steps * problem.inputs.step)} ahead"


def _named(result: Diagnosis, found: Sequence[Refit], begin: str, doubt: str) -> str:
    """Name effects: those more likely there than not, and what may be there besides."""
    likely = [r for r in found if candidate(result, r.screened.effect).probability >= _LIKELY]
    rest = [r for r in found if r not in likely]
    if not likely:
        begin, likely, rest = doubt, rest[:1], rest[1:]
    text = f"{begin} {listed([_found(result, r) for r in likely])}"
    return text + (f", and perhaps {listed([_found(result, r) for r in rest])}." if rest else ".")


def _either(result: Diagnosis, first: Refit) -> str:
    """Say what is left out where other effects look alike: a choice only where another is likely enough."""
    effect = first.screened.effect
    likely = rivals(result, effect)
    if len(likely) > 1:
        named = listed([f"{called(e)} ({sure(candidate(result, e).probability)})" for e in likely], "or")
        either = "either " if len(likely) == 2 else ""
        told = CATALOGUE[effect].separated_by
        text = f"The model leaves out {either}{named}: these data cannot tell them apart."
        return f"{text} What would: {told}." if told else text
    inside = {r.screened.effect for r in accepted(result)}
    rest = [candidate(result, e) for e in alike(result, effect) if e not in inside]
    others = [f"{called(s.effect)} ({sure(s.probability)})" for s in rest]
    text = _named(result, [first], "The model leaves out", "Most likely the model leaves out")
    if not others:
        return text
    are = "is" if len(others) == 1 else "are"
    return f"{text} In these data {listed(others)} would look much the same, but {are} far less likely."


def _found(result: Diagnosis, fitted: Refit) -> str:
    effect = fitted.screened.effect
    return f"{called(effect, fitted.zones)} ({sure(candidate(result, effect).probability)} sure)"


def _how_far(result: Diagnosis, found: int) -> str:
    """Say what the error becomes; a share of the gap only where there is one."""
    if not result.steps:
        return ""
    step = result.steps[-1]
    them = "With it" if found == 1 else "With them"
    if result.verdict.name == "group" and len(rivals(result, accepted(result)[0].screened.effect)) > 1:
        them = "With the likeliest" + (" and the others" if found > 1 else "")
    there = f"{them} in the model, its error {ahead(result)}, on days that it was not fitted to,"
    on = any(value > 0.0 for name, value in result.final.values.items() if name.partition("@")[0] == SWITCHED_HEAT)
    if seen := [*["windows open"] * (WINDOWS in step.effects), *["equipment on"] * on]:
        there = f"{there[:-1]} with {' and '.join(seen)} when the temperatures of these days show it,"
        there += " which no forecast knows,"
    if step.after >= step.before:
        return (
            f"{there} does not fall: {kelvin(step.before)} K before, {kelvin(step.after)} K after. What the tuning "
            "days say does not carry over, so do not rely on it yet."
        )
    text = f"{there} falls from {kelvin(step.before)} to {kelvin(step.after)} K"
    if step.share_closed is None:
        return f"{text}; the gap is too small beside its own scatter to state a share of it."
    return f"{text}, {percent(min(1.0, step.share_closed))} of what could be closed."


def _no_gap(result: Diagnosis) -> str:
    begin = "Beyond that, these" if result.verdict.name == "named" else "These"
    text = (
        f"{begin} data show nothing that the model leaves out. {ahead(result).capitalize()}, on days that it was not "
        f"fitted to, the calibrated model misses the measured zone temperatures by {kelvin(result.gap)} K on average."
    )
    if found := accepted(result):
        names = listed([called(r.screened.effect, r.zones) for r in found])
        text += f" A trace of {names} explains too little of the error to be named."
    text += comes_back(result)
    sizes = [w for w in result.detectable.values() if np.isfinite(w)]
    if not sizes:
        return text
    between = watts(min(sizes)) + (f" to {watts(max(sizes))}" if len(sizes) > 1 else "")
    return f"{text} Steady heat that is missing in one zone would have been noticed from {between} on, by zone."


def _unexplained(result: Diagnosis) -> str:
    found = accepted(result)
    error = (
        f"{ahead(result).capitalize()} it misses the measured zone temperatures by {kelvin(result.gap)} K on average"
    )
    best = result.verdict.candidates[0]
    if found:
        group = alike(result, found[0].screened.effect)
        if len(group) > LARGEST_GROUP:
            names = listed([called(e) for e in group[:LARGEST_GROUP]])
            return (
                f"The model leaves something out, but these data cannot tell what: {len(group)} effects explain it "
                f"about equally well, among them {names}. {error}."
            )
        part = f"{listed([called(r.screened.effect) for r in found])} would be a part of it, and not enough"
        how_far = _how_far(result, len(found)) + comes_back(result)
        return f"The model leaves something out that no effect we know of explains: {part}. {how_far}"
    text = f"The model leaves something out that no effect we know of explains. {error}"
    if result.left_over is not None:
        text += f".{comes_back(result)}".rstrip(".")
    elif result.floor < result.gap:
        text += f", and {kelvin(result.gap - result.floor)} K of it follow time of day, zone or outdoor temperature"
    return f"{text}. The best single guess is {called(best.effect)} ({sure(best.probability)}): not enough to name it."


def where_sentence(where: Where) -> str:
    """Name the part that holds more of the squared error than any other beyond its share of the predictions.

    Parameters
    ----------
    where : Where
        From `diagnose`.
    """
    if where.most is None:
        return "The error is spread evenly over zones, hours and weather."
    place, moment, share, predictions = where.most
    when = moment if not moment or moment.startswith(("with", "in")) else f"when {moment}"
    spoken = " ".join(filter(None, (f"in {place}" if place else "", when)))
    return f"{percent(share)} of the squared error is {spoken}, which has {percent(predictions)} of the predictions."


def part(name: str) -> str:
    """Name a part of the building or of the time as a place or a moment.

    Parameters
    ----------
    name : str
        Such as ``the core``, ``floor 2``, ``heating`` or ``in sun hours``.
    """
    return {"the": "in ", "flo": "on ", "in ": "", "wit": ""}.get(name[:3], "when ") + name


def alternating_sentence(result: Diagnosis) -> str:
    """Say why tuning and held-out days alternate; nothing where they do not.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    if result.last_third is None:
        return ""
    return (
        "The telemetry's last third shows other weather or use than the days before it: a baseline tuned on these "
        f"misses it by {kelvin(result.last_third)} K. So tuning and held-out days alternate."
    )
