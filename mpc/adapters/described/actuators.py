"""Actuators as a description alone gives them: of a real building, which no program declares."""

from __future__ import annotations

from collections.abc import Mapping

from mpc.adapters.described.schema import PlantFile
from mpc.errors import PlantError
from mpc.loop.actuators import Actuator
from mpc.loop.conversion import SIGNAL_UNITS
from thermal.case.points import POINT_TYPES


def described_actuators(
    file: PlantFile, ranges: Mapping[str, tuple[float, float]] | None = None
) -> tuple[Actuator, ...]:
    """List the actuators of a description.

    Parameters
    ----------
    file : PlantFile
        As read.
    ranges : mapping of str to tuple of float, optional
        Lowest and highest value by actuator, before those of the description [library's unit].

    Raises
    ------
    PlantError
        When neither gives an actuator's range.
    """
    found = []
    for name, entry in file.actuators.items():
        ends = (ranges or {}).get(name, entry.range)
        if ends is None:
            raise PlantError(f"actuators.{name}.range", "a lowest and a highest value of a real building's", "none")
        kind = POINT_TYPES.get(name.rpartition("/")[2])
        unit = "1" if kind is None else SIGNAL_UNITS[kind.quantity]
        found.append(Actuator(name, unit, *ends, False, entry.kind or "continuous", entry.minimum))
    return tuple(found)
