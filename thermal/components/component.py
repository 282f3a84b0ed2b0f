"""What every component is: declared ports, parameters, states, actuators and sensors, and one function.

A component's function, `Component.run`, is written once against a set of operations and runs on floats, NumPy arrays
and CasADi expressions. It is a generator: ``message = yield "hot_water"`` waits for what comes through a port, and
``given.put("hot_water", message)`` sends something out. Who is connected to whom, in which order functions run, and
where sums over many elements are cut, is the business of `thermal.system`.
"""

from collections.abc import Callable, Generator, Mapping
from functools import cache, cached_property
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.components.checks import all_in_range, in_range
from thermal.components.energy_balance import EnergyBalance
from thermal.components.moist_air import USUAL_HUMIDITY
from thermal.components.operations import Operations, Value
from thermal.errors import ModelError

Quantity = Literal["air", "water", "chilled_water", "heat", "electricity", "fuel"]
#: A component's function while it runs: yields the port that it waits for, returns its named results. One that waits
#: for nobody may be a plain function that returns them.
Run = Generator[str, Any, Any]
IndexArray = NDArray[np.intp]


class Port(NamedTuple):
    """Where a component meets others, a zone or a meter.

    Parameters
    ----------
    name : str
        Of the port. What leaves as heat, electricity or fuel stands under this name in the component's results.
    quantity : {"air", "water", "chilled_water", "heat", "electricity", "fuel"}
        What goes through it.
    unit : str
        Unit of the flow.
    shape : {"one", "each"}
        One partner, or, of a group, one for each of its elements.
    supplies : bool
        Whether it supplies others, which draw from it; their draws are added up.
    """

    name: str
    quantity: Quantity
    unit: str
    shape: Literal["one", "each"] = "one"
    supplies: bool = False


class Range(NamedTuple):
    """Declares a parameter: ``capacity: Annotated[float, Range("W", 1e-3, 1e8)]``; its source is in the docstring.

    Parameters
    ----------
    unit : str
        Unit of the parameter.
    lowest, highest : float
        What is accepted [unit].
    """

    unit: str
    lowest: float
    highest: float


class Actuator(NamedTuple):
    """A setpoint or switch of a component.

    Parameters
    ----------
    point : str
        Type of the point, as in telemetry. What supplies hot water is switched by points that end in ``_running``,
        1 while the building is in operation.
    unit : str
        Unit of the values.
    lowest, highest : float
        What is physically possible [unit].
    usual : tuple of float, optional
        What a supervisory controller may choose from [unit]; None where schedules decide.
    default : str or float, optional
        Value [unit], or the property of the component that is taken, where none is given; None: one must be given.
    """

    point: str
    unit: str
    lowest: float
    highest: float
    usual: tuple[float, float] | None = None
    default: str | float | None = None


class State(NamedTuple):
    """What a component remembers from step to step.

    Parameters
    ----------
    name : str
        Name; its value at the end of a step stands under it in the component's results.
    unit : str
        Unit of the value.
    lowest, highest : float
        Of a value to start from [unit].
    start : float
        Value to start from where none is given [unit].
    """

    name: str
    unit: str
    lowest: float
    highest: float
    start: float


class Conditions(NamedTuple):
    """What a system meets at the start of a step.

    Parameters
    ----------
    zone_temperature : numpy.ndarray, shape (n_zone,)
        Air of the zones [K].
    zone_air_heating_temperature_setpoint, zone_air_cooling_temperature_setpoint : numpy.ndarray, shape (n_zone,)
        Of the thermostats [K].
    outdoor_temperature : float
        Air outdoors [K].
    outdoor_humidity : float
        Humidity ratio outdoors [kg/kg].
    return_humidity : float or tuple of float
        Humidity ratio of the return air [kg/kg], for all air handlers or one each.
    room_temperature : float
        Of the plant room, where pipes and boiler lose heat [K].
    """

    zone_temperature: Value
    zone_air_heating_temperature_setpoint: Value
    zone_air_cooling_temperature_setpoint: Value
    outdoor_temperature: Value
    outdoor_humidity: Value = USUAL_HUMIDITY
    return_humidity: Value = USUAL_HUMIDITY
    room_temperature: Value = 293.15


class Calls(NamedTuple):
    """Calls of the thermostats.

    Parameters
    ----------
    heating, cooling : Value
        0 to 1 [-], one a zone.
    """

    heating: Value
    cooling: Value


class Given(NamedTuple):
    """What a component's function is given beside what comes through its ports.

    Parameters
    ----------
    conditions : Conditions
        Of the step.
    calls : Calls
        Of the thermostats.
    actions : mapping of str to Value
        Values of the component's actuators, by point [unit of the actuator].
    state : mapping of str to Value
        Its states at the start of the step [unit of the state].
    seconds : Value
        Length of the step [s].
    put : callable
        Sends a message, a named tuple, out of a port.
    """

    conditions: Conditions
    calls: Calls
    actions: Mapping[str, Value]
    state: Mapping[str, Value]
    seconds: Value
    put: Callable[[str, Any], None]


