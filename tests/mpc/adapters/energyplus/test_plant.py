"""EnergyPlus as a plant beside EnergyPlus alone: meters, own setpoints, energies, and what goes wrong."""

from __future__ import annotations

import re
import sqlite3

import numpy as np
import pytest

from mpc.errors import EnergyPlusError, PlantActionError, PlantError

pytestmark = pytest.mark.energyplus
REPLACED = re.compile(r"output|runperiod$|timestep$|simulationcontrol$|meter:|runperiodcontrol:daylight", re.I)
ALONE = """
Timestep,6;
SimulationControl,Yes,Yes,Yes,No,Yes,No,1;
RunPeriod,run,1,9,2023,1,10,2023,Monday,No,No,No,Yes,Yes;
Output:SQLite,Simple;
Output:Meter,Fans:Electricity,Timestep;
Output:Meter,Cooling:Electricity,Timestep;
Output:Meter,Heating:Electricity,Timestep;
Output:Meter,Pumps:Electricity,Timestep;
Output:Meter,Heating:NaturalGas,Timestep;
"""


@pytest.fixture(scope="module")
def alone(office, tmp_path_factory):
    """Meters of the second day, from the unchanged input file run without the library's callbacks [J]."""
    from mpc.adapters.energyplus.input import building_path
    from mpc.adapters.energyplus.process import Job, run_energyplus

    text = building_path("RefBldgMediumOfficeNew2004_Chicago").read_text(encoding="latin-1")
    objects = [o.strip() for o in re.sub(r"!.*", "", text).split(";") if o.strip()]
    kept = [o for o in objects if not REPLACED.match(o.split(",")[0].strip())]
    content = ";\n".join(kept) + ";\n" + ALONE
    files = run_energyplus(Job(content, "in.idf", office.weather, stepped=False), ["eplusout.sql"])
    path = tmp_path_factory.mktemp("alone") / "eplusout.sql"
    path.write_bytes(files["eplusout.sql"])
    query = """
        SELECT d.Name, SUM(r.Value) FROM ReportData r JOIN Time t USING (TimeIndex)
        JOIN ReportDataDictionary d USING (ReportDataDictionaryIndex)
        WHERE t.Day = 10 AND (t.WarmupFlag IS NULL OR t.WarmupFlag = 0) AND d.IsMeter = 1 GROUP BY d.Name
    """
    with sqlite3.connect(path) as database:
        found = dict(database.execute(query).fetchall())
    database.close()
    return found


@pytest.mark.long
def test_own_control_is_energyplus_alone(own, alone):
    assert set(own.metered()) == set(alone)
    for name, energy in own.metered().items():
        assert energy == pytest.approx(alone[name], rel=1e-6, abs=1.0), name


@pytest.mark.long
def test_its_own_setpoints_as_actions_change_nothing(own, make_plant):
    plant = make_plant(control_steps=3)
    plant.reset()
    mine = [a.name for a in plant.actuators if a.name.endswith("supply_air_temperature_setpoint")]
    theirs = own.telemetry()
    k = 0
    while not plant.finished:
        plant.step({name: round(float(theirs[name].iloc[k]), 9) for name in mine})
        k += 3
    assert plant.metered() == pytest.approx(own.metered(), rel=1e-6)
    np.testing.assert_allclose(plant.telemetry(), theirs, rtol=1e-6, atol=1e-6)


def test_energies_are_integrals_of_powers(own):
    record, telemetry, step = own.record(), own.telemetry(), 600.0
    last = own.recent(5)
    assert np.array_equal(last.zone_temperature, record.zone_temperature[-6:])
    assert np.array_equal(last.electricity, record.electricity[-5:])
    gas = sum(telemetry[c].sum() for c in telemetry if c.endswith("gas_power_sensor")) * step
    assert gas == pytest.approx(own.metered()["Heating:NaturalGas"], rel=1e-3)
    fans = sum(telemetry[c].sum() for c in telemetry if c.endswith("supply_fan_power_sensor")) * step
    assert fans == pytest.approx(own.metered()["Fans:Electricity"], rel=1e-3)
    electric = sum(v for k, v in own.metered().items() if k.endswith("Electricity"))
    assert record.electricity.sum() * step == pytest.approx(electric, rel=1e-12)
    assert record.n_steps == 144 and record.zone_temperature.shape == (145, 15)


def test_the_reheat_coils_give_the_heat_that_is_metered(own):
    heat = 0.0
    telemetry = own.telemetry()
    for loop in own.source.layout.air_loops:
        for t in loop.terminals:
            flow = telemetry[f"{t.name}/supply_air_flowrate_sensor"]
            warm = telemetry[f"{t.name}/discharge_air_temperature_sensor"]
            heat += (flow * 1006.0 * (warm - telemetry[f"{loop.name}/supply_air_temperature_sensor"])).sum() * 600.0
    assert heat == pytest.approx(own.metered()["Heating:Electricity"], rel=0.01)  # moist air holds a little more


