"""What a controller may set, and the check of what it sets."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from mpc.errors import ControlError, PlantActionError
from thermal.components.registry import setpoints
from thermal.errors import describe
from thermal.system.system import HvacSystem

SUPPLY_AIR = "supply_air_temperature_setpoint"
SUPPLY_WATER = "supply_water_temperature_setpoint"
STATIC_PRESSURE = "supply_air_static_pressure_setpoint"
DIFFERENTIAL_PRESSURE = "differential_pressure_setpoint"
HEATING_SETPOINT = "zone_air_heating_temperature_setpoint"
COOLING_SETPOINT = "zone_air_cooling_temperature_setpoint"

#: Which values of its range an actuator accepts.
ActuatorKind = Literal["continuous", "on_off", "modulating"]

#: Lowest and highest value of each kind of action [K] or [Pa] where no component declares them, as in foreign plants.
ACTION_LIMITS: Mapping[str, tuple[float, float]] = {name: a.usual for name, a in setpoints().items() if a.usual}


@dataclass(frozen=True)
class Actuator:
    """A setpoint that a controller may set.

    Parameters
    ----------
    name : str
        ``ENTITY/POINT``, as a column of telemetry.
    unit : str
        ``K`` or ``Pa``.
    lowest, highest : float
        Range that is accepted [unit]; what lies outside is refused, never clipped.
    required : bool
        Whether every action must have it; what is left out otherwise stays as the building has it.
    kind : {"continuous", "on_off", "modulating"}
        Which values of the range are accepted: all of them; its two ends only; or off, the lower end, and all from
        `minimum` on.
    minimum : float, optional
        Smallest value of a modulating actuator that is not off [unit].

    Raises
    ------
    PlantActionError
        When the kind is not known, or a modulating actuator has no minimum within its range.

    Examples
    --------
    >>> compressor = Actuator("heat_pump/speed", "1", 0.0, 1.0, kind="modulating", minimum=0.3)
    >>> [compressor.accepts(value) for value in (0.0, 0.1, 0.3, 1.0)]
    [True, False, True, True]
    """

    name: str
    unit: str
    lowest: float
    highest: float
    required: bool = True
    kind: ActuatorKind = "continuous"
    minimum: float | None = None

    def __post_init__(self) -> None:
        kinds = get_args(ActuatorKind)
        PlantActionError.unless_known(self.kind, kinds, f"actuator {self.name}: kind", f"one of {', '.join(kinds)}")
        least = self.lowest if self.minimum is None else self.minimum
        fits = (self.kind == "modulating") == (self.minimum is not None) and self.lowest <= least <= self.highest
        expected = f"a number within {self.lowest:g} to {self.highest:g} of a modulating actuator, none of others"
        PlantActionError.unless(fits, f"actuator {self.name}: minimum", expected, repr(self.minimum))

    @property
    def expected(self) -> str:
        """What is accepted, in words."""
        low, high, unit = f"{self.lowest:g}", f"{self.highest:g}", "" if self.unit == "1" else f" {self.unit}"
        if self.kind == "on_off":
            return f"{low} (off) or {high} (on){unit}"
        if self.minimum is not None:
            return f"{low} (off) or a number from {self.minimum:g} to {high}{unit}"
        return f"a number from {low} to {high}{unit}"

    def accepts(self, value: float) -> bool:
        """Tell whether a value may be set.

        Parameters
        ----------
        value : float
            [unit of the actuator]; NaN never.
        """
        if self.kind == "on_off":
            return value in (self.lowest, self.highest)
        least = self.lowest if self.minimum is None else self.minimum
        return least <= value <= self.highest or value == self.lowest


def actuators_of(
    system: HvacSystem, zones: Sequence[str], limits: Mapping[str, tuple[float, float]] | None = None
) -> tuple[Actuator, ...]:
    """List the setpoints of a plant, first those that every action must have.

    Parameters
    ----------
    system : HvacSystem
        Its components, with the names of the devices; each declares its setpoints with their ranges.
    zones : sequence of str
        Names of the zones.
    limits : mapping of str to tuple of float, optional
        In the place of the declared ranges, by kind of action [K] or [Pa].

    Raises
    ------
    PlantActionError
        When a limit is for no kind of action, or the lower is not below the upper.
    """
    declared = [(system.actuators[key][1], key) for keys in system.by_point.values() for key in keys]
    declared += [(a, f"{zone}/{a.point}") for a in system.thermostat.actuators for zone in zones]
    known = [(a, key, a.usual) for a, key in declared if a.usual is not None]
    for kind, pair in (limits or {}).items():
        PlantActionError.unless_known(kind, {a.point for a, _, _ in known}, "limits", "a kind of action")
        finite = -math.inf < pair[0] < pair[1] < math.inf
        PlantActionError.unless(finite, f"limits: {kind}", "a lower and a higher number", repr(pair))
    found = [
        Actuator(key, a.unit, *(limits or {}).get(a.point, usual), required=a.default is None)
        for a, key, usual in known
    ]
    return tuple(sorted(found, key=lambda actuator: not actuator.required))


def need_actuator(who: str, wanted: Iterable[str], actuators: Iterable[Actuator], *, every: bool = False) -> None:
    """Refuse a controller whose actuators a plant does not have: it would run and set nothing.

    Parameters
    ----------
    who : str
        Which controller, for the message.
    wanted : iterable of str
        What it sets, by ``ENTITY/POINT`` or by point for any entity.
    actuators : iterable of Actuator
        Of the plant.
    every : bool
        Whether it needs all of them, rather than one at least.

    Raises
    ------
    ControlError
        With the names of what is missed, and of what the plant has.
    """
    there = [actuator.name for actuator in actuators]
    known = {*there, *(name.rpartition("/")[2] for name in there)}
    named = [*wanted]
    missed = [name for name in named if name not in known]
    if missed and (every or len(missed) == len(named)):
        listed = f"{', '.join(there[:8]) or 'none'}{' ...' if len(there) > 8 else ''}"
        expected = f"{(' and ' if every else ' or ').join(missed)} among the plant's actuators"
        advice = "map them to the plant's inputs, or take a controller that sets what there is"
        raise ControlError(who, expected, listed, advice)


def checked_actions(actions: Mapping[str, float], actuators: Mapping[str, Actuator]) -> dict[str, float]:
    """Check an action by name.

    Parameters
    ----------
    actions : mapping of str to float
        Setpoints by ``ENTITY/POINT`` [K] or [Pa].
    actuators : mapping of str to Actuator
        By name.

    Returns
    -------
    dict of str to float
        The same, as Python's floats.

    Raises
    ------
    PlantActionError
        When a setpoint is missing, unknown, no finite number, outside its range or between its steps.
    """
    given: dict[str, float] = {}
    for name, value in actions.items():
        actuator = actuators.get(name)
        if actuator is None:
            PlantActionError.unless_known(name, actuators, "action", "an actuator of the plant")
            continue
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not actuator.accepts(number):
            raise PlantActionError(describe(f"action {name}", actuator.expected, repr(value)))
        given[name] = number
    for name, actuator in actuators.items():
        if not actuator.required:
            break  # those that are required come first
        if name not in given:
            advice = "give every required setpoint"
            raise PlantActionError(describe(f"action {name}", actuator.expected, "nothing", advice))
    return given
