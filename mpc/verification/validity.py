"""What would make a saving invalid: weather, occupancy, service, missing days, carry-over, too few days."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.verification.before_after import BeforeAfter
from mpc.verification.inference import Estimate, mean_estimate, sum_error
from mpc.verification.switchback import Switchback, runs_of

#: How far beyond the baseline's outdoor temperatures a model may be used, as a share of their range [-]: a tenth, as in
#: ASHRAE Guideline 14-2014 (independent variables within 90 to 110 % of those of the baseline).
_BEYOND = 0.1

#: Share of days outside of that, and of days missing, from which a saving is in doubt [-]: a tenth, as for days.
_MANY = 0.1

#: Difference of occupancy that counts, as a share of its mean [-], and of zone temperature [K]: some 3 % of the heating
#: of a building with 16 K between inside and outside.
_OCCUPANCY, _SERVICE = 0.05, 0.5

#: Level of tests of changes [-]: of two that are sound one in ten is told as changed.
_LEVEL = 0.05

#: Runs of each control below which intervals are too short: with two, 90 % intervals held the truth in 80 % of 40
#: repeats (`benchmarks/verification.py`).
_FEWEST_RUNS = 4

#: Fractional savings uncertainty that ASHRAE Guideline 14 allows at 68 % [-].
UNCERTAINTY_ALLOWED, AT_CONFIDENCE = 0.5, 0.68

#: Limits of ASHRAE Guideline 14 for models of hours [-]: CV(RMSE) and NMBE; its monthly ones are half of these.
_CV_RMSE, _NMBE = 0.3, 0.1


@dataclass(frozen=True)
class Check:
    """A check of a saving.

    Parameters
    ----------
    name : str
        Such as ``weather``.
    passed : bool or None
        None: nothing was measured that tells.
    sentence : str
        What was found.
    advice : str
        What to do about it; empty where it passed.
    """

    name: str
    passed: bool | None
    sentence: str
    advice: str = ""


def check_before_after(found: BeforeAfter, baseline: pd.DataFrame, reporting: pd.DataFrame) -> tuple[Check, ...]:
    """Check a saving against a baseline.

    Parameters
    ----------
    found : BeforeAfter
        The saving.
    baseline, reporting : DataFrame
        Every day of the two periods, as `Metered.days` has them.
    """
    uncertainty = found.fractional_uncertainty(AT_CONFIDENCE)
    fit = found.fitness
    held = max(fit.held_out_cv_rmse / _CV_RMSE, abs(fit.held_out_nmbe) / _NMBE)
    told = (
        f"CV(RMSE) {100 * fit.held_out_cv_rmse:.1f} % and NMBE up to {100 * fit.held_out_nmbe:+.1f} % "
        "on days that a fit had not seen"
    )
    return (
        Check("baseline model", None if np.isnan(held) else bool(held <= 1.0),
              "too few days to hold any out" if np.isnan(held) else told,
              "" if held <= 1.0 else "take a longer baseline, or meter what the energy depends on"),
        Check("uncertainty", uncertainty <= UNCERTAINTY_ALLOWED,
              f"fractional savings uncertainty {100 * min(uncertainty, 9.99):.0f} % at 68 % confidence "
              "(ASHRAE Guideline 14)",
              "" if uncertainty <= UNCERTAINTY_ALLOWED else "report for longer; the guideline allows 50 %"),
        _weather(baseline, reporting, "the baseline's", "extend the baseline to such weather"),
        _missing(pd.concat([baseline, reporting])),
        *_changes(baseline, reporting, "the baseline", "the reporting period"),
    )  # fmt: skip


def check_switchback(found: Switchback, days: pd.DataFrame, confidence: float) -> tuple[Check, ...]:
    """Check a saving by alternate days.

    Parameters
    ----------
    found : Switchback
        The saving.
    days : DataFrame
        Every day of the span, as `Metered.days` has them.
    confidence : float
        Level of its interval [-].
    """
    own, new = (days[days["acts"] == mode] for mode in (0.0, 1.0))
    return (
        _enough(found, confidence),
        _carried(found, days),
        _weather(own, new, "the own control's", "go on until both controls have had such weather"),
        _missing(days),
        *_changes(own, new, "days of the own control", "those of the new one"),
    )


def _enough(found: Switchback, confidence: float) -> Check:
    acts = found.days["acts"].to_numpy()
    runs = int(runs_of(acts)[-1]) + 1
    fewest, half = runs // 2, found.saving.half_width(confidence)
    enough = fewest >= _FEWEST_RUNS and half <= 0.5 * abs(found.saving.value)
    ratio = half / max(abs(found.saving.value), 1e-9)
    told = f"{len(acts)} days in {runs} runs; the interval is ± {100 * min(ratio, 99.0):.0f} % of the saving"
    advice = "" if enough else f"go on to about {found.days_needed(confidence)} days"
    if fewest < _FEWEST_RUNS:
        advice = f"switch more often: each control needs {_FEWEST_RUNS} runs of days"
    return Check("days", bool(enough), told, advice)


def _carried(found: Switchback, days: pd.DataFrame) -> Check:
    """Whether a day's heat or cold is left to the next, which has the other control."""
    name, advice = "carry-over", "let each control act for two days or more in a row, in random order"
    state = _difference(days[days["acts"].shift(1) == 0.0], days[days["acts"].shift(1) == 1.0], "zone_start")
    told = ""
    if state is not None:
        told = f"; zones begin {state.value:+.2f} K warmer after a day of the new control"
    if found.carried is not None:
        carried, share = found.carried, found.carried.value / found.own_power
        is_there = carried.p_value < 2.0 * _LEVEL
        words = f"the day after the new control acted takes {100 * (-share):+.1f} % energy{told}"
        then = "it is counted in the saving of permanent use; longer runs of days show it with less noise"
        return Check(name, not is_there, words, then if is_there else "")
    warm = state is not None and state.p_value < _LEVEL and abs(state.value) > 0.1
    words = f"strictly alternate days cannot tell what one leaves to the next{told}"
    return Check(name, False if warm else None, words, advice)


