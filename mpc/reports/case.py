"""Pages about a case itself: what a check found, and what a replay gave."""

from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mpc.reports.evaluation import by_error, error_maps, tidy
from mpc.reports.figures.errors import Series, zone_panels
from mpc.reports.figures.plan import plan_drawings, quality_timeline
from mpc.reports.figures.style import CELSIUS
from mpc.reports.means import check_means, simulation_means
from mpc.reports.page import counted, duration, kelvin, percent, significant, write_report
from thermal.case.building import FloorPlans
from thermal.case.case import Case
from thermal.case.check import CaseCheck
from thermal.model.simulation import Simulation


def write_check(check: CaseCheck, out: str | Path, *, force: bool = False) -> Path:
    """Write ``check.json`` and ``report.html``.

    Parameters
    ----------
    check : CaseCheck
        From `thermal.case.check.check_case`.
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
    building, quality = check.case.building, check.quality
    plans = building.geometry if isinstance(building.geometry, FloorPlans) else None
    content = {
        "check": check,
        "verdict": check_verdict(check),
        "means": check_means(check),
        "span": f"{(check.end - check.start).total_seconds() / 86400:.3g} days",
        "plans": plan_drawings(plans, building.orientation) if plans else [],
        "missing_rows": sum(finding.steps for finding in quality.missing_rows),
        "timeline": quality_timeline(quality),
        "flaws": quality_rows(check),
        "anomalies": anomaly_rows(check),
        "fine": check.is_fit_for_calibration,
        "zones": [vars(z) | {"seen": ", ".join(z.measured_by) or "nothing", "at": ", ".join(z.devices)}
                  for z in check.zones],
        "points": [vars(p) | {"of": p.zone or p.entity_kind, "usable": 100.0 * p.usable_share} for p in check.points],
    }  # fmt: skip
    return write_report(out, "check", content, {"check.json": check.to_dict()}, force)


def check_verdict(check: CaseCheck) -> str:
    """Say in plain words what a case is and how good its telemetry is.

    Parameters
    ----------
    check : CaseCheck
        From `thermal.case.check.check_case`.
    """
    measured = sum(bool(z.measured_by) for z in check.zones)
    usable = 1.0 - float(np.mean([c.unusable_share for c in check.quality.columns]))
    flawed = sum(c.unusable_share > 0 for c in check.quality.columns)
    days = ((check.end - check.start).total_seconds() + check.step) / 86400.0
    wrong = [anomaly.what for anomaly in check.anomalies if anomaly.severity == "error"]
    valid = f"The case is not valid for calibration: {'; '.join(wrong)}. It has" if wrong else "The case is valid:"
    parts = [
        f"{valid} {counted(len(check.zones), 'zone')} on {significant(check.floor_area)} m², {measured}",
        f"of them measured, {counted(len(check.devices), 'device')}, {days:.3g} days of telemetry every",
        f"{duration(check.step)}. {percent(usable)} of its values can be used",
    ]
    text = " ".join(parts) + (f"; {flawed} of {len(check.quality.columns)} columns lack some." if flawed else ".")
    if check.anomalies:
        text += f" {counted(len(check.anomalies), 'finding').capitalize()}."
    return text + (f" {counted(len(check.remarks), 'remark').capitalize()}." if check.remarks else "")


def anomaly_rows(check: CaseCheck) -> list[list[str]]:
    """Rows of the list of anomalies: severity, certainty, when, what, what to do.

    Parameters
    ----------
    check : CaseCheck
        From `thermal.case.check.check_case`.
    """
    whole = (check.start, check.end)
    return [
        [a.severity, a.certainty,
         "all the time" if ends == whole else " to ".join(f"{t:%Y-%m-%d %H:%M}" for t in ends), a.what, a.advice]
        for a, ends in ((a, (a.start, a.end)) for a in check.anomalies)
    ]  # fmt: skip


def quality_rows(check: CaseCheck) -> list[list[str]]:
    """Rows of the table of quality: columns with findings, the worst first.

    Parameters
    ----------
    check : CaseCheck
        From `thermal.case.check.check_case`.
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
        From `thermal.model.simulation.simulate`.
    case : Case
        The case that was replayed.
    parameters : str
        Where the parameters come from.
    """
    error = simulation.simulated - simulation.measured
    seen = error.columns[error.notna().any()]
    by_zone = pd.DataFrame({"mae": error.abs().mean(), "bias": error.mean(), "mean_heat": simulation.heat.mean()})
    stamps = pd.DatetimeIndex(error.index)
    return {
        "case": case.building.name,
        "start": simulation.start.isoformat(),
        "end": stamps[-1].isoformat(),
        "step_seconds": (stamps[0] - simulation.start).total_seconds(),
        "steps": len(stamps),
        "mae": float(error.abs().mean(axis=1).mean()) if len(seen) else float("nan"),
        "bias": float(error.mean(axis=1).mean()) if len(seen) else float("nan"),
        "by_zone": by_zone.loc[seen].to_dict("index"),
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
        From `thermal.model.simulation.simulate`.
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
    summary = simulation_summary(simulation, case, parameters)
    files = {"simulation.json": summary, "simulation.parquet": _simulation_table(simulation)}
    return write_report(out, "simulation", _simulation_content(simulation, case, summary), files, force)


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
    zones, by_zone = tuple(map(str, simulation.simulated.columns)), summary["by_zone"]
    bias = np.array([by_zone[z]["bias"] if z in by_zone else np.nan for z in zones])
    courses = (frame.to_numpy(dtype=float) for frame in (simulation.measured, simulation.simulated))
    series = Series(pd.DatetimeIndex(simulation.simulated.index), *courses)
    return {
        "case": case.building.name,
        "summary": summary,
        "verdict": simulation_verdict(summary),
        "means": simulation_means(summary),
        "span": (simulation.start, series.stamps[-1]),
        "figures": {
            "plan": isinstance(case.building.geometry, FloorPlans),
            "zone_count": len(by_zone),
            "maps": error_maps(case, zones, bias, "mean over the time"),
            "zones": zone_panels(series, zones, {z: e["mae"] for z, e in by_zone.items()}),
        },
        "zones": by_error(by_zone),
    }


def _simulation_table(simulation: Simulation) -> pd.DataFrame:
    """Replay in tidy form: index ``timestamp``; ``zone``, ``simulated`` and ``measured`` [degC], ``heat`` [W]."""
    tables = {"simulated": simulation.simulated - CELSIUS, "measured": simulation.measured - CELSIUS}
    values = {name: t.to_numpy(dtype=float) for name, t in (tables | {"heat": simulation.heat}).items()}
    table = tidy(pd.DatetimeIndex(simulation.simulated.index), tuple(map(str, simulation.simulated.columns)), values)
    table.attrs["units"] = {"simulated": "degC", "measured": "degC", "heat": "W"}
    return table
