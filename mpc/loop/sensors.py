"""What the sensors of a plant say: its signals under the names of the case format, with noise."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpc.errors import PlantError
from mpc.loop.history import PlantStep
from mpc.loop.noise import NoiseSource, SensorNoise
from mpc.loop.plant import PointLayout
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.points import DISCHARGE_TEMPERATURE, SUPPLY_FLOW
from thermal.components.air_handler import AirHandler
from thermal.components.component import Group
from thermal.components.moist_air import LEAST_AIR
from thermal.components.operations import Operations, StepOperations, Value
from thermal.components.terminals import Terminals
from thermal.system.points import HvacPoints
from thermal.system.system import HvacSystem

_STEP = StepOperations()


@dataclass(frozen=True, eq=False)
class PlantDevices:
    """Which devices of a building are those of its plant.

    Parameters
    ----------
    by_type : mapping of str to tuple of str
        Names by type, in the order of the plant.
    boiler : str
        Name of what supplies the hot water, a boiler or another; empty where nothing does.
    meter : str
        Type of the point that reads its electric power.
    """

    by_type: Mapping[str, tuple[str, ...]]
    boiler: str = ""
    meter: str = "pump_power_sensor"

    @property
    def terminals(self) -> tuple[str, ...]:
        """Names of the terminals."""
        return self.by_type.get("vav", ())

    @property
    def air_handlers(self) -> tuple[str, ...]:
        """Names of the air handlers."""
        return self.by_type.get("ahu", ())

    @property
    def chiller(self) -> str | None:
        """Name of the device that meters refrigeration; None when the air handlers' meters have it."""
        return next(iter(self.by_type["chiller"]), None)

    @property
    def count(self) -> int:
        """Number of devices."""
        return sum(len(names) for names in self.by_type.values())

    def named(self, system: HvacSystem) -> HvacSystem:
        """Give a system's components the names of the devices.

        Parameters
        ----------
        system : HvacSystem
            The system.
        """
        return system.named({type(c): self.by_type[c.device] for c in system.components.values()})


def plant_devices(building: Building, system: HvacSystem) -> PlantDevices:
    """Find the devices of a plant in a building.

    Parameters
    ----------
    building : Building
        Its devices of the types that the system's components have, and ``chiller``, in the order of the plant.
    system : HvacSystem
        The plant.

    Raises
    ------
    PlantError
        When the building has not as many as the plant.
    """
    zones, found = building.zone_names, dict[str, tuple[str, ...]]()
    if system.zone_count != len(zones):
        raise PlantError("plant", f"terminals in all {len(zones)} zones", f"in {system.zone_count}")
    for component in system.components.values():
        kind = component.device
        if isinstance(component, Group):
            found[kind] = _of_zones(building, kind, [zones[k] for k in component.zone])
        elif kind not in found:
            found[kind] = tuple(d.name for d in building.devices if d.type == kind)
            wanted, count = len(system.of_kind(type(component))), len(found[kind])
            PlantError.unless(count == wanted, f"devices of type {kind!r}", str(wanted), count)
    found["chiller"] = tuple(d.name for d in building.devices if d.type == "chiller")
    if len(found["chiller"]) > 1:
        raise PlantError("devices of type 'chiller'", "one or none", f"{len(found['chiller'])}")
    water = [system.components[name] for name in system.water_suppliers]
    names = [name for kind in dict.fromkeys(c.device for c in water) for name in found[kind]]
    electric = [p for c in water for p in c.sensors if p in ("electrical_power_sensor", PlantDevices.meter)]
    return PlantDevices(found, next(iter(names), ""), next(iter(electric), PlantDevices.meter))


def _of_zones(building: Building, kind: str, zones: Sequence[str]) -> tuple[str, ...]:
    """Names of the devices of a type for the elements of a group, which are in these zones."""
    waiting = {z: [d.name for d in building.devices_of(z) if d.type == kind][::-1] for z in building.zone_names}
    names = []
    for zone in zones:
        expected = f"a device of type {kind!r} for each {'terminal' if kind == 'vav' else kind}"
        PlantError.unless(waiting[zone], f"zone {zone!r}", expected, "too few")
        names.append(waiting[zone].pop())
    spare = [name for left in waiting.values() for name in left]
    if spare:
        expected = f"no more devices of type {kind!r} than the plant has"
        raise PlantError("building", expected, f"{spare[0]!r} too")
    return tuple(names)


