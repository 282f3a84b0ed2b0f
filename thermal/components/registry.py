"""Which component a device of a case is, by its type; one's own are added with `register_component`."""

from thermal.case.building import DEVICE_TYPES
from thermal.components.air_handler import AirHandler
from thermal.components.battery import Battery
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.chiller_loop import ChillerLoop
from thermal.components.component import Actuator, Component
from thermal.components.district_loop import DistrictLoop
from thermal.components.electric_heaters import ElectricHeaters
from thermal.components.fan_coils import FanCoils
from thermal.components.heat_pump_loop import HeatPumpLoop
from thermal.components.mixing_valve import MixingValve
from thermal.components.radiators import HeatedFloors, Radiators
from thermal.components.storage_tank import StorageTank
from thermal.components.terminals import Terminals
from thermal.components.thermostat import Thermostat
from thermal.components.unitary_units import UnitaryUnits
from thermal.components.ventilators import Ventilators
from thermal.errors import ModelError

#: Classes of components by type of device.
COMPONENTS: dict[str, type[Component]] = {
    kind.device: kind
    for kind in (
        Terminals, AirHandler, BoilerLoop, Radiators, HeatPumpLoop, DistrictLoop, StorageTank, MixingValve, ChillerLoop,
        HeatedFloors, ElectricHeaters, FanCoils, UnitaryUnits, Ventilators, Battery,
    )
}  # fmt: skip


def register_component(kind: type[Component]) -> type[Component]:
    """Let devices of a type be components of a class; a decorator.

    Parameters
    ----------
    kind : type
        A subclass of `Component` with a `device` of its own.

    Returns
    -------
    type
        The same.

    Raises
    ------
    ModelError
        The class names no type of device, or one that another class has.
    """
    known = COMPONENTS.get(kind.device)
    named = (kind.__module__, kind.__qualname__)
    if not kind.device or (known is not None and (known.__module__, known.__qualname__) != named):
        expected = f"a type of device beside {', '.join(sorted(COMPONENTS))}"
        raise ModelError(f"component {kind.__name__}: device", expected, repr(kind.device))
    COMPONENTS[kind.device] = kind
    return kind


def device_types() -> tuple[str, ...]:
    """Give the types of devices that are known: of the case format, and of registered components."""
    return (*DEVICE_TYPES, *(kind for kind in COMPONENTS if kind not in DEVICE_TYPES))


def setpoints() -> dict[str, Actuator]:
    """Give the setpoints that a supervisory controller may decide, by type of the point; whose was first keeps it."""
    kinds: list[type[Component]] = [*COMPONENTS.values(), Thermostat]
    usual = [(a.point, a) for kind in kinds for a in kind.actuators if a.usual is not None]
    return dict(reversed(dict(reversed(usual)).items()))
