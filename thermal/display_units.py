"""Display units: the inch-pound unit that each SI unit of a page is read in, and the line that leads there."""

from functools import cache
from typing import Any, NamedTuple

#: Unit as reports spell it; the same as pint knows it; the unit that it is read in, for pint and as it is spelled.
#: Electricity and gas stay in kW and kWh, as on American bills; what is given per area is so per square foot.
_UNITS = (
    ("K h", "delta_degC * hour", "delta_degF * hour", "°F h"),
    ("K", "delta_degC", "delta_degF", "°F"),
    ("degrees C", "delta_degC", "delta_degF", "degrees F"),  # a difference, for who knows no kelvin
    ("mK", "delta_degC", "delta_degF", "m°F"),
    ("°C", "degC", "degF", "°F"),
    ("degC", "degC", "degF", "°F"),
    ("W", "watt", "Btu / hour", "Btu/h"),
    ("W/K", "watt / delta_degC", "Btu / hour / delta_degF", "Btu/h/°F"),
    ("W/m²", "watt / meter ** 2", "watt / foot ** 2", "W/ft²"),
    ("kWh/m²", "kWh / meter ** 2", "kWh / foot ** 2", "kWh/ft²"),
    ("g/m²", "gram / meter ** 2", "gram / foot ** 2", "g/ft²"),
    ("m", "meter", "foot", "ft"),
    ("m²", "meter ** 2", "foot ** 2", "ft²"),
    ("m³", "meter ** 3", "foot ** 3", "ft³"),
    ("m/s", "meter / second", "mile / hour", "mph"),
    ("m³/s", "meter ** 3 / second", "foot ** 3 / minute", "cfm"),
    ("kg/s", "kilogram / second", "pound / minute", "lb/min"),
    ("kg/s/m²", "kilogram / second / meter ** 2", "pound / minute / foot ** 2", "lb/min/ft²"),
    ("kg/m³", "kilogram / meter ** 3", "pound / foot ** 3", "lb/ft³"),
    ("Pa", "pascal", "inch_H2O_60F", "inH₂O"),
    ("W/m/K", "watt / meter / delta_degC", "Btu / hour / foot / delta_degF", "Btu/h/ft/°F"),
    ("W/m²/K", "watt / meter ** 2 / delta_degC", "Btu / hour / foot ** 2 / delta_degF", "Btu/h/ft²/°F"),
    ("J/kg/K", "joule / kilogram / delta_degC", "Btu / pound / delta_degF", "Btu/lb/°F"),
    ("J/m²/K", "joule / meter ** 2 / delta_degC", "Btu / foot ** 2 / delta_degF", "Btu/ft²/°F"),
    ("W*s/m³/K", "joule / meter ** 3 / delta_degC", "Btu / foot ** 3 / delta_degF", "Btu/ft³/°F"),
    ("W·s/m³/K", "joule / meter ** 3 / delta_degC", "Btu / foot ** 3 / delta_degF", "Btu/ft³/°F"),
    ("1/h/K^0.5", "delta_degC ** -0.5", "delta_degF ** -0.5", "1/h/°F^0.5"),
    ("s/m/h", "second / meter", "hour / mile", "1/h/mph"),
)

#: Units that are read in others, as reports spell them.
CONVERTED = tuple(name for name, *_ in _UNITS)


class Line(NamedTuple):
    """Conversion along a straight line, and the unit that it leads to.

    Parameters
    ----------
    scale, offset : float
        Of ``scale x + offset``.
    unit : str
        As it is spelled.
    """

    scale: float
    offset: float
    unit: str

    def __call__(self, value: float) -> float:
        """Convert a value, or an array of them.

        Parameters
        ----------
        value : float
            In the first unit.
        """
        return self.scale * value + self.offset


@cache
def inch_pound(unit: str) -> Line | None:
    """Find the inch-pound unit that a unit is read in, and how values are converted.

    Parameters
    ----------
    unit : str
        As reports spell it, such as ``K`` for a difference and ``°C`` for a temperature.

    Returns
    -------
    callable or None
        From values to values, with ``unit``; None where the unit stays, such as ``%`` and ``kWh``.

    Examples
    --------
    >>> inch_pound("°C")(20.0), inch_pound("K").unit, inch_pound("kWh") is None
    (68.0, '°F', True)
    """
    found = next((u for u in _UNITS if u[0] == unit), None)
    if found is None:
        return None
    registry = _registry()
    _, own, other, spelled = found
    zero, one = (float(registry.Quantity(x, own).to(other).magnitude) for x in (0.0, 1.0))
    return Line(round(one - zero, 12), round(zero, 9), spelled)


def inch_pound_lines() -> dict[str, Line]:
    """All units that are read in others, by their SI spelling.

    Returns
    -------
    dict of str to Line
        For pages that convert on the reader's side.
    """
    return {name: line for name in CONVERTED if (line := inch_pound(name)) is not None}


@cache
def _registry() -> Any:
    from pint import UnitRegistry  # here: its table takes 0.3 s to read

    registry: Any = UnitRegistry()
    registry.define("inch_H2O_60F = 248.84 * pascal")  # ASHRAE Fundamentals 2017, ch. 39, table 2
    return registry
