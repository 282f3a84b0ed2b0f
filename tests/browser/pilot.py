"""Drawings and the list of devices of a generated pilot building, as a technician gets them."""

from __future__ import annotations

import csv
import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from thermal import FloorPlans
from thermal.case.building import EXTERIOR_WALL, INTERIOR_WALL
from thermal.case.plan import zone_floor_areas
from thermal.pilot.building import devices, generate_office

MARGIN = 40  # px of paper around the building


def draw_pilot(
    folder: Path, *, seed: int = 0, zones: int = 123, floor_area: float = 6317.0, floors: int = 2, pixel: float = 0.025
) -> dict[str, Any]:
    """Draw each floor as a PNG, write the devices as CSV, and say what is true of them.

    The list names the room of each terminal; on the drawings the rooms have no names.
    """
    plans = generate_office(seed, floor_area=floor_area, zones=zones, floors=floors)
    side = round(plans.cell_size / pixel)
    rooms: dict[str, Any] = {}
    for floor in plans.floors:
        wall = np.isin(floor.tokens, [EXTERIOR_WALL, INTERIOR_WALL])
        pixels = np.kron(np.where(wall, 0, 255), np.ones((side, side))).astype(np.uint8)
        Image.fromarray(np.pad(pixels, MARGIN, constant_values=255)).save(folder / f"{floor.name}.png")
        for zone in floor.zone_names:
            rooms[zone] = {"floor": floor.name, "point": inner_point(floor.tokens == zone, side)}
    listed = devices(plans)
    with (folder / "devices.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["Name", "Type", "Room"])
        writer.writerows([d.name, d.type, d.zone or ""] for d in listed)
    truth = {
        "rooms": rooms,
        "floors": [floor.name for floor in plans.floors],
        "areas": zone_floor_areas(plans),
        "devices": {d.name: d.zone for d in listed},
        "scale": scale_of(plans, side),
    }
    (folder / "truth.json").write_text(json.dumps(truth), encoding="utf-8")
    return truth


def inner_point(mask: Any, side: int) -> list[float]:
    """A point well inside a room [px]."""
    from scipy import ndimage

    depth = ndimage.distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1]
    row, column = np.unravel_index(int(depth.argmax()), depth.shape)
    return [MARGIN + (float(column) + 0.5) * side, MARGIN + (float(row) + 0.5) * side]


def scale_of(plans: FloorPlans, side: int) -> dict[str, Any]:
    """Two outer corners of the lowest floor [px], and how far apart they are [m]."""
    wall = plans.floors[0].tokens == EXTERIOR_WALL
    row = int(np.flatnonzero(wall.any(axis=1))[0])
    columns = np.flatnonzero(wall[row])
    first, last = int(columns[0]), int(columns[-1])
    points = [[MARGIN + first * side, MARGIN + row * side], [MARGIN + (last + 1) * side, MARGIN + row * side]]
    return {"points": points, "distance": (last + 1 - first) * plans.cell_size}


def write_bomb(folder: Path) -> None:
    """Write ``bomb.png``: some hundred bytes that say that they are 90,000 x 90,000 pixels."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", 90_000, 90_000, 8, 0, 0, 0, 0)
    parts = (chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(bytes(1000))), chunk(b"IEND", b""))
    (folder / "bomb.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