def test_actions_are_followed_and_what_is_left_out_goes_back(own, make_plant):
    core = "Core_bottom VAV Box Component/zone_air_heating_temperature_setpoint"
    plant = make_plant(control_steps=72)
    plant.reset()
    air = {a.name: 289.15 for a in plant.actuators if a.name.endswith("supply_air_temperature_setpoint")}
    seen = plant.step({**air, "Core_bottom/zone_air_heating_temperature_setpoint": 295.15})
    assert seen["VAV_1/supply_air_temperature_setpoint"] == pytest.approx(289.15)
    assert seen[core] == pytest.approx(295.15)
    reheat = plant.record().electricity[42:72].sum()  # from seven to noon
    assert reheat < 0.9 * own.record().electricity[42:72].sum()
    seen = plant.step({})
    assert seen["VAV_1/supply_air_temperature_setpoint"] == pytest.approx(285.95)
    assert seen[core] == pytest.approx(own.telemetry()[core].iloc[72:].mean())


@pytest.mark.parametrize("action", [{"VAV_9/supply_air_temperature_setpoint": 290.0},
                                    {"VAV_1/supply_air_temperature_setpoint": 400.0},
                                    {"VAV_1/supply_air_temperature_setpoint": float("nan")}])  # fmt: skip
def test_a_bad_action_is_refused_by_name_and_changes_nothing(make_plant, action):
    plant = make_plant(control_steps=72)
    with pytest.raises(PlantError, match="reset"):
        plant.step({})
    plant._number = 0
    with pytest.raises(PlantActionError, match=next(iter(action))):
        plant.step(action)


def test_a_dead_process_is_a_named_error_and_nothing_is_left(make_plant, left_over):
    before = left_over()
    plant = make_plant(control_steps=72)
    plant.reset()
    assert left_over() - before
    plant._process._process.kill()
    with pytest.raises(EnergyPlusError, match="died|gone"):
        plant.step({})
    assert not left_over() - before
    with pytest.raises(PlantError, match="closed"):
        plant.step({})


@pytest.mark.long
def test_a_warm_up_that_swings_without_end_is_no_error_of_the_run(office):
    """A plenum of that day has two states that follow each other for 25 days, which EnergyPlus calls severe."""
    from mpc.adapters.energyplus.make import energyplus_plant
    from mpc.adapters.energyplus.plant import EnergyPlusSettings

    plant = energyplus_plant(
        "RefBldgMediumOfficeNew2004_Chicago", "2023-08-28", 1, EnergyPlusSettings(control_steps=288)
    )
    plant.reset()
    process = plant._process
    assert "CheckWarmupConvergence" in (process.output / "eplusout.err").read_text(encoding="latin-1")
    plant.step({})
    assert plant.finished and plant._process is None


def test_a_process_that_does_not_answer_is_ended(office, make_plant, left_over):
    before = left_over()
    plant = make_plant()
    plant._patience = 0.01
    with pytest.raises(EnergyPlusError, match="within 0.01 s"):
        plant.reset()
    assert not left_over() - before


def test_a_handle_that_is_not_there_is_named(office, make_plant):
    from mpc.adapters.energyplus.process import EnergyPlusProcess

    job = make_plant().job()._replace(
        variables=(("Zone Air Temperature", "Nowhere"),), meters=("No:Meter",),
        actuators=(("System Node Setpoint", "Temperature Setpoint", "No Node"),), products=(),
    )  # fmt: skip
    process = EnergyPlusProcess(job)
    with pytest.raises(EnergyPlusError, match="no handle for variables.*Nowhere.*meters.*No:Meter.*actuators.*No Node"):
        process.ask(1, [None] * len(job.actuators))
    assert not process.folder.exists()


def test_the_end_of_the_run_ends_the_process(own, left_over):
    assert own._process is None and own.finished
    with pytest.raises(PlantError, match="make it longer"):
        own.step({})


def test_a_scenario_of_another_building_is_refused(office):
    from mpc.adapters.energyplus.make import energyplus_scenario
    from mpc.adapters.energyplus.plant import EnergyPlusPlant, EnergyPlusSettings

    scenario = energyplus_scenario(office, "2023-01-10", 1, step_seconds=600.0)
    with pytest.raises(PlantError, match="days that the scenario covers"):
        EnergyPlusPlant(office, scenario, 2)
    with pytest.raises(PlantError, match="whole number"):
        EnergyPlusPlant(office, scenario, 1, EnergyPlusSettings(control_steps=7))
