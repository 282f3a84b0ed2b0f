"""What the data determine and prefer, in words: on the estimation scale these are products, ratios, odds."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from calibration.fit.cross_validation import CrossValidation
from calibration.fit.selection import LEAST_DAYS, HeldOutDifference, LikelihoodRatio, Reason, Selection
from calibration.identifiability.information import Combination, Information, ParameterInformation
from calibration.identifiability.power import ParameterPower, Power
from calibration.identifiability.profile import Profile
from mpc.reports.page import counted, in_words, listed, unit
from thermal.parameters import Parameter

#: Relative deviations up to this one are told in per cent, larger ones as a factor [-].
MOST_PER_CENT = 0.5

#: Members of one group that are named one by one; of more, how many there are and the ends of what they have.
MOST_NAMED = 3

#: End of the names of nominal values, and of the parameters with which they enter as a product.
_DENSITY, _CAPACITY = "_density", "_heat_capacity"


def _precision_words(parameter: Parameter | None, deviation: float) -> str:
    """Say a standard deviation of a logarithm.

    Parameters
    ----------
    parameter : Parameter or None
        Whose it is; for a probability it is that of its odds.
    deviation : float
        On the estimation scale [-].
    """
    size = f"{100 * deviation:.2g} %" if deviation < MOST_PER_CENT else f"a factor of {np.exp(deviation):.2g}"
    return f"its odds to {size}" if parameter is not None and parameter.scale == "logit" else f"to {size}"


def combination_words(parameters: Mapping[str, Parameter], exponents: Mapping[str, float]) -> str:
    """Name a product of powers: a product, a ratio, or a combination.

    Parameters
    ----------
    parameters : mapping of str to Parameter
        By name.
    exponents : mapping of str to float
        By name, not zero; those of a probability are on its odds [-].

    Examples
    --------
    >>> from thermal.parameters import PARAMETERS
    >>> combination_words(PARAMETERS, {"slab_heat_capacity": 1.0, "slab_coupling": -1.0})
    'ratio slab heat capacity / slab coupling'
    """
    names = {
        name: ("odds of the " if parameters[name].scale == "logit" else "") + in_words(parameters[name].name)
        for name in exponents
    }
    if any(abs(abs(e) - 1.0) > 1e-9 for e in exponents.values()):
        powers = (names[n] if e == 1.0 else f"({names[n]})^{e:.2g}" for n, e in exponents.items())
        return f"combination {' × '.join(powers)}"
    above, below = ([names[n] for n, e in exponents.items() if e * sign > 0] for sign in (1.0, -1.0))
    if not below:
        return f"product {' × '.join(above)}"
    kind = "ratio" if len(exponents) == 2 else "combination"
    under = below[0] if len(below) == 1 else f"({' × '.join(below)})"
    return f"{kind} {' × '.join(above) or '1'} / {under}"


def information_sentences(information: Information) -> tuple[str, ...]:
    """Say what the data determine.

    Parameters
    ----------
    information : Information
        From `fisher_information`, or of a result.
    """
    known, found = information.parameters, information.combinations
    named = {p.name: p for p in information.estimated}
    told = {k.name: k for k in known if k.status == "determined"}
    sentences = [_summary(len(told), len(known), len(found))]
    if told:
        each = _gathered([(named[n], k.posterior_deviation) for n, k in told.items()], _precision_words)
        sentences.append(f"Determined: {', '.join(each)}.")
    sentences += [_combination(named, set(told), c) for c in found]
    members = {name for c in found for name in c.exponents}
    sentences += _open(named, [k for k in known if k.name not in members | set(told)])
    sentences += [_nominal(named, set(told), name, *value) for name, value in information.nominal.items()]
    sentences += [
        f"The errors of {in_words(named[a].name)} and {in_words(named[b].name)} go together: correlation {r:.2f}."
        for a, b, r in information.correlations
    ]
    return tuple(sentences)


def information_content(information: Information) -> dict[str, Any]:
    """Entry of ``calibration.json``: the numbers with what they say.

    Parameters
    ----------
    information : Information
        Of a result.
    """
    named, content = {p.name: p for p in information.estimated}, information.to_dict()
    for entry in content["combinations"]:
        entry["words"] = combination_words(named, entry["exponents"])
    return content | {"sentences": list(information_sentences(information))}


def power_sentences(power: Power) -> tuple[str, ...]:
    """Say what data will tell, one sentence a parameter, then what they determine at the start.

    Parameters
    ----------
    power : Power
        From `power_of_data`.
    """
    named = {p.name: p for p in power.information.estimated}
    each = (_power_sentence(named[p.name], p, power.draws > 0) for p in power.parameters)
    return (*each, *information_sentences(power.information))


def _power_sentence(parameter: Parameter, power: ParameterPower, drawn: bool) -> str:
    first, least, most = (f"{100 * r:.0f} %" for r in (power.ratio, power.least, power.most))
    span = f" ({least} to {most} over the prior)" if drawn and least != most else ""
    verb = {"yes": "will tell", "perhaps": "may tell", "no": "will not tell"}[power.told]
    return f"These data {verb} the {in_words(parameter.name)}: {first} of the prior's deviation will be left{span}."


def profile_sentence(profile: Profile) -> str:
    """Say the first interval of a profile.

    Parameters
    ----------
    profile : Profile
        From `profile_likelihood`.
    """
    name, interval = in_words(profile.parameter.name), profile.intervals[0]
    of = "" if profile.parameter.unit == "1" else f" {profile.parameter.unit}"
    lower, upper = f"{interval.lower:.3g}{of}", f"{interval.upper:.3g}{of}"
    source = "data and prior" if profile.with_prior else "the data alone"
    sure = f"with {100 * interval.level:g} % confidence by {source}"
    name = name[0].upper() + name[1:]
    if interval.open_lower and interval.open_upper:
        return f"{name}: nothing between {lower} and {upper}, its physical range, is excluded {sure}."
    if interval.open_lower:
        return f"{name}: at most {upper} {sure}; no lower limit within its physical range."
    if interval.open_upper:
        return f"{name}: at least {lower} {sure}; no upper limit within its physical range."
    return f"{name}: {interval.lower:.3g} to {upper} {sure}."


def selection_verdict(selection: Selection) -> str:
    """Say which structure the data prefer, and why.

    Parameters
    ----------
    selection : Selection
        From `select_structure`.
    """
    days = selection.differences[0].days
    left = [c for c in selection.candidates if c.name not in selection.against]
    if len(left) == 1:
        sentences = [f"The structure {left[0].name} is preferred."]
    else:
        few = ", which is too few," if days < LEAST_DAYS else ""
        simplest = min(left, key=lambda c: c.parameters)
        sentences = [
            f"Cannot tell {listed(c.name for c in left)} apart, by {counted(days, 'day')} held out{few} or by the "
            f"tuning data: the simplest of them, {simplest.name}, is enough."
        ]
    sentences += [f"Against {n} speak {_reason_words(selection, n, r)}." for n, r in selection.against.items()]
    size = selection.effective_size
    return " ".join([*sentences, f"({days} days held out, {size:.0f} effective observations tuned on.)"])


def _reason_words(selection: Selection, name: str, reason: Reason) -> str:
    if isinstance(reason, HeldOutDifference):
        span = f"({reason.lower:.3f} to {reason.upper:.3f} K)"
        return f"the days held out, by {reason.mae:.3f} K more than {reason.second} {span}"
    if isinstance(reason, LikelihoodRatio):
        return (
            f"the tuning data, by a likelihood ratio of {reason.statistic:.1f} for the {reason.degrees} more "
            f"parameters of {reason.large} (p = {reason.p_value:.2g})"
        )
    evidence = {c.name: c.log_evidence(selection.effective_size) for c in selection.candidates}
    return f"the tuning data, by a log evidence {evidence[reason] - evidence[name]:.1f} below that of {reason}"


def cross_validation_sentences(found: CrossValidation) -> tuple[str, ...]:
    """Say how large errors on days left out are, and which parameters move with the days.

    Parameters
    ----------
    found : CrossValidation
        From `cross_validate`.
    """
    folds, failed = len(found.folds), sum(fold.failure is not None for fold in found.folds)
    sentences = [
        f"On days that it was not calibrated on the model misses by {found.mae:.3f} K, give or take "
        f"{found.standard_error:.3f} K ({folds - failed} folds)."
    ]
    if failed:
        sentences.append(f"{failed} of {folds} folds failed and are not in these numbers.")
    moving = [p.name.replace("_", " ") for p in found.parameters if p.moves]
    if moving:
        sentences.append(
            f"Leaving out days moves {', '.join(moving)} by more than the standard errors say: either these are too "
            "small, or the building was not the same on all days."
        )
    return tuple(sentences)


def _summary(told: int, count: int, combinations: int) -> str:
    alone = "none" if not told else "all" if told == count else str(told)
    beside = f", and {combinations} combination{'s' if combinations > 1 else ''} of others" if combinations else ""
    return f"The data determine {alone} of {count} parameters by themselves{beside}."


def _combination(named: Mapping[str, Parameter], told: set[str], combination: Combination) -> str:
    apart = [in_words(named[name].name) for name in combination.exponents if name not in told]
    kept = "by themselves" if len(apart) > 1 else "by itself"
    precise = _precision_words(None, combination.deviation)
    words = combination_words(named, combination.exponents)
    return f"Only the {words} is determined ({precise}), not {listed(apart, 'or')} {kept}."


def _open(named: Mapping[str, Parameter], known: Sequence[ParameterInformation]) -> list[str]:
    def having(status: str, words: Callable[[Parameter, float], str]) -> list[str]:
        return _gathered([(named[k.name], k.ratio) for k in known if k.status == status], words)

    def left(parameter: Parameter, ratio: float) -> str:
        return f"{100 * ratio:.0f} %"

    sentences = []
    if partly := having("partly", left):
        sentences.append(f"Partly determined (share of the prior's deviation that is left): {', '.join(partly)}.")
    if held := having("through_priors", left):
        sentences.append(f"Known only because priors hold the others (share that is left): {', '.join(held)}.")
    if none := having("not", lambda parameter, ratio: ""):
        are = "is" if sum(k.status == "not" for k in known) == 1 else "are"
        sentences.append(f"{listed(none)} {are} not determined by these data.")
    return [s[0].upper() + s[1:] for s in sentences]


def _gathered(parameters: Sequence[tuple[Parameter, float]], words: Callable[[Parameter, float], str]) -> list[str]:
    """Name parameters, each with what is said of its number; many of one kind are named together."""
    groups: dict[str, list[tuple[Parameter, float]]] = {}
    for p, number in parameters:
        groups.setdefault(f"{p.base} {p.scope}", []).append((p, number))
    named = []
    for group in groups.values():
        first, count = group[0][0], len(group)
        parts = [(in_words(p.name), words(p, number)) for p, number in group]
        if count > MOST_NAMED:
            best, worst = (words(first, end) for end in (min(n for _, n in group), max(n for _, n in group)))
            of_pairs = any(" " in str(p.member) for p, _ in group)  # of zones, or of a zone and a direction
            base = in_words(first.base)
            name = f"{count} values of {base}" if of_pairs else f"{base} of {count} {first.scope}s"
            parts = [(name, best if best == worst else f"{best} at best, {worst} at worst")]
        named += [f"{name} ({said})" if said else name for name, said in parts]
    return named


def _nominal(named: Mapping[str, Parameter], told: set[str], name: str, value: float, of: str) -> str:
    """Say what a nominal value hides: a density, that only its product with the heat capacity counts."""
    base = name.removesuffix(_DENSITY)
    partners = [p.name for p in named.values() if p.base == base + _CAPACITY]
    thing, number = base.replace("_", " "), f"{value:g}" if of == "1" else f"{value:g} {unit(of)}"
    stays = f"the density stays at its nominal {number}"
    if name.endswith(_DENSITY) and partners and set(partners) <= told:
        return f"Only the product density × heat capacity of the {thing} is determined: {stays}."
    if name.endswith(_DENSITY):
        return f"Density and heat capacity of the {thing} enter only as a product: {stays}."
    return f"{name.replace('_', ' ').capitalize()} enters only as a product and stays at its nominal {number}."
