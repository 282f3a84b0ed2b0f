"""Pages of reports: templates, and how numbers, times and durations read in them."""

from __future__ import annotations

import math
from functools import cache
from importlib.metadata import version
from typing import Any

import jinja2
import pandas as pd

_NO_NUMBER = "–"


@cache
def _environment() -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.PackageLoader("mpc.reports", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render(template: str, content: dict[str, Any]) -> str:
    """Fill a template; the page loads nothing from elsewhere.

    Parameters
    ----------
    template : str
        Name without its ending, such as ``calibration``.
    content : dict
        What it shows; every text is escaped.
    """
    return _environment().get_template(f"{template}.html.j2").render(version=version("buildingmpc"), **content)


def kelvin(value: float) -> str:
    """Spell a difference of temperatures, without its unit.

    Examples
    --------
    >>> kelvin(0.4406), kelvin(0.0532)
    ('0.44', '0.053')
    """
    if not math.isfinite(value):
        return _NO_NUMBER
    return f"{value:.3f}" if abs(value) < 0.095 else f"{value:.2f}"


def signed(value: float) -> str:
    """Spell an error with its sign, without its unit."""
    return f"{value:+.3f}".replace("-", "−") if math.isfinite(value) else _NO_NUMBER


def watts(value: float) -> str:
    """Spell a heat with two significant digits and its unit.

    Examples
    --------
    >>> watts(1234.0), watts(-87.6), watts(0.31)
    ('1 200 W', '−88 W', '0.31 W')
    """
    return f"{significant(value, 2)} W" if math.isfinite(value) else "not known"


def significant(value: float | None, digits: int = 3) -> str:
    """Spell a number with a few significant digits.

    Parameters
    ----------
    value : float or None
        Number [any].
    digits : int
        How many.

    Examples
    --------
    >>> significant(0.012345), significant(153210.0)
    ('0.0123', '153 000')
    """
    if value is None or not math.isfinite(value):
        return _NO_NUMBER
    if value == 0.0:
        return "0"
    power = math.floor(math.log10(abs(value)))
    if not -4 <= power < 7:
        return f"{value:.{digits - 1}e}"
    rounded = round(value, digits - 1 - power)
    return f"{rounded:,.{max(0, digits - 1 - power)}f}".replace(",", " ").replace("-", "−")


def plain(value: float) -> str:
    """Spell a number that was given, such as a bound, with no more digits than it needs.

    Examples
    --------
    >>> plain(0.02), plain(60.0), plain(600000.0)
    ('0.02', '60', '600 000')
    """
    digits = f"{value:.6g}"
    return f"{int(value):,}".replace(",", " ") if value == int(value) and "e" not in digits else digits


def unit(text: str) -> str:
    """Spell a unit as people write it; a dash for a pure number."""
    return _NO_NUMBER if text in {"1", "", "-"} else text.replace("^2", "²").replace("^3", "³")


def duration(seconds: float) -> str:
    """Spell a length of time.

    Parameters
    ----------
    seconds : float
        Length [s].

    Examples
    --------
    >>> duration(21600.0), duration(5400.0), duration(864000.0)
    ('6 hours', '90 minutes', '10 days')
    """
    for name, length in (("day", 86400.0), ("hour", 3600.0), ("minute", 60.0), ("second", 1.0)):
        if seconds >= 2.0 * length or (seconds == length and name != "second"):
            count = seconds / length
            if abs(count - round(count)) < 1e-9:
                return f"{round(count)} {name}{'s' if round(count) != 1 else ''}"
    return f"{seconds / 3600.0:.3g} hours"


def clock(stamp: pd.Timestamp) -> str:
    """Spell a local time to the minute.

    Parameters
    ----------
    stamp : pandas.Timestamp
        Local.
    """
    return f"{stamp:%Y-%m-%d %H:%M}"


def counted(number: int, noun: str, plural: str = "") -> str:
    """Spell a count.

    Parameters
    ----------
    number : int
        How many.
    noun, plural : str
        Of what; by default the plural has an s.

    Examples
    --------
    >>> counted(1, "zone"), counted(0, "zone")
    ('1 zone', 'no zones')
    """
    return f"{number or 'no'} {noun if number == 1 else plural or noun + 's'}"
