"""Roll-outs against the plant's function and the modes step by step; slopes against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import Horizon, HorizonData
from mpc.errors import ControlError
from thermal.model.step import IMPLICIT_EULER
from thermal.system.symbolic import hvac_function


def test_a_rollout_solves_plant_and_building_together(make_problem, make_data, hvac, modes) -> None:
    problem = make_problem()
    data, predictor = make_data(problem), problem.predictor
    plan = np.array([[288.0, 330.0], [290.0, 345.0], [286.0, 320.0], [292.0, 335.0]])
    found, function = predictor.rollout(data, plan), hvac_function(hvac.system)
    x, water = data.state, data.water
    for k, dt in enumerate(predictor.horizon.steps):
        air, hot = plan[predictor.horizon.block_of[k]]
        done = function(
            BOILER_supply_water_temperature=water, zone_temperature=found.seen[k],
            zone_air_heating_temperature_setpoint=294.65, zone_air_cooling_temperature_setpoint=296.65,
            outdoor_temperature=276.0, outdoor_humidity=0.003, return_humidity=0.006, room_temperature=293.15,
            supply_air_temperature_setpoint=air, supply_water_temperature_setpoint=hot,
            supply_air_static_pressure_setpoint=250.0, differential_pressure_setpoint=80_000.0, fan_running=1.0,
            boiler_running=1.0, ventilation=1.0, seconds=dt,
        )  # fmt: skip
        heat, step = np.array(done["heat"]).ravel(), modes.propagator(dt, IMPLICIT_EULER)
        left = np.exp(-predictor.horizon.edges[k] / (6 * 3600.0)) * data.disturbance + data.gains[k]
        drive = modes.boundary @ (data.boundary[k] - 293.15) + modes.heating @ left
        free = step.end * x + step.end_gain * drive
        own = np.diag(modes.output @ (step.end_gain[:, None] * modes.heating))
        np.testing.assert_allclose(found.seen[k], modes.output @ free + 293.15 + own * heat, atol=1e-5)
        x, water = free + step.end_gain * (modes.heating @ heat), float(done["BOILER_supply_water_temperature_end"])
        np.testing.assert_allclose(found.zone[k + 1], modes.output @ x + 293.15, atol=1e-5)
        assert found.electric[k] == pytest.approx(float(done["electric_power"]), rel=1e-9)
        assert found.fuel[k] == pytest.approx(float(done["fuel_power"]), rel=1e-9)


@pytest.mark.parametrize("outdoor", [270.0, 300.0])
def test_slopes_are_those_of_finite_differences(make_problem, make_data, outdoor: float) -> None:
    problem = make_problem()
    data, predictor = make_data(problem, outdoor, 296.0), problem.predictor
    plan = np.array([[288.0, 330.0], [290.0, 345.0], [286.0, 320.0], [292.0, 335.0]])
    slopes = predictor.sensitivity(data, predictor.rollout(data, plan))
    for j in range(plan.size):
        moved = []
        for sign in (1.0, -1.0):
            other = plan.copy()
            other.ravel()[j] += sign * 1e-3
            moved.append(predictor.rollout(data, other))
        for name in ("zone", "electric", "fuel", "end_state"):
            wanted = (getattr(moved[0], name) - getattr(moved[1], name)) / 2e-3
            # what differences of temperatures of 300 K leave of their digits, and the rest of the steps' curvature
            close = 1e-8 + 2e-3 * np.abs(wanted).max()
            np.testing.assert_allclose(getattr(slopes, name)[..., j], wanted, atol=close, rtol=2e-3)


def test_thermostats_do_not_swing_at_long_steps(make_problem, make_data) -> None:
    """Five minutes or half an hour: the zones settle at the same temperatures."""
    ends = []
    for step in (300.0, 1800.0):
        problem = make_problem(Horizon.regular(6.0, step, 1, step))
        zone = problem.predictor.rollout(make_data(problem), np.array([[288.0, 340.0]])).zone
        assert np.abs(np.diff(zone[-4:], axis=0)).max() < 0.05
        ends.append(zone[-1])
    np.testing.assert_allclose(ends[0], ends[1], atol=0.05)


def test_heat_content_is_that_of_capacities(make_problem, modes) -> None:
    predictor = make_problem().predictor
    # a kelvin more everywhere, against the same by the definition of the modes
    assert predictor.heat_content(modes.uniform) == pytest.approx(float(modes.uniform**2 @ modes.capacity))


def test_two_channels_for_one_setpoint_are_refused(modes, hvac) -> None:
    twice = (
        Channel("supply_air_temperature_setpoint", 285.0, 300.0),
        Channel("supply_air_temperature_setpoint", 285.0, 300.0),
    )
    with pytest.raises(ControlError, match="one for each setpoint"):
        Predictor(modes, hvac, Horizon.regular(1.0, 300.0, 2), twice)
    with pytest.raises(ControlError, match="pressures=True"):
        Predictor(
            modes, hvac, Horizon.regular(1.0, 300.0, 2), (Channel("supply_air_static_pressure_setpoint", 100.0, 300.0),)
        )


def test_what_is_not_finite_is_named(make_problem, make_data) -> None:
    problem = make_problem()
    good = make_data(problem)
    price = good.electricity_price.copy()
    price[3] = np.nan
    with pytest.raises(ControlError, match="electricity_price"):
        make_data(problem, electricity_price=price)
    with pytest.raises(ControlError, match="lower"):
        HorizonData(**{**good.__dict__, "lower": good.lower[:3]})
