"""Reference buildings: which there are, and what of a building's input file says where air enters its zones."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from _sealed import TrialError

from mpc.adapters.energyplus.input import InputFile, building_path, entity, read_input
from thermal.case.building import Airflow

Content = dict[str, dict[str, dict[str, Any]]]


@dataclass(frozen=True)
class Reference:
    """A reference building.

    Parameters
    ----------
    file : str
        Its input file, without ending.
    words : str
        Building and system, for tables.
    """

    file: str
    words: str


#: Systems of every kind that the files of EnergyPlus have, in buildings of at most 27 zones.
REFERENCES: Mapping[str, Reference] = {
    "medium_office": Reference("RefBldgMediumOfficeNew2004_Chicago", "medium office, VAV with electric reheat"),
    "small_office": Reference("RefBldgSmallOfficeNew2004_Chicago", "small office, packaged units of constant flow"),
    "heat_pump_office": Reference("ASHRAE901_OfficeSmall_STD2019_Denver", "small office, air-to-air heat pumps"),
    "strip_mall": Reference("RefBldgStripMallNew2004_Chicago", "strip mall, unitary systems that cycle"),
    "retail": Reference("RefBldgStand-aloneRetailNew2004_Chicago", "retail, unitary systems and a unit heater"),
    "restaurant": Reference("RefBldgFullServiceRestaurantNew2004_Chicago", "restaurant, packaged units"),
    "hotel": Reference("RefBldgLargeHotelNew2004_Chicago", "hotel, fan coils and VAV with hot water"),
    "school": Reference("RefBldgPrimarySchoolNew2004_Chicago", "primary school, VAV with hot water"),
}

#: Kinds of devices by the beginning of the object that air comes from.
_DEVICES = {
    "AirTerminal:SingleDuct:VAV": "vav",
    "AirTerminal:SingleDuct:ConstantVolume": "supply_air_terminal",
    "ZoneHVAC:FourPipeFanCoil": "fan_coil",
    "ZoneHVAC:PackagedTerminal": "fan_coil",
    "ZoneHVAC:UnitHeater": "fan_coil",
}
_SHORT = {"vav": "VAV", "supply_air_terminal": "SAT", "fan_coil": "FCU"}

#: Objects that are left out of every variant: cold cases and programs that override lights.
_LEFT_OUT = ("Refrigeration:", "EnergyManagementSystem:", "Daylighting:")


@dataclass(frozen=True)
class Inlet:
    """Where conditioned air enters a zone, which is where it is metered.

    Parameters
    ----------
    device : str
        Name of the device in the case.
    kind : str
        Type of it.
    zone : str
        Zone, as EnergyPlus calls it.
    node : str
        Air node.
    """

    device: str
    kind: str
    zone: str
    node: str


@cache
def source(key: str) -> InputFile:
    """Read a building, each zone standing for itself.

    Refrigeration and programs that switch lights are left out. A zone that stands for several in the file is one of
    them here, so that what leaves one zone through a wall enters its neighbour.

    Parameters
    ----------
    key : str
        Of `REFERENCES`.
    """
    read = read_input(building_path(REFERENCES[key].file))
    content: Content = {
        kind: {name: dict(copy.deepcopy(fields)) for name, fields in objects.items()}
        for kind, objects in read.content.items()
        if not kind.startswith(_LEFT_OUT)
    }
    content["ZoneAirHeatBalanceAlgorithm"] = {"air": {"algorithm": "AnalyticalSolution"}}  # whose account closes
    for zone in content["Zone"].values():
        zone.pop("multiplier", None)
    for group in content.get("ZoneGroup", {}).values():
        group.pop("zone_list_multiplier", None)
    for water in content.get("WaterUse:Equipment", {}).values():
        water.pop("zone_name", None)
    for heater in content.get("WaterHeater:Mixed", {}).values():
        if heater.get("ambient_temperature_indicator") == "Zone":  # its losses would be heat of the zone
            heater.pop("ambient_temperature_zone_name", None)
            heater |= {
                "ambient_temperature_indicator": "Schedule",
                "ambient_temperature_schedule_name": "trial ambient",
            }
            heater |= {"off_cycle_loss_fraction_to_zone": 0.0, "on_cycle_loss_fraction_to_zone": 0.0}
            content.setdefault("Schedule:Constant", {})["trial ambient"] = {"hourly_value": 20.0}
    return InputFile(content, read.name)


def inlets(building: InputFile) -> tuple[Inlet, ...]:
    """Find where conditioned air enters zones, in the order of the file's zones.

    Parameters
    ----------
    building : InputFile
        Of `source`.

    Raises
    ------
    TrialError
        When air comes from what is no device of the case format.
    """
    owners = {
        str(value).lower(): (kind, name)
        for prefix in ("AirTerminal:", "ZoneHVAC:")
        for kind, name, fields in building.begins(prefix)
        if kind.startswith(tuple(_DEVICES))
        for field, value in fields.items()
        if field.endswith(("air_outlet_node_name", "outlet_node_name"))
    }
    names = {zone.lower(): zone for zone in building.of_type("Zone")}
    found, count = [], dict[str, int]()
    for fields in building.of_type("ZoneHVAC:EquipmentConnections").values():
        zone = names[fields["zone_name"].lower()]
        for node in building.nodes(fields.get("zone_air_inlet_node_or_nodelist_name", "")):
            if node and node.lower() not in owners:
                raise TrialError(f"{building.name}: expected a device whose air enters {zone} at {node!r}, found none")
            if node:
                kind = next(k for begin, k in _DEVICES.items() if owners[node.lower()][0].startswith(begin))
                name = f"{_SHORT[kind]}_{entity(zone)}".replace(" ", "_")
                count[name] = count.get(name, 0) + 1
                found.append(Inlet(name if count[name] == 1 else f"{name}_{count[name]}", kind, zone, node))
    return tuple(found)


def served(building: InputFile) -> tuple[str, ...]:
    """List the zones that have conditioned air; all others are measured spaces beside them.

    Parameters
    ----------
    building : InputFile
        Of `source`.
    """
    return tuple(dict.fromkeys(inlet.zone for inlet in inlets(building)))


def airflows(building: InputFile) -> tuple[Airflow, ...]:
    """Find where return air passes through a plenum.

    Parameters
    ----------
    building : InputFile
        Of `source`.
    """
    rooms = {
        node.lower(): fields["zone_name"].lower()
        for fields in building.of_type("ZoneHVAC:EquipmentConnections").values()
        for node in building.nodes(fields.get("zone_return_air_node_or_nodelist_name", ""))
    }
    entries = [(i.zone.lower(), i) for i in inlets(building)]
    return tuple(
        Airflow(source=entity(i.zone), target=entity(plenum["zone_name"]), device=i.device, fraction=1.0)
        for plenum in building.of_type("AirLoopHVAC:ReturnPlenum").values()
        for node in plenum["nodes"]
        for zone, i in entries
        if zone == rooms.get(node["inlet_node_name"].lower())
    )
