"""Generated points of a network in three habits of naming, and what each truly is."""

from __future__ import annotations

import random
from collections.abc import Iterator

from thermal.case.building import Building
from thermal.plan.discovery import NetworkPoint

HABITS = ("contractor", "integrator", "opaque")

#: Short names that control contractors give, and words that integrators write, by point type.
_SHORT = {
    "zone_air_temperature_sensor": ("ZN-T", "ZNT", "RM_TEMP", "SPACE TEMP", "ZoneTemp"),
    "supply_air_flowrate_sensor": ("SA-FLOW", "AIRFLOW", "SupFlow", "FLOW"),
    "discharge_air_temperature_sensor": ("DA-T", "DAT", "DischAirTemp", "DA_TEMP"),
    "supply_air_damper_percentage_command": ("DMPR-POS", "DPR_CMD", "DamperPos", "DMP-C"),
    "heating_water_valve_percentage_command": ("HTG-VLV", "RHT_VLV_CMD", "ReheatValve", "HW-VLV"),
    "zone_air_heating_temperature_setpoint": ("HTG-SP", "ZN_HTG_SP", "HeatingSetpoint", "OCC-HTG-SP"),
    "zone_air_cooling_temperature_setpoint": ("CLG-SP", "ZN_CLG_SP", "CoolingSetpoint", "OCC-CLG-SP"),
    "supply_air_temperature_sensor": ("SA-T", "SAT", "SupplyAirTemp"),
    "supply_air_temperature_setpoint": ("SAT-SP", "SA_TEMP_SP", "SupplyAirTempSetpoint"),
    "mixed_air_temperature_sensor": ("MA-T", "MAT", "MixedAirTemp"),
    "return_air_temperature_sensor": ("RA-T", "RAT", "ReturnAirTemp"),
    "supply_water_temperature_sensor": ("HWS-T", "HWST", "SupplyWaterTemp"),
    "return_water_temperature_sensor": ("HWR-T", "HWRT", "ReturnWaterTemp"),
}
_WORDS = {
    "zone_air_temperature_sensor": ("Zone Temperature", "Room Air Temperature", "Space Temp"),
    "supply_air_flowrate_sensor": ("Supply Air Flow", "Air Flow", "Supply Airflow Rate"),
    "discharge_air_temperature_sensor": ("Discharge Air Temperature", "Discharge Air Temp", "Supply Air Temperature"),
    "supply_air_damper_percentage_command": ("Damper Command", "Damper Position", "Supply Air Damper"),
    "heating_water_valve_percentage_command": ("Heating Valve", "Reheat Valve Command", "Hot Water Valve Position"),
    "zone_air_heating_temperature_setpoint": ("Heating Setpoint", "Zone Heating Temperature Setpoint", "Room Heat SP"),
    "zone_air_cooling_temperature_setpoint": ("Cooling Setpoint", "Zone Cooling Temperature Setpoint", "Room Cool SP"),
    "supply_air_temperature_sensor": ("Supply Air Temperature", "Supply Temp"),
    "supply_air_temperature_setpoint": ("Supply Air Temperature Setpoint", "Supply Air Temp SP"),
    "mixed_air_temperature_sensor": ("Mixed Air Temperature", "Mixed Air Temp"),
    "return_air_temperature_sensor": ("Return Air Temperature", "Return Air Temp"),
    "supply_water_temperature_sensor": ("Hot Water Supply Temperature", "Supply Water Temp"),
    "return_water_temperature_sensor": ("Hot Water Return Temperature", "Return Water Temp"),
}

#: Points of each type of device.
_OF = {
    "vav": tuple(_SHORT)[:7],
    "ahu": tuple(_SHORT)[7:11],
    "boiler": tuple(_SHORT)[11:],
}

#: Points that are none of the library's: short name, words, object, unit.
_OTHERS = (
    ("FLTR-ALM", "Filter Alarm", "binary-input", ""), ("RUN-HRS", "Run Hours", "analog-value", "hours"),
    ("SPD-FB", "Fan Speed Feedback", "analog-input", "hertz"), ("FLTR-DP", "Filter Loss", "analog-input", "pascals"),
    ("OCC-MODE", "Occupancy Mode", "multi-state-value", ""), ("FLOW-KI", "Flow Loop Integral Gain", "analog-value", ""),
    ("CO2-SP", "CO2 Alarm Limit", "analog-value", "parts-per-million"),
    ("ZN-T-OFS", "Sensor Offset", "analog-value", "delta-degrees-kelvin"),
)  # fmt: skip


def network_points(building: Building, habit: str, seed: int) -> Iterator[tuple[NetworkPoint, tuple[str, str]]]:
    """Points of a building's network with what they are: entity and point type, empty for others."""
    rng = random.Random(f"{habit} {seed}")
    habits_of_names = rng.choice((str.upper, str.lower, str.title))
    sign, metric = rng.choice("-_. "), rng.random() < 0.5
    style = {point: rng.randrange(12) for point in _SHORT}
    number = 0
    for device in building.devices:
        called = habits_of_names(device.name.replace("_", sign))
        for point in _OF.get(device.type, ()):
            number += 1
            kind = "analog-input" if point.endswith("sensor") else rng.choice(("analog-output", "analog-value"))
            if point.endswith("setpoint"):
                kind = "analog-value"
            unit = "percent" if "percentage" in point else ("degrees-celsius" if metric else "degrees-fahrenheit")
            if "flowrate" in point:
                unit = "liters-per-second" if metric else "cubic-feet-per-minute"
            short, words = (t[point][style[point] % len(t[point])] for t in (_SHORT, _WORDS))
            yield _named(habit, f"{kind},{number}", (called, short, words, unit), rng), (device.name, point)
        short, words, kind, unit = rng.choice(_OTHERS)
        number += 1
        yield _named(habit, f"{kind},{number}", (called, short, words, unit), rng), ("", "")


def _named(habit: str, at: str, of: tuple[str, str, str, str], rng: random.Random) -> NetworkPoint:
    called, short, words, unit = of
    if habit == "contractor":
        return NetworkPoint(f"10.0.0.9 {at}", f"{called}.{short}", "", "DEV1001", unit)
    if habit == "integrator":
        return NetworkPoint(f"10.0.0.9 {at}", words, "", called, unit)
    known = unit if rng.random() < 0.7 else ""
    return NetworkPoint(f"10.0.0.9 {at}", at.replace(",", " "), f"{called} {words}", "NAE-01", known)
