"""What the design of an experiment leaves behind: numbers, schedule, expected temperatures, and a page."""

from typing import Any

import numpy as np
import pandas as pd

from calibration.experiment.design import Experiment
from calibration.experiment.odds import chance_of
from calibration.experiment.outcome import Outcome
from calibration.experiment.schedule import STATIC_PRESSURE, SUPPLY_AIR, Move
from calibration.results import Content
from mpc.reports.diagnosis_words import called
from mpc.reports.figures import style
from mpc.reports.figures.style import Picture, keys_below, lines_over_time, panel, picture, styled
from mpc.reports.means_found import experiment_means
from mpc.reports.page import clock, duration, listed, percent, render, significant
from thermal.case.case import Case

#: Panels of zones on a page: those whose members differ most.
_PANELS = 4

#: Places that a sentence names, where it cannot count them instead.
_NAMED = 6

_FREEZING = 273.15


def experiment_files(found: Experiment, case: Case, outcome: Outcome | None = None) -> dict[str, Content]:
    """Files of an experiment by name: ``experiment.json``, ``schedule.csv``, ``expected.parquet``, ``report.html``.

    Parameters
    ----------
    found : Experiment
        From `design_experiment`.
    case : Case
        The case it is for.
    outcome : Outcome, optional
        Of the experiment, where it was carried out.
    """
    content = found.to_dict() | {"outcome": None if outcome is None else outcome.to_dict()}
    rows = found.schedule.rows(found.step)
    warm = rows["unit"] == "K"
    rows["value"] = (rows["value"] - np.where(warm, _FREEZING, 0.0)).round(2)
    rows["unit"] = rows["unit"].where(~warm, "degC")
    rows["time"] = [t.isoformat() for t in rows["time"]]
    return {
        "experiment.json": content,
        "schedule.csv": rows.to_csv(index=False, lineterminator="\n"),
        "expected.parquet": expected_table(found),
        "report.html": render("experiment", _content(found, case, outcome)),
    }


def expected_table(found: Experiment) -> pd.DataFrame:
    """Tabulate expected temperatures, one row a step and zone.

    Index ``timestamp``; ``zone``; the zone's temperature were each member true, in a column of its id, and ``.._usual``
    under usual operation [degC].

    Parameters
    ----------
    found : Experiment
        From `design_experiment`.
    """
    stamps = _stamps(found)
    parts = []
    for i, zone in enumerate(found.zones):
        columns = {}
        for member in (m.effect for m in found.members):
            columns[member] = found.best.emulated[member].zone[:, i] - _FREEZING
            columns[f"{member}_usual"] = found.usual.emulated[member].zone[:, i] - _FREEZING
        parts.append(pd.DataFrame({"zone": zone, **columns}, index=stamps))
    table = pd.concat(parts).sort_index(kind="stable")
    table.attrs["units"] = {name: "degC" for name in table if name != "zone"}
    return table


def _stamps(found: Experiment) -> pd.DatetimeIndex:
    """Give the ends of the steps of the experiment, at the time when it is to be carried out."""
    count = len(next(iter(found.best.emulated.values())).zone)
    steps = pd.to_timedelta(np.arange(1, count + 1) * found.step, unit="s")
    return pd.DatetimeIndex(found.start + steps).rename("timestamp")


def experiment_verdict(found: Experiment, outcome: Outcome | None = None) -> str:
    """Say in plain words what an experiment is worth, and what it said where it was carried out.

    Parameters
    ----------
    found : Experiment
        From `design_experiment`.
    outcome : Outcome, optional
        Of the experiment.
    """
    names = listed([called(m.effect) for m in found.members], "or")
    usual, chance = percent(found.usual_chance), percent(found.chance)
    if found.verdict == "hopeless":
        text = f"None of the {found.tried} schedules of setpoints that were tried for "
        text += f"{duration(3600 * found.settings.hours)} tells apart whether it is {names}: the best admissible one "
        text += f"would name one with a chance of {chance}. "
        text += f"Measure instead: {'; or '.join(found.instead)}."
    else:
        text = f"{duration(3600 * found.schedule.hours).capitalize()} from {clock(found.start)} on tell whether it is "
        text += f"{names}, with a chance of {chance} (as many hours of usual operation: {usual})."
    if found.by_hand:
        several = len(found.by_hand) > _NAMED
        names = f"{len(found.by_hand)} of the places that it moves" if several else listed(found.by_hand)
        text += f" The telemetry has no setpoints of {names}: set these by hand if need be, and record "
        text += "what was set."
    if outcome is None:
        return text
    if outcome.named is None:
        return f"{text} It was carried out, and does not say which: {_shares(outcome)}."
    return f"{text} It was carried out: it is {called(outcome.named)} ({_shares(outcome)})."


