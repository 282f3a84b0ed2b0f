"""Plants of a description: the example of the documentation, what a unit of BOPTEST brings, servers, and refusals."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from mpc.adapters.boptest.scenario import YearClock
from mpc.adapters.described.load import _mappings, _span, load_plant
from mpc.adapters.described.read import READY, ready_plants
from mpc.adapters.described.schema import Period, PlantFile
from mpc.adapters.described.series import NamedSeries, read_table, unit_period
from mpc.adapters.fmu.plant import FmuSignals
from mpc.errors import MpcError, PlantActionError, PlantError
from mpc.identify.telemetry import PlantTelemetry
from mpc.kpi.kpis import measure_kpis
from mpc.loop.plant import Measurements
from mpc.loop.run import run_closed_loop
from mpc.scenario.forecast import Forecast
from mpc.scenario.grid import StepGrid
from mpc.studies.described import PlantStudy
from mpc.studies.electric import electric_of

pytest.importorskip("fmpy", reason="needs the extra [fmu]")
GUIDE = Path(__file__).parents[4] / "docs" / "plant.md"
SPEED, SETPOINT = "heat_pump/compressor_speed", "house/zone_air_heating_temperature_setpoint"
Make = Callable[..., Path]


def blocks(kind: str) -> list[str]:
    """Blocks of code of the guide."""
    return re.findall(rf"```{kind}[^\n]*\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, make_house: Make) -> Path:
    """The example of the guide, and its unit."""
    (tmp_path / "plant.yaml").write_text(blocks("yaml")[0])
    (tmp_path / "prices.csv").write_text(blocks("csv")[0])
    (tmp_path / "house.fmu").write_bytes(make_house().read_bytes())
    return tmp_path


class Saving:
    """A controller that heats at full speed while the price of the next hours is low, and else lets the house do it."""

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        assert forecast is not None and len(forecast.table) == 96
        return {SPEED: 1.0} if forecast.table["electricity_price"].iloc[:8].max() < 0.3 else {}


def test_the_example_of_the_guide_closes_a_loop(folder: Path) -> None:
    with load_plant(folder / "plant.yaml") as plant:
        by_name = {a.name: a for a in plant.actuators}
        assert (by_name[SPEED].kind, by_name[SPEED].minimum) == ("modulating", 0.25)
        setpoint = by_name["living/zone_air_heating_temperature_setpoint"]
        assert (setpoint.lowest, setpoint.highest, setpoint.unit) == (289.15, 299.15, "K")
        run = run_closed_loop(plant, Saving(), steps=36, forecasts=True)
        with pytest.raises(PlantActionError, match=r"0 \(off\) or a number from 0.25 to 1"):
            plant.step({SPEED: 0.2})
        scenario = plant.forecaster.scenario
        assert scenario.zones == ("living",) and scenario.areas.tolist() == [120.0] and scenario.grid.n_steps == 192
        assert scenario.electricity_price[68:80].tolist() == [0.35] * 12 and scenario.electricity_price[67] == 0.21
        assert scenario.electricity_carbon[0] == 0.167 and scenario.currency == "EUR"
        # from 7 to 22 h of a Wednesday, by the clock
        assert scenario.lower[27:30, 0].tolist() == [289.15, 294.15, 294.15] and scenario.lower[88, 0] == 289.15
        assert scenario.occupancy[[0, 31, 32, 68], 0].tolist() == [3.0, 3.0, 0.0, 3.0]
        np.testing.assert_allclose(scenario.outdoor, 273.15)
        heated = run.actions[SPEED].fillna(0.0).to_numpy()
        np.testing.assert_allclose(run.measurements["floor/heating_power_sensor"][heated == 1.0], 8000.0)
        kpis = measure_kpis(run.record, scenario)
        energy = run.measurements["heat_pump/electrical_power_sensor"].to_numpy() * 900.0 / 3.6e6
        assert kpis.cost_tot * 120.0 == pytest.approx(float(energy @ scenario.electricity_price[:36]), rel=1e-9)


def test_series_of_the_units_own_outputs_are_what_it_measures_later(folder: Path) -> None:
    unit = {"kind": "fmu", "file": "house.fmu", "parameters": {"amplitude": 6.0}, "interface": "model exchange"}
    with load_plant(folder / "plant.yaml", changes={"plant": unit}) as plant:
        plant.reset()
        ahead = plant.forecast().table["outside_air_temperature_sensor"].to_numpy()
        seen = [plant.step({})["weather_station/outside_air_temperature_sensor"] for _ in range(12)]
        np.testing.assert_allclose(seen, ahead[:12], atol=1e-9)
        edges = 2.0 * np.pi * np.arange(97) / 96.0  # of the day: the mean of a sine
        np.testing.assert_allclose(ahead, 273.15 - 6.0 * np.diff(np.cos(edges)) / np.diff(edges), atol=2e-5)
    wrong = {"forecast": {"hours": 6.0, "errors": "day_ahead"}}
    with load_plant(folder / "plant.yaml", changes={"plant": unit} | wrong) as plant:
        plant.reset()
        miss = plant.forecast().table["outside_air_temperature_sensor"].to_numpy() - ahead[:24]
        assert 0.05 < np.abs(miss).max() < 8.0


def cut_to_the_house() -> dict[str, Any]:
    """What of the ready description the house lacks is left out."""
    ready = yaml.safe_load((READY / "bestest_hydronic_heat_pump.yaml").read_text(encoding="utf-8"))
    there = ("reaTZon_y", "reaPHeaPum_y", "reaQFloHea_y", "weaSta_reaWeaTDryBul_y")
    return {
        "measurements": {c: s for c, s in ready["measurements"].items() if s in there},
        "actuators": {n: e for n, e in ready["actuators"].items() if n in (SPEED, "house/zone_air_heating_temperature_setpoint")},
        "energy": {"electricity": ["reaPHeaPum_y"]},
        "emissions": None,
        "weather": {"outside_air_temperature_sensor": "TDryBul", "direct_normal_irradiance_sensor": "HDirNor"},
    }  # fmt: skip


def test_what_a_unit_of_boptest_brings(make_house: Make, boptest_resources: dict[str, str]) -> None:
    """Its tables, its periods: by the ready description."""
    path, changes = make_house(resources=boptest_resources), cut_to_the_house()
    assert unit_period(path, "typical_heat_day") == (33 * 86_400.0, 14 * 86_400.0, 7 * 86_400.0)
    with load_plant("bestest_hydronic_heat_pump", at=path, changes=changes) as plant:
        seen = plant.reset()
        assert seen.stamp == YearClock(2023, "Etc/GMT-1").stamp(86_400.0)  # a week before day 8
        assert plant._warm * plant._step == 86_400.0 and plant._actions == 14 * 96
        table = plant.forecast().table
        hours = np.arange(96) / 4.0 + 0.125
        # straight lines over the hours of the table but for its jump at midnight; what holds is taken as it is
        np.testing.assert_allclose(table["outside_air_temperature_sensor"][:92], 273.15 + hours[:92])
        day = (hours > 7.0) & (hours < 22.0)
        np.testing.assert_array_equal(table["electricity_price"], np.where(day, 0.3, 0.1))
        np.testing.assert_array_equal(table["house/comfort_lower_temperature"], np.where(day, 294.15, 288.15))
        np.testing.assert_array_equal(table["house/occupancy_count_sensor"], np.where(day, 0.0, 5.0))
    with pytest.raises(PlantError, match="period: expected one that wrapped.fmu names in resources/days.json, found 'mix'"):
        load_plant("bestest_hydronic_heat_pump", at=path, changes=changes | {"period": "mix"})
    with pytest.raises(PlantError, match="the nearest valid one is 'reaTZon_y'"):
        zones = {"house": {"temperature": "reaTZone_y", "floor_area": 1.0}}
        load_plant("bestest_hydronic_heat_pump", at=path, changes=changes | {"zones": zones})


class Stepping:
    """Overwrites that come and go."""

    def __init__(self) -> None:
        self.plan = [{SPEED: 0.5}, {SPEED: 0.0, SETPOINT: 300.0}, {}, {SETPOINT: 295.15}, {SPEED: 1.0}, {}]

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        return self.plan.pop(0)


@pytest.mark.parametrize("period", ["peak_heat_day", {"start": "2023-02-01 12:00", "days": 2, "warm_up_days": 0.5}])
def test_a_server_and_the_units_file_are_the_same_plant(
    boptest_url: str, make_house: Make, boptest_resources: dict[str, str], period: Any
) -> None:
    pytest.importorskip("httpx", reason="needs the extra [boptest]")
    runs, seen = [], []
    for at in (boptest_url, make_house(kinds=("CoSimulation",), resources=boptest_resources)):
        changes = cut_to_the_house() | {"period": period}
        with load_plant("bestest_hydronic_heat_pump", at=at, changes=changes) as plant:
            runs.append(run_closed_loop(plant, Stepping(), steps=6))
            seen.append(plant.forecast().table)
    remote, own = runs
    pd.testing.assert_frame_equal(remote.measurements, own.measurements)
    powers = [4000.0 / 3.0 + 100.0, 0.0, 8000.0 / 3.0 + 100.0]
    np.testing.assert_allclose(own.measurements["heat_pump/electrical_power_sensor"].iloc[[0, 1, 4]], powers)
    np.testing.assert_array_equal(remote.record.zone_temperature, own.record.zone_temperature)
    others = ("internal_gain", "electricity_carbon_intensity")  # that the description leaves out
    both = [c for c in seen[0] if c in seen[1] and not c.endswith(others)]
    assert len(both) == 6
    pd.testing.assert_frame_equal(seen[0][both], seen[1][both], check_names=False, check_freq=False)


def test_means_of_series_are_exact() -> None:
    grid = StepGrid(pd.Timestamp("2023-01-01 00:15", tz="UTC"), 1800.0, 3)
    times = grid.edges[0] - 900.0 + np.array([0.0, 3600.0, 4500.0, 9000.0])
    series = NamedSeries("a table", times, {"x": np.array([0.0, 4.0, 0.0, 10.0])})
    held = series.on("x", grid, lines=False)
    np.testing.assert_allclose(held, [0.0, (900 * 0.0 + 900 * 4.0) / 1800.0, 0.0])
    fine = np.linspace(grid.edges[0], grid.edges[-1], 3 * 1800 + 1)
    values = np.interp(fine, times, [0.0, 4.0, 0.0, 10.0])
    exact = [np.trapezoid(values[k * 1800 : (k + 1) * 1800 + 1]) / 1800.0 for k in range(3)]
    np.testing.assert_allclose(series.on("x", grid, lines=True), exact, rtol=1e-12)
    late = StepGrid(pd.Timestamp("2023-01-01 02:15", tz="UTC"), 1800.0, 3)
    with pytest.raises(MpcError, match="series x of a table from"):
        series.on("x", late, lines=True)


def test_ready_descriptions_fit_the_schema() -> None:
    assert len(ready_plants()) == 7 and "bestest_hydronic_heat_pump" in ready_plants()
    for name in ready_plants():
        described = PlantFile.model_validate(yaml.safe_load((READY / f"{name}.yaml").read_text(encoding="utf-8")))
        assert described.name == name
        FmuSignals(**_mappings(described))  # refuses points that the case format lacks
        assert all(entry.signal.endswith("_u") for entry in described.actuators.values())
        assert all(signal.endswith("_y") for signals in described.energy.model_dump().values() for signal in signals)


def test_a_source_of_the_guide_needs_terminals_of_several_zones(folder: Path) -> None:
    told = yaml.safe_load(blocks("yaml")[0]) | yaml.safe_load(blocks("yaml")[1])
    (folder / "plant.yaml").write_text(yaml.safe_dump(told))
    study = PlantStudy(folder / "plant.yaml")
    expected = np.array([[253.15, 13800.0], [273.15, 31400.0], [293.15, 49000.0]])
    np.testing.assert_allclose(study.site.capacity, expected)
    cooled = PlantStudy(folder / "plant.yaml", cooling=True).site.capacity
    np.testing.assert_allclose(cooled, [[278.15, 50800.0], [318.15, 36400.0]])
    with study.plant() as plant, pytest.raises(PlantError, match="source: expected setpoints of all zones, two at leas"):
        study.machines(plant)


def test_the_battery_of_the_guide_is_no_machine(folder: Path) -> None:
    told = yaml.safe_load(blocks("yaml")[0]) | yaml.safe_load(blocks("yaml")[2])
    with pytest.raises(ValueError, match="expected an actuator of the description as the battery's, found 'battery/batt"):
        PlantFile.model_validate(told)
    told["actuators"]["battery/battery_command"] = {"signal": "oveBat_u", "range": [-1, 1]}
    told["measurements"]["battery/charge_level_sensor"] = {"signal": "reaSoc_y", "unit": "1"}
    told["plant"], told["prices"]["demand"] = {"kind": "site"}, 4.0
    told["actuators"][SPEED]["range"] = [0, 1]
    told["actuators"]["living/zone_air_heating_temperature_setpoint"]["range"] = [290.0, 299.0]
    file = PlantFile.model_validate(told)
    electric = electric_of(file)
    assert (electric.battery.capacity, electric.photovoltaic.tilt, electric.feed_in, electric.demand) == (36e6, 35.0, 0.08, 4.0)
    (folder / "plant.yaml").write_text(yaml.safe_dump(told))
    frame = pd.DataFrame(columns=["floor/heating_power_sensor"], dtype=float)
    study = PlantStudy(folder / "plant.yaml")
    assert [m.name for m in study.seen_machines(PlantTelemetry(frame, 900.0, study.site))] == [SPEED]


HOUSE: dict[str, Any] = {"temperature": "reaTZon_y", "floor_area": 120.0}
EDITS: list[tuple[dict[str, Any], str]] = [
    ({"format": 2}, "plant.yaml: format: expected 1, found 2"),
    ({"zonen": {}}, "plant.yaml: zonen: expected a key of the format, found 'zonen'; the nearest valid one is 'zones'"),
    ({"zones": {"living": {"temperature": "reaTZon_y", "floor_area": -1}}},
     "plant.yaml: zones.living.floor_area: expected greater than 0, found -1"),
    ({"zones": {"living": {"temperature": "reaTZon_y", "floor_area": 9.0, "comfort": {"lower": 294.0}}}},
     "zones.living.comfort: expected 'lower' and 'upper', or 'occupied' and 'unoccupied' with hours"),
    ({"actuators": {SPEED: {"signal": "oveHeaPumY_u", "kind": "modulating"}}}, "expected a minimum of a modulating"),
    ({"actuators": {SPEED: {"signal": "oveHeaPumY_u", "kind": "stepped"}}}, f"actuators.{SPEED}.kind"),
    ({"actuators": {SETPOINT: {"signal": "oveTSet_u", "capacity": [["7 degC", 9000], ["-5 degC", 7000]]}}},
     "expected a capacity over rising outdoor temperatures, found [280.15, 268.15] K"),
    ({"source": {"heating": [["7 degC", 9000], ["-5 degC", 7000]]}},
     "source.heating: expected a capacity over rising outdoor temperatures, found [280.15, 268.15] K"),
    ({"source": {"capacity": []}}, "source.capacity"),
    ({"energy": {"district_heating": ["reaQFloHea_y"]}}, "expected prices.district_heating, which is bought, found none"),
    ({"actuators": {SPEED: "oveHeaPumX_u"}}, "'oveHeaPumX_u'; the nearest valid one is 'oveHeaPumY_u'"),
    ({"zones": {"living": HOUSE | {"comfort": {"lower": 21, "upper": 24}}}},
     "zones.living.comfort: expected a lower and an upper temperature in K, found 21 to 24"),
    ({"zones": {"living": HOUSE | {"comfort": {"lower": "24 degC", "upper": {"weekday": ["21 degC"] * 24}}}}},
     "zones.living.comfort: expected a lower and an upper temperature in K, found 297.15 to 294.15"),
    ({"zones": {"living": HOUSE | {"comfort": {"lower": "heat", "upper": "24 degC"}}}, "series": ["heat.csv", "prices.csv", "outputs"]},
     "zones.living.comfort.lower: expected values from -20 degC to 60 degC, found -252.15 degC of 'heat'"),
    ({"actuators": {SETPOINT: {"signal": "oveTSet_u", "range": [16, 26]}}},
     f"limits: {SETPOINT}: expected numbers from 253.15 to 333.15, in the library's unit, found 16 to 26"),
    ({"actuators": {SPEED: "oveHeaPumY_u", "pump/speed": "oveHeaPumY_u"}},
     f"actuators: pump/speed: expected an input of its own, found 'oveHeaPumY_u' of {SPEED}"),
    ({"measurements": {"a/zone_air_temperature_sensor": {"signal": "reaTZon_y", "unit": "degC"},
                       "b/zone_air_temperature_sensor": {"signal": "reaTZon_y", "unit": "K"}}},
     "signal 'reaTZon_y': expected one unit, 'degC', found 'K'"),
    ({"weather": {"outside_air_temperature_sensor": {"signal": "reaTZon_y", "unit": "degC"}}},
     "weather.outside_air_temperature_sensor: expected values from -80 degC to 65 degC, found 292.536 degC of 'reaTZon_y'"),
    ({"prices": {"electricity": True}}, "prices.electricity: expected a number, the name of a series, or hours"),
    ({"prices": {"electricity": {"weekday": [0.1]}}}, "prices.electricity.weekday"),
    ({"prices": {"electricity": "spott"}}, "prices.electricity: expected a series of prices.csv, found 'spott'; the nea"),
    ({"prices": {"electricity": "0.25"}}, "prices.electricity: expected a number, the name of a series, or hours"),
    ({"prices": {"electricity": "spott"}, "series": ["prices.csv", "outputs"]},
     "FMU house.fmu: series of prices.electricity: expected a variable, found 'spott'"),
    ({"period": {"start": "NaT", "days": 1}}, "period.start: expected a local time"),
    ({"period": {"start": "1500-01-01", "days": 1}}, "of the years 1"),
    ({"period": {"start": "2023-01-11", "days": 1e9}}, "period.days: expected less than or equal to 3660"),
    ({"control_step": 1e-6}, "control_step: expected greater than or equal to 1"),
    ({"forecast": {"hours": 1e9}}, "forecast.hours: expected less than or equal to 8784"),
    ({"plant": {"kind": "fmu", "file": "house.fmu", "communication_step": 1e-9}}, "communication_step: expected greater than or equal to 0.001"),
    ({"prices": None}, "prices: expected those of electricity beside the weather, found none"),
    ({"weather": {"outdoor": "spot"}}, "weather.outdoor: expected a point of the weather station, found 'outdoor'"),
    ({"period": {"start": "soon", "days": 1}}, "period.start: expected a local time such as 2023-01-09 00:00"),
    ({"period": "peak_heat_day"}, "period: expected one that house.fmu names in resources/days.json"),
    ({"period": {"start": "2023-01-12", "days": 2}}, "spot of prices.csv from 2023-01-12"),
    ({"series": ["prices.xlsx"]}, "series: expected 'unit', 'outputs' or a .csv file, found 'prices.xlsx'"),
    ({"series": ["unit"]}, "expected tables in its resources, as BOPTEST's units, found none"),
    ({"series": ["none.csv"]}, "series none.csv: expected a .csv file, found no such file"),
    ({"plant": {"kind": "fmu", "file": "none.fmu"}}, "plant.file none.fmu: expected a functional mock-up unit"),
    ({"plant": {"kind": "tmu", "file": "house.fmu"}}, "plant.yaml: plant.kind: expected one of 'fmu', 'boptest', 'energyplus', 'site', found 'tmu'"),
    ({"plant": {"kind": "boptest", "url": "http://127.0.0.1:9"}}, "prices.electricity: expected one of PriceElec"),
    ({"location": {"latitude": 0, "longitude": 0, "elevation": 0, "timezone": "Mars"}}, "location.timezone"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "says"), EDITS, ids=[says[:40] for _, says in EDITS])
def test_descriptions_that_do_not_fit(folder: Path, changes: Mapping[str, Any], says: str) -> None:
    changed = dict(changes)
    if changed == {"prices": {"electricity": "spott"}}:
        changed["series"] = ["prices.csv"]
        changed["weather"] = {"outside_air_temperature_sensor": {"signal": "spot", "unit": "degC"}}
    (folder / "heat.csv").write_text("timestamp,heat\n2023-01-10,21\n2023-01-14,21\n")
    with pytest.raises(MpcError, match=re.escape(says)):
        load_plant(folder / "plant.yaml", changes=changed)


def test_the_unit_that_a_unit_declares_holds_for_its_series(folder: Path) -> None:
    """A setpoint that is declared in degC, by the series of the same instant in K."""
    house = folder / "house.fmu"
    with zipfile.ZipFile(house) as unit:
        content = {name: unit.read(name) for name in unit.namelist()}
    told = content["modelDescription.xml"].replace(b'<Real unit="K"/>', b'<Real unit="degC"/>')
    assert told != content["modelDescription.xml"]
    with zipfile.ZipFile(house, "w") as unit:
        for name, data in (content | {"modelDescription.xml": told}).items():
            unit.writestr(name, data)
    # the house computes in kelvin, 20 of them here; it is its description that calls them degC
    plant = {"kind": "fmu", "file": "house.fmu", "parameters": {"mean": 20.0}}
    with load_plant(folder / "plant.yaml", changes={"plant": plant, "period": {"start": "2023-01-11", "days": 1}}) as made:
        np.testing.assert_allclose(made.forecaster.scenario.outdoor, 293.15)


HOURS = pd.date_range("2023-10-28", "2023-10-31", freq="h", tz="Europe/Brussels")


@pytest.mark.parametrize(
    "stamps",
    [
        [stamp.isoformat() for stamp in HOURS],
        HOURS.tz_convert("UTC").strftime("%Y-%m-%dT%H:%MZ"),
        HOURS.strftime("%Y-%m-%d %H:%M"),
    ],
    ids=["offsets", "UTC", "local"],
)
def test_tables_over_a_change_of_clocks(tmp_path: Path, stamps: Sequence[str]) -> None:
    (tmp_path / "p.csv").write_text("\n".join(["timestamp,spot", *(f"{stamp},0.2" for stamp in stamps)]))
    table = read_table(tmp_path / "p.csv", "p.csv", YearClock(2023, "Europe/Brussels"))
    np.testing.assert_array_equal(table.seconds, [stamp.timestamp() for stamp in HOURS])


@pytest.mark.parametrize(
    ("stamps", "says"),
    [
        (["2023-10-29 01:00", "2023-10-29 02:00", "2023-10-29 03:00"], "write offsets or UTC"),
        (["10.01.2023", "11.01.2023"], "series p.csv: column 'timestamp': expected times"),
        (["2023-01-01", "", "2023-01-02"], "found nan in row 2"),
        (["1500-01-01", "2023-01-02"], "1500-01-01"),
    ],
)
def test_stamps_that_are_none(tmp_path: Path, stamps: Sequence[str], says: str) -> None:
    (tmp_path / "p.csv").write_text("\n".join(["timestamp,spot", *(f"{stamp},0.2" for stamp in stamps)]))
    with pytest.raises(PlantError, match=re.escape(says)):
        read_table(tmp_path / "p.csv", "p.csv", YearClock(2023, "Europe/Brussels"))


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(PlantError, match=r"house.yaml: expected a description of a plant, or one of bestest_air, best"):
        load_plant(tmp_path / "house.yaml")
    (tmp_path / "twice.yaml").write_text("format: 1\nname: a\nname: b\n")
    with pytest.raises(PlantError, match="twice.yaml: line 3: expected a new key"):
        load_plant(tmp_path / "twice.yaml")
    (tmp_path / "list.yaml").write_text("- 1\n")
    with pytest.raises(PlantError, match="list.yaml: expected a mapping of keys, found list"):
        load_plant(tmp_path / "list.yaml")


def test_a_warm_up_begins_with_the_year_at_the_earliest() -> None:
    clock, span = _span(Period(start="2023-01-03", days=1, warm_up_days=7), "Europe/Brussels")
    assert clock.year == 2023 and span == (2 * 86_400.0, 86_400.0, 2 * 86_400.0)


def test_holes_of_tables_are_not_bridged(tmp_path: Path) -> None:
    """An hourly table that lacks a day is refused where it is asked for it; its last row holds for an hour."""
    hours = np.delete(np.arange(0.0, 240.0), np.arange(100, 124))
    start = pd.Timestamp("2023-01-01", tz="UTC")
    series = NamedSeries("p.csv", start.timestamp() + 3600.0 * hours, {"spot": np.ones(len(hours))})

    def grid(first: float, hours: int) -> StepGrid:
        return StepGrid(start + pd.Timedelta(hours=first), 3600.0, hours)

    np.testing.assert_array_equal(series.on("spot", grid(0, 99), lines=False), 1.0)
    np.testing.assert_array_equal(series.on("spot", grid(130, 110), lines=False), 1.0)
    with pytest.raises(PlantError, match="rows every 3600 s, found 25 h without after 2023-01-05 03:00 UTC"):
        series.on("spot", grid(90, 24), lines=False)
    ends = NamedSeries("p.csv", np.append(series.seconds[:50], series.seconds[50] + 7200.0), {"spot": np.ones(51)})
    with pytest.raises(MpcError, match="spot of p.csv"):
        ends.on("spot", grid(50, 4), lines=False)
    changes = NamedSeries("c.csv", start.timestamp() + 3600.0 * np.array([0, 7, 22, 31, 240]), {"spot": np.ones(5)})
    np.testing.assert_array_equal(changes.on("spot", grid(0, 240), lines=False), 1.0)
    (tmp_path / "p.csv").write_text("time,spot,spot\n0,1,2\n3600,1,2\n")
    with pytest.raises(PlantError, match="a name of its own for each column, found .'spot'. again"):
        read_table(tmp_path / "p.csv", "p.csv", YearClock(2023, "UTC"))
