"""Thermostats and ideal air of zones."""

from __future__ import annotations

from ideal_air_trials.fabric import Objects
from ideal_air_trials.settings import DUAL
from ideal_air_trials.specification import Spec

HIGHEST_HUMIDITY, LOWEST_HUMIDITY = 0.02, 0.002  # [kg/kg], of supply air that heats, and that cools


def ideal_air(zone: str) -> str:
    """Return the name of a zone's ideal air.

    Parameters
    ----------
    zone : str
        Name in the building.
    """
    return f"{zone} ideal air"


def setpoint_schedules(zone: str) -> tuple[str, str]:
    """Return the names of the schedules of a zone's set points, for heating and for cooling.

    Parameters
    ----------
    zone : str
        Name in the building.
    """
    return f"{zone} heating", f"{zone} cooling"


def terminal(spec: Spec, zone: str, area: float) -> Objects:
    """Return the thermostat and the ideal air of a zone, which is limited in heat and cold.

    Parameters
    ----------
    spec : Spec
        Of a trial.
    zone : str
        Name in the building.
    area : float
        Of its floor [m2].
    """
    air = spec.terminal
    heating, cooling = setpoint_schedules(zone)
    return {
        "ThermostatSetpoint:DualSetpoint": {
            f"{zone} set points": {"heating_setpoint_temperature_schedule_name": heating,
                                   "cooling_setpoint_temperature_schedule_name": cooling}
        },
        "ZoneControl:Thermostat": {
            f"{zone} thermostat": {
                "zone_or_zonelist_name": zone, "control_type_schedule_name": DUAL,
                "control_1_object_type": "ThermostatSetpoint:DualSetpoint", "control_1_name": f"{zone} set points",
            }
        },
        "ZoneHVAC:EquipmentConnections": {
            f"{zone} connections": {
                "zone_name": zone, "zone_conditioning_equipment_list_name": f"{zone} equipment",
                "zone_air_inlet_node_or_nodelist_name": f"{zone} inlet",
                "zone_air_exhaust_node_or_nodelist_name": f"{zone} exhaust",
                "zone_air_node_name": f"{zone} air", "zone_return_air_node_or_nodelist_name": f"{zone} return",
            }
        },
        "ZoneHVAC:EquipmentList": {
            f"{zone} equipment": {
                "load_distribution_scheme": "SequentialLoad",
                "equipment": [{
                    "zone_equipment_object_type": "ZoneHVAC:IdealLoadsAirSystem",
                    "zone_equipment_name": ideal_air(zone), "zone_equipment_cooling_sequence": 1,
                    "zone_equipment_heating_or_no_load_sequence": 1,
                }],
            }
        },
        "ZoneHVAC:IdealLoadsAirSystem": {
            ideal_air(zone): {
                "zone_supply_air_node_name": f"{zone} inlet", "zone_exhaust_air_node_name": f"{zone} exhaust",
                "maximum_heating_supply_air_temperature": air.heating_temperature,
                "minimum_cooling_supply_air_temperature": air.cooling_temperature,
                "maximum_heating_supply_air_humidity_ratio": HIGHEST_HUMIDITY,
                "minimum_cooling_supply_air_humidity_ratio": LOWEST_HUMIDITY,
                "heating_limit": "LimitCapacity", "cooling_limit": "LimitCapacity",
                "maximum_sensible_heating_capacity": round(air.heating_power * area, 1),
                "maximum_total_cooling_capacity": round(air.cooling_power * area, 1),
                "dehumidification_control_type": "None", "humidification_control_type": "None",
            }
        },
    }  # fmt: skip
