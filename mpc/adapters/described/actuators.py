"""Actuators as a description alone gives them: of a real building, which no program declares."""

from __future__ import annotations

from collections.abc import Mapping

from mpc.adapters.described.schema import PlantFile
from mpc.adapters.described.values import Input
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
    return tuple(described_actuator(name, told, ranges) for name, told in file.actuators.items())


def described_actuator(
    name: str, told: Input, ranges: Mapping[str, tuple[float, float]] | None = None
) -> Actuator:
    """Give one actuator of a description.

    Parameters
    ----------
    name : str
        Of it.
    told : Input
        What the description says of it.
    ranges : mapping of str to tuple of float, optional
        As of `described_actuators` [library's unit].

    Raises
    ------
    PlantError
        When neither gives its range.
    """
    ends = (ranges or {}).get(name, told.range)
    if ends is None:
        raise PlantError(f"actuators.{name}.range", "a lowest and a highest value of a real building's", "none")
    kind = POINT_TYPES.get(name.rpartition("/")[2])
    unit = "1" if kind is None else SIGNAL_UNITS[kind.quantity]
    return Actuator(name, unit, *ends, False, told.kind or "continuous", told.minimum)
