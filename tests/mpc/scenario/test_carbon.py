"""Carbon: average or marginal is said, gas has its source's factor."""

from __future__ import annotations

import pytest

from mpc.errors import ScenarioError
from mpc.scenario.rates import ConstantRate
from mpc.scenario.tariff import GAS_CARBON, CarbonIntensity


def test_gas_by_its_energy() -> None:
    assert pytest.approx(0.1810, abs=1e-4) == GAS_CARBON  # 53.06 kg per million Btu, 293.07 kWh
    assert CarbonIntensity(ConstantRate(0.3), "marginal").gas == ConstantRate(GAS_CARBON)


def test_the_kind_has_to_be_said() -> None:
    with pytest.raises(ScenarioError, match="'average' or 'marginal'"):
        CarbonIntensity(ConstantRate(0.3), "mean")  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        CarbonIntensity(ConstantRate(0.3))  # type: ignore[call-arg]
