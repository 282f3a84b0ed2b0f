"""What is identified and controlled of BOPTEST's test cases by their ready descriptions."""

from __future__ import annotations

import pytest
import yaml

from mpc.adapters.described.actuators import described_actuators
from mpc.adapters.described.read import READY
from mpc.adapters.described.schema import PlantFile
from mpc.identify.machines import find_machines

OFFICE = ("core", "east", "north", "south", "west")


@pytest.mark.parametrize("name, chosen, meters, cooling", [
    ("bestest_air", ["office/zone_air_heating_temperature_setpoint"], [""], True),
    ("bestest_hydronic", ["house/zone_air_heating_temperature_setpoint"], ["boiler/heating_power_sensor"], True),
    ("bestest_hydronic_heat_pump", ["heat_pump/compressor_speed"], ["heat_pump/heating_power_sensor"], False),
    ("twozone_apartment_hydronic", [f"{zone}/zone_air_heating_temperature_setpoint" for zone in ("day", "night")],
     ["day/heating_power_sensor", "night/heating_power_sensor"], False),
    ("multizone_residential_hydronic", ["boiler/part_load_ratio"], [""], True),
    ("multizone_office_simple_air", [f"{zone}/zone_air_heating_temperature_setpoint" for zone in OFFICE],
     [f"{zone}/supply_air_flowrate_sensor" for zone in OFFICE], True),
    ("singlezone_commercial_hydronic", ["building/zone_air_heating_temperature_setpoint"],
     ["district/heating_power_sensor"], False),
])  # fmt: skip
def test_what_is_identified_of_ready_plants(name: str, chosen: list[str], meters: list[str], cooling: bool) -> None:
    file = PlantFile.model_validate(yaml.safe_load((READY / f"{name}.yaml").read_text(encoding="utf-8")))
    there = described_actuators(file, {a: (0.0, 400.0 if a.endswith("setpoint") else 1.0) for a in file.actuators})
    found = find_machines(there, [*file.measurements], [*file.zones])
    assert [m.name for m in found] == chosen and [m.meter for m in found] == meters
    if cooling:
        cools = find_machines(there, [*file.measurements], [*file.zones], cooling=True)
        assert all(m.sign == -1.0 and len(m.serves) == 1 for m in cools) and len(cools) >= len(file.zones)
