"""What a plant's own control left is enough: a model without an experiment, with and without its commands."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from mpc.baselines.plants import OwnControl
from mpc.control.identified.controller import IdentifiedController
from mpc.errors import PlantError
from mpc.identify.identify import Identified, identify
from mpc.identify.machines import find_machines
from mpc.identify.telemetry import PlantTelemetry, Site, run_recorded
from mpc.kpi.kpis import measure_kpis
from mpc.studies.described import PlantStudy


@pytest.fixture(scope="module")
def own(truth: SimpleNamespace) -> SimpleNamespace:
    house = truth.House(days=4, start="2023-01-10")
    site = Site("house", {"house": 192.0}, house.scenario.building.location)
    _, telemetry = run_recorded(house, OwnControl(), site)
    machines = find_machines(house.actuators, house.columns, house.zone_names)
    return SimpleNamespace(telemetry=telemetry, machines=machines, site=site)


@pytest.fixture(scope="module")
def without_commands(own: SimpleNamespace) -> Identified:
    return identify(own.telemetry, own.machines)


def test_commands_that_the_plant_measures_are_loads(own: SimpleNamespace, truth: SimpleNamespace) -> None:
    """A readback under the actuator's name stands in for what was not set; what was set counts before it."""
    frame = own.telemetry.frame
    heat = frame["heat_pump/heating_power_sensor"].to_numpy()
    speed = heat / np.array([truth.heat_of(1.0, t) for t in own.telemetry.outdoor])
    measured = PlantTelemetry(frame.assign(**{truth.heat_pump: speed}), own.telemetry.step, own.site)
    (machine,) = own.machines
    np.testing.assert_allclose(machine.level(measured), speed)
    half = frame.assign(**{truth.heat_pump: speed, f"set/{truth.heat_pump}": 0.25})
    np.testing.assert_allclose(machine.level(PlantTelemetry(half, own.telemetry.step, own.site)), 0.25)


def test_without_commands_the_note_says_what_full_load_is(without_commands: Identified) -> None:
    (note,) = without_commands.notes
    assert "no command of heat_pump/compressor_speed was recorded" in note
    (found,) = without_commands.model.maps
    heat = without_commands.telemetry.column("heat_pump/heating_power_sensor")
    assert found.heat(1.0, 1.0, 275.0, 303.15) == pytest.approx(np.quantile(heat, 0.98), rel=1e-6)
    # it never stopped: nothing tells its standing power from the base
    assert "standing" not in found.powers["electricity"].coefficients


def test_control_by_it_keeps_comfort_for_less(
    without_commands: Identified, own: SimpleNamespace, truth: SimpleNamespace
) -> None:
    def cost_of(controller: Any) -> tuple[float, float]:
        house = truth.House(days=1, start="2023-01-20")
        run, _ = run_recorded(house, controller, own.site, 48)
        kpis = measure_kpis(run.record, house.scenario)
        return kpis.cost_tot, kpis.tdis_tot

    before, _ = cost_of(OwnControl())
    house = truth.House(days=1, start="2023-01-20")
    cost, cold = cost_of(IdentifiedController(without_commands.model, house.actuators, own.site.location))
    assert cost < 0.8 * before and cold < 0.3


def test_a_real_building_has_its_machines_from_description_and_telemetry(tmp_path: Path) -> None:
    """No program stands for it that could be asked."""
    point = "north/zone_air_heating_temperature_setpoint"
    text = {
        "format": 1, "name": "hall", "plant": {"kind": "site"}, "control_step": 900.0,
        "location": {"latitude": 50.8, "longitude": 4.35, "elevation": 100.0, "timezone": "Europe/Brussels"},
        "period": {"start": "2026-01-12 00:00", "days": 1}, "zones": {"north": {"temperature": "x", "floor_area": 60.0}},
        "actuators": {point: {"signal": "y", "range": ["16 degC", "26 degC"]}},
    }  # fmt: skip
    (tmp_path / "plant.yaml").write_text(yaml.safe_dump(text))
    study = PlantStudy(tmp_path / "plant.yaml")
    index = pd.date_range("2026-01-05", periods=2, freq="15min", tz="Europe/Brussels")
    columns = ("north/zone_air_temperature_sensor", "north/heating_power_sensor", f"set/{point}")
    seen = PlantTelemetry(pd.DataFrame(dict.fromkeys(columns, 290.0), index=index), 900.0, study.site)
    (machine,) = study.seen_machines(seen)
    assert machine.name == point and machine.heat == "north/heating_power_sensor" and machine.serves == ("north",)
    assert (machine.actuator.lowest, machine.actuator.highest) == pytest.approx((289.15, 299.15))
    del text["actuators"][point]["range"]  # type: ignore[attr-defined]
    (tmp_path / "plant.yaml").write_text(yaml.safe_dump(text))
    with pytest.raises(PlantError, match="range: expected a lowest and a highest value"):
        PlantStudy(tmp_path / "plant.yaml").seen_machines(seen)
