"""Gains of people, light and equipment, worked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.errors import ScenarioError
from mpc.scenario.gains import InternalGains


def test_gains_worked_by_hand() -> None:
    gains = InternalGains(sensible=70.0, latent=45.0, equipment=10.0, lights=8.0, idle_equipment=0.5, idle_lights=0.0)
    people, areas = np.array([4.0, 0.0]), np.array([50.0, 20.0])
    heat = gains.heat([[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]], people, areas)
    # a quarter in: 70 W, equipment 10 * 50 * (0.5 + 0.5 / 4) = 312.5 W, lights 8 * 50 / 4 = 100 W
    assert heat == pytest.approx(np.array([[250.0, 100.0], [482.5, 100.0], [280.0 + 500.0 + 400.0, 100.0]]))
    assert gains.moisture_heat([[2.0, 0.0]]).tolist() == [[90.0, 0.0]]


def test_expected_people_give_the_expected_gain() -> None:
    rng = np.random.default_rng(0)
    count = rng.integers(0, 6, (500, 3)).astype(float)
    gains, people, areas = InternalGains(), np.full(3, 5.0), np.array([10.0, 50.0, 90.0])
    mean = gains.heat(count, people, areas).mean(axis=0)
    assert mean == pytest.approx(gains.heat(count.mean(axis=0)[None], people, areas)[0])


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ScenarioError, match="gains: lights"):
        InternalGains(lights=-1.0)
    with pytest.raises(ScenarioError, match="gains: idle_lights"):
        InternalGains(idle_lights=1.5)
