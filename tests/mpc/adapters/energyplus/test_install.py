"""EnergyPlus that is not there."""

from __future__ import annotations

import importlib.util

import pytest

from mpc.adapters.energyplus import process as _install
from mpc.adapters.energyplus.input import reference_buildings, weather_files
from mpc.errors import EnergyPlusError


@pytest.fixture
def missing(monkeypatch):
    _install.data_folder.cache_clear()
    monkeypatch.setattr(_install, "find_spec", lambda name: None)
    yield
    _install.data_folder.cache_clear()


def test_a_missing_installation_is_named_with_what_to_do(missing):
    with pytest.raises(EnergyPlusError, match=r"pip install 'buildingmpc\[energyplus\]'"):
        reference_buildings()


@pytest.mark.energyplus
@pytest.mark.skipif(importlib.util.find_spec("pyenergyplus") is None, reason="EnergyPlus is not installed")
def test_what_it_brings_is_listed():
    assert len(reference_buildings()) == 32 and len(weather_files()) == 16