class Component:
    """A device, or a part of one: a frozen dataclass whose parameters are annotated with their `Range`.

    Raises
    ------
    ModelError
        When a parameter is no number within its range.
    """

    #: What a report calls it, and its type among the devices of a case.
    label: ClassVar[str] = "component"
    device: ClassVar[str] = ""
    ports: ClassVar[tuple[Port, ...]] = ()
    states: ClassVar[tuple[State, ...]] = ()
    actuators: ClassVar[tuple[Actuator, ...]] = ()
    #: Types of the points that it is read at, in the order of `read`; those of pressures need sensors of their own.
    sensors: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, limits in _ranges(kind).items():
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, self._checked(f"{type(self).__name__}.{name}", value, limits))

    def _checked(self, where: str, value: Any, limits: Range) -> Any:
        """Refuse what is out of range; floats of NumPy, ten times slower than Python's, become such."""
        in_range(where, value, *limits)
        return float(value)

    @property
    def connectors(self) -> tuple[Port, ...]:
        """Ports of air and water: each needs something that it is connected to."""
        return tuple(port for port in self.ports if port.quantity in ("air", "water", "chilled_water"))

    @classmethod
    def sized(cls, *design: Any, **options: Any) -> Any:
        """Size the component by its design loads, for the devices of a case.

        Parameters
        ----------
        *design : Any
            Of a group: heat of each element [W], and positions of their zones. Of what supplies hot water: largest heat
            [W], and water through the open valves of all that draw from it [kg/s].
        **options
            Of a class's own.

        Raises
        ------
        ModelError
            The class cannot be sized.
        """
        expected = "a class with a classmethod `sized`"
        raise ModelError(f"component {cls.__name__}", expected, "none", "write it, or pass the system itself")

    def run(self, ops: Operations, given: Given) -> Any:
        """Give outputs of inputs: the component's equations, as a `Run`.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Conditions, calls, actions and states.
        """
        raise NotImplementedError

    def energy(self, conditions: Conditions, done: Any) -> EnergyBalance:
        """Where the energy of a step went, from flows and temperatures.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : object
            What `run` returned.
        """
        raise NotImplementedError

    def read(self, ops: Operations, given: Given, done: Any) -> list[Value]:
        """Values of its points, in the order of `sensors`.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : object
            What `run` returned.
        """
        return []


class Group(Component):
    """Many components of a kind at once, as arrays; each belongs to a zone.

    Its parameters may be arrays, one value an element. It sums over its elements with `Operations.sums` and
    `Operations.dot` only, so that whoever differentiates can cut there. It has neither states nor actuators: what
    remembers or is set is a component of its own, which the group draws from.

    Raises
    ------
    ModelError
        When a class of groups declares states or actuators.
    """

    zone: IndexArray

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if cls.states or cls.actuators:
            found = ", ".join([s.name for s in cls.states] + [a.point for a in cls.actuators])
            advice = "declare them in a Component that the group draws from"
            raise ModelError(f"group {cls.__name__}", "neither states nor actuators", found, advice)

    def __post_init__(self) -> None:
        object.__setattr__(self, "zone", self.positions("zone"))
        super().__post_init__()

    def __len__(self) -> int:
        return int(np.size(self.zone))

    def _checked(self, where: str, value: Any, limits: Range) -> Any:
        kind = get_type_hints(type(self))[where.rpartition(".")[2]]
        if kind is float:
            return super()._checked(where, value, limits)
        return all_in_range(where, value, np.size(self.zone), *limits)

    def likely_heat(self, call: float, zone: FloatArray) -> FloatArray:
        """Heat that the elements are likely to bring, for local control [W].

        Parameters
        ----------
        call : float
            For heating, 0 to 1; for cooling, -1 to 0 [-].
        zone : numpy.ndarray, shape (n_element,)
            Temperatures of their zones [K].
        """
        return np.zeros(len(self))

    def energy(self, conditions: Conditions, done: Any) -> EnergyBalance:
        """Where the energy of a step went: into the zones.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : object
            What `run` returned.
        """
        return EnergyBalance(zones=done.heat.sum(axis=-1))

    def positions(self, name: str) -> IndexArray:
        """Check a field of positions, one an element.

        Parameters
        ----------
        name : str
            Name of the field.
        """
        index = np.array(np.broadcast_to(np.asarray(getattr(self, name)), (len(np.atleast_1d(self.zone)),)))
        if not np.issubdtype(index.dtype, np.integer) or (len(index) and index.min() < 0):
            raise ModelError(f"{type(self).__name__}.{name}", "positions from 0 on", f"{index.dtype} {index}")
        return index.astype(np.intp)

    @cached_property
    def one_each(self) -> int:
        """Number of zones where the first element is in the first zone and so on, else 0."""
        return len(self) * int(np.array_equal(self.zone, np.arange(len(self))))

    def of_zones(self, ops: Operations, values: Value) -> Value:
        """Give values of the zones, one an element.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        values : Value
            One a zone [any].
        """
        return values if values.shape[0] == self.one_each else ops.pick(values, self.zone)

    @cached_property
    def _everyone(self) -> FloatArray:
        return np.ones(len(self))

    def total(self, ops: Operations, values: Value) -> Value:
        """Sum over the elements.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        values : Value
            One an element [any].
        """
        return ops.dot(values, self._everyone)


@cache
def _ranges(kind: Any) -> dict[str, Range]:
    """Find the declared parameters of a class."""
    found = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        for part in (hint, *get_args(hint)):
            if get_origin(part) is Annotated and isinstance(part.__metadata__[0], Range):
                found[name] = part.__metadata__[0]
    return found
