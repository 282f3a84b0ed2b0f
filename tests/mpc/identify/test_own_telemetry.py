"""What a plant's own control left is enough: a model without an experiment, with and without its commands."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mpc.baselines.plants import OwnControl
from mpc.control.identified.controller import IdentifiedController
from mpc.identify.identify import Identified, identify
from mpc.identify.machines import find_machines
from mpc.identify.telemetry import PlantTelemetry, Site, run_recorded
from mpc.kpi.kpis import measure_kpis


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
