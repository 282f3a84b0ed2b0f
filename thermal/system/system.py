"""A building's HVAC system: components, how their ports are connected, and what follows from both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from thermal._types import FloatArray
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Actuator, Component, Group, State
from thermal.components.operations import Operations, Value
from thermal.components.terminals import Terminals
from thermal.components.thermostat import Thermostat
from thermal.components.water_coil import WaterCoil
from thermal.errors import ModelError
from thermal.system.connections import Connection, by_kind, connectors, find_partners, spread

_Kind = TypeVar("_Kind", bound=Component)


@dataclass(frozen=True, eq=False)
class HvacSystem:
    """Components of a building's HVAC system and how they are connected.

    Parameters
    ----------
    components : mapping of str to Component
        By name.
    connections : tuple of Connection
        Of all ports that draw.
    thermostat : Thermostat
        Of every zone.
    names : mapping of str to tuple of str
        Names of the elements of groups; the group's with a number by default.

    Raises
    ------
    ModelError
        When a connection does not fit its components, or a zone has nothing that heats or cools it.
    """

    components: Mapping[str, Component]
    connections: tuple[Connection, ...]
    thermostat: Thermostat = field(default_factory=Thermostat)
    names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        find_partners(self.components, self.connections)
        zones = np.unique(np.concatenate([g.zone for g in self.groups.values()] or [np.zeros(0, dtype=np.intp)]))
        if not len(zones) or len(zones) != zones[-1] + 1:
            missing = sorted(set(range(int(zones[-1]) if len(zones) else 1)) - set(zones.tolist()))
            raise ModelError("HvacSystem", "a terminal in each zone", f"none in zones {missing[:8]}")

    def of_kind(self, kind: type[_Kind]) -> dict[str, _Kind]:
        """Components of a class, by name.

        Parameters
        ----------
        kind : type
            The class.
        """
        return {name: c for name, c in self.components.items() if isinstance(c, kind)}

    def only(self, kind: type[_Kind]) -> _Kind:
        """Give the one component of a class.

        Parameters
        ----------
        kind : type
            The class.

        Raises
        ------
        ModelError
            There is none, or several.
        """
        found = self.of_kind(kind)
        if len(found) != 1:
            known = ", ".join(f"{name} ({type(c).__name__})" for name, c in self.components.items())
            raise ModelError("HvacSystem", f"one {kind.__name__}", f"{len(found)} among {known}")
        return next(iter(found.values()))

    @cached_property
    def groups(self) -> dict[str, Group]:
        """Components that have an element in each of some zones."""
        return self.of_kind(Group)

    @cached_property
    def singles(self) -> dict[str, Component]:
        """Components that there is one of, or a few."""
        return {name: c for name, c in self.components.items() if name not in self.groups}

    @cached_property
    def air_handlers(self) -> tuple[AirHandler, ...]:
        """The air handlers."""
        return tuple(self.of_kind(AirHandler).values())

    @cached_property
    def loop(self) -> BoilerLoop:
        """The boiler loop."""
        return self.only(BoilerLoop)

    @cached_property
    def water_suppliers(self) -> tuple[str, ...]:
        """Names of the components that supply hot water."""
        ports = connectors(self.components).items()
        return tuple(name for (name, _), port in ports if port.supplies and port.quantity == "water")

    @cached_property
    def terminals(self) -> Terminals:
        """The VAV terminals; of a system without air, a group of none."""
        return self.only(Terminals) if self.of_kind(Terminals) else Terminals.sized([], [])

    @cached_property
    def zone_count(self) -> int:
        """Zones that are heated or cooled."""
        return 1 + max(int(group.zone.max()) for group in self.groups.values())

    def by_zone(self, values: Value) -> Value:
        """Sum values of the terminals, one a zone, shape (n_zone,).

        Parameters
        ----------
        values : ndarray, shape (n_terminal,)
            Values [any].
        """
        return values if self.terminals.one_each == self.zone_count else values @ self._terminals_of_zones

    @cached_property
    def _terminals_of_zones(self) -> FloatArray:
        """Terminals of each zone as 1 of 0 and 1, (n_terminal, n_zone)."""
        return np.eye(self.zone_count)[self.terminals.zone]

    @cached_property
    def rooms(self) -> dict[str, FloatArray]:
        """Elements of each zone as 1 of 0 and 1, by group, (n_element, n_zone)."""
        return {name: np.eye(self.zone_count)[group.zone] for name, group in self.groups.items()}

    @cached_property
    def static_pressures(self) -> tuple[float, ...]:
        """Design static pressures of the air handlers [Pa]."""
        return tuple(handler.design_pressure for handler in self.air_handlers)

    @cached_property
    def states(self) -> dict[str, tuple[str, State]]:
        """States by ``ENTITY/state``, each with the component that has it."""
        return {f"{name}/{s.name}": (name, s) for name, c in self.singles.items() for s in c.states}

    @cached_property
    def actuators(self) -> dict[str, tuple[str, Actuator]]:
        """Actuators by ``ENTITY/point``, each with the component that has it."""
        return {f"{name}/{a.point}": (name, a) for name, c in self.singles.items() for a in c.actuators}

    @cached_property
    def defaults(self) -> dict[str, float]:
        """Values of the actuators that need not be given, by ``ENTITY/point`` [unit of the actuator]."""
        return {
            key: float(getattr(self.components[name], a.default) if isinstance(a.default, str) else a.default)
            for key, (name, a) in self.actuators.items()
            if a.default is not None
        }

    @cached_property
    def by_point(self) -> dict[str, tuple[str, ...]]:
        """Actuators of each type, by the type of the point."""
        return by_kind(self.actuators)

    @cached_property
    def water_switches(self) -> tuple[str, ...]:
        """Actuators that switch what supplies hot water, by ``ENTITY/point``."""
        every = ((key, name) for key, (name, _) in self.actuators.items() if key.endswith("_running"))
        return tuple(key for key, name in every if name in self.water_suppliers)

    def actions(self, **values: Any) -> dict[str, Any]:
        """Spread values of points over the components that have them.

        Parameters
        ----------
        **values
            By type of the point, one value for all or one each, or by ``ENTITY/point`` [unit of the actuator].

        Returns
        -------
        dict
            By ``ENTITY/point``.

        Raises
        ------
        ModelError
            When no component has such an actuator, or there are not as many values.
        """
        return spread("actions", self.actuators, values)

    def start(self, **values: Any) -> dict[str, Any]:
        """Give states to start from, by ``ENTITY/state``.

        Parameters
        ----------
        **values
            By name of the state, one value for all that have it or one each, or by ``ENTITY/state`` [unit of the
            state]; as declared by default.
        """
        declared = {key: state.start for key, (_, state) in self.states.items()}
        return declared | spread("start", self.states, values)

    def entities(self, name: str) -> tuple[str, ...]:
        """Names under which a component, or each element of a group, is known.

        Parameters
        ----------
        name : str
            Of the component.
        """
        component = self.components[name]
        if not isinstance(component, Group):
            return (name,)
        return self.names.get(name) or tuple(f"{name}_{k}" for k in range(len(component)))

    def named(self, names: Mapping[type[Component], Sequence[str]]) -> HvacSystem:
        """Give components and elements of groups the names that a building has for them.

        Parameters
        ----------
        names : mapping of type to sequence of str
            By class, in the order of the system.

        Raises
        ------
        ModelError
            There are too many names, too few, or the same twice.
        """
        new: dict[str, str] = {}
        elements, parts = dict(self.names), list[str]()
        given = [name for each in names.values() for name in each]
        fits = len(set(given)) == len(given)
        for kind, each in names.items():
            mine = self.of_kind(kind)
            count = sum(len(self.entities(name)) for name in mine)
            parts += [f"{count} {kind.label}s"] * (count > 1)
            fits &= count == len(each)
            if issubclass(kind, Group):
                elements |= {name: tuple(each) for name in mine}
            else:
                new |= zip(mine, each, strict=False)
        if not fits:
            found = f"{', '.join(str(len(each)) for each in names.values())}, {len(set(given))} different"
            raise ModelError("names", f"{' and '.join(parts)}, all named differently", found)
        known = {name: new.get(name, name) for name in self.components}
        return replace(
            self,
            components={known[name]: c for name, c in self.components.items()},
            connections=tuple(
                Connection(known[c.consumer], c.port, tuple(known[s] for s in c.suppliers)) for c in self.connections
            ),
            names=elements,
        )

    def having(self, **components: Component) -> HvacSystem:
        """Replace components by others of the same ports.

        Parameters
        ----------
        **components : Component
            By name.

        Raises
        ------
        ModelError
            When the system has no component of such a name, or a new one lacks a port that is connected.
        """
        for name in components:
            ModelError.unless_known(name, self.components, "having", "a component (with_component adds one)")
        return replace(self, components={**self.components, **components})

    def with_component(
        self, name: str, component: Component, feeds: Sequence[str] = (), **suppliers: str | tuple[str, ...]
    ) -> HvacSystem:
        """Add a component, such as radiators or a heat pump, and connect its ports.

        Parameters
        ----------
        name : str
            A new one.
        component : Component
            The component.
        feeds : sequence of str
            Names of components that from now on draw from this one what it supplies.
        **suppliers : str or tuple of str
            Names of the components that supply it, by port.

        Raises
        ------
        ModelError
            When there is a component of this name, or a port stays without a connection.
        """
        if name in self.components:
            advice = "take another name, or replace that one with having"
            raise ModelError("with_component", "a new name", repr(name), advice)
        supplied, ports = {p.quantity for p in component.connectors if p.supplies}, connectors(self.components)
        links = {(c.consumer, c.port): c.suppliers for c in self.connections}
        for consumer in feeds:
            ModelError.unless_known(consumer, self.components, "with_component: feeds", "a component of the system")
        links |= {link: (name,) for link in links if link[0] in feeds and ports[link].quantity in supplied}
        links |= {(name, port): (s,) if isinstance(s, str) else s for port, s in suppliers.items()}
        joined = tuple(Connection(*link, feeding) for link, feeding in links.items())
        return replace(self, components={**self.components, name: component}, connections=joined)

    def at_zones(self, ops: Operations, results: Mapping[str, Any], port: str = "heat") -> Value:
        """Sum the heat that groups bring into the zones, one a zone [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        results : mapping of str to named tuple
            What components did.
        port : str
            Of the heat: all of it, or the radiant part.
        """
        total: Value = None
        for name, group in self.heating.get(port, ()):
            values = getattr(results[name], port)
            if group.one_each != self.zone_count:
                values = ops.gather(values, self.rooms[name])
            total = values if total is None else total + values
        return np.zeros(self.zone_count) if total is None else total

    @cached_property
    def heating(self) -> dict[str, list[tuple[str, Group]]]:
        """Groups that bring heat into zones, by port."""
        found: dict[str, list[tuple[str, Group]]] = {}
        for name, group in self.groups.items():
            for port in group.ports:
                if port.quantity == "heat":
                    found.setdefault(port.name, []).append((name, group))
        return found

    def powers(self, ops: Operations, results: Mapping[str, Any]) -> tuple[Value, Value]:
        """Electric and fuel power of components [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        results : mapping of str to named tuple
            What they did.
        """
        totals: dict[str, Value] = {"electricity": 0.0, "fuel": 0.0}
        for name, result in results.items():
            for kind, port in self.meters[name]:
                power, group = getattr(result, port), self.groups.get(name)
                totals[kind] = totals[kind] + (power if group is None else group.total(ops.of(name), power))
        return totals["electricity"], totals["fuel"]

    @cached_property
    def meters(self) -> dict[str, list[tuple[str, str]]]:
        """Electricity and fuel that each component takes up, with the ports, by component."""
        return {
            name: [(port.quantity, port.name) for port in component.ports if port.quantity in ("electricity", "fuel")]
            for name, component in self.components.items()
        }


def vav_system(
    air_handlers: Sequence[AirHandler], loop: Component, terminals: Terminals, thermostat: Thermostat | None = None
) -> HvacSystem:
    """Join air handlers, a hot-water loop and terminals, the usual system of an office.

    Parameters
    ----------
    air_handlers : sequence of AirHandler
        At least one; they become ``AHU_0`` and so on.
    loop : Component
        What supplies the hot water that every water coil draws; by its type of device ``BOILER``, ``HEAT_PUMP`` or so.
    terminals : Terminals
        Each supplied by one of the air handlers; the group is ``VAV``.
    thermostat : Thermostat, optional
        Of every zone.

    Raises
    ------
    ModelError
        When an air handler has no terminal, or a terminal none of the air handlers.
    """
    n, supplied = len(air_handlers), set(terminals.air_handler.tolist())
    if n == 0 or not supplied or supplied != set(range(n)):
        expected = "at least one air handler, each with a terminal of its own"
        advice = "Terminals.air_handler holds positions in air_handlers"
        raise ModelError("HvacSystem", expected, f"{n} of them and terminals at {supplied}", advice)
    handlers = {f"AHU_{k}": handler for k, handler in enumerate(air_handlers)}
    wet = [name for name, handler in handlers.items() if isinstance(handler.heating, WaterCoil)]
    connections = [Connection("VAV", "supply_air", tuple(handlers))]
    water = loop.device.upper() or "HOT_WATER"
    connections += [Connection(name, "hot_water", (water,)) for name in ("VAV", *wet)]
    return HvacSystem({"VAV": terminals, **handlers, water: loop}, tuple(connections), thermostat or Thermostat())
