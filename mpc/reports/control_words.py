"""Closed loops in plain words: what a controller does, what a run cost, what optimal control saves, and the log."""

from __future__ import annotations

import re
from typing import NamedTuple

import pandas as pd

from mpc.kpi.kpis import Kpis
from mpc.reports.page import significant, spell
from mpc.studies.run import Comparison, ControlRun

_CHANGING = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d|\b\d+(\.\d+)?\b")  # times and numbers within a reason


def own_indicators(kpis: Kpis) -> list[tuple[str, str]]:
    """List the values of indicators that users have registered, with what they say.

    Parameters
    ----------
    kpis : Kpis
        Of a run.
    """
    own = kpis.to_frame().loc[[*kpis.own]].dropna(subset="value")
    return [(f"{significant(value)} {unit}", words) for value, unit, words in own.itertuples(index=False)]


def control_verdict(run: ControlRun) -> str:
    """Say in plain words what a run cost and how comfortable it was.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    k, worst = run.kpis, max(run.kpis.zones, key=lambda z: z.below + z.above)
    powers = (run.loop.record.electricity, run.loop.record.gas)
    electricity, gas = (0.0 if power is None else float(power.sum()) for power in powers)
    parts = [
        f"{run.entry.title.capitalize()} spent {money(run.cost, k.currency)} on energy in "
        f"{k.hours / 24:g} days ({significant(k.ener_tot)} kWh/m², of which "
        f"{electricity / max(electricity + gas, 1e-9):.0%} electricity)."
    ]
    if k.tdis_tot < 1e-3:
        parts.append("No zone left its comfort band.")
    else:
        parts.append(
            f"Zones were outside of their comfort band by {significant(k.tdis_tot, 2)} K h on average, the worst, "
            f"{worst.zone}, by {significant(worst.below + worst.above, 2)} K h and at most "
            f"{max(worst.largest_below, worst.largest_above):.1f} K."
        )
    planned = run.sources.get("optimal plan", 0)
    if run.decisions and planned == len(run.decisions):
        parts.append(f"All {planned} actions followed a plan that the solver had found.")
    elif run.decisions:
        parts.append(
            f"{len(run.decisions) - planned} of {len(run.decisions)} actions fell back on an earlier plan or "
            "on rules; the log below says why."
        )
    return " ".join(parts)


def money(value: float, currency: str) -> str:
    """Spell an amount of money.

    Parameters
    ----------
    value : float
        Amount [currency].
    currency : str
        Its name.
    """
    return f"{value:,.2f} {currency}"


def comparison_verdict(comparison: Comparison) -> str:
    """Say in plain words what optimal control saves.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    """
    best, mpc = comparison.best_rule, comparison.of("mpc")
    if best is None or mpc is None:
        cheapest = min(comparison.runs, key=lambda run: run.objective)
        return f"{cheapest.entry.title.capitalize()} costs least: {control_verdict(cheapest)}"
    name, change = best.entry.title, 1.0 - mpc.cost / best.cost
    comfort = mpc.kpis.tdis_tot - best.kpis.tdis_tot
    parts = [
        f"Optimal control spent {money(mpc.cost, mpc.kpis.currency)} on energy, the best rule ({name}) "
        f"{money(best.cost, best.kpis.currency)}: {abs(change):.0%} {'less' if change >= 0 else 'more'}."
    ]
    if abs(comfort) < 0.01:
        parts.append("Both keep the zones equally comfortable.")
    else:
        parts.append(
            f"Its zones were outside of their comfort band by {significant(mpc.kpis.tdis_tot, 2)} K h on average, "
            f"{'more' if comfort > 0 else 'less'} than the rule's {significant(best.kpis.tdis_tot, 2)} K h."
        )
    way = comparison.way_to_bound(mpc)
    if way is not None:
        parts.append(
            f"Counting discomfort at {comparison.study.settings.comfort_price:g} {mpc.kpis.currency} a kelvin hour and "
            f"zone, that is {way:.0%} of the perfect-forecast savings."
        )
    return " ".join(parts)


def comparison_rows(comparison: Comparison) -> list[list[str]]:
    """Rows of the table of controllers, from cost to the share of the perfect-forecast savings.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    """
    rows = []
    for run in comparison.runs:
        k, best = run.kpis, run is comparison.best_rule
        worst = max(z.below + z.above for z in k.zones)
        way = comparison.way_to_bound(run) if run.controller in ("mpc", "bound") else None
        values = (
            (run.cost, ",.2f"), (run.objective, ",.2f"), (None if best else comparison.saving(run), ".1%"),
            (k.tdis_tot, ".3f"), (worst, ".2f"), (k.ener_tot, ".3f"), (1e3 * (k.pele_tot or 0.0), ".1f"),
            (None if k.emis_tot is None else 1e3 * k.emis_tot, ".1f"), (way, ".0%"),
        )  # fmt: skip
        rows.append([run.entry.title, *(spell(value, how) for value, how in values)])
    return rows


class _Reason(NamedTuple):
    """A reason that was given once or more.

    Parameters
    ----------
    first, last : pandas.Timestamp
        When it was given first and last, local.
    times : int
        How often.
    reason : str
        In the words of the first time.
    """

    first: pd.Timestamp
    last: pd.Timestamp
    times: int
    reason: str


def reason_rows(run: ControlRun) -> list[_Reason]:
    """Give the reasons of a run, those that differ in times and numbers only taken together, the first time first.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    found: dict[str, _Reason] = {}
    for decision in run.decisions:
        for reason in decision.reasons:
            before = found.get(kind := _CHANGING.sub("#", reason), _Reason(decision.stamp, decision.stamp, 0, reason))
            found[kind] = before._replace(last=decision.stamp, times=before.times + 1)
    return list(found.values())
