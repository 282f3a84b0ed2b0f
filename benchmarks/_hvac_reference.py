"""Weeks of EnergyPlus' reference offices for `hvac_energyplus`: a run in a process of its own, its outputs and sizes.

The runtime leaks state between runs, so each has its process: ``python _hvac_reference.py INPUT WEATHER FOLDER``.
"""

from __future__ import annotations

import os
import re
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

WEATHER = "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
WEEKS = {"winter": (1, 15), "summer": (7, 15)}  # month, first day; Mondays in a year that starts on a Sunday
STEPS_PER_HOUR = 12
_REPLACED = re.compile(r"output:|outputcontrol:|runperiod$|timestep$|simulationcontrol$|energymanagement|meter:", re.I)
_SEVERE = re.compile(r"(\d+) Severe Errors")


class ReferenceRunError(Exception):
    """EnergyPlus is not there, or did not end well."""


@dataclass(frozen=True)
class Reference:
    """A building's weeks.

    Parameters
    ----------
    weeks : dict of str to DataFrame
        Season to means over 5 minutes, columns (key, variable) in EnergyPlus' units.
    sizes : dict
        (component in capitals, description) to what EnergyPlus sized it to.
    """

    weeks: dict[str, pd.DataFrame]
    sizes: dict[tuple[str, str], float]

    def size(self, component: str, description: str) -> float:
        """Return the size of a component whose description begins so."""
        found = [v for (c, d), v in self.sizes.items() if c == component.upper() and d.startswith(description)]
        if not found:
            raise ReferenceRunError(f"no size {description!r} of {component!r}")
        return found[0]


def reference_weeks(name: str, outputs: Sequence[tuple[str, str]]) -> Reference:
    """Run a reference building over the weeks.

    Parameters
    ----------
    name : str
        File in EnergyPlus' data, such as ``RefBldgMediumOfficeNew2004_Chicago.idf``.
    outputs : sequence of tuple of str
        Key and variable of each output; key ``*`` for all.
    """
    data = energyplus_data()
    with tempfile.TemporaryDirectory(prefix="energyplus_") as temporary:
        folder = Path(temporary)
        text = (data / "model" / name).read_text(encoding="latin-1")
        (folder / "in.idf").write_text(_rewritten(text, outputs), encoding="latin-1")
        run_energyplus(folder / "in.idf", folder / "out")
        with closing(sqlite3.connect(folder / "out" / "eplusout.sql")) as database:
            return Reference(_weeks(database), _sizes(database))


def energyplus_data() -> Path:
    """Folder of EnergyPlus' models and weather."""
    try:
        import pyenergyplus
    except ImportError as error:
        raise ReferenceRunError("EnergyPlus is not installed: pip install -e .[energyplus]") from error
    return Path(str(pyenergyplus.__file__)).parent / "data"


def run_energyplus(model: Path, out: Path) -> None:
    """Run a model in a process of its own with the weather of the reference."""
    command = [sys.executable, __file__, str(model), str(energyplus_data() / "weather" / WEATHER), str(out)]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    end, errors = out / "eplusout.end", out / "eplusout.err"
    said = end.read_text(encoding="utf-8") if end.exists() else "no end file"
    severe = _SEVERE.search(said)
    if done.returncode != 0 or severe is None or int(severe[1]):
        lines = errors.read_text(encoding="utf-8").splitlines() if errors.exists() else [done.stderr[-1000:]]
        worst = [line for line in lines if "Severe" in line or "Fatal" in line or "~~~" in line][:20]
        raise ReferenceRunError("\n".join([f"{model}: EnergyPlus returned {done.returncode}: {said}", *worst]))


def _rewritten(text: str, outputs: Sequence[tuple[str, str]]) -> str:
    """Return the building with our weeks, step and outputs in the place of its own."""
    objects = re.sub(r"!.*", "", text).split(";")
    kept = [o.strip() for o in objects if o.strip() and not _REPLACED.match(o.split(",")[0].strip())]
    added = [f"Timestep,{STEPS_PER_HOUR}", "SimulationControl,YES,YES,YES,NO,YES", "Output:SQLite,SimpleAndTabular"]
    for season, (month, day) in WEEKS.items():
        added.append(f"RunPeriod,{season},{month},{day},,{month},{day + 6},,Monday,No,No,No,Yes,Yes")
    added += [f"Output:Variable,{key},{variable},Timestep" for key, variable in outputs]
    return ";\n".join([*kept, *added]) + ";\n"


def _weeks(database: sqlite3.Connection) -> dict[str, pd.DataFrame]:
    query = """
        SELECT e.EnvironmentName AS week, t.TimeIndex AS time, d.KeyValue AS key, d.Name AS variable, r.Value AS value
        FROM ReportData r JOIN Time t USING (TimeIndex) JOIN ReportDataDictionary d USING (ReportDataDictionaryIndex)
        JOIN EnvironmentPeriods e ON e.EnvironmentPeriodIndex = t.EnvironmentPeriodIndex
        WHERE e.EnvironmentType = 3 AND (t.WarmupFlag IS NULL OR t.WarmupFlag = 0)
    """
    rows = pd.read_sql_query(query, database)
    rows["key"] = rows["key"].str.upper()
    table = rows.pivot(index=["week", "time"], columns=["key", "variable"], values="value")
    weeks = {season: table.loc[season.upper()] for season in WEEKS}
    for season, week in weeks.items():
        if len(week) != 7 * 24 * STEPS_PER_HOUR or week.isna().any(axis=None):
            raise ReferenceRunError(f"{season}: expected a week without gaps, found {len(week)} steps")
    return weeks


def _sizes(database: sqlite3.Connection) -> dict[tuple[str, str], float]:
    rows = database.execute("SELECT CompName, Description, Value FROM ComponentSizes").fetchall()
    return {(str(name).upper(), str(what)): float(value) for name, what, value in rows if np.isfinite(float(value))}


def main(source: str, weather: str, out: str) -> int:
    """Run EnergyPlus."""
    from pyenergyplus.api import EnergyPlusAPI

    api = EnergyPlusAPI()
    state = api.state_manager.new_state()
    api.runtime.set_console_output_status(state, False)
    return int(api.runtime.run_energyplus(state, ["-w", weather, "-d", out, source]))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
