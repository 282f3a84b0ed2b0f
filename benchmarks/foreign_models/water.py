"""A loop of water with one machine, one pump and one or more consumers, as EnergyPlus wants its branches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep

_RESET = """
SET {name}_wanted = {at_zero} - {slope} * {name}_outdoor
SET {name}_wanted = @Min {name}_wanted {warmest}
SET {name}_wanted = @Max {name}_wanted {coolest}
IF {name}_told > 0.0
  SET {name}_wanted = {name}_told
ENDIF
"""

#: Schedule that tells the supply water of a loop.
_SUPPLY = "{} SUPPLY"


def water_loop(
    name: str, pump: dict[str, Any], machine: tuple[str, str], consumers: Sequence[tuple[str, str]],
    scheme: tuple[str, str], flow: float, *, variable: bool = False,
) -> Objects:  # fmt: skip
    """Return the loop; the machine's and consumers' nodes are called ``NAME in`` and ``NAME out``.

    Parameters
    ----------
    name : str
        Of the loop.
    pump : dict
        Fields of a pump beside its nodes.
    machine : tuple of str
        Class and name.
    consumers : sequence of tuple of str
        Class and name of each.
    scheme : tuple of str
        Class and name of the operation scheme.
    flow : float
        Largest flow [m3/s].
    variable : bool
        Whether the pump gives what consumers let through: ``Pump:VariableSpeed`` rather than ``Pump:ConstantSpeed``.
    """
    kind = f"Pump:{'Variable' if variable else 'Constant'}Speed"
    found: Objects = {kind: {
        f"{name} pump": {**pump, "inlet_node_name": f"{name} supply in", "outlet_node_name": f"{name} pump out"}
    }}  # fmt: skip

    def branch(title: str, kind: str, what: str, nodes: tuple[str, str]) -> str:
        found.setdefault("Branch", {})[title] = {"components": [{
            "component_object_type": kind, "component_name": what, "component_inlet_node_name": nodes[0],
            "component_outlet_node_name": nodes[1],
        }]}  # fmt: skip
        return title

    def pipe(title: str, begin: str, end: str) -> str:
        found.setdefault("Pipe:Adiabatic", {})[title] = {"inlet_node_name": begin, "outlet_node_name": end}
        return branch(title, "Pipe:Adiabatic", title, (begin, end))

    def side(title: str, first: str, parallel: Sequence[str], last: str) -> None:
        listed = [{"branch_name": each} for each in (first, *parallel, last)]
        found.setdefault("BranchList", {})[title] = {"branches": listed}
        found.setdefault("ConnectorList", {})[title] = {
            "connector_1_object_type": "Connector:Splitter", "connector_1_name": f"{title} splitter",
            "connector_2_object_type": "Connector:Mixer", "connector_2_name": f"{title} mixer",
        }  # fmt: skip
        found.setdefault("Connector:Splitter", {})[f"{title} splitter"] = {
            "inlet_branch_name": first,
            "branches": [{"outlet_branch_name": each} for each in parallel],
        }
        found.setdefault("Connector:Mixer", {})[f"{title} mixer"] = {
            "outlet_branch_name": last,
            "branches": [{"inlet_branch_name": each} for each in parallel],
        }

    first = branch(f"{name} pump", kind, f"{name} pump", (f"{name} supply in", f"{name} pump out"))
    side(f"{name} supply", first, [branch(machine[1], *machine, (f"{machine[1]} in", f"{machine[1]} out"))],
         pipe(f"{name} supply pipe", f"{name} supply pipe in", f"{name} supply out"))  # fmt: skip
    taking = [branch(what, kind, what, (f"{what} in", f"{what} out")) for kind, what in consumers]
    bypass = pipe(f"{name} bypass", f"{name} bypass in", f"{name} bypass out")
    side(f"{name} demand", pipe(f"{name} flow", f"{name} demand in", f"{name} flow out"), [*taking, bypass],
         pipe(f"{name} return", f"{name} return in", f"{name} demand out"))  # fmt: skip
    ep.merge(found, {
        "PlantEquipmentOperationSchemes": {f"{name} operation": {
            "control_scheme_1_object_type": scheme[0], "control_scheme_1_name": scheme[1],
            "control_scheme_1_schedule_name": "always",
        }},
        "PlantLoop": {name: {
            "fluid_type": "Water", "plant_equipment_operation_scheme_name": f"{name} operation",
            "loop_temperature_setpoint_node_name": f"{name} supply out", "maximum_loop_temperature": 80.0,
            "minimum_loop_temperature": 5.0, "maximum_loop_flow_rate": flow, "minimum_loop_flow_rate": 0.0,
            "plant_side_inlet_node_name": f"{name} supply in", "plant_side_outlet_node_name": f"{name} supply out",
            "plant_side_branch_list_name": f"{name} supply", "plant_side_connector_list_name": f"{name} supply",
            "demand_side_inlet_node_name": f"{name} demand in", "demand_side_outlet_node_name": f"{name} demand out",
            "demand_side_branch_list_name": f"{name} demand", "demand_side_connector_list_name": f"{name} demand",
            "load_distribution_scheme": "SequentialLoad",
        }},
    })  # fmt: skip
    return found


def scheduled_loop(
    name: str, pump: dict[str, Any], machine: tuple[str, str], consumers: Sequence[tuple[str, str]], kind: str,
    flow: float, water: float, *, variable: bool = False,
) -> Objects:  # fmt: skip
    """Return the loop of a machine that runs as consumers ask, to a temperature of the schedule ``NAME water``.

    Parameters
    ----------
    name, pump, machine, consumers, flow, variable
        As of `water_loop`.
    kind : str
        ``Heating`` or ``Cooling``.
    water : float
        Temperature unless something else says it [degC].
    """
    scheme = f"PlantEquipmentOperation:{kind}Load"
    found = water_loop(name, pump, machine, consumers, (scheme, f"{name} load"), flow, variable=variable)
    ep.merge(found, {
        scheme: {f"{name} load": {
            "load_range_1_lower_limit": 0.0, "load_range_1_upper_limit": 1e9,
            "range_1_equipment_list_name": f"{name} machines",
        }},
        "PlantEquipmentList": {f"{name} machines": {
            "equipment": [{"equipment_object_type": machine[0], "equipment_name": machine[1]}]
        }},
        "Schedule:Constant": {f"{name} water": ep.constant(water)},
        "SetpointManager:Scheduled": {f"{name} setpoint": {
            "control_variable": "Temperature", "schedule_name": f"{name} water",
            "setpoint_node_or_nodelist_name": f"{name} supply out",
        }},
    })  # fmt: skip
    return found


def supply_water(loop: str, reset: tuple[float, float, float, float]) -> Objects:
    """Return the program of a loop's supply water: by the outdoor temperature, unless ``LOOP SUPPLY`` tells it.

    Parameters
    ----------
    loop : str
        A `scheduled_loop`.
    reset : tuple of float
        Warmest water and the outdoor air below which it is that warm, coolest water and the outdoor air above which it
        is that cool, on a straight line in between [degC].
    """
    name = loop.lower().replace(" ", "_")
    found: Objects = {"Schedule:Constant": {_SUPPLY.format(loop): ep.constant(ep.OWN)}}
    ep.merge(found, ep.sensors({
        f"{name}_outdoor": ("Environment", "Site Outdoor Air Drybulb Temperature"),
        f"{name}_told": (_SUPPLY.format(loop), "Schedule Value"),
    }))  # fmt: skip
    ep.merge(found, ep.actuators({f"{name}_wanted": (f"{loop} water", "Schedule:Constant", "Schedule Value")}))
    warmest, cold, coolest, mild = reset
    slope = (warmest - coolest) / (mild - cold)
    line = {"warmest": warmest, "coolest": coolest, "slope": slope, "at_zero": warmest + slope * cold}
    ep.merge(found, ep.program(f"{name}_supply", _RESET.format(name=name, **line)))
    return found


def supply_water_points(
    machine: str, entity: str, loop: str, lowest: str, highest: str, pump: str = "hot_water"
) -> tuple[dict[str, str], dict[str, Any]]:
    """Return measured points and the actuator of a loop's water (`supply_water`), as ``plant.yaml`` has them.

    Parameters
    ----------
    machine, entity : str
        EnergyPlus' name of what heats it, and ours.
    loop : str
        A `scheduled_loop`.
    lowest, highest : str
        Range of the supply water, with units.
    pump : str
        Our name of what the loop's pump belongs to.
    """
    setpoint = f"{entity}/supply_water_temperature_setpoint"
    signal = f"{_SUPPLY.format(loop)}, Schedule:Constant, Schedule Value"
    measured = {
        f"{pump}/pump_power_sensor": f"{loop} pump, Pump Electricity Rate",
        f"{entity}/supply_water_temperature_sensor": f"{machine} out, System Node Temperature",
        f"{entity}/return_water_temperature_sensor": f"{machine} in, System Node Temperature",
        setpoint: f"{loop} water, Schedule Value",
    }
    return measured, {setpoint: {"signal": signal, "range": [lowest, highest]}}
