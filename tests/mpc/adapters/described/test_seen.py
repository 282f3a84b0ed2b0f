"""A server whose forecasts are the scenario: the same indicators as of the unit's file, for experiment and control."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from mpc.adapters.described.read import READY
from mpc.adapters.described.schema import PlantFile
from mpc.adapters.described.seen import seen_scenario
from mpc.errors import PlantError
from mpc.identify.excitation import ExcitationSettings
from mpc.kpi.bought import fuel_of
from mpc.kpi.daily import by_day
from mpc.kpi.kpis import measure_kpis
from mpc.reports.control import trajectory, write_control
from mpc.studies.described import PlantStudy
from mpc.studies.excited import run_experiment
from mpc.studies.run import run_controller

Make = Callable[..., Path]
START = {"start": "2023-02-01 12:00", "end": "2023-02-01 16:00"}


@pytest.fixture
def described(tmp_path: Path) -> Path:
    """The ready description, less what the house lacks."""
    told: dict[str, Any] = yaml.safe_load((READY / "bestest_hydronic_heat_pump.yaml").read_text(encoding="utf-8"))
    there = ("reaTZon_y", "reaPHeaPum_y", "reaQFloHea_y", "weaSta_reaWeaTDryBul_y")
    told["measurements"] = {c: s for c, s in told["measurements"].items() if s in there}
    told["actuators"] = {n: e for n, e in told["actuators"].items() if n == "heat_pump/compressor_speed"}
    told |= {"energy": {"electricity": ["reaPHeaPum_y"]}, "emissions": None}
    told["weather"] = {"outside_air_temperature_sensor": "TDryBul", "direct_normal_irradiance_sensor": "HDirNor"}
    (tmp_path / "plant.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")
    return tmp_path / "plant.yaml"


@pytest.mark.parametrize("district", [False, True])
def test_indicators_of_a_server_are_those_of_the_units_file(
    described: Path, boptest_url: str, make_house: Make, boptest_resources: dict[str, str], district: bool
) -> None:
    pytest.importorskip("httpx", reason="needs the extra [boptest]")
    if district:  # as of a building on district heating, whose heat is bought and priced
        told = yaml.safe_load(described.read_text(encoding="utf-8"))
        told["energy"]["district_heating"] = ["reaQFloHea_y"]
        told["prices"]["district_heating"] = "PriceDistrictHeatingPower"
        told["emissions"] = {"electricity": "EmissionsElectricPower",
                             "district_heating": "EmissionsDistrictHeatingPower"}  # fmt: skip
        described.write_text(yaml.safe_dump(told), encoding="utf-8")
    unit = make_house(kinds=("CoSimulation",), resources=boptest_resources)
    remote, own = (run_controller(PlantStudy(described, str(at), **START), "full_speed") for at in (boptest_url, unit))
    assert len(remote.loop.measurements) == 16 and remote.kpis.cost_tot > 0.0
    for name in ("cost_tot", "ener_tot", "tdis_tot"):
        assert getattr(remote.kpis, name) == pytest.approx(getattr(own.kpis, name), rel=1e-9)
    if district:
        record = own.loop.record
        heat, electricity = (float(np.mean(v)) * 4e-3 / 192.0 for v in (record.district_heating, record.electricity))
        assert own.kpis.ener_tot == pytest.approx(heat + electricity) and heat > 0.0
        assert own.kpis.cost_tot == pytest.approx(0.08 * heat + 0.3 * electricity)
        assert remote.kpis.emis_tot == pytest.approx(0.1 * heat + 0.2 * electricity)
        day, fuel = by_day(record, own.study.scenario).sum(), fuel_of(record, own.study.scenario)
        assert day["cost"] == pytest.approx(192.0 * own.kpis.cost_tot)
        assert day["energy"] == pytest.approx(192.0 * own.kpis.ener_tot) and fuel.name == "district heating"
        page = write_control(own, described.parent / "control").read_text(encoding="utf-8")
        assert "district heating price" in page
        table = trajectory(own)
        assert {"district_heating_price", "true/district_heating"} <= {*table}
    made = run_experiment(PlantStudy(described, boptest_url, **START), 1, ExcitationSettings())
    assert {"heat_pump/compressor_speed", "electricity", "electricity_price"} <= {
        c.removeprefix("set/") for c in made.telemetry.frame
    }
    assert measure_kpis(made.run.record, made.scenario).cost_tot > 0.0


def test_what_was_not_forecast_is_named(described: Path) -> None:
    file = PlantFile.model_validate(yaml.safe_load(described.read_text(encoding="utf-8")))
    stamps = pd.date_range("2023-02-01 12:15", periods=4, freq="15min", tz="Etc/GMT-1")
    frame = pd.DataFrame({"electricity_price": np.full(4, 0.2)}, index=stamps)
    with pytest.raises(PlantError, match="none of house/comfort_lower_temperature, house/comfort_upper_temperature"):
        seen_scenario(file, frame, 900.0)
