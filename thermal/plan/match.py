"""Matching of telemetry columns to devices and points, and the list of matches."""

import csv
import difflib
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from thermal.case.building import Device
from thermal.case.points import POINT_TYPES
from thermal.case.telemetry import INDEX
from thermal.errors import PlanError
from thermal.plan.devices import ListedPoint, key, words_of
from thermal.plan.guard import checked_file, reading, vocabulary

_LEAST = 0.5  # -, of the confidence of a match that is offered
_ALIKE = 0.85  # -, of two names that differ by a slip of the pen

# What names in building automation stand for, in the words of the point types.
_SHORT = vocabulary("abbreviations")
# Words that say little: many names leave them out.
_WEIGHTS = vocabulary("weights")
_TERMINALS = frozenset({"vav", "fan_coil", "supply_air_terminal"})


@dataclass(frozen=True)
class PointMatch:
    """What a column of telemetry is taken for.

    Parameters
    ----------
    column : str
        Its name.
    entity : str
        Device, zone or weather station; empty when there is none.
    point : str
        Point type of the case format; empty when there is none.
    confidence : float
        From 0 to 1 [-]; 1 for ``ENTITY/POINT`` itself.
    remark : str
        Why it is not matched; empty when it is.
    unit : str
        Unit in the table; empty for that of `--unit`, or the usual one.
    """

    column: str
    entity: str
    point: str
    confidence: float
    remark: str = ""
    unit: str = ""


def match_points(
    columns: Sequence[str],
    devices: Sequence[Device],
    zones: Sequence[str] = (),
    *,
    weather_station: str = "weather_station",
    listed: Sequence[ListedPoint] = (),
) -> tuple[PointMatch, ...]:
    """Match columns of telemetry to devices and point types by name.

    Parameters
    ----------
    columns : sequence of str
        Names of the columns.
    devices : sequence of Device
        Of the building.
    zones : sequence of str
        Of the building; they have sensors too.
    weather_station : str
        Name of the weather station.
    listed : sequence of ListedPoint
        What a Brick model or a Haystack export says of columns; it is believed.

    Returns
    -------
    tuple of PointMatch
        One a column, in their order. What is not matched has a remark, and its best guess where there is one.

    Notes
    -----
    Confidence is that of the entity times that of the point. A device's words in a row in the column's name count 1;
    names that are spelt nearly alike as much as they are alike (ratio of Ratcliff and Obershelp, at least 0.85). For
    the point it is Dice's coefficient of the remaining words, abbreviations spelt out, and the point type's; words such
    as "sensor" hardly count. Of two columns for one point the more confident one has it.

    Examples
    --------
    >>> found = match_points(["vav-01 Zn Temp"], [Device(name="VAV_1", type="vav")])[0]
    >>> found.entity, found.point, round(found.confidence, 2)
    ('VAV_1', 'zone_air_temperature_sensor', 0.89)
    """
    names = EntityNames.of(devices, zones, weather_station)
    known = {p.column: PointMatch(p.column, p.entity, p.point, 1.0) for p in listed if p.point}
    return settled([known.get(column) or names.guess(column) for column in columns])


def settled(guesses: Sequence[PointMatch]) -> tuple[PointMatch, ...]:
    """Give each point to the most confident of the columns that could be it; the others get a remark.

    Parameters
    ----------
    guesses : sequence of PointMatch
        One a column.
    """
    best: dict[tuple[str, str], PointMatch] = {}
    for guess in guesses:
        place = (guess.entity, guess.point)
        if guess.confidence >= _LEAST and (place not in best or guess.confidence > best[place].confidence):
            best[place] = guess
    return tuple(replace(guess, remark=_remark(guess, best)) for guess in guesses)


def _remark(guess: PointMatch, best: dict[tuple[str, str], PointMatch]) -> str:
    """Why a column is not matched; empty when it is."""
    if not guess.entity:
        return "no device or zone of that name"
    if not guess.point:
        return "no point type like that"
    if guess.confidence < _LEAST:
        return "too uncertain"
    taken = best[guess.entity, guess.point]
    return "" if taken is guess else f"{taken.column!r} fits as well or better"


@dataclass(frozen=True)
class EntityNames:
    """What columns may be of.

    Parameters
    ----------
    types : dict of str to str
        Type of a device, ``zone`` or ``weather``, by name.
    keys : dict of str to tuple of str
        Words of the names.
    weather_station : str
        Name of the weather station.
    """

    types: dict[str, str]
    keys: dict[str, tuple[str, ...]]
    weather_station: str

    @classmethod
    def of(cls, devices: Sequence[Device], zones: Sequence[str], weather_station: str) -> "EntityNames":
        """Names of a building.

        Parameters
        ----------
        devices : sequence of Device
            Of the building.
        zones : sequence of str
            Of the building.
        weather_station : str
            Name of the weather station.
        """
        types = {device.name: device.type for device in devices} | dict.fromkeys(zones, "zone")
        types[weather_station] = "weather"
        return cls(types, {name: key(name) for name in types}, weather_station)

    def guess(self, column: str, possible: Collection[str] = tuple(POINT_TYPES)) -> PointMatch:
        """Guess what a column is, as far as its name tells.

        Parameters
        ----------
        column : str
            Its name.
        possible : collection of str
            Point types that it can be.
        """
        head, _, tail = column.rpartition("/")
        if head in self.types and tail in possible:
            return PointMatch(column, head, tail, 1.0)
        return _guess(column, self.types, self.keys, self.weather_station, possible)


