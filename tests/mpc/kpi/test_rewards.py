"""Rewards: numbers of the paper's simulator, many runs at once, and stage costs that add up to the indicators."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpc.errors import MpcError
from mpc.kpi.kpis import measure_kpis
from mpc.kpi.record import PlantRecord
from mpc.kpi.rewards import PaperReward, StageCost
from mpc.scenario.scenario import Scenario

Make = Callable[..., Scenario]
BAND = (np.full(2, 293.0), np.full(2, 297.0))

# Settings and expected values of google/sbsim's own test of its regret: two zones of ten people, prices and carbon
# alike for both energies.
SBSIM = dict(
    highest_electricity=10e3, highest_gas=10e3, highest_productivity=500.0, lowest_productivity=150.0,
    half_distance=1.5, stiffness=4.3, comfort_weight=1.0, cost_weight=1.0,
)  # fmt: skip


@pytest.mark.parametrize(
    ("temperature", "electricity", "gas", "carbon_weight", "expected"),
    [
        (293.0, 0.0, 0.0, 1.0, 0.0),
        (298.5, 0.0, 0.0, 1.0, -0.2381),
        (291.5, 0.0, 0.0, 1.0, -0.2381),
        (293.0, 0.0, 5000.0, 0.0, -0.125),
        (293.0, 6000.0, 0.0, 0.0, -0.15),
        (293.0, 6000.0, 5000.0, 0.0, -0.275),
        (293.0, 6000.0, 5000.0, 1.0, -0.36666),
        (280.0, 12000.0, 10000.0, 1.0, -1.0),
    ],
)
def test_numbers_of_the_papers_simulator(
    temperature: float, electricity: float, gas: float, carbon_weight: float, expected: float
) -> None:
    reward = PaperReward(**SBSIM, carbon_weight=carbon_weight)
    zones = np.full(2, temperature)
    terms = reward.of_values(zones, BAND, np.full(2, 10.0), (electricity, gas), (0.05, 0.05), (0.01, 0.01))
    # the simulator's test of "cost without carbon" divides by two weights, as does this
    assert float(terms.reward) == pytest.approx(expected, abs=1e-4)


def test_weights_are_those_of_the_simulator() -> None:
    terms = PaperReward().of_values(np.full(2, 295.0), BAND, np.zeros(2), (80e3, 0.0), (0.2, 0.0), (0.1, 0.0))
    assert (float(terms.comfort), float(terms.cost), float(terms.carbon)) == pytest.approx((0.0, -0.5, -0.5))
    assert float(terms.reward) == pytest.approx(-0.4 * 0.5 - 0.4 * 0.5)


@given(
    temperature=st.lists(st.floats(200.0, 400.0), min_size=2, max_size=2),
    people=st.lists(st.floats(0.0, 50.0), min_size=2, max_size=2),
    electricity=st.floats(0.0, 1e6),
    gas=st.floats(0.0, 1e6),
    comfort=st.sampled_from(["productivity", "setpoint_deviation"]),
)
def test_rewards_lie_between_minus_one_and_nought(
    temperature: list[float], people: list[float], electricity: float, gas: float, comfort: str
) -> None:
    reward = PaperReward(comfort=comfort)  # type: ignore[arg-type]
    terms = reward.of_values(temperature, BAND, people, (electricity, gas), (0.2, 0.03), (0.1, 0.18))
    assert all(-1.0 - 1e-12 <= float(term) <= 1e-12 for term in terms)


def test_productivity_weighs_zones_by_their_people() -> None:
    reward = PaperReward(comfort_weight=1.0, cost_weight=0.0, carbon_weight=0.0)

    def comfort(people: list[float]) -> float:
        return float(reward.of_values([297.5, 295.0], BAND, people, (0.0, 0.0), (0, 0), (0, 0)).reward)

    # half a kelvin above the band: half of the productivity
    assert comfort([1.0, 0.0]) == pytest.approx((150.0 - 100.0) / 200.0 - 1.0)
    assert comfort([1.0, 1.0]) == pytest.approx((225.0 - 100.0) / 200.0 - 1.0)
    assert comfort([0.0, 1.0]) == comfort([0.0, 0.0]) == 0.0


def test_setpoint_deviation_by_hand() -> None:
    reward = PaperReward("setpoint_deviation", 1.0, 0.0, 0.0, deviation_scale=2.0)
    terms = reward.of_values([292.0, 301.0], BAND, np.zeros(2), (0.0, 0.0), (0, 0), (0, 0))
    assert float(terms.reward) == pytest.approx(-(0.5 + 1.0) / 2)


def test_many_runs_at_once(plain_scenario: Make) -> None:
    scenario, rng = plain_scenario(), np.random.default_rng(0)
    start, end = rng.normal(295, 3, (2, 7, 2))
    electricity, gas = rng.uniform(0, 2e5, (2, 7))
    for term in ("productivity", "setpoint_deviation"):
        reward = PaperReward(comfort=term)  # type: ignore[arg-type]
        many = reward.of_step(scenario, 40, end, electricity, gas)
        ones = [reward.of_step(scenario, 40, end[i], electricity[i], gas[i]).reward for i in range(7)]
        assert many.reward == pytest.approx(ones) and many.reward.shape == (7,)
    stage = StageCost(1.5, 0.1)
    ones = [float(stage.of_step(scenario, 40, start[i], end[i], electricity[i], gas[i])) for i in range(7)]
    assert stage.of_step(scenario, 40, start, end, electricity, gas) == pytest.approx(ones)


def test_stage_costs_add_up_to_the_indicators(plain_scenario: Make) -> None:
    scenario, rng = plain_scenario(), np.random.default_rng(2)
    n = scenario.grid.n_steps
    temperature = 294.0 + np.cumsum(rng.normal(0, 0.4, (n + 1, 2)), axis=0)
    electricity, gas = rng.uniform(0, 5e3, (2, n))
    stage = StageCost(discomfort_price=0.7, carbon_price=0.15)
    total = sum(
        float(stage.of_step(scenario, k, temperature[k], temperature[k + 1], electricity[k], gas[k])) for k in range(n)
    )
    kpis = measure_kpis(PlantRecord(900.0, temperature, electricity, gas), scenario)
    assert kpis.emis_tot is not None
    expected = kpis.floor_area * (kpis.cost_tot + 0.15 * kpis.emis_tot) + 0.7 * 2 * kpis.tdis_tot
    assert total == pytest.approx(expected, rel=1e-12)


def test_what_cannot_be_is_refused() -> None:
    for build, message in (
        (lambda: PaperReward("productive"), "nearest valid one is 'productivity'"),  # type: ignore[arg-type]
        (lambda: PaperReward(cost_weight=-1.0), "weights"),
        (lambda: PaperReward(comfort_weight=0.0, cost_weight=0.0, carbon_weight=0.0), "not all 0"),
        (lambda: PaperReward(highest_gas=0.0), "scales"),
        (lambda: PaperReward(lowest_productivity=400.0), "a productivity that rises"),
        (lambda: StageCost(-1.0), "prices of 0 or more"),
    ):
        with pytest.raises(MpcError, match=message):
            build()
