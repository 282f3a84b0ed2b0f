"""Closed loops in plain words: what a run cost, how comfortable it was, what optimal control saves."""

from __future__ import annotations

from mpc.reports.page import significant
from mpc.studies.compare import Comparison
from mpc.studies.run import ControlRun


def control_verdict(run: ControlRun) -> str:
    """Say in plain words what a run cost and how comfortable it was.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    k, worst = run.kpis, max(run.kpis.zones, key=lambda z: z.below + z.above)
    parts = [
        f"{run.entry.title.capitalize()} spent {money(run.cost, k.currency)} on energy in "
        f"{k.hours / 24:g} days ({significant(k.ener_tot)} kWh/m², of which {_electric(run):.0%} electricity)."
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


def _electric(run: ControlRun) -> float:
    gas = 0.0 if run.loop.record.gas is None else float(run.loop.record.gas.sum())
    electricity = float(run.loop.record.electricity.sum())
    return electricity / max(electricity + gas, 1e-9)


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
            f"zone, it goes {way:.0%} of the way from that rule to what perfect knowledge would reach."
        )
    return " ".join(parts)
