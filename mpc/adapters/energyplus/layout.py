"""What a building's input file says of its plant: air loops, terminals and hot water, found by object type."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mpc.adapters.energyplus.input import InputFile
from mpc.errors import EnergyPlusError

_TERMINALS = ("AirTerminal:SingleDuct:VAV:Reheat", "AirTerminal:SingleDuct:VAV:NoReheat")
_SCHEDULED = "SetpointManager:Scheduled"


@dataclass(frozen=True)
class Terminal:
    """A VAV terminal.

    Parameters
    ----------
    name, zone : str
        Of the object, and of the zone that it serves.
    inlet, outlet : str
        Air nodes.
    coil, coil_type : str
        Reheat coil and its object type; empty without.
    water_node : str
        Where hot water enters the coil; empty without.
    minimum_share : float
        Least air flow as a share of the largest [-].
    """

    name: str
    zone: str
    inlet: str
    outlet: str
    coil: str
    coil_type: str
    water_node: str
    minimum_share: float


@dataclass(frozen=True)
class AirLoop:
    """An air handler with its terminals.

    Parameters
    ----------
    name : str
        Of the object.
    outlet, inlet, mixed : str
        Nodes of supply, return and mixed air; the last empty without outdoor air.
    managers : tuple of str
        Scheduled setpoint managers of the supply air.
    components : tuple of tuple of str
        Type and name of what the air passes through.
    terminals : tuple of Terminal
        Its terminals.
    controller : str
        Of the outdoor air; empty without.
    """

    name: str
    outlet: str
    inlet: str
    mixed: str
    managers: tuple[str, ...]
    components: tuple[tuple[str, str], ...]
    terminals: tuple[Terminal, ...]
    controller: str

    def of_kind(self, prefix: str) -> tuple[tuple[str, str], ...]:
        """Give type and name of the components whose type begins so.

        Parameters
        ----------
        prefix : str
            Such as ``Fan:``.
        """
        return tuple(c for c in self.components if c[0].startswith(prefix))


@dataclass(frozen=True)
class WaterLoop:
    """A hot-water loop with boilers.

    Parameters
    ----------
    name : str
        Of the object.
    outlet, inlet : str
        Nodes of the supply side.
    managers : tuple of str
        Scheduled setpoint managers of the water.
    boilers, pumps : tuple of tuple of str
        Type and name of each.
    """

    name: str
    outlet: str
    inlet: str
    managers: tuple[str, ...]
    boilers: tuple[tuple[str, str], ...]
    pumps: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class PlantLayout:
    """Plant of a building.

    Parameters
    ----------
    air_loops : tuple of AirLoop
        Those with VAV terminals and a scheduled supply temperature.
    water_loops : tuple of WaterLoop
        Those with boilers that serve these, with a scheduled temperature.
    zones : tuple of str
        Zones that the terminals serve, in their order.
    others : tuple of str
        All other zones: plenums, attics, and what other systems serve.
    chillers : tuple of str
        Names.
    """

    air_loops: tuple[AirLoop, ...]
    water_loops: tuple[WaterLoop, ...]
    zones: tuple[str, ...]
    others: tuple[str, ...]
    chillers: tuple[str, ...]

    @property
    def terminals(self) -> tuple[Terminal, ...]:
        """Terminals of all air loops, in their order."""
        return tuple(t for loop in self.air_loops for t in loop.terminals)


def find_layout(source: InputFile) -> PlantLayout:
    """Find the plant of a building.

    Parameters
    ----------
    source : InputFile
        The building.

    Raises
    ------
    EnergyPlusError
        When no air loop has VAV terminals and a scheduled supply temperature.
    """
    loops = tuple(loop for name in source.of_type("AirLoopHVAC") if (loop := _air_loop(source, name)) is not None)
    if not loops:
        expected = "an air loop with VAV terminals and a scheduled supply temperature"
        kinds = sorted({kind for kind, _, _ in source.begins("SetpointManager:")} | {
            kind for kind, _, _ in source.begins("AirTerminal:")})  # fmt: skip
        raise EnergyPlusError(source.name, expected, ", ".join(kinds) or "none")
    zones = tuple(dict.fromkeys(t.zone for loop in loops for t in loop.terminals))
    others = tuple(zone for zone in source.of_type("Zone") if zone not in zones)
    water = tuple(w for name in source.of_type("PlantLoop") if (w := _water_loop(source, name)) is not None)
    wet = any(loop.of_kind("Coil:Heating:Water") or any(t.water_node for t in loop.terminals) for loop in loops)
    chillers = tuple(name for kind, name, _ in source.begins("Chiller:"))
    return PlantLayout(loops, water if wet else (), zones, others, chillers)


def _air_loop(source: InputFile, name: str) -> AirLoop | None:
    fields = source.find("AirLoopHVAC", name)
    outlets = source.nodes(fields["supply_side_outlet_node_names"])
    demand = {n.lower() for n in source.nodes(fields["demand_side_inlet_node_names"])}
    managers = _managers(source, outlets)
    terminals = _terminals(source, _branches_of_duct(source, demand))
    if not (len(outlets) == 1 and managers and terminals):
        return None
    components = tuple(
        c for part in _parts(source, fields["branch_list_name"]) for c in _inside(source, *_type_and_name(part))
    )
    mixers = (source.find(*component) for component in components if component[0] == "OutdoorAir:Mixer")
    mixed = next((mixer["mixed_air_node_name"] for mixer in mixers), "")
    outdoor = source.of_type("Controller:OutdoorAir").items() if mixed else ()
    controllers = (title for title, control in outdoor if control["mixed_air_node_name"].lower() == mixed.lower())
    inlet = fields["supply_side_inlet_node_name"]
    return AirLoop(name, outlets[0], inlet, mixed, managers, components, terminals, next(controllers, ""))


def _branches_of_duct(source: InputFile, demand: set[str]) -> set[str]:
    """Nodes where the supply path of an air loop ends, in lower case."""
    nodes = set(demand)
    for path in source.of_type("AirLoopHVAC:SupplyPath").values():
        if path["supply_air_path_inlet_node_name"].lower() in demand:
            for part in path["components"]:
                fields = source.find(*_type_and_name(part))
                nodes |= {entry["outlet_node_name"].lower() for entry in fields.get("nodes", ())}
    return nodes


def _terminals(source: InputFile, nodes: set[str]) -> tuple[Terminal, ...]:
    names = {zone.lower(): zone for zone in source.of_type("Zone")}
    zone_of = {
        node.lower(): names[fields["zone_name"].lower()]
        for fields in source.of_type("ZoneHVAC:EquipmentConnections").values()
        for node in source.nodes(fields.get("zone_air_inlet_node_or_nodelist_name", ""))
    }
    found = []
    for name, fields in (item for kind in _TERMINALS for item in source.of_type(kind).items()):
        inlet, outlet = fields["air_inlet_node_name"], fields["air_outlet_node_name"]
        if inlet.lower() in nodes and outlet.lower() in zone_of:
            coil, coil_type = (fields.get(f"reheat_coil_{what}", "") for what in ("name", "object_type"))
            wet = coil_type == "Coil:Heating:Water"
            water = source.find(coil_type, coil)["water_inlet_node_name"] if wet else ""
            least = fields.get("constant_minimum_air_flow_fraction", 0.0)
            share = float(least) if isinstance(least, int | float) else 0.3
            found.append(Terminal(name, zone_of[outlet.lower()], inlet, outlet, coil, coil_type, water, share))
    return tuple(found)


def _managers(source: InputFile, nodes: tuple[str, ...]) -> tuple[str, ...]:
    wanted = {node.lower() for node in nodes}
    return tuple(
        name
        for name, fields in source.of_type(_SCHEDULED).items()
        if fields.get("control_variable", "Temperature") == "Temperature"
        and wanted & {n.lower() for n in source.nodes(fields["setpoint_node_or_nodelist_name"])}
    )


def _parts(source: InputFile, branch_list: str) -> list[Mapping[str, Any]]:
    """Components on the branches of a loop."""
    branches = source.find("BranchList", branch_list)["branches"]
    return [part for entry in branches for part in source.find("Branch", entry["branch_name"])["components"]]


def _type_and_name(part: Mapping[str, Any]) -> tuple[str, str]:
    return part["component_object_type"], part["component_name"]


def _inside(source: InputFile, kind: str, name: str) -> list[tuple[str, str]]:
    """Types and names of a component, or of what an outdoor air system or a coil system holds."""
    if kind == "AirLoopHVAC:OutdoorAirSystem":
        listed = source.find(kind, name)["outdoor_air_equipment_list_name"]
        parts = source.find("AirLoopHVAC:OutdoorAirSystem:EquipmentList", listed)
        count = sum(key.endswith("_object_type") for key in parts)
        return [(parts[f"component_{k}_object_type"], parts[f"component_{k}_name"]) for k in range(1, count + 1)]
    if kind.startswith("CoilSystem:"):
        fields = source.find(kind, name)
        return [(fields["cooling_coil_object_type"], fields["cooling_coil_name"])]
    return [(kind, name)]


def _water_loop(source: InputFile, name: str) -> WaterLoop | None:
    fields = source.find("PlantLoop", name)
    parts = _parts(source, fields["plant_side_branch_list_name"])
    components = [_type_and_name(part) for part in parts]
    boilers, pumps = (tuple(c for c in components if c[0].startswith(kind)) for kind in ("Boiler:HotWater", "Pump:"))
    outlet, inlet = (fields[f"plant_side_{side}_node_name"] for side in ("outlet", "inlet"))
    managers = _managers(source, (outlet, *(part["component_outlet_node_name"] for part in parts)))
    return WaterLoop(name, outlet, inlet, managers, boilers, pumps) if boilers and managers else None
