"""The page that adds a component, followed to the letter."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from thermal.case.building import Device
from thermal.components.component import Component
from thermal.components.registry import COMPONENTS, register_component
from thermal.errors import ModelError
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system

PAGE = Path(__file__).parents[3] / "docs" / "add_a_component.md"


@pytest.fixture(scope="module")
def page() -> Iterator[dict[str, Any]]:
    """Names that the page's blocks leave behind, run one after the other as a module."""
    module = ModuleType("page_of_a_component")
    sys.modules[module.__name__] = module  # annotations are looked up in it
    known = dict(COMPONENTS)
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        exec(compile(block, str(PAGE), "exec"), module.__dict__)
    yield module.__dict__
    COMPONENTS.clear()
    COMPONENTS.update(known)
    del sys.modules[module.__name__]


def test_the_page_runs_and_its_component_is_registered(page: dict[str, Any]) -> None:
    assert COMPONENTS["electric_baseboard"] is page["Baseboards"]
    with pytest.raises(ModelError, match=r"Baseboards.capacity\[0\]: expected 1 to 100000 W"):
        page["Baseboards"](np.array([0.0]), np.array([0]))


def test_devices_of_its_type_join_a_sized_system(page: dict[str, Any]) -> None:
    office = pilot_building(1, floor_area=600.0, zones=12, name="office")
    device = Device(name="BASE", type="electric_baseboard", zone=office.zone_names[5])
    group = size_system(replace(office, devices=(*office.devices, device))).components["ELECTRIC_BASEBOARD"]
    assert isinstance(group, page["Baseboards"]) and group.zone.tolist() == [5]


def test_a_type_of_two_classes_is_refused(page: dict[str, Any]) -> None:
    class Other(Component):
        device = "electric_baseboard"

    with pytest.raises(ModelError, match="component Other: device: expected a type of device beside .*boiler"):
        register_component(Other)
    with pytest.raises(ModelError, match="found ''"):
        register_component(Component)
