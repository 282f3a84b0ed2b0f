"""What is measured and set: columns of the case format as sums of EnergyPlus' output variables, and its setpoints."""

from collections.abc import Mapping, Sequence
from datetime import date
from typing import Any, NamedTuple

import numpy as np

from mpc.adapters.energyplus.building import EnergyPlusBuilding
from mpc.adapters.energyplus.input import InputFile, entity
from mpc.adapters.energyplus.layout import AirLoop, PlantLayout, Terminal, WaterLoop
from mpc.errors import EnergyPlusError, PlantError
from mpc.loop.actuators import ACTION_LIMITS, COOLING_SETPOINT, HEATING_SETPOINT, SUPPLY_AIR, SUPPLY_WATER, Actuator
from mpc.loop.conversion import conversion
from thermal._types import FloatArray

#: Name and key of an output variable.
Output = tuple[str, str]
#: Output variables whose sum a point is, with the factor of each; a point of none is not measured.
Points = Mapping[str, Mapping[Output, float]]

#: To and from the only unit of EnergyPlus that is not the library's.
CELSIUS = conversion("zone_air_temperature_sensor", "EnergyPlus", "degC")

_LEAST_FLOW = 1e-6  # kg/s: less is none
_TEMPERATURE, _FLOW = "System Node Temperature", "System Node Mass Flow Rate"
_SETPOINT = "System Node Setpoint Temperature"
_ZONE = "Zone Air Temperature"
_SITE = {
    "outside_air_temperature_sensor": "Site Outdoor Air Drybulb Temperature",
    "wind_speed_sensor": "Site Wind Speed",
    "wind_direction_sensor": "Site Wind Direction",
    "direct_normal_irradiance_sensor": "Site Direct Solar Radiation Rate per Area",
    "diffuse_horizontal_irradiance_sensor": "Site Diffuse Solar Radiation Rate per Area",
    "horizontal_infrared_irradiance_sensor": "Site Horizontal Infrared Radiation Rate per Area",
}
_MEASURED = ("zone_air_temperature_sensor", "supply_air_flowrate_sensor", "discharge_air_temperature_sensor")
_SCHEDULED = "SetpointManager:Scheduled"

#: End uses that belong to heating, ventilation and air conditioning.
_END_USES = ("Fans", "Cooling", "Heating", "Pumps", "HeatRejection", "HeatRecovery", "Humidifier")

#: Ranges of the supply setpoints [K]; water as hot as the reference buildings' own, 82.2 degC, must be in.
_LIMITS = {SUPPLY_AIR: (283.15, 303.15), SUPPLY_WATER: (310.0, 361.15)}


def meters(names: Sequence[str], resource: str) -> tuple[str, ...]:
    """Choose the meters of a resource's end uses for heating, ventilation and air conditioning.

    Parameters
    ----------
    names : sequence of str
        All meters of the building.
    resource : str
        ``Electricity`` or ``NaturalGas``.
    """
    return tuple(f"{use}:{resource}" for use in _END_USES if f"{use}:{resource}" in set(names))


def _all(output: str, *keys: str) -> dict[Output, float]:
    return {(output, key): 1.0 for key in keys}


def _of_terminal(t: Terminal, full_flow: Mapping[str, float]) -> Points:
    full = full_flow.get(t.coil, 0.0) if t.water_node else 0.0
    return {
        "zone_air_temperature_sensor": _all(_ZONE, t.zone),
        HEATING_SETPOINT: _all("Zone Thermostat Heating Setpoint Temperature", t.zone),
        COOLING_SETPOINT: _all("Zone Thermostat Cooling Setpoint Temperature", t.zone),
        "supply_air_flowrate_sensor": _all(_FLOW, t.outlet),
        "discharge_air_temperature_sensor": _all(_TEMPERATURE, t.outlet),
        "supply_air_damper_percentage_command": _all("Zone Air Terminal VAV Damper Position", t.name),
        "heating_water_valve_percentage_command": {(_FLOW, t.water_node): 1.0 / full} if full > 0.0 else {},
    }


