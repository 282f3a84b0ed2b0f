"""Units at the edge: any unit that pint knows comes in, SI and kelvin go on.

A quantity is what a point measures (temperature, mass flow, ...). Inside the library each has one unit, the SI one;
shares (``%``, ``ppm``) are plain fractions. The one exception is the angle, which is in degrees throughout the
library, as azimuths are in building science.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import CaseError


@dataclass(frozen=True)
class _Quantity:
    """What a point measures, and in which unit.

    Parameters
    ----------
    name
        In words, for messages.
    unit
        Unit inside the library, as pint writes it.
    file_unit
        Unit in files that the library writes, as in the table of the case format.
    examples
        Units that a case may use.
    """

    name: str
    unit: str
    file_unit: str
    examples: str


QUANTITIES: dict[str, _Quantity] = {
    "temperature": _Quantity("a temperature", "kelvin", "degC", "degC, K, degF"),
    "air_flow": _Quantity("a mass flow or a volume flow", "kilogram / second", "kg/s", "kg/s, m^3/h, L/s, cfm"),
    "power": _Quantity("a power", "watt", "W", "W, kW, BTU/h"),
    "share": _Quantity("a share", "dimensionless", "%", "%, ppm, 1"),
    "concentration": _Quantity("a share", "dimensionless", "ppm", "ppm, %, 1"),
    "count": _Quantity("a number of people", "dimensionless", "-", "-, 1, count"),
    "speed": _Quantity("a speed", "meter / second", "m/s", "m/s, km/h, mph"),
    "angle": _Quantity("an angle", "degree", "deg", "deg, rad"),
    "pressure": _Quantity("a pressure", "pascal", "Pa", "Pa, kPa, inH2O, psi"),
    "irradiance": _Quantity("a power per area", "watt / meter ** 2", "W/m^2", "W/m^2, kW/m^2"),
}

STANDARD_PRESSURE = 101_325.0  # Pa, at sea level (ISO 2533)
DRY_AIR_GAS_CONSTANT = 287.042  # J/kg/K (ASHRAE Fundamentals 2017, ch. 1)
#: Temperature from which states, boundaries and signals that stand for a temperature are counted [K].
REFERENCE_TEMPERATURE = 293.15

AIR_HEAT_CAPACITY = 1006.0  # J/kg/K, dry air at room temperature; the value of the metered heat (case format)
METERING_TEMPERATURE = 293.15  # K: volumetric meters and balancing reports state flows of air at 20 degC


def air_density(elevation: float) -> float:
    """Density of dry air at 20 degC and the standard pressure of a site.

    Parameters
    ----------
    elevation
        Height of the site above the sea [m], -500 to 11000.

    Returns
    -------
    float
        Density [kg/m3].

    Notes
    -----
    Pressure after ASHRAE Fundamentals 2017, ch. 1, eq. 3, ``p = 101325 (1 - 2.25577e-5 z)^5.2559``; ideal gas.
    Moisture is left out: at 20 degC and 50 % it lowers the density by 0.4 %.

    Examples
    --------
    >>> round(air_density(0.0), 3)
    1.204
    """
    pressure = STANDARD_PRESSURE * (1.0 - 2.25577e-5 * elevation) ** 5.2559
    return float(pressure / (DRY_AIR_GAS_CONSTANT * METERING_TEMPERATURE))


def to_si(values: ArrayLike, unit: str, quantity: str, *, elevation: float = 0.0, where: str = "unit") -> NDArray[Any]:
    """Convert values from a unit of a file to the library's unit.

    Parameters
    ----------
    values
        Numbers of any shape [unit]; NaN stays NaN.
    unit
        Any unit that pint knows, and ``-`` for a number of things.
    quantity
        Key of `QUANTITIES`.
    elevation
        Height of the site above the sea [m], for volume flows; default sea level.
    where
        Where the unit stands, for the message.

    Returns
    -------
    ndarray
        The same shape, float64 [`QUANTITIES[quantity].unit`].

    Raises
    ------
    CaseError
        Pint does not know the unit.
    CaseError
        It is a unit of something else.

    Examples
    --------
    >>> to_si([20.0], "degC", "temperature").tolist()
    [293.15]
    """
    scale, offset = _line(unit, quantity, elevation, where)
    return np.asarray(values, dtype=float) * scale + offset


def from_si(values: ArrayLike, unit: str, quantity: str, *, elevation: float = 0.0) -> NDArray[Any]:
    """Convert values from the library's unit to another one: the inverse of `to_si`.

    Parameters
    ----------
    values
        Numbers of any shape [`QUANTITIES[quantity].unit`]; NaN stays NaN.
    unit
        Any unit that pint knows, and ``-`` for a number of things.
    quantity
        Key of `QUANTITIES`.
    elevation
        Height of the site above the sea [m], for volume flows; default sea level.

    Returns
    -------
    ndarray
        The same shape, float64 [unit].

    Examples
    --------
    >>> from_si([293.15], "degC", "temperature").tolist()
    [20.0]
    """
    scale, offset = _line(unit, quantity, elevation, "unit")
    return (np.asarray(values, dtype=float) - offset) / scale


def check_unit(unit: str, quantity: str, where: str) -> None:
    """Refuse a unit that does not measure a quantity.

    Parameters
    ----------
    unit
        Any unit that pint knows, and ``-`` for a number of things.
    quantity
        Key of `QUANTITIES`.
    where
        Where the unit stands, for the message.

    Raises
    ------
    CaseError
        Pint does not know the unit.
    CaseError
        It is a unit of something else.
    """
    _line(unit, quantity, 0.0, where)


@cache
def _registry() -> Any:
    import pint  # here, because building its registry takes 0.3 s that not every import should pay

    registry: Any = pint.UnitRegistry()
    # Without these two lines pint reads `cfm` as centifermi, a length.
    registry.define("cubic_foot_per_minute = foot ** 3 / minute = cfm")
    registry.define("@alias cubic_foot_per_minute = CFM")
    return registry


@cache
def _line(unit: str, quantity: str, elevation: float, where: str) -> tuple[float, float]:
    """Scale and offset that take a unit to the library's: every conversion here is a straight line."""
    target, registry, text = QUANTITIES[quantity], _registry(), unit.strip()
    try:
        if not text:
            raise ValueError("blank")
        parsed = registry.parse_units("dimensionless" if text in {"-", "1"} else text)
    except Exception as error:  # pint lets its parser's AssertionError, TypeError, ValueError and others through
        expected = f"a unit that pint knows, of {target.name}"
        raise CaseError(where, expected, repr(unit), f"use one of {target.examples}") from error
    if "delta_" in str(parsed):
        raise CaseError(where, f"{target.name} ({target.examples})", repr(unit), "this is a difference")
    if quantity == "air_flow" and parsed.dimensionality == registry.parse_units("m^3/s").dimensionality:
        return float(registry.Quantity(1.0, parsed).to("m^3/s").magnitude) * air_density(elevation), 0.0
    is_angle = "radian" in str(registry.Quantity(1.0, parsed).to_root_units().units)
    if parsed.dimensionality != registry.parse_units(target.unit).dimensionality or is_angle != (quantity == "angle"):
        hint = {"C": "write degC", "F": "write degF"}.get(unit, f"use one of {target.examples}")
        raise CaseError(where, f"a unit of {target.name}", repr(unit), hint)
    zero, one = (float(registry.Quantity(x, parsed).to(target.unit).magnitude) for x in (0.0, 1.0))
    return one - zero, zero
