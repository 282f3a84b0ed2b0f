"""Columns of telemetry matched to devices and point types by their names."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace

from thermal.case.points import POINT_TYPES
from thermal.case.schema import Device
from thermal.plan.devices import ListedPoint, key, words_of

_LEAST = 0.5  # -, of the confidence of a match that is offered
_ALIKE = 0.85  # -, of two names that differ by a slip of the pen

# What names in building automation stand for, in the words of the point types.
_SHORT = {
    "zat": "zone air temperature",
    "znt": "zone air temperature",
    "rmt": "zone air temperature",
    "dat": "discharge air temperature",
    "sat": "supply air temperature",
    "rat": "return air temperature",
    "mat": "mixed air temperature",
    "oat": "outside air temperature",
    "hwst": "supply water temperature",
    "hwrt": "return water temperature",
    "zn": "zone",
    "room": "zone",
    "rm": "zone",
    "space": "zone",
    "spc": "zone",
    "da": "discharge air",
    "sa": "supply air",
    "ra": "return air",
    "ma": "mixed air",
    "oa": "outside air",
    "outdoor": "outside",
    "ambient": "outside air",
    "hw": "water",
    "hws": "supply water",
    "hwr": "return water",
    "temp": "temperature",
    "tmp": "temperature",
    "t": "temperature",
    "airflow": "air flowrate",
    "flow": "flowrate",
    "flw": "flowrate",
    "cfm": "air flowrate",
    "sp": "setpoint",
    "stpt": "setpoint",
    "spt": "setpoint",
    "htg": "heating",
    "heat": "heating",
    "clg": "cooling",
    "cool": "cooling",
    "dmp": "damper",
    "dmpr": "damper",
    "dpr": "damper",
    "vlv": "valve",
    "reheat": "heating valve",
    "pos": "command",
    "position": "command",
    "cmd": "command",
    "pct": "percentage",
    "percent": "percentage",
    "kw": "power",
    "elec": "electrical",
    "occ": "occupancy",
    "people": "occupancy count",
    "ghi": "global horizontal irradiance",
    "dni": "direct normal irradiance",
    "dhi": "diffuse horizontal irradiance",
}
# Words that say little: many names leave them out.
_WEIGHTS = {
    "sensor": 0.1,
    "air": 0.4,
    "percentage": 0.1,
    "command": 0.4,
    "concentration": 0.1,
    "supply": 0.6,
    "count": 0.4,
}
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
    """

    column: str
    entity: str
    point: str
    confidence: float
    remark: str = ""


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
    entities = {device.name: device.type for device in devices} | dict.fromkeys(zones, "zone")
    entities[weather_station] = "weather"
    keys = {name: key(name) for name in entities}
    known = {p.column: PointMatch(p.column, p.entity, p.point, 1.0) for p in listed if p.point}
    guesses = [known.get(column) or _guess(column, entities, keys, weather_station) for column in columns]
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


def _guess(column: str, entities: dict[str, str], keys: dict[str, tuple[str, ...]], weather_station: str) -> PointMatch:
    head, _, tail = column.rpartition("/")
    if head in entities and tail in POINT_TYPES:
        return PointMatch(column, head, tail, 1.0)
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
        point, share = _point(list(words), "weather")
        if point in _OF_WEATHER and share > 0.0:
            return PointMatch(column, weather_station, point, 0.8 * share)
        return PointMatch(column, "", "", 0.0)
    point, share = _point(rest, entities[name])
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


def _point(words: Sequence[str], kind: str) -> tuple[str, float]:
    """Point type whose words are most like those of a name, and how much they are."""
    meant = {part for word in words for part in _SHORT.get(word, word).split()}
    if kind in _TERMINALS and {"supply", "temperature"} <= meant and "setpoint" not in meant:
        meant = meant - {"supply"} | {"discharge"}
    if kind in _TERMINALS and {"heating", "valve"} <= meant:
        meant |= {"water"}
    if not meant:
        return "", 0.0
    if kind == "zone":
        meant |= {"zone"}  # of a room's temperature nobody says that it is the room's
    best, share = "", 0.0
    for point in POINT_TYPES:
        wanted = set(words_of(point))
        both, either = _weight(meant & wanted), _weight(meant) + _weight(wanted)
        ratio = 2.0 * both / either
        if ratio > share:
            best, share = point, ratio
    return best, share


def _weight(words: set[str]) -> float:
    return sum(_WEIGHTS.get(word, 1.0) for word in words)
