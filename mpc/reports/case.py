"""Pages about a case itself: what a check found, and what a replay gave."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.results import check_results_folder, write_results
from mpc.reports import figures
from mpc.reports.evaluation import CELSIUS, error_maps, tidy
from mpc.reports.page import clock, counted, duration, kelvin, render, signed, significant, unit
from thermal.case.building import FloorPlans
from thermal.case.case import Case
from thermal.case.check import CaseCheck
from thermal.model.simulation import Simulation


def write_check(check: CaseCheck, out: str | Path, *, force: bool = False) -> Path:
    """Write ``check.json`` and ``report.html``.

    Parameters
    ----------
    check : CaseCheck
        From `thermal.case.check_case`.
    out : str or Path
        Folder, made if need be.
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
    files: dict[str, Any] = {"check.json": check.to_dict(), "report.html": render("check", _check_content(check))}
    return write_results(out, files, force) / "report.html"


def check_verdict(check: CaseCheck) -> str:
    """Say in plain words what a case is and how good its telemetry is.

    Parameters
    ----------
    check : CaseCheck
        From `thermal.case.check_case`.
    """
    measured = sum(bool(z.measured_by) for z in check.zones)
    usable = 1.0 - float(np.mean([c.unusable_share for c in check.quality.columns]))
    flawed = sum(c.unusable_share > 0 for c in check.quality.columns)
    parts = [
        f"The case is valid: {counted(len(check.zones), 'zone')} on {significant(check.floor_area)} m², {measured}",
        f"of them measured, {counted(len(check.devices), 'device')}, {_days(check):.3g} days of telemetry every",
        f"{duration(check.step)}. {100 * usable:.1f} % of its values can be used",
    ]
    text = " ".join(parts) + (f"; {flawed} of {len(check.quality.columns)} columns lack some." if flawed else ".")
    return text + (f" {counted(len(check.remarks), 'remark').capitalize()}." if check.remarks else "")


def _days(check: CaseCheck) -> float:
    """Length of the telemetry [days]."""
    return float((check.end - check.start).total_seconds() + check.step) / 86400.0


def _check_content(check: CaseCheck) -> dict[str, Any]:
    geometry = check.case.building.geometry
    site = check.location
    return {
        "case": check.name,
        "subtitle": f"{site.latitude:g}°, {site.longitude:g}°, {site.elevation:g} m; times are local ({site.timezone})",
        "verdict": check_verdict(check),
        "cards": [
            (str(len(check.zones)), f"zones, {check.geometry}"),
            (f"{significant(check.floor_area)} m²", f"floor area; {significant(check.volume)} m³"),
            (
                f"{(check.end - check.start).total_seconds() / 86400:.3g} days",
                f"{clock(check.start)} to {clock(check.end)}",
            ),
            (str(len(check.points)), "measured points"),
        ],
        "remarks": check.remarks,
        "plans": figures.plan_drawings(geometry, check.case.building.orientation)
        if isinstance(geometry, FloorPlans)
        else [],
        "zones": [
            [
                z.name,
                z.floor or "–",
                f"{z.floor_area:.1f}",
                f"{z.volume:.1f}",
                ", ".join(z.measured_by) or "nothing",
                ", ".join(z.devices),
            ]
            for z in check.zones
        ],
        "missing_rows": sum(finding.steps for finding in check.quality.missing_rows),
        "stamps": check.n_time,
        "timeline": figures.quality_timeline(check.quality),
        "flaws": quality_rows(check),
        "points": [
            [
                p.column,
                p.meaning,
                p.zone or p.entity_kind,
                unit(p.unit),
                *(significant(v) for v in (p.lowest, p.mean, p.highest)),
                f"{100 * p.usable_share:.1f}",
            ]
            for p in check.points
        ],
        "reproduce": [
            ("version", f"buildingmpc {version('buildingmpc')}"),
            ("command", "buildingmpc check CASE --out RESULTS"),
        ],
    }


def quality_rows(check: CaseCheck) -> list[list[str]]:
    """Rows of the table of quality: columns with findings, the worst first.

    Parameters
    ----------
    check : CaseCheck
        From `thermal.case.check_case`.
    """
    kinds = ("gap", "impossible", "flat", "spike", "constant")
    flawed = sorted((c for c in check.quality.columns if c.findings), key=lambda c: -c.unusable_share)
    return [
        [c.column, f"{100 * c.missing_share:.1f}", f"{100 * c.unusable_share:.1f}",
         *(str(sum(f.kind == kind for f in c.findings) or "–") for kind in kinds)]
        for c in flawed
    ]  # fmt: skip


