"""Terminals of the zones in EnergyPlus: as much warm or cool air as the thermostat asks for, up to a limit."""

from __future__ import annotations

from energyplus_trials.frame import Objects, constant

HEATING_SUPPLY, COOLING_SUPPLY = 35.0, 14.0  # [degC]
# So dry that EnergyPlus's cp of air (1004.84 + 1858.95 w) is the case format's 1006 J/kg/K; no moisture anywhere else.
SUPPLY_HUMIDITY_RATIO = 0.000624  # [kg/kg]
DUAL_SETPOINT = "dual setpoint"  # schedule of the kind of thermostat


def terminal(zone: str, flow: float) -> Objects:
    """Return the terminal of a zone and its thermostat.

    Parameters
    ----------
    zone : str
        Where.
    flow : float
        Largest supply air flow [m3/s].
    """
    return _thermostat(zone) | _connections(zone) | _ideal_loads(zone, flow)


def _thermostat(zone: str) -> Objects:
    return {
        "Schedule:Constant": {f"{zone} heating": constant(20.0), f"{zone} cooling": constant(25.0)},
        "ZoneControl:Thermostat": {
            f"{zone} thermostat": {
                "zone_or_zonelist_name": zone,
                "control_type_schedule_name": DUAL_SETPOINT,
                "control_1_object_type": "ThermostatSetpoint:DualSetpoint",
                "control_1_name": f"{zone} setpoints",
            }
        },
        "ThermostatSetpoint:DualSetpoint": {
            f"{zone} setpoints": {
                "heating_setpoint_temperature_schedule_name": f"{zone} heating",
                "cooling_setpoint_temperature_schedule_name": f"{zone} cooling",
            }
        },
    }


def _connections(zone: str) -> Objects:
    return {
        "ZoneHVAC:EquipmentConnections": {
            f"{zone} connections": {
                "zone_name": zone,
                "zone_conditioning_equipment_list_name": f"{zone} equipment",
                "zone_air_inlet_node_or_nodelist_name": f"{zone} inlet",
                "zone_air_node_name": f"{zone} air",
                "zone_return_air_node_or_nodelist_name": f"{zone} return",
            }
        },
        "ZoneHVAC:EquipmentList": {
            f"{zone} equipment": {
                "load_distribution_scheme": "SequentialLoad",
                "equipment": [
                    {
                        "zone_equipment_object_type": "ZoneHVAC:IdealLoadsAirSystem",
                        "zone_equipment_name": f"{zone} ideal loads",
                        "zone_equipment_cooling_sequence": 1,
                        "zone_equipment_heating_or_no_load_sequence": 1,
                    }
                ],
            }
        },
    }


def _ideal_loads(zone: str, flow: float) -> Objects:
    return {
        "ZoneHVAC:IdealLoadsAirSystem": {
            f"{zone} ideal loads": {
                "zone_supply_air_node_name": f"{zone} inlet",
                "maximum_heating_supply_air_temperature": HEATING_SUPPLY,
                "minimum_cooling_supply_air_temperature": COOLING_SUPPLY,
                "maximum_heating_supply_air_humidity_ratio": SUPPLY_HUMIDITY_RATIO,
                "minimum_cooling_supply_air_humidity_ratio": SUPPLY_HUMIDITY_RATIO,
                "heating_limit": "LimitFlowRate",
                "maximum_heating_air_flow_rate": round(flow, 6),
                "cooling_limit": "LimitFlowRate",
                "maximum_cooling_air_flow_rate": round(flow, 6),
                "dehumidification_control_type": "ConstantSupplyHumidityRatio",
                "humidification_control_type": "ConstantSupplyHumidityRatio",
            }
        },
    }
