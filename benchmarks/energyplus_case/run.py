"""One EnergyPlus run and its checked results."""

import csv
import json
import re
import sqlite3
import tempfile
from contextlib import closing
from datetime import date
from pathlib import Path

import pandas as pd
from energyplus_trials.frame import SITE_OUTPUTS, STEPS_PER_HOUR

from energyplus_case import layout, model
from energyplus_case.thermostats import setpoints

STEP = pd.Timedelta(minutes=60 // STEPS_PER_HOUR)


class EnergyPlusError(Exception):
    """EnergyPlus did not do what the case needs; the message says what."""


def simulate(weather: Path, first: date, last: date, seed: int) -> pd.DataFrame:
    """Run EnergyPlus and return every output of the model, columns (entity, name), ends of intervals.

    Parameters
    ----------
    weather : Path
        EPW file.
    first, last : date
        First and last day of the run, in one year.
    seed : int
        Of the set points, at least 0.

    Returns
    -------
    DataFrame
        Index without time zone (standard time of the weather file); entity `site` or a zone's name; EnergyPlus's
        units: [degC], [kg/s], [W], [W/m2], [m/s], [degree].

    Raises
    ------
    EnergyPlusError
        Severe errors, an unfinished run, or missing outputs.
    """
    with tempfile.TemporaryDirectory(prefix="energyplus_") as name:
        folder = Path(name)
        columns = _write_setpoints(folder / "setpoints.csv", first, last, seed)
        source = folder / "in.epJSON"
        source.write_text(json.dumps(model.epjson(first, last, folder / "setpoints.csv", columns)), encoding="utf-8")
        _run(source, weather, folder / "out")
        with closing(sqlite3.connect(folder / "out" / "eplusout.sql")) as database:
            _check_geometry(database)
            return _read(database)


def _write_setpoints(path: Path, first: date, last: date, seed: int) -> list[tuple[str, str]]:
    """Write a year of set points; outside the run the run's first row is repeated. Return the columns."""
    run = pd.date_range(pd.Timestamp(first), pd.Timestamp(last) + pd.Timedelta(days=1), freq=STEP, inclusive="left")
    year = pd.date_range(f"{first.year}-01-01", f"{first.year + 1}-01-01", freq=STEP, inclusive="left")
    table = setpoints(run, seed).reindex(year).bfill().ffill()
    header = [" ".join(column) for column in table.columns]
    table.to_csv(path, index=False, header=header)
    return [(str(column[0]), str(column[1])) for column in table.columns]


def _run(source: Path, weather: Path, out: Path) -> None:
    try:
        from pyenergyplus.api import EnergyPlusAPI
    except ImportError as error:
        raise EnergyPlusError("EnergyPlus is not installed: pip install -e .[energyplus]") from error
    api = EnergyPlusAPI()
    state = api.state_manager.new_state()
    try:
        api.runtime.set_console_output_status(state, False)
        code = api.runtime.run_energyplus(state, ["-w", str(weather), "-d", str(out), str(source)])
    finally:
        api.state_manager.delete_state(state)
    end = (out / "eplusout.end").read_text(encoding="utf-8") if (out / "eplusout.end").exists() else "no end file"
    severe = re.search(r"(\d+) Severe Errors", end)
    if code != 0 or "Completed Successfully" not in end or severe is None or int(severe[1]) != 0:
        log = (out / "eplusout.err").read_text(encoding="utf-8") if (out / "eplusout.err").exists() else ""
        raise EnergyPlusError(f"EnergyPlus returned {code}: {end.strip()}\n{log}")


def _check_geometry(database: sqlite3.Connection) -> None:
    """Compare what EnergyPlus made of the surfaces with the layout: floor areas, facades' azimuths, glass."""
    floors = pd.read_sql_query("SELECT ZoneName AS zone, FloorArea AS area FROM Zones", database).set_index("zone")
    plan = layout.plan_areas(layout.plan_tokens())
    for zone, outline in layout.zone_rectangles().items():
        area = floors["area"][zone.upper()]
        if abs(area - outline.area) > 1e-6 or abs(area / plan[zone] - 1.0) > 0.01:
            found = f"{area} m2 in EnergyPlus, {outline.area} m2 in the layout, {plan[zone]} m2 in the plan"
            raise EnergyPlusError(f"{zone}: {found}")
    query = "SELECT SurfaceName AS name, Azimuth AS azimuth, Area AS area FROM Surfaces"
    surfaces = pd.read_sql_query(query, database).set_index("name")
    panes = layout.glazing()
    for segment in layout.segments():
        expected = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}[segment.side] + layout.ORIENTATION
        name = segment.name.upper()
        if abs(surfaces["azimuth"][name] - expected) > 1e-3:
            raise EnergyPlusError(f"{name} looks to {surfaces['azimuth'][name]}, not to {expected} degrees")
        area = panes.get(segment.zone, {}).get(segment.side, 0.0) if segment.other is None else 0.0
        glass = surfaces["area"].get(f"{name}_PANE", 0.0)
        if abs(glass - area) > 1e-6 or abs(surfaces["area"][name] + glass - segment.length * layout.HEIGHT) > 1e-6:
            raise EnergyPlusError(f"{name}: {surfaces['area'][name]} m2 of wall, {glass} m2 of glass; {area} expected")


