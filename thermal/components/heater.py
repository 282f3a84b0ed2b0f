"""Heaters of air that burn gas or take electricity."""

from dataclasses import dataclass
from typing import Annotated

from thermal.components.component import Component, Port, Range
from thermal.components.operations import Operations, Value


@dataclass(frozen=True)
class Heater(Component):
    """A coil that heats air by itself: a gas burner or electric resistance.

    Parameters
    ----------
    capacity : float
        Largest heat into the air [W], positive.
    efficiency : float
        Heat over fuel or electric power [-], 0.5 to 1. The default is the Medium Office's gas coil.
    electric : bool
        True for electric resistance.
    """

    ports = (Port("air", "air", "kg/s"), Port("power", "fuel", "W"))

    capacity: Annotated[float, Range("W", 1e-3, 1e8)]
    efficiency: Annotated[float, Range("-", 0.5, 1.0)] = 0.8
    electric: bool = False

    def heat(self, ops: Operations, wanted: Value) -> Value:
        """Heat into the air [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        wanted : Value
            Heat that is wanted [W].
        """
        return ops.minimum(wanted, self.capacity, 0.1 * self.capacity)

    def power(self, heat: Value) -> tuple[Value, Value]:
        """Electric and fuel power [W].

        Parameters
        ----------
        heat : Value
            Heat into the air [W].
        """
        taken = heat / self.efficiency
        return (taken, 0.0) if self.electric else (0.0, taken)
