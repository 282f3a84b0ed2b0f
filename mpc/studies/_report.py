"""What a run leaves behind: numbers as JSON, the course as a table, and a page that a building manager can read."""

from __future__ import annotations

import platform
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration import check_results_folder, write_results
from calibration.pages import clock, counted, render, significant
from mpc.studies._compare import Comparison
from mpc.studies._figures import NAMES, cost_bars, course, expectations, side_by_side
from mpc.studies._reasons import reason_rows
from mpc.studies._run import ControlRun, prediction_errors
from thermal.case.points import POINT_TYPES, split_column
from thermal.units import QUANTITIES, from_si

_RULES = {
    "schedule": "Supply air stands at its design value; supply water is hot by day and cooler by night.",
    "reset": "Supply air and water follow the outdoor temperature.",
    "guideline36": "Supply air and water drift to where they cost least until zones or valves ask for more "
    "(ASHRAE Guideline 36, trim and respond).",
    "mpc": "Every {step} minutes supply air and water are chosen so that energy and discomfort cost least over the "
    "next {hours:g} hours, according to the model of the building, the forecast and the prices.",
    "bound": "As optimal control, but on a plant that is its own model, with exact sensors, and with weather and "
    "people known in advance: what perfect knowledge would reach.",
}


def control_summary(run: ControlRun) -> dict[str, Any]:
    """Contents of ``control.json``.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    study = run.study
    statuses = Counter(d.status for d in run.decisions if d.status)
    kpis, times = run.kpis.to_dict(), [d.seconds for d in run.decisions]
    return {
        "controller": run.controller,
        "start": study.scenario.grid.start.isoformat(),
        "end": study.stamps[-1].isoformat(),
        "cost": run.cost,
        "cost_with_discomfort": run.objective,
        "comfort_price": study.settings.comfort_price,
        "kpis": kpis,
        "actions": {"count": len(run.loop.actions), "sources": dict(run.sources), "statuses": dict(statuses),
                    "solve_seconds_mean": float(np.mean(times)) if times else None},
        "prediction": prediction_errors(run),
        "reasons": [{"first": row.first.isoformat(), "last": row.last.isoformat(), "count": row.times,
                     "reason": row.reason} for row in reason_rows(run)],
        **_about(run),
    }  # fmt: skip


def _about(run: ControlRun) -> dict[str, Any]:
    study = run.study
    return {
        "plant": {"building": study.kind, "step_seconds": study.scenario.grid.step, "noise": study.noise is not None,
                  "control_step_seconds": run.plant.control_step, "effects": list(study.built.effects)},
        "forecast": "with errors" if study.errors else "perfect",
        "notes": list(study.notes), "case": study.name, "version": version("buildingmpc"), "seed": study.seed,
    }  # fmt: skip


def trajectory(run: ControlRun) -> pd.DataFrame:
    """Contents of ``trajectory.parquet``: what was measured, what was set, prices, bands and true powers.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.

    Returns
    -------
    DataFrame, shape (n_steps, n_column)
        By the plant's own steps; points of the case format in the units of case folders [degC, kg/s, %, W], then
        ``true/...``: zone temperatures without noise [degC] and powers [W].
    """
    frame, layout, n = run.plant.telemetry(), run.plant.columns, run.study.steps
    columns = {}
    for name in layout:
        quantity = POINT_TYPES[split_column(name, "plant")[1]].quantity
        columns[name] = from_si(frame[name].to_numpy(), QUANTITIES[quantity].file_unit, quantity)
    scenario, record = run.study.scenario, run.loop.record
    for k, zone in enumerate(scenario.zones):
        columns[f"{zone}/comfort_lower_temperature"] = scenario.lower[:n, k] - 273.15
        columns[f"{zone}/comfort_upper_temperature"] = scenario.upper[:n, k] - 273.15
        columns[f"true/{zone}"] = record.zone_temperature[1:, k] - 273.15
    columns["electricity_price"], columns["gas_price"] = scenario.electricity_price[:n], scenario.gas_price[:n]
    columns["true/electricity"] = record.electricity
    columns["true/gas"] = np.zeros(n) if record.gas is None else record.gas
    return pd.DataFrame(columns, index=frame.index)


def write_control(run: ControlRun, out: str | Path, *, command: str = "", force: bool = False) -> Path:
    """Write ``control.json``, ``trajectory.parquet`` and ``report.html``.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    out : str or Path
        Folder, made if need be.
    command : str
        That led to it, for the page.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    """
    check_results_folder(out, force)
    content = _frame([run], control_verdict(run), f"Control of {run.study.name}: {NAMES[run.controller]}")
    page = render("control", content | {"runs": [_section(run, True)], "table": None, "bars": [], "together": [],
                                        "reproduce": _reproduce(run, command)}, "mpc")  # fmt: skip
    files: dict[str, Any] = {
        "control.json": control_summary(run), "trajectory.parquet": trajectory(run), "report.html": page,
    }  # fmt: skip
    return write_results(out, files, force) / "report.html"


def control_verdict(run: ControlRun) -> str:
    """Say in plain words what a run cost and how comfortable it was.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    k, worst = run.kpis, max(run.kpis.zones, key=lambda z: z.below + z.above)
    parts = [
        f"{NAMES[run.controller].capitalize()} spent {_money(run.cost, k.currency)} on energy in "
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


def _money(value: float, currency: str) -> str:
    return f"{value:,.2f} {currency}"


def comparison_summary(comparison: Comparison) -> dict[str, Any]:
    """Contents of ``comparison.json``.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    """
    best = comparison.best_rule
    return {
        "controllers": {
            run.controller: control_summary(run)
            | {"saving": comparison.saving(run), "way_to_bound": comparison.way_to_bound(run)}
            for run in comparison.runs
        },
        "best_rule": None if best is None else best.controller,
        "case": comparison.study.name, "version": version("buildingmpc"), "seed": comparison.study.seed,
    }  # fmt: skip


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
        name = NAMES[cheapest.controller]
        return f"{name.capitalize()} costs least: {control_verdict(cheapest)}"
    name, change = NAMES[best.controller], 1.0 - mpc.cost / best.cost
    comfort = mpc.kpis.tdis_tot - best.kpis.tdis_tot
    parts = [
        f"Optimal control spent {_money(mpc.cost, mpc.kpis.currency)} on energy, the best rule ({name}) "
        f"{_money(best.cost, best.kpis.currency)}: {abs(change):.0%} {'less' if change >= 0 else 'more'}."
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


def write_comparison(comparison: Comparison, out: str | Path, *, command: str = "", force: bool = False) -> Path:
    """Write ``comparison.json``, a ``trajectory_NAME.parquet`` a controller, and ``report.html``.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    out : str or Path
        Folder, made if need be.
    command : str
        That led to it, for the page.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    """
    check_results_folder(out, force)
    runs = comparison.runs
    content = _frame(list(runs), comparison_verdict(comparison), f"Controllers of {comparison.study.name} compared")
    shown = comparison.of("mpc") or runs[0]
    page = render("control", content | {
        "runs": [_section(run, run is shown) for run in runs], "table": comparison_rows(comparison),
        "bars": cost_bars(runs), "together": side_by_side(runs),
        "reproduce": _reproduce(runs[0], command),
    }, "mpc")  # fmt: skip
    files: dict[str, Any] = {"comparison.json": comparison_summary(comparison), "report.html": page}
    files |= {f"trajectory_{run.controller}.parquet": trajectory(run) for run in runs}
    return write_results(out, files, force) / "report.html"


def comparison_rows(comparison: Comparison) -> list[list[str]]:
    """Rows of the table of controllers: name, cost, saving, discomfort, worst zone, energy, peak, way to the bound.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    """
    rows = []
    for run in comparison.runs:
        k, saving, way = run.kpis, comparison.saving(run), comparison.way_to_bound(run)
        worst = max(z.below + z.above for z in k.zones)
        rows.append([
            NAMES[run.controller], f"{run.cost:,.2f}", f"{run.objective:,.2f}",
            "–" if saving is None or run is comparison.best_rule else f"{saving:.1%}".replace("-", "−"),
            f"{k.tdis_tot:.3f}", f"{worst:.2f}", f"{k.ener_tot:.3f}", f"{1e3 * (k.pele_tot or 0.0):.1f}",
            "–" if k.emis_tot is None else f"{1e3 * k.emis_tot:.1f}",
            "–" if way is None or run.controller not in ("mpc", "bound") else f"{way:.0%}",
        ])  # fmt: skip
    return rows


def _frame(runs: list[ControlRun], verdict: str, title: str) -> dict[str, Any]:
    """Give what both pages begin with."""
    study, run = runs[0].study, next((r for r in runs if r.controller == "mpc"), runs[0])
    k, planned = run.kpis, run.sources.get("optimal plan", 0)
    cards = [
        (_money(run.cost, k.currency), f"energy, {NAMES[run.controller]}"),
        (f"{significant(k.ener_tot)} kWh/m²", "energy"),
        (f"{significant(k.tdis_tot, 2)} K h", "outside of the comfort band, mean zone"),
        (f"{1e3 * (k.pele_tot or 0.0):.1f} W/m²", "highest quarter of an hour of electricity"),
    ]
    if run.decisions:
        cards.append((f"{planned} of {len(run.decisions)}", "actions from an optimal plan"))
    area = f"{significant(k.floor_area)} m²"
    when = f"{clock(study.scenario.grid.start)} to {clock(study.stamps[-1])}"
    return {
        "title": title, "verdict": verdict, "cards": cards, "notes": study.notes, "currency": k.currency,
        "subtitle": f"{when}, {counted(len(study.scenario.zones), 'zone')}, {area}; a simulated plant",
        "fine": run.controller != "mpc" or planned == len(run.decisions),
    }  # fmt: skip


def _section(run: ControlRun, shown: bool) -> dict[str, Any]:
    """Lay out one controller's part of a page."""
    step, hours = round(run.plant.control_step / 60.0), 12.0
    errors, zones = prediction_errors(run), sorted(run.kpis.zones, key=lambda z: -(z.below + z.above))
    return {
        "name": NAMES[run.controller].capitalize(), "shown": shown,
        "how": _RULES[run.controller].format(step=step, hours=hours),
        "course": course(run),
        "expectations": expectations(run) if shown else [],
        "errors": errors,
        "reasons": [[clock(r.first), clock(r.last), str(r.times), r.reason] for r in reason_rows(run)[:40]],
        "more_reasons": max(len(reason_rows(run)) - 40, 0),
        "planned": bool(run.decisions),
        "zones": [
            [z.zone, f"{z.below:.2f}", f"{z.above:.2f}", f"{z.largest_below:.1f}", f"{z.largest_above:.1f}"]
            for z in zones[:15]
        ],
        "all_zones": len(zones),
    }  # fmt: skip


def _reproduce(run: ControlRun, command: str) -> list[tuple[str, str]]:
    study = run.study
    entries = [
        ("plant", f"building {study.kind}, steps of {study.scenario.grid.step:g} s, "
                  f"{'sensors with noise' if study.noise else 'exact sensors'}, "
                  f"weather forecast {'with errors' if study.errors else 'perfect'}"),
        ("version", f"buildingmpc {version('buildingmpc')}, Python {platform.python_version()}"),
        ("seed", str(study.seed)),
    ]  # fmt: skip
    return entries + ([("command", command)] if command else [])
