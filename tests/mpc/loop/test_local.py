"""Zones come to rest where thermostats, terminals and the zones' own response agree."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from mpc.loop.local import LocalControl
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY

SUPPLY, REACH = (287.0, 287.0), (1.0, 1.0)


def heat_of(system: HvacSystem, zone: int, at: float, heating: float, cooling: float) -> float:
    """Heat of a zone's terminal by the thermostat's own words [W]."""
    terminals, width = system.terminals, system.thermostat.throttling_range
    h, c = np.clip([(heating - at) / width, (at - cooling) / width], 0.0, 1.0)
    first = terminals.reheat_first
    least, warm, most = (v[zone] for v in (terminals.minimum_flow, terminals.heating_flow, terminals.design_flow))
    flow = least + (most - least) * c + (warm - least) * max(h - first, 0.0) / (1.0 - first)
    discharge = SUPPLY[0] + min(h / first, 1.0) * (terminals.discharge_limit - SUPPLY[0])
    return float(AIR_HEAT_CAPACITY * flow * (discharge - at))


@settings(max_examples=60, deadline=None)
@given(free=st.floats(280.0, 310.0), response=st.floats(1e-5, 5e-3))
def test_the_rest_is_the_fixed_point(system: HvacSystem, free: float, response: float) -> None:
    """Against bisection on the thermostat's and the terminal's equations; heat is a parabola where we have chords."""
    n, zone = system.zone_count, 4
    control = LocalControl(system, np.full(n, response))
    low, high = np.full(n, 294.0), np.full(n, 297.0)
    found = control.settle(np.full(n, free), low, high, SUPPLY, REACH)[zone]
    exact = brentq(lambda t: t - free - response * heat_of(system, zone, t, 294.0, 297.0), 200.0, 400.0)
    assert found == pytest.approx(exact, abs=0.05)


def test_warmer_supply_air_never_cools_a_zone(system: HvacSystem) -> None:
    n = system.zone_count
    control = LocalControl(system, np.full(n, 1e-3))
    low, high = np.full(n, 294.0), np.full(n, 297.0)
    free = np.linspace(285.0, 305.0, n)
    rests = [control.settle(free, low, high, (t, t), REACH) for t in np.linspace(285.0, 300.0, 16)]
    assert (np.diff(rests, axis=0) >= -1e-9).all()


def test_a_zone_that_moves_along_its_line_rests_where_a_fresh_look_finds_it(system: HvacSystem) -> None:
    """Lines are kept from step to step: bit for bit what looking them up anew gives, knots and far ends too."""
    n, rng = system.zone_count, np.random.default_rng(1)
    low, high = np.full(n, 294.0), np.full(n, 297.0)
    control = LocalControl(system, np.full(n, 1e-3))
    free = np.full(n, 293.0)
    for k in range(200):
        free = free + rng.normal(0.0, 3.0 if k % 20 == 0 else 0.01, n)
        free = np.full(n, 400.0) if k == 100 else np.full(n, 150.0) if k == 150 else free
        fresh = LocalControl(system, np.full(n, 1e-3))
        assert np.array_equal(
            control.settle(free, low, high, SUPPLY, REACH), fresh.settle(free, low, high, SUPPLY, REACH)
        )


def test_where_more_air_warms_a_zone_that_is_too_warm_all_steppers_agree(system: HvacSystem) -> None:
    """Points of the lines fall there: what is looked up, what is kept, and what a batch goes through are one."""
    n, rng = system.zone_count, np.random.default_rng(2)
    low, high, supply = np.full(n, 294.0), np.full(n, 297.0), (303.0, 303.0)
    control = LocalControl(system, np.full(n, 5e-2))
    lines = control.segments(low, high, np.array(supply), np.array(REACH))
    assert (np.diff(lines[1], axis=0) < 0.0).any()
    for free in rng.uniform(280.0, 310.0, (200, n)):
        np.testing.assert_array_equal(control.settle(free, low, high, supply, REACH), control.rest(free, lines))


def test_without_fans_nothing_moves(system: HvacSystem) -> None:
    n = system.zone_count
    control = LocalControl(system, np.full(n, 1e-3))
    free = np.linspace(285.0, 305.0, n)
    rest = control.settle(free, np.full(n, 294.0), np.full(n, 297.0), SUPPLY, (0.0, 0.0))
    np.testing.assert_allclose(rest, free, rtol=1e-12)


def test_what_was_missed_is_made_up_for(system: HvacSystem) -> None:
    """A terminal that gives less than thought: in the end the zone is seen where it is."""
    n = system.zone_count
    control = LocalControl(system, np.full(n, 1e-3))
    low, high, free = np.full(n, 294.0), np.full(n, 297.0), np.full(n, 292.0)
    for _ in range(30):
        rest = control.settle(free, low, high, SUPPLY, REACH)
        reached = free + 0.6 * 1e-3 * np.array([heat_of(system, k, rest[k], 294.0, 297.0) for k in range(n)])
        control.learn(reached)
    np.testing.assert_allclose(rest, reached, atol=1e-3)
