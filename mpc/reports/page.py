"""Pages of reports: one way from contents to a page, and how numbers, times and lists read in them."""

import json
import math
import platform
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
from jinja2.filters import make_attrgetter
from markupsafe import Markup, escape

from mpc.reports.display import display, write_results
from mpc.reports.figures.zoom import zoom_scripts
from mpc.reports.glossary import words_on
from mpc.reports.opening import opening
from thermal.case.estimated import Estimated, estimate_summary
from thermal.parameters import FACADE_PREFIX

_NO_NUMBER = "–"

#: Where the glossary and the script of figures go, and a figure with its data for plotly.
_GLOSSARY, _ZOOM = "<!-- glossary -->", "<!-- zoom -->"
_INTERACTIVE = re.compile(
    r'<figure([^>]*)>((?:(?!</figure>).)*?)<script type="application/json">(.*?)</script></figure>', re.DOTALL
)

#: A date or a time, which does not wrap.
_DATE = re.compile(r"\d{4}-\d\d-\d\d( \d\d:\d\d)?")

#: More zones than this are counted, not named.
_MOST_NAMED = 4


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("mpc.reports", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {**_SPELLINGS, "spell": spell, "cells": _cells, "opening": opening}
    return environment


def render(template: str, content: Mapping[str, Any]) -> str:
    """Fill a template, in the units that are shown, with its glossary; the page loads nothing from elsewhere.

    A page of a case of a hundred zones is below 3 MB, and 2 MB more where plotly is installed, for figures that zoom.

    Parameters
    ----------
    template : str
        Name without its ending, such as ``calibration``.
    content : mapping
        What it shows; every text is escaped. ``means``, a `Means`, stands at the top.
    """
    made_by = {"version": version("buildingmpc"), "python": platform.python_version()}
    environment = _environment()
    page = display().page(environment.get_template(f"{template}.html.j2").render(made_by | dict(content)))
    page, figures = _taken_out(page)
    folded = environment.get_template("glossary.html.j2").render(words=words_on(page))
    scripts = environment.get_template("zoom.html.j2").render(packed=zoom_scripts(figures))
    return page.replace(_GLOSSARY, folded).replace(_ZOOM, scripts)


def _taken_out(page: str) -> tuple[str, dict[str, Any]]:
    """Page without the figures for plotly, each in place of its number, and these by that."""
    figures: dict[str, Any] = {}

    def taken(match: re.Match[str]) -> str:
        figures[number := str(len(figures))] = json.loads(match[3])
        return f'<figure{match[1]} data-zoom="{number}">{match[2]}</figure>'

    return _INTERACTIVE.sub(taken, page), figures


def write_report(
    out: str | Path, template: str, content: Mapping[str, Any], files: Mapping[str, Any], force: bool = False
) -> Path:
    """Write ``report.html`` and the files of its numbers; see `calibration.results.write_results`.

    Parameters
    ----------
    out : str or Path
        Folder, made if need be.
    template : str
        Of the page.
    content : mapping
        What the page shows.
    files : mapping of str to bytes, str, dict or DataFrame
        By file name.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    """
    return write_results(out, {**files, "report.html": render(template, content)}, force) / "report.html"


def spell(value: Any, how: str = "") -> str:
    """Spell a value of a table.

    Parameters
    ----------
    value : object
        Nothing, and what is no number, is a dash.
    how : str
        Name of a filter, such as ``kelvin``, or a format, such as ``.3f``.

    Examples
    --------
    >>> spell(-0.0532, ".2f"), spell(0.0532, "kelvin"), spell(float("nan"), ".1f"), spell(-0.26, ".0f")
    ('−0.05', '0.053', '–', '0')
    """
    if value is None or value == "" or (isinstance(value, float) and not math.isfinite(value)):
        return _NO_NUMBER
    if how in _SPELLINGS:
        return _SPELLINGS[how](value)
    if not how:
        return str(value)
    text = format(value, how).replace("-", "−")
    return text if "+" in how or text.strip("−0.,%") else text.removeprefix("−")  # a zero has no sign


@jinja2.pass_environment
def _cells(
    environment: jinja2.Environment, row: Any, columns: Sequence[Any], left: Sequence[int]
) -> list[tuple[str, Any]]:
    """Class and text of each cell of a row: of a list of texts, or of a record by the paths and spellings of columns.

    Parameters
    ----------
    environment : Environment
        Of the templates.
    row : sequence of str, or record
        An object, a mapping or a tuple.
    columns : sequence of str or (str, str, str)
        Titles; those of a record with the path of a value, such as ``interval.start``, and its spelling.
    left : sequence of int
        Columns of text.
    """
    if not isinstance(columns[0], str):
        row = [spell(make_attrgetter(environment, path)(row), how) for _, path, how in columns]
    titles = [column if isinstance(column, str) else column[0] for column in columns]
    kinds = ["unit" if title == "unit" else "text" if k in left else "n" for k, title in enumerate(titles)]
    kinds = ["name", *kinds[1:]]
    kinds = ["when" if _DATE.fullmatch(str(text)) else kind for kind, text in zip(kinds, row, strict=True)]
    broken = re.sub(r"([_/])(?=\w)", r"\1<wbr>", str(escape(row[0])))  # a long name wraps between its words
    return list(zip(kinds, [Markup(broken), *row[1:]], strict=True))


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
    >>> duration(21600.0), duration(5400.0), duration(864000.0), duration(45000.0)
    ('6 hours', '90 minutes', '10 days', '12.5 hours')
    """
    for name, length in (("day", 86400.0), ("hour", 3600.0), ("minute", 60.0), ("second", 1.0)):
        count = round(seconds / length)
        if abs(seconds - count * length) < 1e-9 * length and 1 <= count <= (100 if name != "day" else count):
            return counted(count, name)
    return f"{seconds / 3600.0:.3g} hours"


def clock(stamp: pd.Timestamp) -> str:
    """Spell a local time to the minute.

    Parameters
    ----------
    stamp : pandas.Timestamp
        Local.
    """
    return f"{stamp:%Y-%m-%d %H:%M}"


def counted(number: int, noun: str) -> str:
    """Spell a count.

    Parameters
    ----------
    number : int
        How many.
    noun : str
        Of what; its plural has an s.

    Examples
    --------
    >>> counted(1, "zone"), counted(0, "zone")
    ('1 zone', 'no zones')
    """
    return f"{number or 'no'} {noun if number == 1 else noun + 's'}"


def percent(value: float) -> str:
    """Spell a share: without decimals, but for what would be 0, and never as all where a part is lacking.

    Examples
    --------
    >>> percent(0.256), percent(-0.031), percent(0.004), percent(0.9996)
    ('26 %', '−3 %', '0.4 %', 'over 99 %')
    """
    if 0.995 <= value < 1.0 - 1e-9:
        return "over 99 %"
    digits = 1 if 0.0 < abs(value) < 0.005 else 0
    return f"{100 * value:.{digits}f} %".replace("-", "−")


def sure(probability: float) -> str:
    """Spell a probability, never as certainty.

    Parameters
    ----------
    probability : float
        In [0, 1], [-].

    Examples
    --------
    >>> sure(0.937), sure(0.9999), sure(0.001)
    ('94 %', 'over 99 %', 'under 1 %')
    """
    if probability > 0.99:
        return "over 99 %"
    return percent(probability) if probability >= 0.01 else "under 1 %"


def ends(interval: tuple[float, float]) -> str:
    """Spell the ends of an interval of shares.

    Examples
    --------
    >>> ends((0.121, 0.3))
    '12 to 30 %'
    """
    return f"{100 * interval[0]:.0f} to {percent(interval[1])}"


def listed(words: Iterable[str], last: str = "and") -> str:
    """Join words as a sentence does.

    Parameters
    ----------
    words : iterable of str
        At least one.
    last : str
        What stands before the last.

    Examples
    --------
    >>> listed(["sun", "wind", "rain"], "or")
    'sun, wind or rain'
    """
    *first, end = words
    return f"{', '.join(first)} {last} {end}" if first else end


def in_words(name: str) -> str:
    """Spell the name of a parameter as people write it.

    Parameters
    ----------
    name : str
        Such as ``window_u_value``, or ``window_u_value@facade:south`` of a facade or zone.

    Examples
    --------
    >>> in_words("window_u_value"), in_words("constant_gain@F1_N"), in_words("window_u_value@facade:south")
    ('window U-value', 'constant gain of F1_N', 'window U-value of the south facade')
    """
    base, _, member = name.partition("@")
    words = base.replace("_u_value", "_U-value").replace("_", " ")
    if member.startswith(FACADE_PREFIX):
        return f"{words} of the {member.removeprefix(FACADE_PREFIX)} facade"
    return f"{words} of {member.replace(' + ', ' and ')}" if member else words


def estimated_sentences(found: Sequence[Estimated]) -> list[str]:
    """Say which zones' heat was estimated, in one sentence; in none where there is nothing to say.

    Parameters
    ----------
    found : sequence of Estimated
        Where it was.
    """
    if not found:
        return []
    hours: dict[str, float] = {}
    for entry in estimate_summary(found):
        hours[entry["zone"]] = max(entry["hours"], hours.get(entry["zone"], 0.0))
    named = [f"{zone} ({worst:.0f} h)" for zone, worst in hours.items()]
    rest = [f"{len(named) - _MOST_NAMED} more"] if len(named) > _MOST_NAMED else []
    return [
        f"Sensors failed in {listed([*named[:_MOST_NAMED], *rest])}: heat there was estimated meanwhile, and errors "
        "there do not count."
    ]


#: How values read, by name of the filter.
_SPELLINGS: dict[str, Callable[..., str]] = {
    f.__name__: f
    for f in (
        kelvin, signed, watts, significant, plain, unit, duration, clock,
        counted, percent, sure, ends, in_words, listed,
    )
}  # fmt: skip
