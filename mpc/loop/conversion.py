"""Units of signals that others name, to and from those of the library."""

import re
from typing import NamedTuple

import numpy as np

from mpc.errors import PlantError
from thermal.case.points import POINT_TYPES
from thermal.errors import CaseError
from thermal.units import QUANTITIES, to_si

#: How signals spell the library's unit of each quantity.
SIGNAL_UNITS = {
    "temperature": "K",
    "air_flow": "kg/s",
    "power": "W",
    "share": "1",
    "concentration": "1",
    "count": "1",
    "speed": "m/s",
    "angle": "deg",
    "pressure": "Pa",
    "irradiance": "W/m2",
}


class Conversion(NamedTuple):
    """A straight line from a signal's unit to the library's.

    Parameters
    ----------
    offset : float
        What 0 of the signal is [library's unit].
    slope : float
        What a unit of the signal is [library's unit per signal's].
    """

    offset: float = 0.0
    slope: float = 1.0

    def into(self, value: float) -> float:
        """Bring a value of the signal into the library's unit.

        Parameters
        ----------
        value : float
            Of the signal [its unit].
        """
        return float(value) if self == (0.0, 1.0) else self.offset + self.slope * float(value)

    def out(self, value: float) -> float:
        """Bring a value of the library into the signal's unit.

        Parameters
        ----------
        value : float
            Of the library [its unit].
        """
        return float(value) if self == (0.0, 1.0) else (float(value) - self.offset) / self.slope


def conversion(point: str, signal: str, unit: str | None) -> Conversion:
    """Find what brings the values of a signal into the library's unit.

    Parameters
    ----------
    point : str
        Of the case format; what is none is left as it is.
    signal : str
        Its name, for the message.
    unit : str or None
        As whoever made it states it; None or empty is taken for the library's.

    Raises
    ------
    PlantError
        When it is a unit of something else.

    Examples
    --------
    >>> conversion("zone_air_temperature_sensor", "TZon", "degC").into(20.0)
    293.15
    """
    if point not in POINT_TYPES or not unit:
        return Conversion()
    quantity = POINT_TYPES[point].quantity
    if unit in (SIGNAL_UNITS[quantity], QUANTITIES[quantity].unit):
        return Conversion()
    text = re.sub(r"(?<=[a-z])([23])\b", r"^\1", unit)  # W/m2 is W/m^2
    try:
        zero, one = (float(v) for v in to_si(np.array([0.0, 1.0]), text, quantity, where=signal))
    except CaseError as error:
        raise PlantError(f"signal {signal}: {error}") from error
    return Conversion(zero, one - zero)
