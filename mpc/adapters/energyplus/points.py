"""What is measured: columns of the case format as sums of EnergyPlus' output variables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mpc.adapters.energyplus.layout import AirLoop, PlantLayout, WaterLoop
from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT, SUPPLY_AIR, SUPPLY_WATER
from thermal._types import FloatArray

Output = tuple[str, str]

_FREEZING = 273.15  # K
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

#: End uses that belong to heating, ventilation and air conditioning.
_END_USES = ("Fans", "Cooling", "Heating", "Pumps", "HeatRejection", "HeatRecovery", "Humidifier")


class _Column(NamedTuple):
    """A column of telemetry.

    Parameters
    ----------
    name : str
        ``ENTITY/POINT``.
    outputs : tuple
        Name and key of the output variables whose sum it is.
    offset : float
        Added to the sum: 273.15 K for temperatures [unit of the column].
    scale : float
        Of the sum [-].
    """

    name: str
    outputs: tuple[Output, ...]
    offset: float = 0.0
    scale: float = 1.0


def entity(name: str) -> str:
    """Make a name of EnergyPlus one that columns can have.

    Parameters
    ----------
    name : str
        Of an object.
    """
    return name.replace("/", "-").strip()


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


def columns_of(layout: PlantLayout, station: str, full_flow: dict[str, float]) -> tuple[_Column, ...]:
    """List the columns of a building.

    Parameters
    ----------
    layout : PlantLayout
        Its plant.
    station : str
        Name of the weather station.
    full_flow : dict of str to float
        Water flow of reheat coils whose valve is open, by coil [kg/s].
    """
    columns = [*_terminal_columns(layout, full_flow)]
    columns += [_at(f"{entity(zone)}/zone_air_temperature_sensor", _ZONE, zone) for zone in layout.others]
    for loop in layout.air_loops:
        columns += _air_columns(loop)
    for water in layout.water_loops:
        columns += _water_columns(water)
    columns += [_Column(f"{entity(name)}/electrical_power_sensor", (("Chiller Electricity Rate", name),))
                for name in layout.chillers]  # fmt: skip
    columns += [
        _Column(f"{station}/{point}", ((output, "Environment"),), _FREEZING if "temperature" in point else 0.0)
        for point, output in _SITE.items()
    ]
    return tuple(columns)


def _at(name: str, output: str, key: str) -> _Column:
    return _Column(name, ((output, key),), _FREEZING)


def _terminal_columns(layout: PlantLayout, full_flow: dict[str, float]) -> list[_Column]:
    columns: list[_Column] = []
    for t in layout.terminals:
        name = entity(t.name)
        columns += [
            _at(f"{name}/zone_air_temperature_sensor", _ZONE, t.zone),
            _at(f"{name}/{HEATING_SETPOINT}", "Zone Thermostat Heating Setpoint Temperature", t.zone),
            _at(f"{name}/{COOLING_SETPOINT}", "Zone Thermostat Cooling Setpoint Temperature", t.zone),
            _Column(f"{name}/supply_air_flowrate_sensor", ((_FLOW, t.outlet),)),
            _at(f"{name}/discharge_air_temperature_sensor", _TEMPERATURE, t.outlet),
            _Column(
                f"{name}/supply_air_damper_percentage_command", (("Zone Air Terminal VAV Damper Position", t.name),)
            ),
        ]
        if t.water_node and full_flow.get(t.coil, 0.0) > 0.0:
            share = _Column(f"{name}/heating_water_valve_percentage_command", ((_FLOW, t.water_node),))
            columns.append(share._replace(scale=1.0 / full_flow[t.coil]))
    return columns


def _air_columns(loop: AirLoop) -> list[_Column]:
    name = entity(loop.name)
    fans = tuple(("Fan Electricity Rate", fan) for _, fan in loop.of_kind("Fan:"))
    compressors = tuple(("Cooling Coil Electricity Rate", coil) for _, coil in loop.of_kind("Coil:Cooling:DX"))
    electric = tuple(("Heating Coil Electricity Rate", coil) for _, coil in loop.of_kind("Coil:Heating:Electric"))
    gas = tuple(("Heating Coil NaturalGas Rate", coil) for _, coil in loop.of_kind("Coil:Heating:Fuel"))
    columns = [
        _at(f"{name}/{SUPPLY_AIR}", _SETPOINT, loop.outlet),
        _at(f"{name}/supply_air_temperature_sensor", _TEMPERATURE, loop.outlet),
        _at(f"{name}/return_air_temperature_sensor", _TEMPERATURE, loop.inlet),
        _Column(f"{name}/supply_air_flowrate_sensor", ((_FLOW, loop.outlet),)),
    ]
    if loop.mixed:
        columns.append(_at(f"{name}/mixed_air_temperature_sensor", _TEMPERATURE, loop.mixed))
    if fans:
        columns.append(_Column(f"{name}/supply_fan_power_sensor", fans))
    if fans or compressors or electric:
        columns.append(_Column(f"{name}/electrical_power_sensor", (*fans, *compressors, *electric)))
    if gas:
        columns.append(_Column(f"{name}/gas_power_sensor", gas))
    return columns


def _water_columns(loop: WaterLoop) -> list[_Column]:
    name = entity(loop.name)
    gas = tuple(("Boiler NaturalGas Rate", boiler) for _, boiler in loop.boilers)
    pumps = tuple(("Pump Electricity Rate", pump) for _, pump in loop.pumps)
    return [
        _at(f"{name}/{SUPPLY_WATER}", _SETPOINT, loop.outlet),
        _at(f"{name}/supply_water_temperature_sensor", _TEMPERATURE, loop.outlet),
        _at(f"{name}/return_water_temperature_sensor", _TEMPERATURE, loop.inlet),
        _Column(f"{name}/gas_power_sensor", gas),
        _Column(f"{name}/pump_power_sensor", pumps),
    ]


class Reader:
    """Turns EnergyPlus' outputs into columns.

    Parameters
    ----------
    columns : tuple of _Column
        Which.
    layout : PlantLayout
        Plant of the building.

    Attributes
    ----------
    outputs : tuple of tuple of str
        Name and key of every variable that is read, once each.
    names : tuple of str
        Of the columns.
    """

    def __init__(self, columns: tuple[_Column, ...], layout: PlantLayout) -> None:
        self.outputs: tuple[Output, ...] = tuple(dict.fromkeys(o for c in columns for o in c.outputs))
        self.names = tuple(c.name for c in columns)
        place = {output: k for k, output in enumerate(self.outputs)}
        self._sum = np.zeros((len(columns), len(self.outputs)))
        for row, column in enumerate(columns):
            for output in column.outputs:
                self._sum[row, place[output]] += column.scale
        self._offset = np.array([c.offset for c in columns])
        at = {name: k for k, name in enumerate(self.names)}
        kinds = ("zone_air_temperature_sensor", "supply_air_flowrate_sensor", "discharge_air_temperature_sensor")
        terminals = [entity(t.name) for t in layout.terminals]
        self._zone, self._flow, self._warm = (np.array([at[f"{t}/{kind}"] for t in terminals]) for kind in kinds)
        zones = {zone: terminals[[t.zone for t in layout.terminals].index(zone)] for zone in layout.zones}
        self._rooms = np.array([at[f"{zones[zone]}/{kinds[0]}"] for zone in layout.zones])
        self._products = [(place[_FLOW, t.outlet], place[_TEMPERATURE, t.outlet]) for t in layout.terminals]

    @property
    def products(self) -> list[tuple[int, int]]:
        """Pairs of outputs whose product is averaged too: air flow and its temperature, for the heat that it brings."""
        return list(self._products)

    def read(self, rows: FloatArray) -> FloatArray:
        """Turn rows of outputs, products after them, into columns, shape (n_row, n_column) [library's units].

        Parameters
        ----------
        rows : ndarray, shape (n_row, n_output + n_product)
            Means over a step, in EnergyPlus' units.
        """
        outputs, products = rows[:, : len(self.outputs)], rows[:, len(self.outputs) :]
        values = outputs @ self._sum.T + self._offset
        flow = values[:, self._flow]
        flowing = flow > _LEAST_FLOW
        # the temperature of the heat: a flow that changes within the step weighs its own temperature
        warm = np.divide(products, flow, out=np.zeros_like(flow), where=flowing) + _FREEZING
        values[:, self._warm] = np.where(flowing, warm, values[:, self._zone])
        values[:, self._flow] = np.where(flowing, flow, 0.0)
        return np.asarray(values)

    def rooms(self, row: FloatArray) -> FloatArray:
        """Temperatures of the zones in a row of outputs, shape (n_zone,) [K].

        Parameters
        ----------
        row : ndarray, shape (n_output,)
            Values at an instant, in EnergyPlus' units.
        """
        return np.asarray((row @ self._sum.T + self._offset)[self._rooms])
