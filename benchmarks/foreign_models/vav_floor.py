"""The lowest storey of EnergyPlus' Medium Office: five VAV boxes with electric reheat on one air handler.

Nobody here drew it or its air handler, which runs in working hours, and at night where a room falls below its setpoint;
it blows 12.8 degC at all five rooms then. No meter has the heat of a room: it is that of the air which its box gives.
"""

from __future__ import annotations

from typing import Any

from energyplus_trials.frame import Objects

from foreign_models.thermostats import comfort, present
from mpc.adapters.energyplus.input import building_path, read_input

SOURCE = "RefBldgMediumOfficeNew2004_Chicago"
WEATHER = "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3"
#: Our names, EnergyPlus' and floor areas [m2].
_ZONES = {
    "core": ("Core_bottom", 983.54), "south": ("Perimeter_bot_ZN_1", 207.34), "east": ("Perimeter_bot_ZN_2", 131.26),
    "north": ("Perimeter_bot_ZN_3", 207.34), "west": ("Perimeter_bot_ZN_4", 131.26),
}  # fmt: skip
_HEIGHT, _AREA_EACH = 2.74, 18.58  # m, and m2 for a person
_GAS = 0.05  # EUR/kWh
_WORK, _NOBODY = [6 <= hour < 22 for hour in range(24)], [False] * 24


def vav_floor() -> Objects:
    """Return the input, as EnergyPlus brings it."""
    return {kind: {name: dict(fields) for name, fields in objects.items()}
            for kind, objects in read_input(building_path(SOURCE)).content.items()}  # fmt: skip


def description() -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    told: dict[str, Any] = {"zones": {}, "measurements": {}, "actuators": {}}
    electricity = ["VAV_1_Fan, Fan Electricity Rate"]
    for name, (zone, area) in _ZONES.items():
        told["zones"][name] = {
            "temperature": f"{zone}, Zone Mean Air Temperature", "floor_area": area, "volume": area * _HEIGHT,
            "comfort": comfort(_WORK, _NOBODY), "people": present(area / _AREA_EACH, _WORK, _NOBODY),
        }  # fmt: skip
        outlet, setpoint = f"{zone} VAV Box Outlet Node Name", f"{name}/zone_air_heating_temperature_setpoint"
        told["measurements"] |= {
            f"{name}/zone_air_temperature_sensor": f"{zone}, Zone Mean Air Temperature",
            f"{name}/supply_air_flowrate_sensor": f"{outlet}, System Node Mass Flow Rate",
            f"{name}/discharge_air_temperature_sensor": f"{outlet}, System Node Temperature",
            setpoint: f"{zone}, Zone Thermostat Heating Setpoint Temperature",
        }
        told["actuators"][setpoint] = {
            "signal": f"{zone}, Zone Temperature Control, Heating Setpoint", "range": ["12 degC", "23.5 degC"],
        }  # fmt: skip
        electricity.append(f"{zone} VAV Box Reheat Coil, Heating Coil Electricity Rate")
    gas = ["VAV_1_HeatC, Heating Coil NaturalGas Rate"]
    return told | {"energy": {"electricity": electricity, "gas": gas}, "prices": {"gas": _GAS}}