def _shares(outcome: Outcome) -> str:
    return listed([f"{called(e)} {percent(outcome.probability[e])}" for e in outcome.ranked])


def steps_of(found: Experiment) -> list[tuple[str, str, str]]:
    """Tell what is to be done: when, where, and what, in plain words.

    Parameters
    ----------
    found : Experiment
        From `design_experiment`.
    """
    rows = []
    for move in found.schedule.moves:
        for first, last in move.spans:
            begin, end = (found.start + pd.Timedelta(hours=h) for h in (first, last))
            rows.append((f"{begin:%a %d %b %H:%M} to {end:%a %d %b %H:%M}", listed(move.zones), _what(move)))
    return rows


def _what(move: Move) -> str:
    """Say what a move does, in plain words."""
    pressure = move.point == STATIC_PRESSURE
    levels = [f"{np.mean(p):.0f} Pa" if pressure else f"{np.mean(p) - _FREEZING:.1f} °C" for p in move.pairs]
    thing = {"": "hold at", SUPPLY_AIR: "supply air at", STATIC_PRESSURE: "duct pressure at"}[move.point]
    turns = f" in turns of {duration(3600.0 * move.every)}" if len(levels) > 1 else ""
    return f"{thing} {listed(levels)}{turns}"


def _content(found: Experiment, case: Case, outcome: Outcome | None) -> dict[str, Any]:
    worst = sorted(zip(found.zones, found.best.discomfort.tolist(), strict=True), key=lambda pair: -pair[1])
    pairs = [
        (called(a), called(b), v, chance_of(v, found.settings.odds), found.best.separation.swing[a, b],
         found.usual.separation.log_odds[a, b])
        for (a, b), v in found.best.separation.log_odds.items()
    ]  # fmt: skip
    said = [] if outcome is None else [(called(e), outcome.evidence[e] - max(outcome.evidence.values()),
                                       outcome.probability[e]) for e in outcome.ranked]  # fmt: skip
    return {
        "case": case.building.name, "verdict": experiment_verdict(found, outcome),
        "means": experiment_means(found, outcome), "prices": found.settings.prices,
        "subtitle": f"{clock(found.start)} to {clock(found.schedule.end)}", "found": found,
        "chance": found.chance, "usual": found.usual_chance, "pairs": pairs,
        "steps": steps_of(found), "worst": worst, "cost": significant(found.best.cost, 2),
        "energy": significant(found.best.energy, 2), "pictures": _pictures(found), "said": said,
        "odds": f"{found.settings.odds:g}", "hopeless": found.verdict == "hopeless",
        "fine": found.verdict != "hopeless",
        "days": f"{clock(found.days.start)} to {clock(found.days.end)}",
    }  # fmt: skip


@styled
def _pictures(found: Experiment) -> list[Picture]:
    """Draw expected temperatures by member in the zones where they differ most."""
    stamps = _stamps(found)
    zones = np.stack([made.zone for made in found.best.emulated.values()])
    order = np.argsort(-np.ptp(zones, axis=0).mean(axis=0), kind="stable")[:_PANELS]
    drawn = []
    for i in order.tolist():
        figure, axes = panel(5.2, 2.9, title=found.zones[i], ylabel="zone temperature [°C]")
        x = lines_over_time(axes, stamps)
        for k, (effect, made) in enumerate(found.best.emulated.items()):
            axes.plot(x, made.zone[:, i] - _FREEZING, label=called(effect), linestyle=("-", "--", ":", "-.")[k % 4])
        usual = next(iter(found.usual.emulated.values())).zone[:, i] - _FREEZING
        axes.plot(x, usual, color=style.MUTED, linewidth=0.9, label="usual operation")
        keys_below(figure, 2)
        drawn.append(picture(figure, f"Expected temperature of {found.zones[i]} by what causes the gap", zoom=True))
    return drawn
