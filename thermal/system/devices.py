"""The graph of a case's devices: what each is, which zone it is in, and what feeds it."""

from dataclasses import dataclass

import numpy as np

from thermal.case.building import Building, Device, FloorPlans
from thermal.components.air_handler import AirHandler
from thermal.components.battery import Battery
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.chiller_loop import ChillerLoop
from thermal.components.component import Group, IndexArray
from thermal.components.mixing_valve import MixingValve
from thermal.components.registry import COMPONENTS
from thermal.components.storage_tank import StorageTank
from thermal.components.terminals import Terminals
from thermal.components.ventilators import Ventilators
from thermal.errors import ModelError

_METERS = ("chiller",)  # devices that are read, and are parts of others' models


@dataclass(frozen=True, eq=False)
class DeviceGraph:
    """Devices of a building as components of a system.

    Parameters
    ----------
    air_handlers : tuple of str
        Names of the air handlers.
    serving : numpy.ndarray of int, shape (n_zone,)
        Position of the air handler that feeds each zone.
    emitters : dict of str to tuple of Device
        Further devices in zones, by type.
    water : tuple of str
        Types of what stands between heat and those that draw hot water, from what makes it on: of the first device that
        does, else ``boiler``; a tank; a mixing valve, which feeds heated floors only.
    chills : bool
        Whether something makes chilled water.
    has_air : bool
        Whether it has terminals and air handlers, its own or, where some zone has nothing that heats it, assumed ones.
    has_battery : bool
        Whether it has a battery.
    unused : dict of str to str
        Devices that a plant made of the graph leaves out, each with the reason.
    """

    air_handlers: tuple[str, ...]
    serving: IndexArray
    emitters: dict[str, tuple[Device, ...]]
    water: tuple[str, ...]
    chills: bool
    has_air: bool
    has_battery: bool
    unused: dict[str, str]


def device_graph(building: Building) -> DeviceGraph:
    """Make the graph of a building's devices.

    A terminal is fed by the air handler that its ``fed_by`` names. Where it names none, each air handler feeds a floor
    if there are as many of them as floors, else zones go to them in turn.

    Parameters
    ----------
    building : Building
        With its devices.

    Raises
    ------
    ModelError
        When a device is fed by one that the building does not have.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> device_graph(load_bundled_case().building).serving.tolist()
    [0, 0, 0, 0, 0]
    """
    names, zones = [d.name for d in building.devices], building.zone_names
    air_handlers = tuple(d.name for d in building.devices if d.type == "ahu")
    serving, emitters = _by_floor(building, max(1, len(air_handlers))), dict[str, tuple[Device, ...]]()
    wet = {kind: [p.supplies for p in c.ports if p.quantity == "water"] for kind, c in COMPONENTS.items()}
    supplies, draws = ({kind for kind, ports in wet.items() if side in ports} for side in (True, False))
    types, unused = [d.type for d in building.devices], dict[str, str]()
    source = next((kind for kind in types if kind in supplies - draws), BoilerLoop.device)
    water = (source, *(kind.device for kind in (StorageTank, MixingValve) if kind.device in types))
    for device in building.devices:
        feeding = getattr(device, "fed_by", ())
        for name in feeding:
            ModelError.unless_known(name, names, f"device {device.name!r}: fed_by", "a device")
        kind = COMPONENTS.get(device.type)
        if kind is None:
            unused |= {} if device.type in _METERS else {device.name: f"no component has the type {device.type!r}"}
        elif issubclass(kind, Group) and device.zone is None:
            unused[device.name] = f"{device.type} without a zone"
        elif kind is Terminals:
            for name in (n for n in feeding if n in air_handlers):
                serving[zones.index(str(device.zone))] = air_handlers.index(name)
        elif issubclass(kind, Group):
            emitters[device.type] = (*emitters.get(device.type, ()), device)
        elif device.type not in (AirHandler.device, ChillerLoop.device, Battery.device, *water):
            supplied = f"the hot water is from {source}"
            why = supplied if device.type in supplies else "no rule connects it: pass the system"
            unused[device.name] = f"{device.type}, {why}"
    heated = {d.zone for kind, found in emitters.items() for d in found if kind != Ventilators.device}
    has_air = bool({"vav", AirHandler.device} & set(types)) or not set(zones) <= heated
    chills, battery = (kind.device in types for kind in (ChillerLoop, Battery))
    return DeviceGraph(air_handlers, serving, emitters, water, chills, has_air, battery, unused)


def _by_floor(building: Building, count: int) -> IndexArray:
    """Position of the air handler of each zone where no device says it."""
    zones = building.zone_names
    if isinstance(building.geometry, FloorPlans) and count == len(building.geometry.floors):
        of_floor = {zone: k for k, floor in enumerate(building.geometry.floors) for zone in floor.zone_names}
        return np.array([of_floor[zone] for zone in zones], dtype=np.intp)
    return np.arange(len(zones), dtype=np.intp) % count