class Sensors:
    """Reads a plant as telemetry does.

    Parameters
    ----------
    system : HvacSystem
        The plant, with the names of its devices.
    chiller : str or None
        Name of the device that meters refrigeration.
    scenario : Scenario
        Weather, and people where they are counted.
    noise : SensorNoise or None
        None reads exactly.
    counted : bool
        Whether people are counted.
    pressures : bool
        Whether the pressures of ducts and loop are measured.
    """

    def __init__(
        self,
        system: HvacSystem,
        chiller: str | None,
        scenario: Scenario,
        noise: SensorNoise | None,
        counted: bool,
        pressures: bool = False,
    ) -> None:
        self._points, self._terminals, self._counted = HvacPoints(system, pressures), system.terminals, counted
        building = scenario.building
        meter = [] if chiller is None else [f"{chiller}/electrical_power_sensor"]
        weather = [f"{building.weather_station}/{p}" for p in scenario.weather.frame]
        people = [f"{zone}/occupancy_count_sensor" for zone in scenario.zones] if counted else []
        self.layout = PointLayout((*self._points.columns, *meter, *weather, *people), building.location.timezone)
        self._chiller = chiller is not None
        boxes = [entity for name in system.of_kind(Terminals) for entity in system.entities(name)]
        self._meters = self._places(system.of_kind(AirHandler), "electrical_power_sensor")
        self._flow = self._places(boxes, SUPPLY_FLOW)
        self._discharge = self._places(boxes, DISCHARGE_TEMPERATURE)
        self._weather = scenario.weather.frame.to_numpy(dtype=float)
        self.noise = None if noise is None else NoiseSource(self.layout, noise)

    def _places(self, entities: Iterable[str], point: str) -> NDArray[np.intp]:
        return np.array([self.layout.position[f"{entity}/{point}"] for entity in entities], dtype=np.intp)

    def read(self, step: PlantStep, people: FloatArray, seed: int) -> FloatArray:
        """Read all points after a step.

        The discharge temperature is that of the heat at the zone's mean temperature over the step, so that the metered
        heat of a stamp is the heat that the zone received.

        Parameters
        ----------
        step : PlantStep
            Of the plant.
        people : ndarray, shape (n_zone,)
            In the zones [-].
        seed : int
            Of the noise.

        Returns
        -------
        ndarray, shape (n_column,)
            In the library's units.
        """
        whole = self.exact(_STEP, step, self._weather[step.number], people)
        return whole if self.noise is None else self.noise.disturb(step.number, whole, seed)

    def exact(self, ops: Operations, step: PlantStep, weather: Value, people: Value) -> Any:
        """Read all points after a step without noise.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        step : PlantStep
            Of the plant.
        weather : Value, shape (n_weather,)
            As measured [library's units].
        people : Value, shape (n_zone,)
            In the zones [-].

        Returns
        -------
        Value, shape (n_column,)
            In the library's units.
        """
        place, zone, conditions, air = self._terminals.zone, step.mean, step.conditions, step.done.terminals
        values = ops.empty(len(self.layout.columns))
        self._points.read(conditions._replace(zone_temperature=zone), step.actions, step.done, ops, values)
        if place.size:
            flowing = air.airflow > LEAST_AIR
            lift = (zone - conditions.zone_temperature)[place]
            values[self._discharge] = np.where(flowing, air.discharge + lift, zone[place])
            values[self._flow] = np.where(flowing, air.airflow, 0.0)
        begin = len(self._points.columns)
        if self._chiller:
            cooling = [handler.mixed.cooling_power for handler in step.done.air_handlers]
            for at, power in zip(self._meters.tolist(), cooling, strict=True):
                values[at] = values[at] - power
            values[begin] = sum(cooling)
            begin += 1
        width = self._weather.shape[1]
        values[begin : begin + width] = weather
        if self._counted:
            values[begin + width :] = people
        return values
