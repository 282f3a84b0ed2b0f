"""What a run or a comparison leaves behind: numbers as JSON, the course as a table, and a page in plain words."""

import re
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from calibration.results import Content
from mpc.kpi.bought import fuel_of
from mpc.kpi.kpis import Kpis
from mpc.reports.assumptions import assumption_rows
from mpc.reports.comparison import comparison_table
from mpc.reports.display import write_results
from mpc.reports.figures.control import cost_bars, course, expectations, side_by_side
from mpc.reports.figures.style import CELSIUS
from mpc.reports.means import NOTICED, comparison_means, control_means
from mpc.reports.page import duration, percent, render, significant, write_report
from mpc.studies.described import RecordedPlant
from mpc.studies.run import Comparison, ControlRun, prediction_errors
from thermal.case.points import POINT_TYPES, split_column
from thermal.units import QUANTITIES, from_si

_CHANGING = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d|\b\d+(\.\d+)?\b")  # times and numbers within a reason


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
    title = f"Control of {run.study.name}: {run.entry.title}"
    content = _content((run,), run, command) | {
        "title": title,
        "verdict": control_verdict(run),
        "means": control_means(run),
        "table": None,
    }
    files = {"control.json": control_summary(run), "trajectory.parquet": trajectory(run)}
    return write_report(out, "control", content, files, force)


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
    """
    return write_results(out, comparison_files(comparison, comparison.study, command), force) / "report.html"


def comparison_files(comparison: Comparison, case: object, command: str = "") -> dict[str, Content]:
    """Make the files of a comparison.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    case : object
        On which it was made.
    command : str
        That led to it, for the page.
    """
    runs, (columns, rows) = comparison.runs, comparison_table(comparison)
    content = _content(runs, comparison.of("mpc") or runs[0], command) | {
        "title": f"Controllers of {comparison.study.name} compared",
        "verdict": comparison_verdict(comparison),
        "means": comparison_means(comparison),
        "columns": columns,
        "table": rows,
        "comfortable": all(z.below + z.above < NOTICED for run in runs for z in run.kpis.zones),
        "pictures": [*cost_bars(runs), *side_by_side(runs)],
    }
    files: dict[str, Any] = {"comparison.json": comparison_summary(comparison)}
    files |= {f"trajectory_{run.controller}.parquet": trajectory(run) for run in runs}
    return {**files, "report.html": render("control", content)}


def _content(runs: Sequence[ControlRun], shown: ControlRun, command: str) -> dict[str, Any]:
    """Lay out a page: the run that matters most, and each controller's part."""
    return {
        "shown": shown,
        "name": shown.entry.title,
        "fine": shown.controller != "mpc" or shown.sources.get("optimal plan", 0) == len(shown.decisions),
        "planned": shown.sources.get("optimal plan", 0),
        "indicators": own_indicators(shown.kpis),
        "runs": [_section(run, run is shown) for run in runs],
        "assumptions": assumption_rows(shown.study),
        "command": command,
    }


def _section(run: ControlRun, shown: bool) -> dict[str, Any]:
    return {
        "name": run.entry.title.capitalize(),
        "shown": shown,
        "how": run.entry.about.format(
            step=round(run.plant.control_step / 60.0), hours=run.study.hours, decided=run.study.decided
        ),
        "course": course(run),
        "expectations": expectations(run) if shown else [],
        "errors": prediction_errors(run),
        "reasons": reason_rows(run),
        "planned": bool(run.decisions),
        "comfortable": all(z.below + z.above < NOTICED for z in run.kpis.zones),
        "zones": sorted(run.kpis.zones, key=lambda z: -(z.below + z.above)),
    }


