"""The zone table of a house as its drawing has it: right, roughly right, or that of some typical house."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np

from house_trials import fabric
from house_trials.faces import DOORWAY_AREA, faces
from house_trials.readings import WHOLE
from house_trials.specification import SIDES, Fabric, HouseSpec

Table = dict[str, Any]

#: Solar transmittance that a drawing gives for glass of a U-value below 1.3, below 2.3 and above (EN 410, usual panes).
_TRANSMITTANCE = ((1.3, 0.5), (2.3, 0.6), (9.0, 0.75))
# Standard deviations of the logarithms of what an approximate drawing has wrong [-]: areas measured on a plan at 1:100,
# layers and their materials guessed from the year of construction (EN ISO 10456: design values within some 20 %).
_AREA, _VOLUME, _GLASS, _THICKNESS, _CONDUCTIVITY, _U_VALUE = 0.08, 0.06, 0.12, 0.08, 0.2, 0.12
#: Fabric of a typical house, whoever it belongs to.
_TYPICAL = Fabric("cavity", "stud", "joists", 0.06, 0.15, 0.05, 1.8, 0.7, 20.0, 0.08)
_BETWEEN = 4.0  # [m2], partition between any two rooms of a typical house


def zone_table(spec: HouseSpec) -> Table:
    """Return zones, surfaces and constructions of the case.

    Parameters
    ----------
    spec : HouseSpec
        Of which geometry, fabric and the drawing's quality are told, and whether the attic is known.
    """
    table = _typical(spec) if spec.sensors.quality == "generic" else _true(spec)
    if spec.sensors.quality == "approximate":
        _blur(table, np.random.default_rng(spec.sensors.seed))
    if spec.has("unmeasured_attic"):
        table["surfaces"] = [row for row in table["surfaces"] if row["other"] != "attic"]
    if spec.heating.meter == "house":
        _lump(table)
    used = {row.get("construction") for row in table["surfaces"]}
    table["constructions"] = {name: rows for name, rows in table["constructions"].items() if name in used}
    return table


def _constructions(of: Fabric) -> dict[str, list[dict[str, float]]]:
    found = fabric.constructions(of)
    return {name: fabric.table_layers(layers) for name, layers in found.items() if name != "furniture"}


def _window(name: str, room: str, area: float, azimuth: float, u_value: float) -> dict[str, Any]:
    sun = next(value for most, value in _TRANSMITTANCE if u_value < most)
    return {"name": name, "kind": "window", "zone": room, "other": "outdoor", "area": area, "azimuth": azimuth,
            "u_value": u_value, "solar_transmittance": sun}  # fmt: skip


def _true(spec: HouseSpec) -> Table:
    house, surfaces = spec.house, []
    zones = [{"name": r.name, "volume": r.area * house.height, "floor_area": r.area} for r in house.rooms]
    for face in faces(house):
        if face.other in spec.zone_names and (face.kind == "floor" or (face.kind == "wall" and face.room > face.other)):
            continue  # seen from the other room
        row: dict[str, Any] = {"name": face.name.replace(" ", "_"), "kind": face.kind, "zone": face.room,
                               "other": face.other, "area": face.area - face.glass}  # fmt: skip
        if face.side:
            row["azimuth"] = (SIDES[face.side] + house.orientation) % 360.0
        surfaces.append(row | {"construction": fabric.construction_of(face)})
        if face.glass > 0.0:
            name = f"{row['name']}_glass"
            surfaces.append(_window(name, face.room, face.glass, row["azimuth"], spec.fabric.window_u_value))
    if house.doorway:
        first, second = house.doorway
        surfaces.append({"name": "doorway", "kind": "opening", "zone": first, "other": second, "area": DOORWAY_AREA})
    return {"zones": zones, "surfaces": surfaces, "constructions": _constructions(spec.fabric)}


def _typical(spec: HouseSpec) -> Table:
    """Equal rooms, each beside each, whose walls and glass look all ways; only what bounds the house is known."""
    rooms, outer = spec.zone_names, [f for f in faces(spec.house) if f.side]
    n = len(rooms)
    area = sum(room.area for room in spec.house.rooms) / n
    wall = sum(f.area - f.glass for f in outer) / n / len(SIDES)
    glass = sum(f.glass for f in outer) / n / len(SIDES)
    zones = [{"name": r, "volume": 2.5 * area, "floor_area": area} for r in rooms]
    surfaces: list[dict[str, Any]] = []
    for room in rooms:
        for side, azimuth in SIDES.items():
            row = {"name": f"{room}_wall_{side}", "kind": "wall", "zone": room, "other": "outdoor", "area": wall,
                   "azimuth": azimuth, "construction": "exterior wall"}  # fmt: skip
            surfaces += [row, _window(f"{room}_glass_{side}", room, glass, azimuth, _TYPICAL.window_u_value)]
        share = area / spec.house.floors
        for kind, other, name in (("ceiling", spec.house.top, "roof"), ("floor", spec.house.bottom, "lowest floor")):
            surfaces.append({"name": f"{room}_{kind}", "kind": kind, "zone": room, "other": other, "area": share,
                             "construction": name})  # fmt: skip
    for a, b in combinations(rooms, 2):
        surfaces.append({"name": f"{a}_{b}", "kind": "wall", "zone": a, "other": b, "area": _BETWEEN,
                         "construction": "partition"})  # fmt: skip
    return {"zones": zones, "surfaces": surfaces, "constructions": _constructions(_TYPICAL)}


def _blur(table: Table, rng: np.random.Generator) -> None:
    """Let areas, layers and U-values be off."""

    def off(spread: float) -> float:
        return float(np.exp(rng.normal(0.0, spread)))

    for zone in table["zones"]:
        zone["floor_area"] *= off(_AREA)
        zone["volume"] *= off(_VOLUME)
    for row in table["surfaces"]:
        row["area"] *= off(_GLASS if row["kind"] == "window" else _AREA)
    windows = off(_U_VALUE)
    for row in table["surfaces"]:
        if row["kind"] == "window":
            row["u_value"] *= windows
    for layers in table["constructions"].values():
        for layer in layers:
            layer["thickness"] *= off(_THICKNESS)
            layer["conductivity"] *= off(_CONDUCTIVITY)


def _lump(table: Table) -> None:
    """Take the house for one zone: what lies between rooms is mass that stands in it."""
    inside = {zone["name"] for zone in table["zones"]}
    total: Callable[[str], float] = lambda key: sum(zone[key] for zone in table["zones"])  # noqa: E731
    table["zones"] = [{"name": WHOLE, "volume": total("volume"), "floor_area": total("floor_area")}]
    table["surfaces"] = [row for row in table["surfaces"] if row["kind"] != "opening"]
    for row in table["surfaces"]:
        row["zone"], row["other"] = WHOLE, WHOLE if row["other"] in inside else row["other"]
