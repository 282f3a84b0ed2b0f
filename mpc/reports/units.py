"""Display units: what was written in SI units read in inch-pound units, in text, tables, pages and figures."""

import html
import re
from collections.abc import Callable, Sequence

from thermal.display_units import CONVERTED, Line, inch_pound

#: A number as reports spell it.
NUMBER = r"[+\-−±]?(?:\d{1,3}(?:[ \u202f]\d{3})+(?!\d)(?:\.\d+)?|\d+(?:\.\d+)?(?:e[+-]?\d+)?)"
_NAMES = "|".join(re.escape(name) for name in sorted(CONVERTED, key=len, reverse=True))

#: A number with its unit, or several that share one: ``0.4 to 0.6 K``.
_QUANTITY = re.compile(
    rf"(?<![\w.:/\-])({NUMBER}(?:(?: to | and | or | ± | → )[+\-−]?{NUMBER})*)([ \u00a0])({_NAMES})(?![\w/²³·°^*])"
)
#: Cells of numbers: one, or the ends of a range.
_ALONE = re.compile(rf"{NUMBER}(?: to {NUMBER})?")
_IN_BRACKETS = re.compile(rf"\[(%?)({_NAMES})\]")

#: Parts of a page that no reader sees as text, or that are to be copied as they stand.
_PARTS = re.compile(r"(<(?:style|script|code|title)\b.*?</(?:style|script|code|title)>|<[^>]*>)", re.DOTALL)
_TABLE, _ROW = re.compile(r"<table>.*?</table>", re.DOTALL), re.compile(r"<tr>.*?</tr>", re.DOTALL)
_CELL = re.compile(r"(<t([hd])\b[^>]*>)(.*?)(</t[hd]>)", re.DOTALL)


def converted_text(text: str) -> str:
    """Write a sentence in inch-pound units, with as many significant digits.

    Parameters
    ----------
    text : str
        Numbers with units behind them, and units in brackets.

    Examples
    --------
    >>> converted_text("It falls from 0.46 to 0.32 K in 384 m², at 21 °C and 40 %.")
    'It falls from 0.83 to 0.58 °F in 4 130 ft², at 70 °F and 40 %.'
    """

    def quantity(match: re.Match[str]) -> str:
        numbers, space, unit = match.groups()
        line = inch_pound(unit)
        if line is None:  # pragma: no cover - the pattern holds only units that are known
            return match[0]
        return re.sub(NUMBER, lambda m: converted_number(m[0], line), numbers) + space + line.unit

    def bracket(match: re.Match[str]) -> str:
        line = inch_pound(match[2])
        return match[0] if line is None else f"[{line.unit}]"

    return _IN_BRACKETS.sub(bracket, _QUANTITY.sub(quantity, text))


def converted_number(text: str, line: Line) -> str:
    """Write a number in another unit, with as many significant digits and at least two.

    Parameters
    ----------
    text : str
        As reports spell it.
    line : Line
        Of `inch_pound`.
    """
    sign, digits = re.fullmatch(r"([+\-−±]?)(.*)", text, re.DOTALL).groups()  # type: ignore[union-attr]
    plain = digits.replace(" ", "").replace("\u202f", "")
    about = sign == "±" and line.offset != 0.0
    value = float(plain) * (-1.0 if sign in ("-", "−") else 1.0)
    found = line(value) - (line(0.0) if about else 0.0)
    mantissa = plain.partition("e")[0]
    mantissa = mantissa.replace(".", "").lstrip("0") if "." in mantissa else mantissa.strip("0")
    known, decimals = max(2, len(mantissa)), len(plain.partition(".")[2])
    if found == 0.0:
        return "0"
    if "e" in plain:
        return f"{found:.{known - 1}e}".replace("-", "−", 1) if found < 0 else f"{found:.{known - 1}e}"
    places = known - len(str(int(abs(found)))) if abs(found) >= 1.0 else known + len(_zeros(found))
    if line.offset and not about:  # a temperature has no zero that digits could count from
        places = decimals
    rounded = round(found, places)
    spelled = f"{abs(rounded):,.{max(0, places)}f}".replace(",", " ")
    return ("±" if sign == "±" else "−" if rounded < 0 else "+" if sign == "+" else "") + spelled


def _zeros(value: float) -> str:
    """Zeros between the point and the first digit of a number below one."""
    return re.match(r"0*", f"{abs(value):.12f}"[2:])[0]  # type: ignore[index]


def converted_row(titles: Sequence[str], cells: Sequence[str]) -> list[str]:
    """Cells of a row in inch-pound units: by the unit in the head of a column, by a cell of a column ``unit``, in text.

    Parameters
    ----------
    titles : sequence of str
        Heads of the columns in SI units.
    cells : sequence of str
        Under them.

    Examples
    --------
    >>> converted_row(["zone", "unit", "value", "error [K]"], ["A", "W", "100", "0.50"])
    ['A', 'Btu/h', '340', '0.90']
    """
    units = [inch_pound(cell) for title, cell in zip(titles, cells, strict=False) if title == "unit"]
    of_row, found = (units[0] if units else None), []
    for k, (title, cell) in enumerate(zip(titles, cells, strict=False)):
        head = _IN_BRACKETS.search(title)
        line = inch_pound(head[2]) if head else None if "[" in title or k == 0 else of_row  # first are names
        if title == "unit" and of_row is not None:
            found.append(of_row.unit)
        elif line is not None and (head or _ALONE.fullmatch(cell)):
            found.append(re.sub(NUMBER, lambda m, line=line: converted_number(m[0], line), cell))  # type: ignore[misc]
        else:
            found.append(converted_text(cell))
    return found


def converted_page(page: str) -> str:
    """Write a page in inch-pound units: columns by the unit in their head, rows by their unit cell, all text.

    Parameters
    ----------
    page : str
        HTML.
    """
    page = _TABLE.sub(lambda table: _converted_table(table[0]), page)
    page = re.sub(r'(?<= alt=")[^"]*', lambda alt: converted_text(alt[0]), page)
    return "".join(part if part[:1] == "<" else _unescaped(part, converted_text) for part in _PARTS.split(page))


def _unescaped(text: str, change: Callable[[str], str]) -> str:
    changed = change(html.unescape(text))
    return text if changed == html.unescape(text) else html.escape(changed)


def _converted_table(table: str) -> str:
    heads = next((_CELL.findall(row) for row in _ROW.findall(table.partition("</thead>")[0])), [])
    titles = [html.unescape(" ".join(re.sub("<[^>]*>", " ", text).split())) for _, _, text, _ in heads]

    def row(match: re.Match[str]) -> str:
        cells = _CELL.findall(match[0])
        if any(kind == "h" for _, kind, _, _ in cells):  # heads are text, as those at the side are
            return match[0]
        texts = [html.unescape(text) for _, _, text, _ in cells]
        named = [*titles, *[""] * len(cells)][: len(cells)]
        changed = zip(cells, texts, converted_row(named, texts), strict=True)
        return "<tr>" + "".join(
            begin + (text if after == before or "<" in text else html.escape(after)) + end
            for (begin, _, text, end), before, after in changed
        ) + "</tr>"  # fmt: skip

    return _ROW.sub(row, table)
