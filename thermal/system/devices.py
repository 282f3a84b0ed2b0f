"""The graph of a case's devices: what each is, which zone it is in, and what feeds it."""

from dataclasses import dataclass

import numpy as np

from thermal.case.building import Building, Device, FloorPlans
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Group, IndexArray
from thermal.components.registry import COMPONENTS
from thermal.components.terminals import Terminals
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
    water : str
        Type of what supplies hot water: of the first device that does, else ``boiler``.
    unused : dict of str to str
        Devices that a plant made of the graph leaves out, each with the reason.
    """

    air_handlers: tuple[str, ...]
    serving: IndexArray
    emitters: dict[str, tuple[Device, ...]]
    water: str
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
    heats = {kind for kind, c in COMPONENTS.items() if any(p.quantity == "water" and p.supplies for p in c.ports)}
    water, unused = next((d.type for d in building.devices if d.type in heats), BoilerLoop.device), dict[str, str]()
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
        elif device.type not in (AirHandler.device, water):
            why = f"the hot water is from {water}" if device.type in heats else "no rule connects it: pass the system"
            unused[device.name] = f"{device.type}, {why}"
    return DeviceGraph(air_handlers, serving, emitters, water, unused)


def _by_floor(building: Building, count: int) -> IndexArray:
    """Position of the air handler of each zone where no device says it."""
    zones = building.zone_names
    if isinstance(building.geometry, FloorPlans) and count == len(building.geometry.floors):
        of_floor = {zone: k for k, floor in enumerate(building.geometry.floors) for zone in floor.zone_names}
        return np.array([of_floor[zone] for zone in zones], dtype=np.intp)
    return np.arange(len(zones), dtype=np.intp) % count