def _of_air_loop(loop: AirLoop) -> Points:
    fans = _all("Fan Electricity Rate", *(fan for _, fan in loop.of_kind("Fan:")))
    compressors = _all("Cooling Coil Electricity Rate", *(coil for _, coil in loop.of_kind("Coil:Cooling:DX")))
    electric = _all("Heating Coil Electricity Rate", *(coil for _, coil in loop.of_kind("Coil:Heating:Electric")))
    return {
        SUPPLY_AIR: _all(_SETPOINT, loop.outlet),
        "supply_air_temperature_sensor": _all(_TEMPERATURE, loop.outlet),
        "return_air_temperature_sensor": _all(_TEMPERATURE, loop.inlet),
        "supply_air_flowrate_sensor": _all(_FLOW, loop.outlet),
        "mixed_air_temperature_sensor": _all(_TEMPERATURE, loop.mixed) if loop.mixed else {},
        "supply_fan_power_sensor": fans,
        "electrical_power_sensor": fans | compressors | electric,
        "gas_power_sensor": _all("Heating Coil NaturalGas Rate", *(c for _, c in loop.of_kind("Coil:Heating:Fuel"))),
    }


def _of_water_loop(loop: WaterLoop) -> Points:
    return {
        SUPPLY_WATER: _all(_SETPOINT, loop.outlet),
        "supply_water_temperature_sensor": _all(_TEMPERATURE, loop.outlet),
        "return_water_temperature_sensor": _all(_TEMPERATURE, loop.inlet),
        "gas_power_sensor": _all("Boiler NaturalGas Rate", *(boiler for _, boiler in loop.boilers)),
        "pump_power_sensor": _all("Pump Electricity Rate", *(pump for _, pump in loop.pumps)),
    }


def columns_of(layout: PlantLayout, station: str, full_flow: Mapping[str, float]) -> Points:
    """List the columns of a building.

    Parameters
    ----------
    layout : PlantLayout
        Its plant.
    station : str
        Name of the weather station.
    full_flow : mapping of str to float
        Water flow of reheat coils whose valve is open, by coil [kg/s].

    Returns
    -------
    mapping
        By ``ENTITY/POINT``.
    """
    devices: list[tuple[str, Points]] = [(t.name, _of_terminal(t, full_flow)) for t in layout.terminals]
    devices += [(zone, {"zone_air_temperature_sensor": _all(_ZONE, zone)}) for zone in layout.others]
    devices += [(loop.name, _of_air_loop(loop)) for loop in layout.air_loops]
    devices += [(loop.name, _of_water_loop(loop)) for loop in layout.water_loops]
    devices += [(name, {"electrical_power_sensor": _all("Chiller Electricity Rate", name)}) for name in layout.chillers]
    devices.append((station, {point: _all(output, "Environment") for point, output in _SITE.items()}))
    return {f"{entity(name)}/{point}": sums for name, points in devices for point, sums in points.items() if sums}


class Reader:
    """Turns EnergyPlus' outputs into columns.

    Parameters
    ----------
    columns : mapping
        Of `columns_of`, with factors to the units of the columns [unit of the point].
    layout : PlantLayout
        Plant of the building.

    Attributes
    ----------
    outputs : tuple of tuple of str
        Name and key of every variable that is read, once each.
    products : list of tuple of int
        Pairs of outputs whose product is averaged too: air flow and its temperature, for the heat that it brings.
    names : tuple of str
        Of the columns.
    """

    def __init__(self, columns: Points, layout: PlantLayout) -> None:
        self.outputs: tuple[Output, ...] = tuple(dict.fromkeys(o for sums in columns.values() for o in sums))
        self.names = tuple(columns)
        place = {output: k for k, output in enumerate(self.outputs)}
        self._sum = np.zeros((len(columns), len(self.outputs)))
        for row, sums in enumerate(columns.values()):
            for output, factor in sums.items():
                self._sum[row, place[output]] = factor
        self._offset = np.array([CELSIUS.offset if "temperature" in c.rpartition("/")[2] else 0.0 for c in columns])
        at = {name: k for k, name in enumerate(self.names)}
        terminals = {t.zone: entity(t.name) for t in reversed(layout.terminals)}
        self._zone, self._flow, self._warm = (
            np.array([at[f"{entity(t.name)}/{kind}"] for t in layout.terminals]) for kind in _MEASURED
        )
        self._rooms = np.array([at[f"{terminals[zone]}/{_MEASURED[0]}"] for zone in layout.zones])
        self.products = [(place[_FLOW, t.outlet], place[_TEMPERATURE, t.outlet]) for t in layout.terminals]

    def read(self, rows: FloatArray) -> FloatArray:
        """Turn rows of outputs, products after them, into columns, shape (n_row, n_column) [library's units].

        Parameters
        ----------
        rows : ndarray, shape (n_row, n_output + n_product)
            Means over a step [EnergyPlus' units].
        """
        outputs, products = rows[:, : len(self.outputs)], rows[:, len(self.outputs) :]
        values = outputs @ self._sum.T + self._offset
        flow = values[:, self._flow]
        flowing = flow > _LEAST_FLOW
        # the temperature of the heat: a flow that changes within the step weighs its own temperature
        warm = np.divide(products, flow, out=np.zeros_like(flow), where=flowing) + self._offset[self._warm]
        values[:, self._warm] = np.where(flowing, warm, values[:, self._zone])
        values[:, self._flow] = np.where(flowing, flow, 0.0)
        return np.asarray(values)

    def rooms(self, row: FloatArray) -> FloatArray:
        """Temperatures of the zones in a row of outputs, shape (n_zone,) [K].

        Parameters
        ----------
        row : ndarray, shape (n_output,)
            Values at an instant [EnergyPlus' units].
        """
        return np.asarray((row @ self._sum.T + self._offset)[self._rooms])