def _read(database: sqlite3.Connection) -> pd.DataFrame:
    query = """
        SELECT d.KeyValue AS key, d.Name AS name, t.TimeIndex AS step, r.Value AS value
        FROM ReportData r JOIN ReportDataDictionary d USING (ReportDataDictionaryIndex) JOIN Time t USING (TimeIndex)
        WHERE t.WarmupFlag = 0 OR t.WarmupFlag IS NULL
    """
    rows = pd.read_sql_query(query, database)
    times = pd.read_sql_query("SELECT * FROM Time", database).set_index("TimeIndex")
    rows["key"] = rows["key"].fillna("").str.upper()
    table = rows.pivot(index="step", columns=["key", "name"], values="value")
    parts = times.loc[table.index]
    days = pd.to_datetime({"year": parts["Year"], "month": parts["Month"], "day": parts["Day"]})
    table.index = pd.DatetimeIndex(
        days + pd.to_timedelta(parts["Hour"], unit="h") + pd.to_timedelta(parts["Minute"], unit="m"), name="timestamp"
    )
    steps = table.index.to_series().diff().dropna()
    if not (steps == STEP).all():
        raise EnergyPlusError(f"expected results every {STEP}, found steps of {sorted(set(steps))}")
    return _select(table)


def _select(table: pd.DataFrame) -> pd.DataFrame:
    wanted = {("site", ours): ("ENVIRONMENT", name) for ours, name in SITE_OUTPUTS.items()}
    for zone in layout.ZONES:
        for ours, (name, key) in model.OUTPUTS_ZONE.items():
            wanted[zone, ours] = (key.format(zone=zone).upper(), name)
    missing = [source for source in wanted.values() if source not in table.columns or table[source].isna().any()]
    if missing:
        raise EnergyPlusError(f"EnergyPlus did not report {missing}; it reported {sorted(table.columns)}")
    return pd.DataFrame({ours: table[source] for ours, source in wanted.items()})


def without_sun(weather: Path, target: Path) -> None:
    """Write a copy of a weather file whose irradiances are all zero.

    Parameters
    ----------
    weather, target : Path
        EPW files.
    """
    with weather.open(encoding="latin-1", newline="") as source:
        rows = list(csv.reader(source))
    for row in rows[8:]:
        row[13:16] = ["0", "0", "0"]  # global horizontal, direct normal, diffuse horizontal [Wh/m2]
    with target.open("w", encoding="latin-1", newline="") as out:
        csv.writer(out, lineterminator="\n").writerows(rows)
