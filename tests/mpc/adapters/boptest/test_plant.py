"""The same building by HTTP and locally: measurements, records, forecasts and indicators are the same, bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from mpc.adapters.boptest.case import BoptestCase
from mpc.adapters.boptest.plant import BoptestPlant, BoptestTime
from mpc.errors import BoptestError, PlantActionError, PlantError
from mpc.kpi.kpis import measure_kpis
from mpc.loop.plant import Measurements
from mpc.loop.run import run_closed_loop
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import Forecast, Forecaster
from mpc.scenario.grid import StepGrid

DAY = 86_400.0
MORNING = 9 * DAY + 6 * 3600.0  # of a Tuesday
Connect = Callable[..., BoptestPlant]
TOTALS = ("cost_tot", "emis_tot", "ener_tot", "pele_tot", "pgas_tot", "tdis_tot")


class Answering:
    """A controller whose setpoints depend on what it sees and on what it expects."""

    def __init__(self, plant: BoptestPlant) -> None:
        self.names = [a.name for a in plant.actuators if "supply_" in a.name and "temperature" in a.name]
        self.zone = next(c for c in plant.columns if c.endswith("zone_air_temperature_sensor"))

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        room = measurements[self.zone]
        ahead = 280.0 if forecast is None else float(forecast.table["outside_air_temperature_sensor"].iloc[-1])
        air = float(np.clip(287.0 + 2.0 * (294.0 - room), 285.0, 300.0))
        water = float(np.clip(330.0 + 283.0 - ahead, 310.0, 355.0))
        return {name: air if "air" in name.rpartition("/")[2] else water for name in self.names}


def local_plant(served: BoptestCase, begin: float, warm_up: float, end: float) -> tuple[SimulatedPlant, int]:
    """The plant that the server runs, after its warm-up, without a server."""
    begun = served.begin(begin, warm_up, end)
    begun.plant.reset()
    for _ in range(begun.warm_up_steps):
        begun.plant.step(begun.plant.default_actions)
    return begun.plant, begun.warm_up_steps


@pytest.mark.parametrize(("per_control_step", "hours"), [(1, 6), (3, 12)])
def test_closed_loop_by_http_is_the_same_plant_run_locally(
    served: BoptestCase, connect: Connect, per_control_step: int, hours: int
) -> None:
    remote = connect(BoptestTime(MORNING, hours * 3600.0, DAY), 300.0 * per_control_step, horizon=12)
    run = run_closed_loop(remote, Answering(remote), forecasts=True)
    assert len(run.actions) == 12 * hours // per_control_step and remote.finished

    plant, warm = local_plant(served, MORNING, DAY, MORNING + DAY)
    controller = Answering(remote)
    forecaster = Forecaster(plant.scenario, 12 * per_control_step)
    rows, seen = [], None
    for k in range(len(run.actions)):
        given = dict(run.actions.iloc[k].dropna())
        if per_control_step == 1 and seen is not None:  # the controller, too, comes to the same setpoints
            assert dict(controller.step(seen, forecaster.table(warm + k))) == given
        for _ in range(per_control_step):
            seen = plant.step({**plant.default_actions, **given})
        rows.append([seen[column] for column in remote.columns])
    np.testing.assert_array_equal(run.measurements.to_numpy(), np.array(rows))
    whole = plant.record()
    np.testing.assert_array_equal(run.record.zone_temperature, whole.zone_temperature[warm:])
    np.testing.assert_array_equal(run.record.electricity, whole.electricity[warm:])
    np.testing.assert_array_equal(run.record.gas, whole.gas[warm:])
    assert run.record.step == 300.0

    price = served.prices["constant"].on(plant.scenario.grid)
    found = measure_kpis(run.record, replace(plant.scenario, electricity_price=price), first_step=warm)
    asked = remote.kpis()
    assert {name: asked[name] for name in TOTALS} == {name: getattr(found, name) for name in TOTALS}
    assert asked["idis_tot"] is None and asked["pdih_tot"] is None and 0.0 < asked["time_rat"] < 0.1


def test_stamps_are_local_and_measurements_those_of_the_case_format(served: BoptestCase, connect: Connect) -> None:
    plant = connect()
    seen = plant.reset()
    assert seen.stamp.isoformat() == "2023-01-10T00:00:00-08:00"
    assert plant.zone_names == served.building.zone_names
    assert set(seen.columns) == set(served.signals.columns)
    assert all(253.0 < seen[c] < 333.0 for c in seen.columns if c.endswith("zone_air_temperature_sensor"))
    assert plant.server_version == "1.0.0"


def test_forecasts_are_those_of_the_scenario(served: BoptestCase, connect: Connect) -> None:
    plant = connect(horizon=48, electricity_price="dynamic")
    plant.reset()
    plant.step({})
    here, warm = local_plant(served, 9 * DAY, DAY, 10 * DAY)
    expected = Forecaster(here.scenario, 48).table(warm + 1).table
    found = plant.forecast().table
    assert (found.index == expected.index).all()
    assert set(found.columns) == set(expected.columns)
    for column in expected:
        tolerance = 1e-12 if column == "wind_direction_sensor" else 0.0  # goes through radians
        np.testing.assert_allclose(found[column], expected[column], rtol=tolerance, err_msg=column)


def test_the_three_prices_differ_and_have_one_mean(served: BoptestCase, connect: Connect) -> None:
    prices = ("constant", "dynamic", "highly_dynamic")
    plants = [connect(control_step=3600.0, electricity_price=price) for price in prices]
    costs = []
    for plant in plants:
        plant.reset()
        for _ in range(12):
            plant.step({})
        costs.append(plant.kpis()["cost_tot"])
    assert len(set(costs)) == 3
    grid = StepGrid(served.clock.stamp(0.0), 3600.0, 24 * 12)
    means = [float(served.prices[price].on(grid).mean()) for price in prices]
    assert means[1] == pytest.approx(means[0], rel=1e-3) and means[2] == pytest.approx(means[0], rel=0.4)


def test_a_second_reset_repeats_the_first_from_the_kept_warm_up(connect: Connect) -> None:
    plant = connect()
    first = plant.reset().values_array
    ahead = [plant.step({}).values_array for _ in range(5)]
    np.testing.assert_array_equal(plant.reset().values_array, first)
    np.testing.assert_array_equal([plant.step({}).values_array for _ in range(5)], ahead)


def test_a_time_period_runs_to_its_end_and_no_further(served: BoptestCase, connect: Connect) -> None:
    plant = connect("typical_heat_day", 12 * 3600.0)
    seen = plant.reset()
    period = served.periods["typical_heat_day"]
    assert seen.seconds == served.clock.zero + period.start
    count = 0
    while not plant.finished:
        plant.step({})
        count += 1
    assert count == (period.end - period.start) / 43_200.0
    with pytest.raises(PlantError, match=r"test: expected 43200 s more, found 0 s; reset the plant"):
        plant.step({})


def test_setpoints_out_of_range_are_refused_by_name_before_they_are_sent(connect: Connect) -> None:
    plant = connect()
    first = plant.reset()
    water = next(a for a in plant.actuators if a.name == "BOILER/supply_water_temperature_setpoint")
    assert (water.lowest, water.highest, water.unit, water.required) == (310.0, 355.0, "K", False)
    for value in (400.0, 200.0, float("nan")):
        with pytest.raises(PlantActionError, match="BOILER/supply_water_temperature_setpoint"):
            plant.step({water.name: value})
    with pytest.raises(PlantActionError, match="did you mean|nearest|mean"):
        plant.step({"BOILER/supply_water_temperatur_setpoint": 330.0})
    assert plant.step({water.name: 355.0}).seconds == first.seconds + 300  # nothing was taken before


def test_wrong_use_is_refused(connect: Connect, server: object) -> None:
    plant = connect()
    with pytest.raises(PlantError, match="call reset"):
        plant.step({})
    plant.reset()
    with pytest.raises(PlantError, match="a step at least"):
        plant.record()
    with pytest.raises(BoptestError, match="steps of 300 s"):
        connect(control_step=450.0)
    with pytest.raises(BoptestError, match=r"time_period is 'peak_cool_day', but should be one of"):
        connect("peak_cool_day").reset()
    with pytest.raises(BoptestError, match="electricity_price"):
        connect(electricity_price="dynamc")
    with pytest.raises(BoptestError, match="no test case 'smal'; served are small"):
        BoptestPlant(plant._client.url, "smal", "mix_day", 300.0)
    with pytest.raises(BoptestError, match="url: expected such as"):
        BoptestPlant("127.0.0.1:80", "small", "mix_day", 300.0)


def test_closing_frees_the_test(connect: Connect, server: object) -> None:
    before = len(server.tests)
    with connect() as plant:
        assert len(server.tests) == before + 1
        plant.reset()
    assert len(server.tests) == before
    plant.close()  # twice is fine


def test_uncertain_forecasts_are_repeatable_and_grow(connect: Connect) -> None:
    sure = connect(horizon=240)
    unsure = connect(horizon=240, uncertainty={"temperature_uncertainty": "high", "solar_uncertainty": "low"})
    sure.reset()
    truth = sure.forecast().table["outside_air_temperature_sensor"].to_numpy()
    drawn = []
    for seed in (3, 3, 4):
        unsure.reset(seed)
        drawn.append(unsure.forecast().table["outside_air_temperature_sensor"].to_numpy() - truth)
    np.testing.assert_array_equal(drawn[0], drawn[1])
    assert (drawn[0] != drawn[2]).any()
    assert drawn[0][0] == 0.0 and np.abs(drawn[0]).max() > 0.3
