"""Numbers of closed loops: contents of JSON files, tables of their course, rows of controllers."""

from __future__ import annotations

from collections import Counter
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd

from mpc.reports.control_log import reason_rows
from mpc.studies.compare import Comparison
from mpc.studies.run import ControlRun, prediction_errors
from thermal.case.points import POINT_TYPES, split_column
from thermal.units import QUANTITIES, from_si


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
    study, chosen = run.study, run.study.settings
    return {
        "plant": {"building": chosen.kind, "step_seconds": study.scenario.grid.step, "noise": chosen.noise is not None,
                  "control_step_seconds": run.plant.control_step, "effects": list(study.built.effects)},
        "forecast": "with errors" if chosen.errors else "perfect",
        "notes": list(study.notes), "case": study.name, "version": version("buildingmpc"), "seed": chosen.seed,
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
            run.entry.title, f"{run.cost:,.2f}", f"{run.objective:,.2f}",
            "–" if saving is None or run is comparison.best_rule else f"{saving:.1%}".replace("-", "−"),
            f"{k.tdis_tot:.3f}", f"{worst:.2f}", f"{k.ener_tot:.3f}", f"{1e3 * (k.pele_tot or 0.0):.1f}",
            "–" if k.emis_tot is None else f"{1e3 * k.emis_tot:.1f}",
            "–" if way is None or not run.entry.predictive else f"{way:.0%}",
        ])  # fmt: skip
    return rows
