"""Controllers made in one call: what they decide, what they believe, and that they save."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from calibration.estimation.state_space import state_space
from mpc.control.controller.site import Source
from mpc.control.solvers.sampling import CrossEntropy
from mpc.errors import ControlError
from mpc.kpi.kpis import measure_kpis
from mpc.loop.run import FixedSetpoints, run_closed_loop
from mpc.model import control_model
from mpc.studies.optimal_control import (
    default_horizon,
    held_space,
    make_controller,
    make_sampling_controller,
)
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


@pytest.mark.long
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


def test_sampled_plans_cost_what_the_predictor_says_and_are_followed(model, make_plant) -> None:
    plant = make_plant(noise=None)
    few = CrossEntropy(samples=24, rounds=2)
    kept = []
    for _ in range(2):
        controller = make_sampling_controller(model, plant, hours=6.0, method=few, seed=4)
        seen, actions = plant.reset(1), []
        for _ in range(3):
            actions.append(controller.step(seen, plant.forecast()))
            seen = plant.step(actions[-1])
        kept.append([dict(a) for a in actions])
        assert all(a.source is Source.OPTIMAL and a.solution.solver == "sampling" for a in actions)
        assert all(a.solution.terms.total <= a.solution.start + 1e-9 for a in actions)
        ranges = {a.name: a for a in plant.actuators}
        assert all(ranges[name].accepts(value) for a in actions for name, value in a.items())
    assert kept[0] == kept[1]
    solution = actions[-1].solution
    assert solution.plan.shape == (5, 2) and len(controller.problem.predictor.horizon) == 24


@pytest.mark.long
def test_a_plan_tried_on_members_costs_what_the_smooth_model_says(model, make_plant) -> None:
    plant, caught = make_plant(noise=None), []
    controller = make_sampling_controller(model, plant, hours=6.0, method=CrossEntropy(samples=4, rounds=1))
    solver, solve = controller.solver, controller.solver.solve

    def watched(data, plan, time_limit=None):
        caught.append(data)
        return solve(data, plan, time_limit)

    solver.solve = watched
    seen = plant.reset(1)
    for _ in range(28):  # until the plant runs, at seven
        seen = plant.step(controller.step(seen, plant.forecast()))
    problem, data = controller.problem, caught[-1]
    shares = np.stack([np.tile(pair, problem.shape[0]) for pair in ([0.1, 0.4], [0.5, 0.9], [0.9, 0.5], [0.4, 0.1])])
    tried = solver.trials(data, shares)
    smooth = np.array([problem.terms(data, problem.predictor.rollout(data, problem.plan(row))) for row in shares])
    energy = tried[:, :2].sum(axis=1), smooth[:, :2].sum(axis=1)
    np.testing.assert_allclose(*energy, rtol=0.1)
    np.testing.assert_allclose(tried[:, 4], smooth[:, 4], rtol=1e-9)
    assert np.argsort(tried.sum(axis=1)).tolist() == np.argsort(smooth.sum(axis=1)).tolist()
