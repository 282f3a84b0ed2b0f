"""Draws a trial from its seed."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta

import numpy as np
from energyplus_trials import climate
from energyplus_trials.sites import WEATHER_FILES
from energyplus_trials.specification import (
    CONFIRMATION,
    DEVELOPMENT,
    KINDS,
    Climate,
    Kind,
    stream_generator,
)

from house_trials.draw_effects import draw_effects, known_effects
from house_trials.specification import SIDES, Fabric, Heating, House, HouseSpec, Room, Sensors

DAYS = 21
# Purposes of random numbers: far from those of the offices, so that a seed's numbers are its world's own.
_HOUSE, _FABRIC, _HEATING, _SENSORS, _CLIMATE, _PEOPLE, _EFFECTS = range(100, 107)

#: Names of the rooms of one floor, lowest, middle and top, in the order in which the largest gets the first.
_NAMES = (
    ("living", "kitchen", "hall", "study", "utility", "guest"),
    ("bedroom", "child", "bath", "landing", "nursery", "dressing"),
    ("loft", "studio", "shower", "store", "box", "den"),
)
#: Floors and rooms on each that are drawn: three to eight rooms in all.
_PLANS = ((3,), (4,), (5,), (6,), (2, 2), (3, 2), (3, 3), (4, 3), (4, 4), (1, 1, 1), (2, 2, 1), (3, 2, 2), (3, 3, 2))
_LEAST_SIDE = 2.0  # [m]
_GRID = 0.1  # [m]


def draw_spec(
    seed: int, kind: Kind, *, confirmation: bool = False, days: int = DAYS, lived_in: bool = False
) -> HouseSpec:
    """Draw a trial.

    All but the effects is drawn from stream and seed alone, so that the null of a seed is the twin of its other trials.

    Parameters
    ----------
    seed : int
        Number of the trial in its stream, at least 0.
    kind : {"null", "single", "pair", "outside"}
        No effect; one of the catalogue; two or three of them; one that it does not know, or not in this form.
    confirmation : bool
        Draw from the stream that nothing is tuned on.
    days : int
        Length of the telemetry.
    lived_in : bool
        Let sun through the windows and air through the cracks, and tell the diagnosis of the two.

    Raises
    ------
    ValueError
        On a seed or a kind that does not exist.
    """
    if kind not in KINDS or seed < 0:
        raise ValueError(f"expected a seed of 0 or more and a kind of {KINDS}, found {seed} and {kind!r}")
    stream = CONFIRMATION if confirmation else DEVELOPMENT

    def rng(*purpose: int) -> np.random.Generator:
        return stream_generator(stream, seed, *purpose)

    house = draw_house(rng(_HOUSE))
    heating = _heating(rng(_HEATING), house)
    if heating.emitter == "floor":  # an adiabatic back would not be one behind pipes
        house = replace(house, bottom="cellar")
    null = HouseSpec(
        stream=stream,
        seed=seed,
        kind="null",
        days=days,
        house=house,
        fabric=_fabric(rng(_FABRIC)),
        heating=heating,
        sensors=_sensors(rng(_SENSORS)),
        climate=_climate(rng(_CLIMATE), days),
        people=int(rng(_PEOPLE).integers(2**31)),
        effects=(),
    )
    if lived_in:
        null = replace(null, known=known_effects(null, rng(_EFFECTS, len(KINDS))))
    return draw_effects(null, kind, rng(_EFFECTS, KINDS.index(kind)))


def without(spec: HouseSpec) -> tuple[HouseSpec, ...]:
    """Return the twins of a trial of several effects: the same without each of them in turn.

    Parameters
    ----------
    spec : HouseSpec
        With two effects or more.
    """
    left = ([e for e in spec.effects if e is not effect] for effect in spec.effects)
    return tuple(replace(spec, kind="without", effects=tuple(effects)) for effects in left)


def draw_house(rng: np.random.Generator) -> House:
    """Draw the geometry.

    Parameters
    ----------
    rng : Generator
        Random numbers of this purpose.
    """
    counts = _PLANS[int(rng.integers(len(_PLANS)))]
    area = max(counts) * rng.uniform(13.0, 19.0)
    across = rng.uniform(0.6, 1.0)
    width, depth = (max(round(float(side), 1), 3.6) for side in (np.sqrt(area / across), np.sqrt(area * across)))
    rooms: list[Room] = []
    for floor, count in enumerate(counts):
        place = floor if floor < len(counts) - 1 or floor == 0 else max(floor, 1)
        parts = sorted(_cut(rng, width, depth, count), key=lambda p: -(p[1] - p[0]) * (p[3] - p[2]))
        rooms += [Room(name, floor, *part) for name, part in zip(_NAMES[place], parts, strict=False)]
    glazing = {side: round(float(rng.uniform(0.08, 0.3)), 3) for side in SIDES}
    if rng.random() < 0.5:  # semi-detached and the like
        glazing[str(rng.choice(list(SIDES)))] = 0.0
    house = House(
        tuple(rooms), len(counts), round(float(rng.uniform(2.35, 2.8)), 2), round(float(rng.uniform(-90.0, 90.0)), 1),
        glazing, str(rng.choice(["outdoor", "attic"])), str(rng.choice(["ground", "cellar"], p=[0.65, 0.35])), (),
    )  # fmt: skip
    return replace(house, doorway=_doorway(rng, rooms))


def _cut(rng: np.random.Generator, width: float, depth: float, count: int) -> list[tuple[float, float, float, float]]:
    """Cut a rectangle in parts, the largest of which is cut next, across its longer side."""
    parts = [(0.0, width, 0.0, depth)]
    while len(parts) < count:
        w, e, s, n = parts.pop(int(np.argmax([(p[1] - p[0]) * (p[3] - p[2]) for p in parts])))
        low, high = (w, e) if e - w >= n - s else (s, n)
        least = min(_LEAST_SIDE, 0.4 * (high - low))
        at = round(
            round(float(np.clip(low + rng.uniform(0.32, 0.68) * (high - low), low + least, high - least)) / _GRID)
            * _GRID,
            1,
        )
        parts += [(w, at, s, n), (at, e, s, n)] if e - w >= n - s else [(w, e, s, at), (w, e, at, n)]
    return parts


def _doorway(rng: np.random.Generator, rooms: list[Room]) -> tuple[str, ...]:
    """Two rooms of the lowest floor between which there is no door."""
    pairs = [
        (a.name, b.name)
        for k, a in enumerate(rooms)
        for b in rooms[k + 1 :]
        if a.floor == b.floor == 0 and _beside(a, b)
    ]
    return pairs[int(rng.integers(len(pairs)))] if pairs and rng.random() < 0.5 else ()


def _beside(a: Room, b: Room) -> bool:
    across = min(a.north, b.north) - max(a.south, b.south) if a.east == b.west or b.east == a.west else 0.0
    along = min(a.east, b.east) - max(a.west, b.west) if a.north == b.south or b.north == a.south else 0.0
    return max(across, along) > 1.0


def _fabric(rng: np.random.Generator) -> Fabric:
    age = str(rng.choice(["old", "middle", "new"]))
    low, high = {"old": (0.0, 0.03), "middle": (0.05, 0.1), "new": (0.13, 0.2)}[age]
    glass = {"old": (2.5, 2.9), "middle": (1.6, 2.2), "new": (0.9, 1.2)}[age]

    def thick(share: float) -> float:
        return round(float(rng.uniform(low, high)) * share, 3)

    wall = str(rng.choice(["brick", "cavity", "block", "timber"]))
    return Fabric(
        wall=wall,
        partition=str(rng.choice(["brick", "stud"])),
        slab=str(rng.choice(["concrete", "joists"])),
        insulation=thick(1.0),
        roof_insulation=max(thick(1.6), 0.05),
        floor_insulation=max(thick(0.8), 0.02),
        window_u_value=round(float(rng.uniform(*glass)), 2),
        furniture=round(float(rng.uniform(0.4, 1.0)), 2),
        exterior_film=round(float(rng.uniform(12.0, 22.0)), 1),
        doorway_speed=round(float(rng.uniform(0.04, 0.15)), 3),
    )


def _heating(rng: np.random.Generator, house: House) -> Heating:
    emitter = str(rng.choice(["electric", "radiator", "floor"], p=[0.3, 0.5, 0.2]))
    control = "on_off" if rng.random() < (0.7 if emitter == "electric" else 0.35) else "proportional"
    radiant, lag = {"electric": (0.2, 600.0), "radiator": (0.3, 900.0), "floor": (0.3, 900.0)}[emitter]
    halls = [room.name for room in house.rooms if room.name in ("hall", "landing", "store", "utility")]
    bare = tuple(name for name in halls if rng.random() < 0.4)
    return Heating(
        emitter=emitter,
        radiant=round(radiant * float(rng.uniform(0.7, 1.3)), 3),
        lag=round(lag * float(rng.uniform(0.6, 1.4)), 1),
        control=control,
        band=round(float(rng.uniform(0.3, 0.9) if control == "on_off" else rng.uniform(1.5, 2.5)), 2),
        oversize=round(float(rng.uniform(1.3, 2.2)), 2),
        unheated=bare,
        meter="house" if rng.random() < 0.12 else "room",
        setback=round(float(rng.choice([0.0, 2.0, 3.0, 4.0], p=[0.15, 0.25, 0.35, 0.25])), 1),
        seed=int(rng.integers(2**31)),
    )


def _sensors(rng: np.random.Generator) -> Sensors:
    return Sensors(
        minutes=int(rng.choice([5, 10, 15])),
        temperature_noise=round(float(rng.uniform(0.03, 0.08)), 3),
        outdoor_noise=round(float(rng.uniform(0.05, 0.15)), 3),
        power_noise=round(float(rng.uniform(0.003, 0.012)), 4),
        power_resolution=float(rng.choice([1.0, 10.0])),
        counted=bool(rng.random() < 0.4),
        quality=str(rng.choice(["surveyed", "approximate", "generic"], p=[0.4, 0.4, 0.2])),
        seed=int(rng.integers(2**31)),
    )


def _climate(rng: np.random.Generator, days: int) -> Climate:
    """Draw winter or the seasons about it, warmed or cooled so that houses are heated in every place."""
    site = WEATHER_FILES[int(rng.integers(len(WEATHER_FILES)))]
    low, high = [(12, 95), (285, 365 - days)][int(rng.integers(2))]
    day = int(rng.integers(low, high + 1))
    middle = day + days / 2.0
    usual = site.mean - site.swing * np.cos(2.0 * np.pi * (middle - 20.0) / 365.0)
    start = date(climate.YEAR, 1, 1) + timedelta(days=day - 1)
    return Climate(
        source=site.source,
        seed=int(rng.integers(2**31)),
        latitude=site.latitude,
        longitude=site.longitude,
        elevation=site.elevation,
        utc_offset=site.utc_offset,
        start=start.isoformat(),
        warmer=round(float(rng.uniform(-3.0, 9.0) - usual), 2),
        swing=round(float(rng.uniform(0.85, 1.15)), 3),
    )