def _guess(
    column: str,
    entities: dict[str, str],
    keys: dict[str, tuple[str, ...]],
    weather_station: str,
    possible: Collection[str],
) -> PointMatch:
    words = key(column)
    found = [
        (len(name_key), name, i)
        for name, name_key in keys.items()
        for i in range(len(words) - len(name_key) + 1)
        if name_key and words[i : i + len(name_key)] == name_key
    ]
    if found:
        size, name, start = max(found, key=lambda item: item[0])
        rivals = {other for length, other, _ in found if length == size}
        certain = 1.0 / len(rivals)
        rest = [*words[:start], *words[start + size :]]
    else:
        name, certain, rest = _alike(words, keys)
    if not name:
        point, share = _point(list(words), "weather", possible)
        if point in _OF_WEATHER and share > 0.0:
            return PointMatch(column, weather_station, point, 0.8 * share)
        return PointMatch(column, "", "", 0.0)
    point, share = _point(rest, entities[name], possible)
    return PointMatch(column, name, point, certain * share)


_OF_WEATHER = frozenset(
    point for point in POINT_TYPES if point.startswith(("outside", "wind", "direct", "diffuse", "global", "horizontal"))
)


def _alike(words: Sequence[str], keys: dict[str, tuple[str, ...]]) -> tuple[str, float, list[str]]:
    """Find the entity whose name is nearly that of the first words; numbers must be the same."""
    best: tuple[str, float, list[str]] = ("", 0.0, [])
    for name, parts in keys.items():
        start = words[: len(parts)]
        if [w for w in start if w.isdigit()] != [p for p in parts if p.isdigit()]:
            continue
        ratio = difflib.SequenceMatcher(None, " ".join(start), " ".join(parts)).ratio()
        if ratio >= _ALIKE and ratio > best[1]:
            best = (name, ratio, list(words[len(parts) :]))
    return best


def _point(words: Sequence[str], kind: str, possible: Collection[str]) -> tuple[str, float]:
    """Point type whose words are most like those of a name, and how much they are."""
    meant = {part for word in words for part in _SHORT.get(word, word).split()}
    if kind in _TERMINALS and {"supply", "temperature"} <= meant and "setpoint" not in meant:
        meant = meant - {"supply"} | {"discharge"}
    if kind in _TERMINALS and {"heating", "valve"} <= meant:
        meant |= {"water"}
    if not meant or not possible:
        return "", 0.0
    if kind == "zone":
        meant |= {"zone"}  # of a room's temperature nobody says that it is the room's
    names = {point: {*words_of(point)} for point in possible}
    ratios = {p: 2.0 * _weight(meant & words) / (_weight(meant) + _weight(words)) for p, words in names.items()}
    best = max(ratios, key=lambda point: ratios[point])
    return (best, ratios[best]) if ratios[best] > 0.0 else ("", 0.0)


def _weight(words: set[str]) -> float:
    return sum(float(_WEIGHTS.get(word, 1.0)) for word in words)


_HEADER = ("column", "entity", "point", "confidence", "remark", "unit")


def read_columns(path: str | PathLike[str]) -> tuple[str, ...]:
    """Read the names of the columns of a telemetry file, without its values.

    Parameters
    ----------
    path : str or path
        CSV or Parquet.

    Returns
    -------
    tuple of str
        All but the first of a CSV, and all but ``timestamp``.

    Raises
    ------
    PlanError
        The file is missing or neither.
    """
    file = checked_file(Path(path), (".csv", ".parquet"))
    with reading(file, "telemetry with one column a point", csv.Error):
        if file.suffix.lower() == ".csv":
            with file.open(encoding="utf-8-sig", newline="") as stream:
                names = next(csv.reader(stream, strict=True), [])[1:]
        else:
            from pyarrow import parquet

            names = [str(name) for name in parquet.read_schema(file).names]
    return tuple(name for name in names if name not in (INDEX, "__index_level_0__"))


def write_matches(matches: Sequence[PointMatch], path: str | PathLike[str]) -> Path:
    """Write what columns were matched to as CSV.

    Parameters
    ----------
    matches : sequence of PointMatch
        From `match_points`.
    path : str or path
        File to write.

    Returns
    -------
    Path
        The file: column, entity, point, confidence, remark, unit.
    """
    file = Path(path)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_HEADER)
        writer.writerows([m.column, m.entity, m.point, f"{m.confidence:.3f}", m.remark, m.unit] for m in matches)
    return file


def read_matches(path: str | PathLike[str]) -> tuple[PointMatch, ...]:
    """Read what columns were matched to, as a person has corrected it.

    Parameters
    ----------
    path : str or path
        CSV of `write_matches`: columns ``column``, ``entity`` and ``point``; others are not needed.

    Returns
    -------
    tuple of PointMatch
        One a row. A row with a remark, or without an entity or a point, is a column that is left out.

    Raises
    ------
    PlanError
        The file is missing or no CSV.
    PlanError
        A column of it is missing, or a row names a column without a name.
    """
    file = checked_file(Path(path), (".csv",))
    with reading(file, "a CSV in UTF-8", csv.Error), file.open(encoding="utf-8-sig", newline="") as stream:
        reader = csv.DictReader(stream, strict=True)
        rows, header = list(reader), tuple(reader.fieldnames or ())
    if not {*_HEADER[:3]} <= {*header}:
        raise PlanError(file.name, f"columns {', '.join(_HEADER[:3])}", ", ".join(header) or "none")
    matches = []
    for number, row in enumerate(rows, start=2):
        column, entity, point = ((row[name] or "").strip() for name in _HEADER[:3])
        PlanError.unless(column, f"{file.name}: line {number}", "the name of a column", "none")
        remark = (row.get("remark") or "").strip() or ("" if entity and point else "left out")
        matches.append(PointMatch(column, entity, point, 1.0, remark, (row.get("unit") or "").strip()))
    return tuple(matches)
