"""What a step of a system gives."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from thermal.components.air_handler import AirHandlerStep
from thermal.components.operations import Value
from thermal.components.terminals import TerminalStep


class HvacStep(NamedTuple):
    """What a system did in a step; powers are means over it.

    Parameters
    ----------
    results : mapping of str to named tuple
        What each component did, by its name.
    state : tuple of Value
        States at the end, in the order of `HvacSystem.states` [unit of the state].
    electric_power, fuel_power : Value
        Of everything; fuel on the higher heating value [W].
    """

    results: Mapping[str, Any]
    state: tuple[Value, ...]
    electric_power: Value
    fuel_power: Value

    @property
    def air_handlers(self) -> tuple[AirHandlerStep, ...]:
        """What the air handlers did."""
        return tuple([r for r in self.results.values() if type(r) is AirHandlerStep])

    @property
    def terminals(self) -> TerminalStep:
        """What the terminals did; of a system without air, nothing."""
        for result in self.results.values():
            if type(result) is TerminalStep:
                return result
        return TerminalStep(*np.zeros((6, 0)))

    @property
    def supply_temperature(self) -> tuple[Value, ...]:
        """Supply air of the air handlers [K]."""
        return tuple([done.supply_temperature for done in self.air_handlers])
