"""Controllers made in one call: what they decide, what they believe, and that they save."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from calibration.estimation.state_space import state_space
from mpc.control.controller.site import Source
from mpc.errors import ControlError
from mpc.kpi.kpis import measure_kpis
from mpc.loop.run import FixedSetpoints, run_closed_loop
from mpc.model import control_model
from mpc.studies.optimal_control import default_horizon, held_space, make_controller
from mpc.studies.registry import find_controller, register_controller
from thermal.effects.catalogue import chosen
from thermal.model.modal import modal_model


def test_a_held_step_is_several_steps_one_after_the_other(model) -> None:
    modes = modal_model(model.matrices(model.theta))
    one, held = state_space(modes, 300.0), held_space(modes, 900.0)
    rng = np.random.default_rng(0)
    x, u = rng.standard_normal(one.order), rng.standard_normal(one.drive.shape[1])
    then, means = x.copy(), []
    for _ in range(3):
        means.append(one.observation @ then + one.feedthrough @ u)
        then = one.advance(then) + one.drive @ u
    np.testing.assert_allclose(held.advance(x) + held.drive @ u, then, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(held.observation @ x + held.feedthrough @ u, np.mean(means, axis=0), rtol=1e-10)
    assert held_space(modes, 700.0).step == 700.0


@pytest.mark.parametrize(("hours", "blocks"), [(3.0, 5), (6.0, 8), (12.0, 10), (24.0, 13)])
def test_horizons_of_any_length(hours, blocks) -> None:
    ahead = default_horizon(900.0, hours)
    assert ahead.edges[-1] == hours * 3600.0 and ahead.n_block == blocks and ahead.control_step == 900.0
    with pytest.raises(ControlError, match="control step of up to 1800 s"):
        default_horizon(3600.0)


def test_it_saves_against_a_fixed_schedule(model, make_plant) -> None:
    plant = make_plant()
    controller = make_controller(model, plant, horizon=default_horizon(900.0, 6.0))
    assert [(c.lower, c.upper) for c in controller.problem.predictor.channels] == [(285.0, 300.0), (310.0, 355.0)]
    sources = []

    class Recorded:
        def step(self, measurements, forecast):
            sources.append(controller.step(measurements, forecast))
            return sources[-1]

    kinds = {"supply_air_temperature_setpoint": 287.15, "supply_water_temperature_setpoint": 333.15}
    costs = []
    for chosen_one, forecasts in ((Recorded(), True), (FixedSetpoints(kinds, plant.actuators), False)):
        run = run_closed_loop(plant, chosen_one, steps=32, seed=1, forecasts=forecasts)
        kpis = measure_kpis(run.record, plant.scenario)
        costs.append(kpis.cost_tot)
        assert kpis.tdis_tot < 0.1
    assert costs[0] < 0.6 * costs[1]
    assert {action.source for action in sources} == {Source.OPTIMAL}


def test_effects_of_the_model_follow_the_forecast(building, make_plant) -> None:
    """Sun and people drive the controller's model as they drive the plant's, a forecast of theirs at a time."""
    effects = chosen(["solar_gain", "internal_gains", "valve_leak"])
    model = control_model(building, dx=1.0, effects=effects, order=60)
    plant = make_plant(effects=chosen(["solar_gain", "internal_gains"]))
    controller = make_controller(model, plant)
    seen, ahead = plant.reset(0), controller.problem.predictor.horizon
    while plant.now < 144:  # noon
        controller.signals(plant.forecast(), ahead.stamps(seen.stamp))
        seen = plant.step(plant.default_actions)
    forecast = plant.forecast()
    found = controller.signals(forecast, ahead.stamps(seen.stamp))
    names = [s.name for s in model.network.signals]
    truth = {s.name: plant._signals._values[144:156, k] for k, s in enumerate(plant.model.network.signals)}
    assert found.shape == (len(ahead), len(names)) and set(truth) < set(names)
    for name, values in truth.items():
        np.testing.assert_allclose(found[:12, names.index(name)], values, rtol=1e-6, atol=1e-9, err_msg=name)
    assert controller.signals.left_out == tuple(n for n in names if n not in truth)
    assert controller.step(seen, forecast).source is Source.OPTIMAL


def test_what_is_missing_is_named(model, make_plant) -> None:
    with pytest.raises(ControlError, match="forecasts of the plant: expected 12 h, the horizon, found 6 h"):
        make_controller(model, make_plant(horizon=72))

    class Strange:
        control_step, zone_names, actuators = 900.0, ("a",), ()

    with pytest.raises(ControlError, match="`system` and `points`"):
        make_controller(model, Strange())
    with pytest.raises(ControlError, match="none beside a file"):
        control_model(make_plant().scenario.building, "calibration.json", effects=chosen(["solar_gain"]))


def test_a_name_is_registered_once_and_is_a_name() -> None:
    def make(study: Any, plant: Any) -> Any: ...

    with pytest.raises(ControlError, match="found 'mpc'"):
        register_controller("mpc")(make)
    for wrong in ("", "a,b", make):
        with pytest.raises(ControlError, match="register_controller"):
            register_controller(wrong)  # type: ignore[arg-type]
    assert find_controller("mpc").title == "optimal control"
