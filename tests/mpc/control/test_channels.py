"""Pressures and zone setpoints as decisions: slopes by finite differences, what they save, what they may not be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import Channel, supply_channels
from mpc.control.problem.horizon import Horizon
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.ipopt import IpoptSolver
from mpc.control.solvers.sequential import SequentialSolver
from mpc.errors import ControlError
from thermal.system.smooth import SmoothHvac
from thermal.system.system import HvacSystem

PRESSURES = (
    Channel("supply_air_static_pressure_setpoint", 60.0, 300.0),
    Channel("differential_pressure_setpoint", 2e4, 9e4),
)
HEATING = Channel("zone_air_heating_temperature_setpoint", 289.0, 295.0, zones=(0, 2))
COOLING = Channel("zone_air_cooling_temperature_setpoint", 295.5, 300.0)


@pytest.fixture(scope="module")
def make(modes, system: HvacSystem) -> Callable[..., ControlProblem]:
    def build(*channels: Channel, pressures: bool = False, setpoints: bool = False) -> ControlProblem:
        horizon = Horizon.growing([(1.0, 300.0), (2.0, 900.0)], [0.5, 0.5, 1.0, 1.0])
        hvac = SmoothHvac(system, pressures=pressures, setpoints=setpoints)
        return ControlProblem(Predictor(modes, hvac, horizon, channels, 6 * 3600.0))

    return build


def middle(problem: ControlProblem) -> np.ndarray:
    return problem.plan(np.full(problem.span.size, 0.5))


def data_of(make_data, problem, *given, **other):
    return make_data(problem, *given, previous=middle(problem)[0], **other)


@pytest.mark.parametrize("outdoor", [270.0, 303.0])
@pytest.mark.parametrize("kind", ["pressures", "setpoints"])
def test_slopes_are_those_of_finite_differences(make, make_data, outdoor, kind) -> None:
    more = PRESSURES if kind == "pressures" else (HEATING, COOLING)
    problem = make(*supply_channels(), *more, **{kind: True})
    data, predictor = data_of(make_data, problem, outdoor, 295.0), problem.predictor
    shares = np.random.default_rng(0).uniform(0.2, 0.8, problem.span.size)
    slopes = predictor.sensitivity(data, predictor.rollout(data, problem.plan(shares)))
    for j in range(shares.size):
        moved = [
            predictor.rollout(data, problem.plan(shares + sign * 1e-4 * np.eye(shares.size)[j])) for sign in (1, -1)
        ]
        # thermostats are settled to 1e-5 K, which is what differences of 2e-4 of a range are made of
        for name, noise in (("zone", 5e-5), ("electric", 2e-3), ("fuel", 2e-3), ("end_state", 0.05)):
            wanted = (getattr(moved[0], name) - getattr(moved[1], name)) / 2e-4
            found = getattr(slopes, name)[..., j] * problem.span[j]
            np.testing.assert_allclose(found, wanted, atol=3e-3 * np.abs(wanted).max() + noise, rtol=3e-3)


def test_setpoints_among_the_knobs_change_nothing_by_themselves(make, make_problem, make_data) -> None:
    """Zones that no channel sets follow their schedule."""
    plain, other = make_problem(), make(*supply_channels(), setpoints=True)
    data, plan = make_data(plain, 272.0), np.tile([289.0, 335.0], (4, 1))
    for name in ("zone", "electric", "fuel"):
        one, two = (getattr(p.predictor.rollout(data, plan), name) for p in (plain, other))
        np.testing.assert_allclose(one, two, rtol=1e-12)


def test_a_lower_static_pressure_saves_fan_power(make, make_data) -> None:
    """Dampers are nearly shut on a mild day: the solver finds that the duct's pressure may fall, at equal comfort."""
    problem = make(*supply_channels(), PRESSURES[0], pressures=True)
    fixed = make(*supply_channels(), pressures=True)
    data = data_of(make_data, problem, 287.0, 295.5)
    plan = np.tile([288.0, 330.0, 250.0], (4, 1))
    found = SequentialSolver(problem, tolerance=1e-4, iterations=60).solve(data, plan)
    kept = SequentialSolver(fixed, tolerance=1e-4, iterations=60).solve(
        data_of(make_data, fixed, 287.0, 295.5), plan[:, :2]
    )
    assert found.usable and kept.usable
    assert found.plan[:, 2].mean() < 120.0
    assert found.terms.electricity < 0.95 * kept.terms.electricity
    assert found.terms.comfort < kept.terms.comfort + 1e-3
    reference = IpoptSolver(problem).solve(data, plan)
    assert found.terms.total <= 1.005 * reference.terms.total


def test_setback_of_zones_that_nobody_needs_is_found(make, make_data) -> None:
    """Their band is wide, their schedule is not: a lower heating setpoint saves gas."""
    problem = make(*supply_channels(), Channel("zone_air_heating_temperature_setpoint", 289.0, 295.0), setpoints=True)
    fixed = make(*supply_channels(), setpoints=True)
    wide = np.full((len(problem.predictor.horizon), 5), 288.15)
    data = data_of(make_data, problem, 268.0, 293.0, lower=wide)
    plan = np.tile([288.0, 330.0, 294.65], (4, 1))
    found = SequentialSolver(problem, tolerance=1e-4, iterations=60).solve(data, plan)
    kept = SequentialSolver(fixed, tolerance=1e-4, iterations=60).solve(
        data_of(make_data, fixed, 268.0, 293.0, lower=wide), plan[:, :2]
    )
    assert found.plan[:, 2].mean() < 293.0
    assert found.terms.gas < 0.9 * kept.terms.gas and found.terms.comfort < 1e-3


def test_setpoints_have_the_names_of_their_points(make, points) -> None:
    problem = make(*supply_channels(), HEATING, setpoints=True)
    named = points.setpoints(problem.predictor.channels, np.array([290.0, 330.0, 293.0]), problem.predictor.hvac)
    wanted = {f"{points.terminals[k]}/zone_air_heating_temperature_setpoint" for k in (0, 2)}
    assert {name for name, value in named.items() if value == 293.0} == wanted
    assert HEATING.name == "heating setpoint of zones 0, 2" and HEATING.unit == "K"


def test_what_does_not_fit_is_named(make) -> None:
    with pytest.raises(ControlError, match="setpoints=True"):
        make(HEATING)
    with pytest.raises(ControlError, match="zones from 0 to 4"):
        make(Channel("zone_air_heating_temperature_setpoint", 289.0, 295.0, zones=(7,)), setpoints=True)
    with pytest.raises(ControlError, match="below those of cooling"):
        make(HEATING, Channel("zone_air_cooling_temperature_setpoint", 294.0, 300.0), setpoints=True)
