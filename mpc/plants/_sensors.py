"""What the sensors of a plant say: its signals under the names of the case format, with noise."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mpc.errors import PlantError
from mpc.plants._plant import PointLayout
from mpc.scenario import Scenario
from thermal import Building
from thermal.case.points import POINT_TYPES, split_column
from thermal.errors import describe
from thermal.hvac import Actions, Conditions, HvacPoints, HvacStep, HvacSystem

FloatArray = NDArray[np.float64]

_STREAM = 7  # of random numbers of a seed, apart from those of people, forecasts and the shuffle
_BLOCK = 64  # steps whose noise is drawn together
_FREEZING = 273.15  # K: sensors count their resolution from here
_LEAST_FLOW = 1e-6  # kg/s: less is none


@dataclass(frozen=True)
class SensorNoise:
    """Errors of sensors and meters, independent from step to step.

    Parameters
    ----------
    temperature : float
        Standard deviation of temperature sensors [K]; the default is that of the shared practice cases.
    resolution : float
        Steps of temperature sensors [K]; 0 reports every digit.
    flow : float
        Standard deviation of air flow stations as a share of the flow [-]; the default is that of new ones (ASHRAE
        Handbook, Fundamentals 2017, ch. 37).
    power : float
        Standard deviation of meters as a share of the power [-]; the default is a class 1 meter's (IEC 62053-21).

    Raises
    ------
    PlantError
        When one is negative or no number.
    """

    temperature: float = 0.03
    resolution: float = 0.02
    flow: float = 0.02
    power: float = 0.01

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value < np.inf:
                raise PlantError(describe(f"sensor noise: {field.name}", "0 or more", repr(value)))


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
    """

    def __init__(
        self, system: HvacSystem, devices: PlantDevices, scenario: Scenario, noise: SensorNoise | None, counted: bool
    ) -> None:
        self._points = HvacPoints(system, devices.terminals, devices.air_handlers, devices.boiler)
        self._system, self._noise, self._counted = system, noise, counted
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
        self._block: tuple[tuple[int, int], FloatArray] = ((-1, -1), np.zeros((0, 0)))

    @cached_property
    def _scales(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray, NDArray[np.intp]]:
        """Columns with noise, absolute and relative deviations of all, and columns that count in steps."""
        noise = self._noise or SensorNoise()
        rows = []
        for k, column in enumerate(self.layout.columns):
            point = split_column(column, "plant")[1]
            quantity = POINT_TYPES[point].quantity
            by = {"temperature": (noise.temperature, 0.0), "air_flow": (0.0, noise.flow), "power": (0.0, noise.power)}
            if point.endswith("_sensor") and quantity in by:
                rows.append((k, *by[quantity], quantity == "temperature"))
        index = np.array([row[0] for row in rows], dtype=np.intp)
        absolute, relative = np.zeros(len(self.layout.columns)), np.zeros(len(self.layout.columns))
        absolute[index], relative[index] = [row[1] for row in rows], [row[2] for row in rows]
        return index, absolute, relative, index[[row[3] for row in rows]]

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
        place = self._points.zone
        discharge, airflow = step.discharge + (zone - conditions.zone_temperature)[place], step.airflow
        if not airflow.min() > _LEAST_FLOW:
            flowing = airflow > _LEAST_FLOW
            discharge, airflow = np.where(flowing, discharge, zone[place]), np.where(flowing, airflow, 0.0)
        seen = step._replace(airflow=airflow, discharge=discharge)
        values = self._points.read(conditions._replace(zone_temperature=zone), actions, seen)
        whole = np.empty(len(self.layout.columns))
        whole[: values.size], at = values, values.size
        if self._chiller:
            cooling = [m.cooling_power for m in step.mixed]
            whole[self._meters] -= cooling
            whole[at], at = sum(cooling), at + 1
        weather = self._weather[k]
        whole[at : at + weather.size] = weather
        if self._counted:
            whole[at + weather.size :] = people
        return whole if self._noise is None else self._disturbed(k, whole, seed)

    def _disturbed(self, k: int, values: FloatArray, seed: int) -> FloatArray:
        """Add the noise of a step, which depends on seed and step only."""
        index, absolute, relative, stepped = self._scales
        number, row = divmod(k, _BLOCK)
        if self._block[0] != (seed, number):
            rng = np.random.default_rng([seed, _STREAM, number])
            drawn = np.zeros((_BLOCK, values.size))
            drawn[:, index] = rng.standard_normal((_BLOCK, index.size))
            self._block = ((seed, number), drawn)
        error = np.abs(values)
        error *= relative
        error += absolute
        error *= self._block[1][row]
        values += error
        size = 0.0 if self._noise is None else self._noise.resolution
        if size > 0.0:
            seen = values[stepped]
            seen -= _FREEZING
            seen /= size
            np.rint(seen, out=seen)
            seen *= size
            seen += _FREEZING
            values[stepped] = seen
        return values
