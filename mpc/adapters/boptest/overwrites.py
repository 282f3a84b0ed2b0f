"""What a client overwrites in a step: values of inputs and their activations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from mpc.adapters.boptest.signals import activation
from mpc.adapters.boptest.values import flag, number
from mpc.errors import BoptestRequestError
from mpc.loop.actuators import Actuator


class _Overwrites(NamedTuple):
    """Inputs that a step overwrites.

    Parameters
    ----------
    given : dict of str to float
        Setpoints by actuator, within their ranges [unit of the actuator].
    active : tuple of str
        Names of the inputs.
    warnings : str
        What was clipped, in BOPTEST's words; empty when nothing was.
    """

    given: dict[str, float]
    active: tuple[str, ...]
    warnings: str


def read_overwrites(body: Mapping[str, Any], inputs: Mapping[str, Actuator]) -> _Overwrites:
    """Read the arguments of an advance; values out of range are clipped, as BOPTEST does.

    Parameters
    ----------
    body : mapping
        Values and activations by name.
    inputs : mapping of str to Actuator
        By the name of the signal.

    Raises
    ------
    BoptestRequestError
        When a name is unknown, a value is no number, or an active input has none.
    """
    values = {name: value for name, value in body.items() if name in inputs}
    switches = {activation(name): name for name in inputs}
    for name in body:
        if name not in values and name not in switches:
            raise BoptestRequestError(f"Unexpected input variable: {name[:200]}.")
    warnings: list[str] = []
    used = {n: _clipped(n, value, inputs[n], warnings) for n, value in values.items() if value is not None}
    given: dict[str, float] = {}
    active: list[str] = []
    for switch, name in switches.items():
        if body.get(switch) is not None and flag(switch, body[switch]):
            if name not in used:
                raise BoptestRequestError(f"Input {switch} is 1, but {name} has no value.")
            given[inputs[name].name] = used[name]
            active.append(name)
    return _Overwrites(given, tuple(active), ";".join(warnings))


def _clipped(name: str, value: Any, actuator: Actuator, warnings: list[str]) -> float:
    """Move a value into the range of its input, with a warning where it was not there."""
    found = number(f"input {name}", value)
    for side, limit, beyond in (
        ("above maximum", actuator.highest, found > actuator.highest),
        ("below minimum", actuator.lowest, found < actuator.lowest),
    ):
        if beyond:
            warnings.append(f"WARNING: value of {found} for {name} is {side} of {limit}.  Using {limit}. ")
            return limit
    return found
