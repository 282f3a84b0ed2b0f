"""The plant beside EnergyPlus': the building is rewritten to our weeks, sizes are read, energies agree."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from types import ModuleType

import pytest

IDF = """
  Version,25.2;
  Timestep,6;   ! six
  RunPeriod, annual, 1, 1, , 12, 31;
  Output:Variable,*,Boiler Inlet Temperature,HOURLY;
  Fan:VariableVolume, VAV_1_Fan, ALWAYS_ON;
"""


@pytest.fixture(scope="module")
def reference(script: Callable[[str], ModuleType]) -> ModuleType:
    return script("_hvac_reference")


@pytest.fixture(scope="module")
def offices(script: Callable[[str], ModuleType], reference: ModuleType) -> ModuleType:
    return script("_hvac_offices")


@pytest.fixture(scope="module")
def benchmark(script: Callable[[str], ModuleType], offices: ModuleType) -> ModuleType:
    script("_table")
    return script("hvac_energyplus")


def test_a_building_gets_our_weeks_steps_and_outputs(reference):
    text = reference._rewritten(IDF, [("*", "Fan Electricity Rate")])
    assert "Fan:VariableVolume, VAV_1_Fan" in text
    assert "Boiler Inlet" not in text and "annual" not in text and "Timestep,6" not in text
    assert "RunPeriod,winter,1,15,,1,21" in text and "RunPeriod,summer,7,15,,7,21" in text
    assert "Output:Variable,*,Fan Electricity Rate,Timestep" in text


def test_sizes_are_found_by_their_beginning(reference):
    found = reference.Reference({}, {("VAV_1_FAN", "Design Size Maximum Flow Rate"): 6.8})
    assert found.size("VAV_1_Fan", "Design Size Maximum") == 6.8
    with pytest.raises(reference.ReferenceRunError, match="no size 'Power' of 'VAV_1_Fan'"):
        found.size("VAV_1_Fan", "Power")


def test_the_bypass_of_a_rated_coil(offices):
    # the Medium Office's first coil as EnergyPlus sizes it: 151,891 W at 6.822 m3/s, 73.66 % sensible
    assert offices.bypass_factor(151_891.45, 6.821876, 0.736564) == pytest.approx(0.0446, abs=1e-3)


@pytest.mark.long
@pytest.mark.energyplus
@pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="EnergyPlus is not installed: [energyplus]"
)
def test_energies_agree_within_a_tenth(benchmark):
    rows = benchmark.compared()
    assert {row.quantity for _, row in rows} >= {"compressor", "fan", "reheat coils", "gas of the boiler", "pump"}
    for building, row in rows:
        assert row.ours == pytest.approx(row.reference, rel=0.1), (building, row)
