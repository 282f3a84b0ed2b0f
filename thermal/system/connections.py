"""Connections between components: which port draws from which, checked when a system is built."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from thermal.components.component import Component, Port
from thermal.errors import ModelError


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


def connectors(components: Mapping[str, Component]) -> dict[tuple[str, str], Port]:
    """List the ports that are to be connected, by the name of the component and their own.

    Parameters
    ----------
    components : mapping of str to Component
        By name.
    """
    return {(name, port.name): port for name, component in components.items() for port in component.connectors}


def find_partners(
    components: Mapping[str, Component], connections: Iterable[Connection]
) -> dict[tuple[str, str], list[tuple[str, str]]]:
    """Find which ports each port is connected to.

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
    ports = connectors(components)
    supplying = {(key[0], port.quantity): key for key, port in ports.items() if port.supplies}
    found: dict[tuple[str, str], list[tuple[str, str]]] = {key: [] for key in ports}
    for consumer, port, suppliers in connections:
        for name in (consumer, *suppliers):
            ModelError.unless_known(name, components, "HvacSystem: connection", "a component")
        ModelError.unless_known(port, (p for name, p in ports if name == consumer), f"{consumer}: port", "one of its")
        quantity = ports[consumer, port].quantity
        for name in suppliers:
            if (name, quantity) not in supplying:
                raise ModelError(f"{name}: port", f"one that supplies {quantity}", "none")
            found[consumer, port].append(supplying[name, quantity])
            found[supplying[name, quantity]].append((consumer, port))
    for (name, port), others in found.items():
        single = ports[name, port].shape == "one" and not ports[name, port].supplies
        if not others or (single and len(others) > 1):
            expected = f"{'one connection' if single else 'a connection'} for its {ports[name, port].quantity}"
            advice = f"with_component(..., {'feeds=' if ports[name, port].supplies else port + '='}...) connects it"
            raise ModelError(f"{name}: port {port!r}", expected, str(len(others) or "none"), advice)
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
        ModelError.unless_known(kind, kinds, where, "one that a component has")
        mine, plain = kinds[kind], value.tolist() if isinstance(value, np.ndarray) else value
        each = list(plain) if isinstance(plain, tuple | list) else [plain] * len(mine)
        if len(each) != len(mine):
            raise ModelError(kind, f"one value or {len(mine)}, one a component", f"{len(each)} values")
        found |= zip(mine, each, strict=True)
    return found
