"""Which actuators of a plant are controlled, and which sensors tell what they do."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from calibration.estimation.state_space import REFERENCE
from mpc.errors import PlantError
from mpc.identify.telemetry import SET, PlantTelemetry
from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT, Actuator
from thermal._types import FloatArray
from thermal.case.points import DISCHARGE_TEMPERATURE, HEATING_POWER, SUPPLY_FLOW, ZONE_TEMPERATURE
from thermal.units import AIR_HEAT_CAPACITY

#: A command of a machine, or the setpoint of a zone's own controller.
Role = Literal["machine", "setpoint"]

#: Words of a point that make its actuator a helper of the machine it belongs to, which the plant runs by itself.
_HELPERS = re.compile(r"(^|_)(fan|pump|valve|damper)(_|$)")

#: Powers of a machine itself, in the order of choice where its heat is not measured.
_POWERS = ("electrical_power_sensor", "gas_power_sensor")

#: Temperature of the air that a zone is supplied with, where it is not told as that of a terminal's discharge.
_SUPPLY_TEMPERATURE = "supply_air_temperature_sensor"

#: Kelvins between the setpoints of heating and cooling of a zone that are told together, so that neither works against
#: the other: EnergyPlus stops where they cross, and thermostats of dead band control keep a kelvin or more.
_APART = 1.0

#: Share of the largest values that a full load is read from [-], robust against single steps.
FULL = 0.98


def as_heated(temperature: Any, sign: float) -> Any:
    """Give a temperature as it is where machines heat; where they cool it is mirrored about 20 degC [K].

    What is cold to a machine that heats is hot to one that cools: weather in which it is weakest, the edge of a band
    that its zone is kept from, air that wants it. Mirrored, what holds of heating holds of cooling. Mirrored twice it
    is itself again.

    Parameters
    ----------
    temperature : number or array
        [K].
    sign : float
        1 of machines that heat, -1 of machines that cool [-].

    Examples
    --------
    >>> as_heated(280.15, 1.0), round(as_heated(306.15, -1.0), 2)
    (280.15, 280.15)
    """
    return temperature if sign > 0.0 else 2.0 * REFERENCE - temperature


def pairs_as_heated(pairs: Iterable[tuple[float, float]], sign: float) -> tuple[tuple[float, float], ...]:
    """Give pairs of a temperature [K] and something else with the temperatures of `as_heated`, rising.

    Parameters
    ----------
    pairs : iterable of tuple of float
        Temperature first [K].
    sign : float
        As of `as_heated` [-].
    """
    return tuple(sorted((float(as_heated(temperature, sign)), value) for temperature, value in pairs))


@dataclass(frozen=True)
class Machine:
    """An actuator that is controlled, and its sensors.

    Parameters
    ----------
    actuator : Actuator
        What is set.
    role : str
        ``machine`` or ``setpoint``.
    serves : tuple of str
        Zones that its heat may go to.
    heat : str
        Column with its heat, negative where it cools; empty where it is not measured.
    power : str
        Column with what it buys; empty for the plant's meters.
    capacity : tuple of tuple of float
        Of a setpoint whose machine has a data sheet: outdoor air [K], rising, and the most heat there [W].
    beside : Actuator or None
        Of a setpoint of heating that of cooling of the same zone, and the other way round, where there is one.
    air : tuple of str
        Where no column has its heat: those of the flow of its supply air, of that air's temperature and of the zone's;
        empty where these are not measured either.
    supply : float or None
        Of a box on an `AirHandler`: temperature of the air that it gets, beyond which its heat counts [K].
    """

    actuator: Actuator
    role: Role
    serves: tuple[str, ...]
    heat: str = ""
    power: str = ""
    capacity: tuple[tuple[float, float], ...] = ()
    beside: Actuator | None = None
    air: tuple[str, ...] = ()
    supply: float | None = None

    @property
    def name(self) -> str:
        """Of the actuator."""
        return self.actuator.name

    @property
    def sign(self) -> float:
        """Of the heat that it gives: -1 of the setpoints of cooling, else 1 [-]."""
        return -1.0 if self.name.rpartition("/")[2] == COOLING_SETPOINT else 1.0

    def told(self, value: float, other: float) -> dict[str, float]:
        """Give what is told where a setpoint is: beside it the zone's other one, a kelvin from it at least.

        That is at its own edge of the band, or farther from the setpoint, within its range; where that range ends
        first the setpoint gives way.

        Parameters
        ----------
        value : float
            Setpoint [K].
        other : float
            The other edge of the band, the upper one of heating [K].

        Examples
        --------
        >>> heating, cooling = (Actuator(f"room/zone_air_{k}_temperature_setpoint", "K", 285.0, 305.0)
        ...                     for k in ("heating", "cooling"))
        >>> [*Machine(cooling, "setpoint", ("room",), beside=heating).told(293.5, 293.15).values()]
        [293.5, 292.5]
        """
        beside = {}
        if self.beside is not None:
            farther, nearer = (max, min) if self.sign > 0.0 else (min, max)
            apart = farther(other, value + self.sign * _APART)
            apart = float(np.clip(apart, self.beside.lowest, self.beside.highest))
            beside, value = {self.beside.name: apart}, nearer(value, apart - self.sign * _APART)
        return {self.name: float(np.clip(value, self.actuator.lowest, self.actuator.highest))} | beside

    def farthest(self, near: float, far: float, measurements: Mapping[str, float]) -> float:
        """Give the temperature that a setpoint is never told beyond, as `as_heated` [K].

        It is the other edge of the band. Where the zone's other setpoint cannot be told beside it, the plant's own is
        kept clear of, as it is measured; where that is not measured either, a setpoint of cooling stays in its own half
        of the band.

        Parameters
        ----------
        near, far : float
            Edges of the band as `as_heated`: that which the machine keeps the zone from, and the other [K].
        measurements : mapping of str to float
            Of the last step [K].
        """
        if self.beside is not None:
            return far
        point = HEATING_SETPOINT if self.sign < 0.0 else COOLING_SETPOINT
        other = f"{self.name.rpartition('/')[0]}/{point}"
        if other in measurements and np.isfinite(measurements[other]):
            return float(min(far, as_heated(measurements[other], self.sign) - _APART))
        return far if self.sign > 0.0 else 0.5 * (near + far)

    def bound(self, actuators: Mapping[str, Actuator]) -> Machine:
        """Give it the actuators of a plant, whose ranges may be narrower than where it was identified.

        Parameters
        ----------
        actuators : mapping of str to Actuator
            Of the plant, by name; its own among them.
        """
        beside = None if self.beside is None else actuators.get(self.beside.name)
        return replace(self, actuator=actuators[self.name], beside=beside)

    @property
    def meter(self) -> str:
        """Column of its heat, or of the flow of its supply air; empty where neither is measured."""
        return self.heat or (self.air[0] if self.air else "")

    def metered_heat(self, of: Callable[[str], Any]) -> Any:
        """Give the heat into its zones by what is measured, negative where it cools [W].

        That of supply air is its flow times 1006 J/kg/K times how much warmer it is than the zone, as in case folders,
        or than the air that a box gets.

        Parameters
        ----------
        of : callable
            Called with a column, gives what it measures [W], [kg/s] or [K]: numbers or arrays.
        """
        if self.heat:
            return of(self.heat)
        flow, discharge, zone = (of(column) for column in self.air)
        return AIR_HEAT_CAPACITY * flow * (discharge - (zone if self.supply is None else self.supply))

    def signal(self, telemetry: PlantTelemetry) -> FloatArray:
        """Heat that it gives, or takes where it cools, or what is bought in its place, shape (n_time,) [W].

        Parameters
        ----------
        telemetry : PlantTelemetry
            Of the plant.
        """
        if self.heat:
            return self.sign * telemetry.column(self.heat)
        if self.air:  # of the product, not of each: a gap of a temperature is no 0 K
            heat = self.metered_heat(lambda column: telemetry.frame[column].astype(float))
            return self.sign * telemetry.bridged(heat)
        if self.power:
            return telemetry.column(self.power)
        bought = telemetry.bought
        return np.asarray(bought - np.quantile(bought, 1.0 - FULL))

    def given(self, measurements: Mapping[str, float]) -> float:
        """Heat that it gave in a step, or took where it cools, or what it bought in its place [W]; NaN while unknown.

        Parameters
        ----------
        measurements : mapping of str to float
            Of the step [W].
        """

        def of(column: str) -> float:
            return measurements[column] if column in measurements else np.nan

        return float(self.sign * self.metered_heat(of) if self.meter else of(self.power))

    def level(self, telemetry: PlantTelemetry) -> FloatArray:
        """Load as a share of full load, shape (n_time,) [-]; NaN while nothing says it.

        That of a machine is its command, as it was set, else as the plant measures it under the actuator's own name.
        Where none was recorded, and of setpoints, it is the share of the heat of full load, the 98th percentile of what
        was seen, and may be more than 1.

        Parameters
        ----------
        telemetry : PlantTelemetry
            Of the plant.
        """
        low, high = self.actuator.lowest, self.actuator.highest
        told = [telemetry.frame[c] for c in (f"{SET}{self.name}", self.name) if c in telemetry.frame]
        if self.role == "machine" and any(values.notna().any() for values in told):
            command = told[0] if len(told) == 1 else told[0].fillna(told[1])
            return np.asarray((command.to_numpy(dtype=float) - low) / (high - low))
        return np.maximum(self.signal(telemetry) / self.full(telemetry), 0.0)

    def full(self, telemetry: PlantTelemetry) -> float:
        """Heat of full load [W].

        Parameters
        ----------
        telemetry : PlantTelemetry
            Of the plant.

        Raises
        ------
        PlantError
            When it never ran.
        """
        full = float(np.quantile(self.signal(telemetry), FULL))
        PlantError.unless(full > 1.0, f"telemetry: {self.name}", "heat or power at some time", f"{full:g} W")
        return full


def find_machines(
    actuators: Sequence[Actuator],
    columns: Sequence[str],
    zones: Sequence[str],
    wanted: Sequence[str] = (),
    capacities: Mapping[str, tuple[tuple[float, float], ...]] | None = None,
    *,
    cooling: bool = False,
) -> tuple[Machine, ...]:
    """Choose the actuators that are controlled: commands of machines, else setpoints of zones.

    Fans, pumps, valves and dampers are chosen last: they follow what the plant's own control does. What cannot be told
    apart by its sensors is passed over where something else can. All that is chosen heats, or all cools; the other is
    left to the plant.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant.
    columns : sequence of str
        What it measures.
    zones : sequence of str
        Names.
    wanted : sequence of str
        Names of actuators in the place of that choice.
    capacities : mapping of str to tuple, optional
        By actuator, what a data sheet says: outdoor air [K] and heat [W], see `Machine`.
    cooling : bool
        Whether the setpoints of cooling are chosen.

    Raises
    ------
    PlantError
        When there is none, a wanted one is not there, some heat and others cool, or a data sheet is of one that is no
        setpoint with measured heat.
    """
    sheets = {name: pairs for name, pairs in (capacities or {}).items() if pairs}
    by_name = {a.name: a for a in actuators}
    for name in wanted:
        PlantError.unless_known(name, by_name, "actuators", "one of the plant")
    points = {name: name.rpartition("/")[2] for name in by_name}
    setpoints = {kind: [n for n in by_name if points[n] == kind] for kind in (HEATING_SETPOINT, COOLING_SETPOINT)}
    commands = [name for name, a in by_name.items() if a.unit == "1"]
    main = [name for name in commands if not _HELPERS.search(points[name])]
    chosen, expected = [*wanted], f"a {COOLING_SETPOINT}"
    if not wanted:
        heated = [kind for kind in (main, setpoints[HEATING_SETPOINT], commands) if kind]
        told = [kind for kind in heated if len(kind) == 1 or all(any(_meters_of(name, columns)) for name in kind)]
        chosen = setpoints[COOLING_SETPOINT] if cooling else next(iter(told or heated), [])
    if not cooling:
        expected = f"a command of a machine, or a {HEATING_SETPOINT}"
    PlantError.unless(chosen, "actuators", expected, ", ".join(by_name) or "none")
    cools = [name for name in chosen if name in setpoints[COOLING_SETPOINT]]
    expected = "setpoints of cooling alone" if cooling else "machines that all heat, or all cool"
    fits = len(cools) == len(chosen) or not (cools or cooling)
    PlantError.unless(fits, "actuators", expected, ", ".join(chosen))
    heats = [c for c in columns if c.rpartition("/")[2] == HEATING_POWER]
    made = []
    for name in chosen:
        entity = name.rpartition("/")[0]
        role: Role = "setpoint" if any(name in kind for kind in setpoints.values()) else "machine"
        heat, power, air = _meters_of(name, columns)
        if not heat and len(heats) == len(chosen) == 1:
            heat, air = heats[0], ()
            power = power or _own(heat.rpartition("/")[0], _POWERS, columns)
        PlantError.unless(
            heat or air or power or len(chosen) == 1, f"actuator {name}",
            f"a sensor {entity}/{HEATING_POWER} or {_POWERS[0]}", "none",
            f"add it to `measurements`, or {SUPPLY_FLOW} and {DISCHARGE_TEMPERATURE}, or choose others by --actuators:"
            " machines have to be told apart",
        )  # fmt: skip
        PlantError.unless(
            name not in sheets or (role == "setpoint" and (heat or air)), f"actuators.{name}.capacity",
            "a setpoint whose heat is measured", "a command" if role == "machine" else "no heat",
        )  # fmt: skip
        kinds = [kind for kind in setpoints if kind != points[name]] if role == "setpoint" else []
        beside = next((by_name[f"{entity}/{kind}"] for kind in kinds if f"{entity}/{kind}" in by_name), None)
        of = (heat, power, sheets.get(name, ()), beside, air)
        made.append(Machine(by_name[name], role, _served(entity, zones), *of))
    return tuple(made)


def check_terminals(machines: Sequence[Machine], zones: Iterable[str]) -> None:
    """Refuse machines of which no data sheet of one source can say how much heat they give together.

    Heat of supply air will not do: a source of a VAV system heats what comes from outdoors, too.

    Parameters
    ----------
    machines : sequence of Machine
        That are controlled.
    zones : iterable of str
        All of the plant.

    Raises
    ------
    PlantError
        When there is only one, one is no setpoint whose heat has a meter, or a zone has none.
    """
    fitting = [m.name for m in machines if m.role == "setpoint" and m.heat]
    served = {zone for m in machines for zone in m.serves}
    PlantError.unless(
        len(fitting) == len(machines) > 1 and served >= set(zones), "source",
        "setpoints of all zones, two at least, whose heat is measured",
        ", ".join(m.name for m in machines), "say the data sheet of a single machine as `capacity` of its setpoint",
    )  # fmt: skip


def _own(entity: str, points: Sequence[str], columns: Sequence[str]) -> str:
    """First column of an entity's points that is measured; empty where none is."""
    return next((f"{entity}/{point}" for point in points if f"{entity}/{point}" in columns), "")


def _meters_of(name: str, columns: Sequence[str]) -> tuple[str, str, tuple[str, ...]]:
    """Columns of an actuator's own heat and power; where a setpoint's zone has neither, those of its supply air."""
    entity, _, point = name.rpartition("/")
    heat, power = (_own(entity, points, columns) for points in ((HEATING_POWER,), _POWERS))
    if heat or power or point not in (HEATING_SETPOINT, COOLING_SETPOINT):
        return heat, power, ()
    supply = _own(entity, (DISCHARGE_TEMPERATURE, _SUPPLY_TEMPERATURE), columns)
    air = (f"{entity}/{SUPPLY_FLOW}", supply, f"{entity}/{ZONE_TEMPERATURE}")
    return heat, power, air if all(column in columns for column in air) else ()


def _served(entity: str, zones: Sequence[str]) -> tuple[str, ...]:
    """Zones of an entity: the one of its name, or whose last word it ends in as ``fan_coil_north``; else all."""
    own = [z for z in zones if z == entity] or [z for z in zones if z.split("_")[-1] == entity.split("_")[-1]]
    return (own[0],) if len(own) == 1 else tuple(zones)
