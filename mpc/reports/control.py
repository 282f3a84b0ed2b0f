"""What a run or a comparison leaves behind: numbers as JSON, the course as a table, and a page for managers."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from calibration.results import check_results_folder, write_results
from mpc.reports.control_log import reason_rows
from mpc.reports.control_tables import comparison_rows, comparison_summary, control_summary, trajectory
from mpc.reports.control_words import comparison_verdict, control_verdict, money
from mpc.reports.figures.control import cost_bars, course, expectations, side_by_side
from mpc.reports.page import clock, counted, render, significant
from mpc.studies.compare import Comparison
from mpc.studies.run import ControlRun, prediction_errors


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
    numbers = {"control.json": control_summary(run), "trajectory.parquet": trajectory(run)}
    title = f"Control of {run.study.name}: {run.entry.title}"
    together: dict[str, Any] = {"table": None, "bars": [], "together": []}
    return _write((run,), run, title, control_verdict(run), together, numbers, out, command, force)


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
    runs, title = comparison.runs, f"Controllers of {comparison.study.name} compared"
    numbers: dict[str, Any] = {"comparison.json": comparison_summary(comparison)}
    numbers |= {f"trajectory_{run.controller}.parquet": trajectory(run) for run in runs}
    together = {"table": comparison_rows(comparison), "bars": cost_bars(runs), "together": side_by_side(runs)}
    shown = comparison.of("mpc") or runs[0]
    return _write(runs, shown, title, comparison_verdict(comparison), together, numbers, out, command, force)


def _write(
    runs: Sequence[ControlRun],
    shown: ControlRun,
    title: str,
    verdict: str,
    together: dict[str, Any],
    numbers: dict[str, Any],
    out: str | Path,
    command: str,
    force: bool,
) -> Path:
    """Write the files of numbers and the page of one run or of several."""
    check_results_folder(out, force)
    content = _frame(shown, verdict, title) | together
    content |= {"runs": [_section(run, run is shown) for run in runs], "reproduce": _reproduce(runs[0], command)}
    return write_results(out, {**numbers, "report.html": render("control", content)}, force) / "report.html"


def _frame(run: ControlRun, verdict: str, title: str) -> dict[str, Any]:
    """Give what both pages begin with: the run that matters most."""
    study = run.study
    k, planned = run.kpis, run.sources.get("optimal plan", 0)
    cards = [
        (money(run.cost, k.currency), f"energy, {run.entry.title}"),
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
        "name": run.entry.title.capitalize(), "shown": shown,
        "how": run.entry.about.format(step=step, hours=hours),
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
        ("plant", f"building {study.settings.kind}, steps of {study.scenario.grid.step:g} s, "
                  f"{'sensors with noise' if study.settings.noise else 'exact sensors'}, "
                  f"weather forecast {'with errors' if study.settings.errors else 'perfect'}"),
        ("version", f"buildingmpc {version('buildingmpc')}, Python {platform.python_version()}"),
        ("seed", str(study.settings.seed)),
    ]  # fmt: skip
    return entries + ([("command", command)] if command else [])
