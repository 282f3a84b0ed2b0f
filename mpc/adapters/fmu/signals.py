"""Which variables of a functional mock-up unit are which points of a plant of ours."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mpc.errors import PlantError
from mpc.loop.actuators import Actuator
from mpc.loop.conversion import SIGNAL_UNITS, Conversion, conversion
from thermal.case.points import POINT_TYPES, split_column
from thermal.errors import CaseError, describe, nearest


@dataclass(frozen=True)
class FmuSignals:
    """Variables of a functional mock-up unit under the names of the case format.

    Parameters
    ----------
    measurements : mapping of str to str
        Variable of each column ``ENTITY/POINT``; its declared unit is converted.
    actuators : mapping of str to str
        Input of each actuator ``ENTITY/POINT``; its declared limits become the actuator's range.
    zones : mapping of str to str
        Variable with the air temperature of each zone [its declared unit].
    electricity, gas, district_heating : tuple of str
        Variables whose sum is the power that is bought [W].
    limits : mapping of str to tuple of float
        Ranges of actuators in the place of those declared [library's unit].

    Raises
    ------
    PlantError
        When there is no zone, a column is of no known point, or a limit is of no actuator.

    Examples
    --------
    >>> signals = FmuSignals({"room/zone_air_temperature_sensor": "T"}, {"room/heating_power": "Q"}, {"room": "T"})
    >>> signals.zones["room"]
    'T'
    """

    measurements: Mapping[str, str]
    actuators: Mapping[str, str]
    zones: Mapping[str, str]
    electricity: tuple[str, ...] = ()
    gas: tuple[str, ...] = ()
    district_heating: tuple[str, ...] = ()
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.zones:
            raise PlantError(describe("signals", "a variable for the temperature of a zone at least", "none"))
        for column in self.measurements:
            try:
                split_column(column, "signals")
            except CaseError as error:
                raise PlantError(str(error)) from error
        for name, pair in self.limits.items():
            if name not in self.actuators or not -math.inf < pair[0] < pair[1] < math.inf:
                advice = nearest(name, self.actuators)
                raise PlantError(
                    describe(f"limits: {name}", "a lower and a higher number of an actuator", repr(pair), advice)
                )

    @property
    def powers(self) -> Mapping[str, tuple[str, ...]]:
        """Variables of each kind of energy."""
        kinds = {"electricity": self.electricity, "gas": self.gas, "district_heating": self.district_heating}
        return {kind: names for kind, names in kinds.items() if names}


def actuator_of(name: str, variable: Any, limits: tuple[float, float] | None) -> tuple[Actuator, Conversion]:
    """Make an actuator of an input, in the library's unit.

    Parameters
    ----------
    name : str
        ``ENTITY/POINT``.
    variable : fmpy.model_description.ScalarVariable
        The input.
    limits : tuple of float or None
        In the place of those declared [library's unit].

    Returns
    -------
    tuple
        The actuator, and what brings its values out to the input.
    """
    point = name.rpartition("/")[2]
    line = conversion(point, variable.name, variable.unit)
    unit = SIGNAL_UNITS[POINT_TYPES[point].quantity] if point in POINT_TYPES else str(variable.unit or "1")
    if limits is None:
        low, high = (None if text is None else line.into(float(text)) for text in (variable.min, variable.max))
        most = sys.float_info.max
        limits = (-most if low is None else low, most if high is None else high)
    return Actuator(name, unit, *limits, required=False), line
