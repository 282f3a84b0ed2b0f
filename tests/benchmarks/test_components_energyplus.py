"""Components beside EnergyPlus': models are written object by object, and a few winter days agree."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest


@pytest.fixture(scope="module")
def plants(script: Callable[[str], ModuleType]) -> ModuleType:
    for name in ("_hvac_reference", "_component_models"):
        script(name)
    return script("_component_plants")


def test_objects_are_written_with_blanks_and_sums_are_energies(plants: ModuleType) -> None:
    import _component_models as models

    assert models.idf("Fan:OnOff", "fan", None, 0.5) == "Fan:OnOff,\n  fan,\n  ,\n  0.5;\n"
    assert models.curve("c", (1.0, 0.0, 2.0), 0, 1).startswith("Curve:Quadratic,\n  c,\n  1.0")
    found = models.row("a", "b", "heat", np.full(8, 1000.0), np.full(8, 500.0))
    assert (found.reference, found.ours) == (2.0, 1.0)  # two hours of 1 kW


@pytest.mark.energyplus
@pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="EnergyPlus is not installed: [energyplus]"
)
def test_five_winter_days_of_plant_components_agree(plants: ModuleType, tmp_path: Path) -> None:
    rows = [row for row in plants.compared(tmp_path, (1, 5)) if row.reference > 1.0]
    assert {row.component for row in rows} >= {"heat pump, air-source", "boiler, condensing", "storage tank, 4 layers"}
    for row in rows:
        assert row.ours == pytest.approx(row.reference, rel=0.05), row


@pytest.mark.energyplus
@pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="EnergyPlus is not installed: [energyplus]"
)
def test_sun_on_facades_and_through_glass_is_energyplus(plants: ModuleType, script: Any, tmp_path: Path) -> None:
    rows = {(row.component, row.energy): row for row in script("_component_sun").compared(tmp_path, (1, 31))}
    assert len(rows) == 8 and min(row.reference for row in rows.values()) > 30.0
    for row in rows.values():  # an isotropic sky gives the north 30 % too much, and the south 8 % too little
        assert row.ours == pytest.approx(row.reference, rel=0.03), row
