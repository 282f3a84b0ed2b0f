"""What the sensors of a plant say: its signals under the names of the case format, with noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mpc.errors import PlantError
from mpc.loop.noise import NoiseSource, SensorNoise
from mpc.loop.plant import PointLayout
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.errors import describe
from thermal.hvac._points import HvacPoints
from thermal.hvac._step import Actions, Conditions, HvacStep
from thermal.hvac._system import HvacSystem

_LEAST_FLOW = 1e-6  # kg/s: less is none


@dataclass(frozen=True, eq=False)
class PlantDevices:
    """Which devices of a building are those of its plant.

    Parameters
    ----------
    terminals, air_handlers : tuple of str
        Names, in the order of the plant.
    boiler : str
        Name.
    chiller : str or None
        Name of the device that meters refrigeration; None when the air handlers' meters have it.
    """

    terminals: tuple[str, ...]
    air_handlers: tuple[str, ...]
    boiler: str
    chiller: str | None

    @property
    def count(self) -> int:
        """Number of devices."""
        return len(self.terminals) + len(self.air_handlers) + 1 + (self.chiller is not None)


def plant_devices(building: Building, system: HvacSystem) -> PlantDevices:
    """Find the devices of a plant in a building.

    Parameters
    ----------
    building : Building
        Its devices of types ``vav``, ``ahu``, ``boiler`` and ``chiller``, in the order of the plant.
    system : HvacSystem
        The plant.

    Raises
    ------
    PlantError
        When the building has not as many as the plant.
    """
    zones = building.zone_names
    if system.zone_count != len(zones):
        raise PlantError(describe("plant", f"terminals in all {len(zones)} zones", f"in {system.zone_count}"))
    of_type = {kind: [d.name for d in building.devices if d.type == kind] for kind in ("ahu", "boiler", "chiller")}
    waiting = {zone: [d.name for d in building.devices_of(zone) if d.type == "vav"][::-1] for zone in zones}
    terminals: list[str] = []
    for k in system.terminals.zone.tolist():
        if not waiting[zones[k]]:
            raise PlantError(describe(f"zone {zones[k]!r}", "a device of type 'vav' for each terminal", "too few"))
        terminals.append(waiting[zones[k]].pop())
    spare = [name for names in waiting.values() for name in names]
    if spare:
        raise PlantError(describe("building", "no more devices of type 'vav' than terminals", f"{spare[0]!r} too"))
    for kind, wanted in (("ahu", len(system.air_handlers)), ("boiler", 1)):
        if len(of_type[kind]) != wanted:
            raise PlantError(describe(f"devices of type {kind!r}", str(wanted), f"{len(of_type[kind])}"))
    if len(of_type["chiller"]) > 1:
        raise PlantError(describe("devices of type 'chiller'", "one or none", f"{len(of_type['chiller'])}"))
    chiller = of_type["chiller"][0] if of_type["chiller"] else None
    return PlantDevices(tuple(terminals), tuple(of_type["ahu"]), of_type["boiler"][0], chiller)


class Sensors:
    """Reads a plant as telemetry does.

    Parameters
    ----------
    system : HvacSystem
        The plant.
    devices : PlantDevices
        Its names.
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
        devices: PlantDevices,
        scenario: Scenario,
        noise: SensorNoise | None,
        counted: bool,
        pressures: bool = False,
    ) -> None:
        self._points = HvacPoints(system, devices.terminals, devices.air_handlers, devices.boiler, pressures)
        self._system, self._counted = system, counted
        building = scenario.building
        chiller = [] if devices.chiller is None else [f"{devices.chiller}/electrical_power_sensor"]
        weather = [f"{building.weather_station}/{p}" for p in scenario.weather.frame]
        people = [f"{zone}/occupancy_count_sensor" for zone in scenario.zones] if counted else []
        columns = (*self._points.columns, *chiller, *weather, *people)
        self.layout = PointLayout(columns, building.location.timezone)
        self._chiller = devices.chiller is not None
        meters = [f"{name}/electrical_power_sensor" for name in devices.air_handlers]
        self._meters = np.array([self.layout.position[name] for name in meters])
        self._weather = scenario.weather.frame.to_numpy(dtype=float)
        self._noise = None if noise is None else NoiseSource(self.layout, noise)

    def read(
        self,
        k: int,
        conditions: Conditions,
        actions: Actions,
        step: HvacStep,
        zone: FloatArray,
        people: FloatArray,
        seed: int,
    ) -> FloatArray:
        """Read all points after a step.

        The discharge temperature is that of the heat at the zone's mean temperature over the step, so that the metered
        heat of a stamp is the heat that the zone received.

        Parameters
        ----------
        k : int
            Number of the step.
        conditions : Conditions
            Of the plant.
        actions : Actions
            For the step.
        step : HvacStep
            What happened.
        zone : ndarray, shape (n_zone,)
            What the zones' sensors read, mean over the step [K].
        people : ndarray, shape (n_zone,)
            In the zones [-].
        seed : int
            Of the noise.

        Returns
        -------
        ndarray, shape (n_column,)
            In the library's units.
        """
        place = self._system.terminals.zone
        flowing = step.airflow > _LEAST_FLOW
        discharge = np.where(flowing, step.discharge + (zone - conditions.zone_temperature)[place], zone[place])
        seen = step._replace(airflow=np.where(flowing, step.airflow, 0.0))
        values = self._points.read(conditions._replace(zone_temperature=zone), actions, seen, discharge)
        parts: list[Sequence[float] | FloatArray] = [values]
        if self._chiller:
            cooling = np.array([m.cooling_power for m in step.mixed], dtype=float)
            values[self._meters] -= cooling
            parts.append([float(cooling.sum())])
        parts.append(self._weather[k])
        if self._counted:
            parts.append(people)
        whole = np.concatenate(parts)
        return whole if self._noise is None else self._noise.disturb(k, whole, seed)