def _weather(first: pd.DataFrame, second: pd.DataFrame, whose: str, advice: str) -> Check:
    """Whether the outdoor temperatures of the second days are within those of the first."""
    known, seen = first["outdoor"].dropna(), second["outdoor"].dropna()
    low, high = float(known.min()), float(known.max())
    margin = _BEYOND * (high - low)
    outside = ((seen < low - margin) | (seen > high + margin)).mean()
    told = f"{100 * outside:.0f} % of the days lie outside of {whose} {low - 273.15:.1f} to {high - 273.15:.1f} °C"
    return Check("weather", bool(outside <= _MANY), told, "" if outside <= _MANY else advice)


def _missing(days: pd.DataFrame) -> Check:
    columns = [c for c in ("power", "outdoor", "acts") if c in days]
    lost = days[columns].isna().any(axis=1).mean()
    told = f"{100 * lost:.0f} % of the days lack energy, temperature or one control all day long"
    return Check(
        "missing days",
        bool(lost <= _MANY),
        told,
        "" if lost <= _MANY else "find out why: days are not missing at random",
    )


def _changes(first: pd.DataFrame, second: pd.DataFrame, one: str, other: str) -> Iterator[Check]:
    """Whether people and the service that they get are the same in both."""
    people = _difference(first, second, "occupancy")
    if people is None:
        yield Check("occupancy", None, "not measured", "meter people, or say why they are the same")
    else:
        share = people.value / max(abs(float(first["occupancy"].mean())), 1e-9)
        changed = people.p_value < _LEVEL and abs(share) > _OCCUPANCY
        yield Check("occupancy", not changed, f"{100 * share:+.1f} % from {one} to {other}",
                    "a non-routine change: put it into the model with --adjust" if changed else "")  # fmt: skip
    warmth = _difference(first, second, "zone")
    if warmth is None:
        yield Check("service", None, "zone temperatures not given", "a saving by colder or warmer rooms is none")
    else:
        changed = warmth.p_value < _LEVEL and abs(warmth.value) > _SERVICE
        yield Check("service", not changed, f"zones are {warmth.value:+.2f} K from {one} to {other}",
                    "part of the saving is a change of comfort" if changed else "")  # fmt: skip


def _difference(first: pd.DataFrame, second: pd.DataFrame, column: str) -> Estimate | None:
    """Mean of the second less that of the first; None where there is nothing to compare."""
    if column not in first or min(first[column].count(), second[column].count()) < 3:
        return None
    if set(first.index) & set(second.index):
        return None
    both = pd.concat([first[[column]].assign(new=0.0), second[[column]].assign(new=1.0)]).sort_index().dropna()
    values, new = both[column].to_numpy(), both["new"].to_numpy()
    weights = new / new.sum() - (1.0 - new) / (1.0 - new).sum()
    means = np.where(new == 1.0, values[new == 1.0].mean(), values[new == 0.0].mean())
    error, freedom = sum_error(weights * (values - means))
    return Estimate(float(weights @ values), error, freedom)


def predicted_share(days: pd.DataFrame) -> Estimate | None:
    """Share of the energy that shadow operation expected to save; None where it did not say.

    Parameters
    ----------
    days : DataFrame
        As `Metered.days` has them; with ``acts``, only days of the own control count.
    """
    if "predicted" not in days:
        return None
    shadow = days[days["acts"] == 0.0] if "acts" in days else days
    shadow = shadow.dropna(subset=["power", "predicted"])
    if len(shadow) < 3:
        return None
    power, saved = shadow["power"].to_numpy(), shadow["predicted"].to_numpy()
    share = float(saved.sum() / power.sum())
    around = mean_estimate(saved - share * power)
    return Estimate(share, around.error / float(power.mean()), around.freedom)