def control_summary(run: ControlRun) -> dict[str, Any]:
    """Contents of ``control.json``.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    study, times = run.study, [d.seconds for d in run.decisions]
    return {
        "controller": run.controller,
        "start": study.scenario.grid.start.isoformat(),
        "end": study.stamps[-1].isoformat(),
        "cost": run.cost,
        "cost_with_discomfort": run.objective,
        "comfort_price": study.comfort_price,
        "kpis": run.kpis.to_dict(),
        "actions": {"count": len(run.loop.actions), "sources": dict(run.sources),
                    "statuses": dict(Counter(d.status for d in run.decisions if d.status)),
                    "solve_seconds_mean": float(np.mean(times)) if times else None},
        "prediction": prediction_errors(run),
        "reasons": [{"first": row.first.isoformat(), "last": row.last.isoformat(), "count": row.times,
                     "reason": row.reason} for row in reason_rows(run)],
        "plant": {**study.facts, "control_step_seconds": run.plant.control_step}, "forecast": study.forecast,
        "notes": list(study.notes), "case": study.name, "version": version("buildingmpc"), "seed": study.seed,
    }  # fmt: skip


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
    frame, scenario, record, n = run.plant.telemetry(), run.study.scenario, run.loop.record, run.study.steps
    columns = {}
    for name in run.plant.columns:
        quantity = POINT_TYPES[split_column(name, "plant")[1]].quantity
        columns[name] = from_si(frame[name].to_numpy(), QUANTITIES[quantity].file_unit, quantity)
    for k, zone in enumerate(scenario.zones):
        columns[f"{zone}/comfort_lower_temperature"] = scenario.lower[:n, k] - CELSIUS
        columns[f"{zone}/comfort_upper_temperature"] = scenario.upper[:n, k] - CELSIUS
        columns[f"true/{zone}"] = record.zone_temperature[1:, k] - CELSIUS
    if isinstance(run.plant, RecordedPlant):  # with what was set and bought, `buildingmpc identify` can begin with it
        further = run.plant.seen.to_frame()
        columns |= {str(name): further[name].to_numpy() for name in further if name not in columns}
    columns["electricity_price"], columns["gas_price"] = scenario.electricity_price[:n], scenario.gas_price[:n]
    columns["true/electricity"] = record.electricity
    columns["true/gas"] = np.zeros(n) if record.gas is None else record.gas
    if record.district_heating is not None and scenario.district_price is not None:
        columns["district_heating_price"] = scenario.district_price[:n]
        columns["true/district_heating"] = record.district_heating
    table = pd.DataFrame(columns, index=frame.index)
    table.attrs["units"] = {name: _unit_of(name, scenario.currency) for name in columns}
    return table


def _unit_of(name: str, currency: str) -> str:
    """Give the unit of a column of the course."""
    if name.endswith("_price"):
        return f"{currency}/kWh"
    if name in ("true/electricity", "true/gas", "true/district_heating"):
        return "W"
    point = name.rpartition("/")[2]
    return QUANTITIES[POINT_TYPES[point].quantity].file_unit if point in POINT_TYPES else "degC"


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
    record = run.loop.record
    electricity, other = float(record.electricity.sum()), float(fuel_of(record, run.study.scenario).power.sum())
    shared = f", of which {percent(electricity / max(electricity + other, 1e-9))} electricity" if other else ""
    parts = [
        f"{run.entry.title.capitalize()} spent {money(run.cost, k.currency)} on energy in "
        f"{duration(3600.0 * k.hours)} ({significant(k.ener_tot)} kWh/m²{shared})."
    ]
    if k.tdis_tot < 1e-3:
        parts.append("No zone left its comfort band.")
    elif len(k.zones) == 1:
        parts.append(
            f"{worst.zone} was outside of its comfort band by {significant(k.tdis_tot, 2)} K h, at most by "
            f"{significant(max(worst.largest_below, worst.largest_above), 2)} K."
        )
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
        return f"{cheapest.entry.title.capitalize()} has the lowest cost with discomfort: {control_verdict(cheapest)}"
    name, change = best.entry.title, 1.0 - mpc.cost / best.cost
    comfort = mpc.kpis.tdis_tot - best.kpis.tdis_tot
    parts = [
        f"Optimal control spent {money(mpc.cost, mpc.kpis.currency)} on energy, the best rule ({name}) "
        f"{money(best.cost, best.kpis.currency)}: {percent(abs(change))} {'less' if change >= 0 else 'more'}."
    ]
    if abs(comfort) < 0.01:
        parts.append("Both keep the zones equally comfortable.")
    elif mpc.kpis.tdis_tot < NOTICED / 10.0:
        told = f"{significant(best.kpis.tdis_tot, 2)} K h on average"
        parts.append(f"It kept the zones in their comfort band; with the rule they were outside by {told}.")
    else:
        parts.append(
            f"Its zones were outside of their comfort band by {significant(mpc.kpis.tdis_tot, 2)} K h on average, "
            f"{'more' if comfort > 0 else 'less'} than the rule's {significant(best.kpis.tdis_tot, 2)} K h."
        )
    way = comparison.way_to_bound(mpc)
    if way is not None:
        parts.append(
            f"Counting discomfort at {comparison.study.comfort_price:g} {mpc.kpis.currency} a kelvin hour and "
            f"zone, that is {percent(way)} of the perfect-forecast savings."
        )
    return " ".join(parts)


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