def simulation_summary(simulation: Simulation, case: Case, parameters: str = "uncalibrated") -> dict[str, Any]:
    """Contents of ``simulation.json``: errors of a replay, and the heat that drove it.

    Parameters
    ----------
    simulation : Simulation
        From `thermal.model.simulate`.
    case : Case
        The case that was replayed.
    parameters : str
        Where the parameters come from.
    """
    error = simulation.simulated - simulation.measured
    seen = error.columns[error.notna().any()]
    by_zone = {
        str(z): {
            "mae": float(error[z].abs().mean()),
            "bias": float(error[z].mean()),
            "mean_heat": float(simulation.heat[z].mean()),
        }
        for z in seen
    }
    stamps = pd.DatetimeIndex(error.index)
    return {
        "case": case.building.name,
        "start": simulation.start.isoformat(),
        "end": stamps[-1].isoformat(),
        "step_seconds": (stamps[0] - simulation.start).total_seconds(),
        "steps": len(stamps),
        "mae": float(error.abs().mean(axis=1).mean()) if len(seen) else float("nan"),
        "bias": float(error.mean(axis=1).mean()) if len(seen) else float("nan"),
        "by_zone": by_zone,
        "parameters": parameters,
        "version": version("buildingmpc"),
    }


def write_simulation(
    simulation: Simulation, case: Case, out: str | Path, *, parameters: str = "uncalibrated", force: bool = False
) -> Path:
    """Write ``simulation.json``, ``simulation.parquet`` and ``report.html``.

    Parameters
    ----------
    simulation : Simulation
        From `thermal.model.simulate`.
    case : Case
        The case that was replayed.
    out : str or Path
        Folder, made if need be.
    parameters : str
        Where the parameters come from, for the page.
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
    summary = simulation_summary(simulation, case, parameters)
    files: dict[str, Any] = {
        "simulation.json": summary,
        "simulation.parquet": _simulation_table(simulation),
        "report.html": render("simulation", _simulation_content(simulation, case, summary)),
    }
    return write_results(out, files, force) / "report.html"


def simulation_verdict(summary: dict[str, Any]) -> str:
    """Say in plain words how close a replay stayed to the building.

    Parameters
    ----------
    summary : dict
        From `simulation_summary`.
    """
    length = duration(summary["steps"] * summary["step_seconds"])
    lean = "too warm" if summary["bias"] > 0 else "too cold"
    return (
        f"Over {length} without another look at the sensors, the simulated zone temperatures are off by "
        f"{kelvin(summary['mae'])} K on average, and {lean} by {kelvin(abs(summary['bias']))} K."
    )


def _simulation_content(simulation: Simulation, case: Case, summary: dict[str, Any]) -> dict[str, Any]:
    zones = tuple(map(str, simulation.simulated.columns))
    by_zone = summary["by_zone"]
    bias = np.array([by_zone[z]["bias"] if z in by_zone else np.nan for z in zones])
    series = figures.Series(
        pd.DatetimeIndex(simulation.simulated.index),
        simulation.measured.to_numpy(dtype=float),
        simulation.simulated.to_numpy(dtype=float),
    )
    ordered = sorted(by_zone.items(), key=lambda item: -item[1]["mae"])
    return {
        "case": case.building.name,
        "subtitle": f"{clock(simulation.start)} to {clock(series.stamps[-1])}, local time",
        "verdict": simulation_verdict(summary),
        "cards": [
            (f"{kelvin(summary['mae'])} K", "mean absolute error over zones and time"),
            (f"{signed(summary['bias'])} K", "bias, simulated minus measured"),
            (
                duration(summary["steps"] * summary["step_seconds"]),
                f"in {summary['steps']} steps of {duration(summary['step_seconds'])}",
            ),
        ],
        "figures": {
            "growth": [],
            "drift": [],
            "runs": 0,
            "plan": isinstance(case.building.geometry, FloorPlans),
            "cells": False,
            "zone_count": len(by_zone),
            "maps": error_maps(case, zones, bias, "mean over the time"),
            "zones": figures.zone_panels(series, zones, {z: e["mae"] for z, e in by_zone.items()}),
        },
        "zones": [[z, f"{e['mae']:.3f}", signed(e["bias"]), significant(e["mean_heat"])] for z, e in ordered],
        "reproduce": [("version", f"buildingmpc {version('buildingmpc')}"), ("parameters", summary["parameters"])],
    }


def _simulation_table(simulation: Simulation) -> pd.DataFrame:
    """Replay in tidy form: index ``timestamp``; ``zone``, ``simulated`` and ``measured`` [degC], ``heat`` [W]."""
    values = {
        "simulated": simulation.simulated.to_numpy(dtype=float) - CELSIUS,
        "measured": simulation.measured.to_numpy(dtype=float) - CELSIUS,
        "heat": simulation.heat.to_numpy(dtype=float),
    }
    table = tidy(pd.DatetimeIndex(simulation.simulated.index), tuple(map(str, simulation.simulated.columns)), values)
    table.attrs["units"] = {"simulated": "degC", "measured": "degC", "heat": "W"}
    return table
