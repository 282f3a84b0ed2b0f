"""What a run or a comparison leaves behind: numbers as JSON, the course as a table, and a page for managers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mpc.reports import control_words
from mpc.reports.figures.control import cost_bars, course, expectations, side_by_side
from mpc.reports.figures.style import CELSIUS
from mpc.reports.page import write_report
from mpc.studies.run import Comparison, ControlRun, prediction_errors
from thermal.case.points import POINT_TYPES, split_column
from thermal.units import QUANTITIES, from_si

#: Length of a prediction of optimal control [h].
_HOURS = 12.0


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
        "verdict": control_words.control_verdict(run),
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

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    """
    runs = comparison.runs
    content = _content(runs, comparison.of("mpc") or runs[0], command) | {
        "title": f"Controllers of {comparison.study.name} compared",
        "verdict": control_words.comparison_verdict(comparison),
        "table": control_words.comparison_rows(comparison),
        "pictures": [*cost_bars(runs), *side_by_side(runs)],
    }
    files: dict[str, Any] = {"comparison.json": comparison_summary(comparison)}
    files |= {f"trajectory_{run.controller}.parquet": trajectory(run) for run in runs}
    return write_report(out, "control", content, files, force)


def _content(runs: Sequence[ControlRun], shown: ControlRun, command: str) -> dict[str, Any]:
    """Lay out a page: the run that matters most, and each controller's part."""
    return {
        "shown": shown,
        "name": shown.entry.title,
        "fine": shown.controller != "mpc" or shown.sources.get("optimal plan", 0) == len(shown.decisions),
        "planned": shown.sources.get("optimal plan", 0),
        "indicators": control_words.own_indicators(shown.kpis),
        "runs": [_section(run, run is shown) for run in runs],
        "command": command,
    }


def _section(run: ControlRun, shown: bool) -> dict[str, Any]:
    return {
        "name": run.entry.title.capitalize(),
        "shown": shown,
        "how": run.entry.about.format(step=round(run.plant.control_step / 60.0), hours=_HOURS),
        "course": course(run),
        "expectations": expectations(run) if shown else [],
        "errors": prediction_errors(run),
        "reasons": control_words.reason_rows(run),
        "planned": bool(run.decisions),
        "zones": sorted(run.kpis.zones, key=lambda z: -(z.below + z.above)),
    }


def control_summary(run: ControlRun) -> dict[str, Any]:
    """Contents of ``control.json``.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    study, chosen, times = run.study, run.study.settings, [d.seconds for d in run.decisions]
    return {
        "controller": run.controller,
        "start": study.scenario.grid.start.isoformat(),
        "end": study.stamps[-1].isoformat(),
        "cost": run.cost,
        "cost_with_discomfort": run.objective,
        "comfort_price": study.settings.comfort_price,
        "kpis": run.kpis.to_dict(),
        "actions": {"count": len(run.loop.actions), "sources": dict(run.sources),
                    "statuses": dict(Counter(d.status for d in run.decisions if d.status)),
                    "solve_seconds_mean": float(np.mean(times)) if times else None},
        "prediction": prediction_errors(run),
        "reasons": [{"first": row.first.isoformat(), "last": row.last.isoformat(), "count": row.times,
                     "reason": row.reason} for row in control_words.reason_rows(run)],
        "plant": {"building": chosen.kind, "step_seconds": study.scenario.grid.step, "noise": chosen.noise is not None,
                  "control_step_seconds": run.plant.control_step, "effects": list(study.built.effects)},
        "forecast": "with errors" if chosen.errors else "perfect",
        "notes": list(study.notes), "case": study.name, "version": version("buildingmpc"), "seed": chosen.seed,
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
        "case": comparison.study.name, "version": version("buildingmpc"), "seed": comparison.study.settings.seed,
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
    columns["electricity_price"], columns["gas_price"] = scenario.electricity_price[:n], scenario.gas_price[:n]
    columns["true/electricity"] = record.electricity
    columns["true/gas"] = np.zeros(n) if record.gas is None else record.gas
    return pd.DataFrame(columns, index=frame.index)