class _Supply(NamedTuple):
    """A supply setpoint: the schedule that its managers follow, and the device's own copy of it."""

    actuator: str
    managers: tuple[str, ...]
    kind: str
    schedule: str
    own: str


def _supplies(source: EnergyPlusBuilding) -> list[_Supply]:
    file, layout = source.source, source.layout
    found = []
    for point, loops in ((SUPPLY_AIR, layout.air_loops), (SUPPLY_WATER, layout.water_loops)):
        for loop in loops:
            named = {file.find(_SCHEDULED, m)["schedule_name"].lower() for m in loop.managers}
            expected = f"one schedule for the setpoint managers of {loop.name!r}"
            EnergyPlusError.unless(len(named) <= 1, file.name, expected, ", ".join(sorted(named)))
            kind, schedule = _schedule(file, named.pop())
            own = f"{schedule} of {loop.name}"
            found.append(_Supply(f"{entity(loop.name)}/{point}", loop.managers, kind, schedule, own))
    return found


def _schedule(source: InputFile, name: str) -> tuple[str, str]:
    """Type and name of a schedule as the file writes it."""
    for kind, title, _ in source.begins("Schedule:"):
        if title.lower() == name:
            return kind, title
    raise EnergyPlusError(source.name, f"a schedule {name!r}", "none")


def prepared(source: EnergyPlusBuilding, start: date, days: int, steps_per_hour: int) -> dict[str, Any]:
    """Write a building's input for a run: clock, and schedules of supply setpoints that are each device's own.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    start : date
        First day.
    days : int
        Number of days.
    steps_per_hour : int
        Of zones and weather.

    Returns
    -------
    dict
        Content of an input file.
    """
    content = source.source.with_period(start, days, steps_per_hour)
    for supply in _supplies(source):
        content[supply.kind][supply.own] = dict(content[supply.kind][supply.schedule])
        for manager in supply.managers:
            content[_SCHEDULED][manager]["schedule_name"] = supply.own
    return content


def actuators_of(
    source: EnergyPlusBuilding, limits: Mapping[str, tuple[float, float]]
) -> dict[tuple[str, str, str], Actuator]:
    """List the actuators by what each is called in EnergyPlus: schedules of supply setpoints, thermostats of zones.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    limits : mapping of str to tuple of float
        Ranges by kind of action in the place of the default ones [K].

    Raises
    ------
    PlantError
        When a limit is for no kind of action.
    EnergyPlusError
        When a device's setpoint managers follow several schedules.
    """
    for kind in limits:
        PlantError.unless_known(kind, ACTION_LIMITS, "limits", "a kind of action")
    bounds = {**ACTION_LIMITS, **_LIMITS, **limits}
    names = {(s.kind, "Schedule Value", s.own): s.actuator for s in _supplies(source)}
    for point, control in ((HEATING_SETPOINT, "Heating Setpoint"), (COOLING_SETPOINT, "Cooling Setpoint")):
        for zone in source.layout.zones:
            names["Zone Temperature Control", control, zone] = f"{entity(zone)}/{point}"
    return {key: Actuator(name, "K", *bounds[name.rpartition("/")[2]], required=False) for key, name in names.items()}
