"""Connections between components: which port draws from which, checked when a system is built."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from thermal.components.component import Component, Port
from thermal.errors import ModelError, describe, nearest


class Connection(NamedTuple):
    """A port that draws, and what supplies it.

    Parameters
    ----------
    consumer, port : str
        Name of the component that draws, and of its port.
    suppliers : tuple of str
        Names of the components that supply; one, or for a port of shape ``each`` those that its elements point to.
    """

    consumer: str
    port: str
    suppliers: tuple[str, ...]


#: Components and ports at the other end, by component and port.
Partners = dict[tuple[str, str], list[tuple[str, str]]]


def find_port(components: Mapping[str, Component], name: str, port: str) -> Port:
    """Find a port of a component that is to be connected.

    Parameters
    ----------
    components : mapping of str to Component
        By name.
    name, port : str
        Of the component, and of its port.
    """
    ports = {p.name: p for p in components[name].connectors}
    if port not in ports:
        raise ModelError(describe(f"{name}: port", "one of its ports", repr(port), nearest(port, ports)))
    return ports[port]


def find_suppliers(components: Mapping[str, Component], quantity: str) -> dict[str, str]:
    """Find what supplies a quantity: components, each with its port.

    Parameters
    ----------
    components : mapping of str to Component
        By name.
    quantity : str
        ``air`` or ``water``.
    """
    every = ((name, port) for name, component in components.items() for port in component.connectors)
    return {name: port.name for name, port in every if port.supplies and port.quantity == quantity}


def find_partners(components: Mapping[str, Component], connections: Iterable[Connection]) -> Partners:
    """Find what each port is connected to.

    Parameters
    ----------
    components : mapping of str to Component
        By name.
    connections : iterable of Connection
        Of all ports that draw.

    Raises
    ------
    ModelError
        When a connection does not fit its components, a port has none, or one that takes one supplier has several.
    """
    found: Partners = {}
    for consumer, port, suppliers in connections:
        for name in (consumer, *suppliers):
            if name not in components:
                raise ModelError(
                    describe("HvacSystem: connection", "a component", repr(name), nearest(name, components))
                )
        quantity = find_port(components, consumer, port).quantity
        supplying = find_suppliers(components, quantity)
        for name in suppliers:
            if name not in supplying:
                raise ModelError(describe(f"{name}: port", f"one that supplies {quantity}", "none"))
            found.setdefault((consumer, port), []).append((name, supplying[name]))
            found.setdefault((name, supplying[name]), []).append((consumer, port))
    for name, component in components.items():
        for p in component.connectors:
            count, single = len(found.get((name, p.name), ())), p.shape == "one" and not p.supplies
            if count == 0 or (single and count > 1):
                expected = f"{'one connection' if single else 'a connection'} for its {p.quantity}"
                advice = f"with_component(..., {'feeds=' if p.supplies else p.name + '='}...) connects it"
                raise ModelError(describe(f"{name}: port {p.name!r}", expected, str(count or "none"), advice))
    return found


def by_kind(keys: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Group actuators or states, ``ENTITY/kind``, by kind.

    Parameters
    ----------
    keys : iterable of str
        Actuators or states.
    """
    found: dict[str, tuple[str, ...]] = {}
    for key in keys:
        kind = key.rpartition("/")[2]
        found[kind] = (*found.get(kind, ()), key)
    return found


def spread(where: str, keys: Iterable[str], values: Mapping[str, Any]) -> dict[str, Any]:
    """Spread values by kind over all that are of the kind.

    Parameters
    ----------
    where : str
        What the values are of, for messages.
    keys : iterable of str
        Actuators or states, ``ENTITY/kind``.
    values : mapping of str to Value
        By kind, one value for all or one each, or by ``ENTITY/kind`` [unit of the kind].

    Raises
    ------
    ModelError
        When there is no such kind, or there are not as many values.
    """
    found, kinds = dict[str, Any](), by_kind(keys)
    kinds |= {key: (key,) for mine in tuple(kinds.values()) for key in mine}
    for kind, value in values.items():
        if kind not in kinds:
            raise ModelError(describe(where, "one that a component has", repr(kind), nearest(kind, kinds)))
        mine, plain = kinds[kind], value.tolist() if isinstance(value, np.ndarray) else value
        each = list(plain) if isinstance(plain, tuple | list) else [plain] * len(mine)
        if len(each) != len(mine):
            raise ModelError(describe(kind, f"one value or {len(mine)}, one a component", f"{len(each)} values"))
        found |= zip(mine, each, strict=True)
    return found
