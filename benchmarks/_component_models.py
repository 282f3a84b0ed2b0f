"""EnergyPlus' models of single components for `components_energyplus`, written object by object.

Plant components stand on a loop of their own with a `LoadProfile:Plant`; those of zones in a box of their own, all
boxes the same. Every number that both sides need stands at the top of `_component_plants` and `_component_zones`.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from _hvac_reference import WEATHER, ReferenceRunError, energyplus_data, run_energyplus

STEPS_PER_HOUR = 4


YEAR = (12, 31)  # month and day that a model runs up to


class Row(NamedTuple):
    """An energy over the year.

    Parameters
    ----------
    component, model, energy : str
        Ours, the object of EnergyPlus, and what is compared.
    reference, ours : float
        By EnergyPlus and by us [kWh].
    """

    component: str
    model: str
    energy: str
    reference: float
    ours: float


def row(component: str, model: str, energy: str, reference: np.ndarray, ours: np.ndarray) -> Row:
    """Sum powers [W] of all steps to energies."""
    each = (float(np.sum(power)) / STEPS_PER_HOUR / 1000.0 for power in (reference, ours))
    return Row(component, model, energy, *each)


def column(table: pd.DataFrame, key: str, variable: str) -> np.ndarray:
    """Give an output, one a step, in EnergyPlus' unit."""
    return table[key.upper(), variable].to_numpy(dtype=float)


def idf(kind: str, *fields: Any) -> str:
    """Write an object; what is None is left blank."""
    return ",\n  ".join([kind, *("" if field is None else str(field) for field in fields)]) + ";\n"


def curve(name: str, coefficients: Sequence[float], *ranges: float) -> str:
    """Write a curve: biquadratic of six coefficients, else quadratic or cubic."""
    kinds = {6: "Curve:Biquadratic", 3: "Curve:Quadratic", 4: "Curve:Cubic"}
    return idf(kinds[len(coefficients)], name, *coefficients, *ranges)


def constant(name: str, value: float) -> str:
    """Write a schedule that never changes."""
    return idf("Schedule:Constant", name, "Any Number", value)


def head(title: str, last: tuple[int, int]) -> str:
    """Begin a model: the weather file up to a month and day, in steps of a quarter of an hour."""
    return "".join([
        idf("Version", "25.2"),
        idf("Timestep", STEPS_PER_HOUR),
        idf("Building", title, 0, "Suburbs", 0.04, 0.04, "FullExterior", 25, 6),
        idf("GlobalGeometryRules", "UpperLeftCorner", "CounterClockWise", "Relative"),
        idf("SimulationControl", "No", "No", "No", "No", "Yes"),
        idf("RunPeriod", "year", 1, 1, 2017, *last, 2017, "Sunday", "No", "No", "No", "Yes", "Yes"),
        idf("ScheduleTypeLimits", "Any Number"),
        constant("always", 1.0),
        idf("Output:SQLite", "Simple"),
        *(idf("Output:Variable", "*", f"Site Outdoor Air {what}", "Timestep")
          for what in ("Drybulb Temperature", "Humidity Ratio", "Barometric Pressure", "Wetbulb Temperature")),
    ])  # fmt: skip


def outputs(key: str, *variables: str) -> str:
    """Ask for outputs of every step."""
    return "".join(idf("Output:Variable", key, variable, "Timestep") for variable in variables)


def loop(name: str, kind: str, component: str, flow: float, setpoint: float, load: str | None) -> str:
    """Write a loop: a pump and one component on its plant side, and a load profile, if any, on its demand side.

    The component's nodes are ``NAME in`` and, where it cools, ``NAME out``; behind what heats, at ``NAME middle``, a
    district connection brings what is left. The load is that of the schedule, its flow the loop's.
    """
    cools = kind.startswith(("Chiller", "CoolingTower"))
    scheme, last = ("Cooling", ()) if cools else ("Heating", ("DistrictHeating:Water", f"{name} backup"))
    end = f"{name} out" if cools else f"{name} middle"
    parts = [
        idf("PlantLoop", name, "Water", None, f"{name} operation", f"{name} out", 98, 1, flow, 0, 0.5, f"{name} begin",
            f"{name} out", f"{name} supply branches", None, f"{name} demand in", f"{name} demand out",
            f"{name} demand branches", None, "SequentialLoad"),
        constant(f"{name} setpoint", setpoint),
        idf("SetpointManager:Scheduled", f"{name} manager", "Temperature", f"{name} setpoint", f"{name} out"),
        idf("PlantEquipmentOperationSchemes", f"{name} operation", f"PlantEquipmentOperation:{scheme}Load",
            f"{name} scheme", "always"),
        idf(f"PlantEquipmentOperation:{scheme}Load", f"{name} scheme", 0, 1e9, f"{name} equipment"),
        idf("PlantEquipmentList", f"{name} equipment", kind, component, *last),
        idf("BranchList", f"{name} supply branches", f"{name} supply branch"),
        idf("Branch", f"{name} supply branch", None, "Pump:VariableSpeed", f"{name} pump", f"{name} begin",
            f"{name} in", kind, component, f"{name} in", end, *((*last, end, f"{name} out") if last else ())),
        idf("Pump:VariableSpeed", f"{name} pump", f"{name} begin", f"{name} in", flow, 100, 200 * flow, 0.9, 0, 0, 1, 0,
            0, 0, "Intermittent"),
        idf("BranchList", f"{name} demand branches", f"{name} demand branch"),
    ]  # fmt: skip
    if last:
        parts += [idf(*last, end, f"{name} out", 1e6)]
    if load is not None:
        parts += [
            idf("Branch", f"{name} demand branch", None, "LoadProfile:Plant", f"{name} profile", f"{name} demand in",
                f"{name} demand out"),
            idf("LoadProfile:Plant", f"{name} profile", f"{name} demand in", f"{name} demand out", load, flow,
                f"{load} flow"),
        ]  # fmt: skip
    return "".join(parts)


def series(name: str, values: np.ndarray, folder: Path) -> str:
    """Write a schedule of hourly values, and its file."""
    path = folder / f"{name.replace(' ', '_')}.csv"
    pd.Series(values).to_csv(path, index=False, header=["value"])
    return idf("Schedule:File", name, "Any Number", path, 1, 1, 8760)


def outdoor_hours() -> np.ndarray:
    """Dry bulb of the weather file, one an hour [degC]."""
    path = energyplus_data() / "weather" / WEATHER
    return pd.read_csv(path, skiprows=8, header=None)[6].to_numpy(dtype=float)


def run(text: str, folder: Path) -> pd.DataFrame:
    """Run a model: columns (key in capitals, variable), a row a step."""
    (folder / "in.idf").write_text(text, encoding="latin-1")
    run_energyplus(folder / "in.idf", folder / "out")
    query = """
        SELECT r.TimeIndex AS time, d.KeyValue AS key, d.Name AS variable, r.Value AS value
        FROM ReportData r JOIN ReportDataDictionary d USING (ReportDataDictionaryIndex)
        JOIN Time t USING (TimeIndex) WHERE t.WarmupFlag IS NULL OR t.WarmupFlag = 0
    """
    with closing(sqlite3.connect(folder / "out" / "eplusout.sql")) as database:
        rows = pd.read_sql_query(query, database)
    rows["key"] = rows["key"].str.upper()
    table = rows.pivot(index="time", columns=["key", "variable"], values="value")
    if len(table) % (24 * STEPS_PER_HOUR) or table.isna().any(axis=None):
        raise ReferenceRunError(f"expected whole days without gaps, found {len(table)} steps")
    return table
