"""Draws a trial from its seed: office, weather, use, and which effect it has."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta

import numpy as np

from ideal_air_trials.cuts import draw_cut
from ideal_air_trials.draw_effects import CATALOGUE, OUTSIDE_CATALOGUE, draw_effect
from ideal_air_trials.operation import draw_excitation
from ideal_air_trials.plan import Layout, glazing
from ideal_air_trials.specification import (
    BUILDING,
    CONFIRMATION,
    DAYS,
    DEVELOPMENT,
    KINDS,
    MOST_DAYS,
    OUTSIDE,
    PAIR,
    SINGLE,
    USE,
    WEATHER,
    YEAR,
    Climate,
    Fabric,
    Kind,
    Spec,
    Terminal,
    generator,
)

#: Weather files that come with EnergyPlus, by kind.
SITES = {
    "cold": (
        "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3",
        "USA_CO_Denver-Aurora-Buckley.AFB.724695_TMY3",
        "USA_IL_University.of.Illinois-Willard.AP.725315_TMY3",
        "USA_CO_Boulder-Broomfield-Jefferson.County.AP.724699_TMY3",
        "USA_CO_Colorado.Springs-Peterson.Field.724660_TMY3",
        "USA_CO_Golden-NREL.724666_TMY3",
    ),
    "mixed": (
        "USA_NJ_Newark.Intl.AP.725020_TMY3",
        "USA_VA_Sterling-Washington.Dulles.Intl.AP.724030_TMY3",
        "USA_OK_Oklahoma.City-Will.Rogers.World.AP.723530_TMY3",
    ),
    "mild": (
        "USA_CA_San.Francisco.Intl.AP.724940_TMY3",
        "USA_CA_Fresno.Air.Terminal.723890_TMY3",
    ),
    "hot": (
        "USA_AZ_Phoenix-Sky.Harbor.Intl.AP.722780_TMY3",
        "USA_NV_Las.Vegas-McCarran.Intl.AP.723860_TMY3",
        "USA_FL_Tampa.Intl.AP.722110_TMY3",
        "USA_FL_Orlando.Intl.AP.722050_TMY3",
        "USA_FL_Miami.Intl.AP.722020_TMY3",
    ),
}
#: Mondays in the middle of the seasons; telemetry begins up to three weeks earlier or later, in winter not earlier.
SEASONS = {"winter": (1, 9), "spring": (4, 3), "summer": (7, 3), "autumn": (10, 2)}
#: Floors and zones a floor of a third of the offices; the others have two floors of six.
_SMALLER = ((1, 6), (1, 5), (1, 4), (2, 5), (2, 4))
_LARGER_SHARE = 0.66
_BLANK_SHARE = 0.2  # of offices with a facade without windows
_FACADES = ("south", "north", "west", "east")
_GLAZING_ERROR = 0.04  # [-], standard deviation of the drawing's glazed areas
_UNCOATED = 0.84  # [-], emissivity of glass
#: Seeds of the order in which effects take turns, by stream and purpose.
_ORDERS = {(DEVELOPMENT, SINGLE): 77, (DEVELOPMENT, OUTSIDE): 78, (CONFIRMATION, SINGLE): 177,
           (CONFIRMATION, OUTSIDE): 178}  # fmt: skip


def draw_spec(seed: int, kind: Kind, *, confirmation: bool = False, days: int = DAYS) -> Spec:
    """Draw a trial.

    Office, weather, use and noise depend on stream and seed alone, so that the null of a seed is the twin of its single
    and of what it has outside of the catalogue. The office is one that can have the single's effect, which is one of
    its pair's.

    Parameters
    ----------
    seed : int
        Number of the trial in its stream, at least 0; effects take turns.
    kind : {"null", "single", "pair", "outside"}
        No effect, one or two of the catalogue, or one that it does not know.
    confirmation : bool
        Draw from the stream that nothing is tuned on.
    days : int
        Length of the telemetry, 1 to `MOST_DAYS` [d].

    Raises
    ------
    ValueError
        On a seed, a kind or a length that does not exist.
    """
    if kind not in KINDS or seed < 0 or not 1 <= days <= MOST_DAYS:
        raise ValueError(f"expected a seed of 0 or more, a kind of {KINDS} and 1 to {MOST_DAYS} days, "
                         f"found {seed}, {kind!r} and {days}")  # fmt: skip
    stream = CONFIRMATION if confirmation else DEVELOPMENT
    rng = generator(stream, seed, BUILDING)
    single = _turn(stream, seed, SINGLE)
    layout = _layout(rng, single)
    fabric = _fabric(rng, single)
    terminal = _terminal(rng)
    panes = sum(len(areas) for areas in glazing(layout).values())
    null = Spec(
        stream, seed, "null", days, layout, fabric, terminal,
        climate=_climate(generator(stream, seed, WEATHER)),
        excitation=draw_excitation(generator(stream, seed, USE)),
        drawing_errors=tuple(rng.normal(1.0, _GLAZING_ERROR, panes).tolist()),
    )  # fmt: skip
    if kind == "null":
        return null
    purpose = OUTSIDE if kind == "outside" else SINGLE
    first = draw_effect(_turn(stream, seed, purpose), null, generator(stream, seed, purpose))
    if kind != "pair":
        return replace(null, kind=kind, effects=(first,))
    rng = generator(stream, seed, PAIR)
    second = draw_effect(str(rng.choice([e for e in CATALOGUE if e != first.name and _can_have(null, e)])), null, rng)
    return replace(null, kind=kind, effects=tuple(sorted((first, second), key=lambda e: list(CATALOGUE).index(e.name))))


def _can_have(null: Spec, name: str) -> bool:
    """Whether an office can have an effect that it was not drawn for; thin slabs, which one takes, are."""
    return name != "interfloor_exchange" and (name != "neighbour" or null.layout.blank is not None)


def _turn(stream: int, seed: int, purpose: int) -> str:
    """Return the effect of a seed: each once in every block of as many seeds as there are effects."""
    names: list[str] = list(CATALOGUE if purpose == SINGLE else OUTSIDE_CATALOGUE)
    block, place = divmod(seed, len(names))
    order = np.random.default_rng([_ORDERS[stream, purpose], block]).permutation(len(names))
    return names[int(order[place])]


def _layout(rng: np.random.Generator, single: str) -> Layout:
    floors, zones = (2, 6) if rng.random() < _LARGER_SHARE else _SMALLER[int(rng.integers(len(_SMALLER)))]
    if single == "interfloor_exchange":
        floors = 2
    kind, (columns, rows, rectangles) = draw_cut(rng, zones)
    height = float(rng.choice([2.7, 3.0, 3.0, 3.0, 3.3, 3.6]))
    orientation = float(rng.choice([0, 0, 20, -35, 45, -15, 10, -60]))
    shares = {side: float(rng.uniform(0.12, 0.42)) for side in _FACADES}
    has_blank = rng.random() < _BLANK_SHARE or single == "neighbour"
    facade = _FACADES[int(rng.integers(len(_FACADES)))]
    if has_blank:
        shares[facade] = 0.0
    return Layout(kind, columns, rows, rectangles, floors, height, orientation, shares, facade if has_blank else None)


def _fabric(rng: np.random.Generator, single: str) -> Fabric:
    gap, coated, emissivity = float(rng.uniform(0.006, 0.016)), rng.random() < 0.5, float(rng.uniform(0.06, 0.2))
    wall = str(rng.choice(["brick_veneer", "light", "concrete_outside", "block_inside"]))
    wall_resistance = float(rng.uniform(1.2, 4.0))
    partition, partition_thickness = str(rng.choice(["stud", "stud", "block"])), float(rng.uniform(0.08, 0.14))
    if partition == "block":
        partition_thickness = float(np.clip(partition_thickness, 0.08, 0.11))
    slab, conductivity = float(rng.uniform(0.09, 0.125)), float(rng.uniform(1.4, 1.9))
    density = float(rng.uniform(1900.0, 2300.0))
    carpet, tile = float(rng.uniform(0.01, 0.07)), float(rng.uniform(0.01, 0.09))
    if single == "interfloor_exchange":
        slab = 0.08 + 0.4 * (slab - 0.09)  # thin enough for the transfer functions of a whole slab
    return Fabric(
        wall, wall_resistance, partition, partition_thickness, slab, conductivity, density, carpet, tile, gap,
        emissivity=emissivity if coated else _UNCOATED,
        air_multiplier=float(rng.uniform(1.0, 2.0)),
        inside_convection=str(rng.choice(["TARP", "TARP", "TARP", "AdaptiveConvectionAlgorithm"])),
        outside_convection=str(rng.choice(["DOE-2", "DOE-2", "TARP", "MoWiTT"])),
        terrain=str(rng.choice(["Suburbs", "Suburbs", "City", "Country"])),
    )  # fmt: skip


def _terminal(rng: np.random.Generator) -> Terminal:
    return Terminal(
        heating_power=float(rng.uniform(60.0, 110.0)),
        cooling_power=float(rng.uniform(60.0, 100.0)),
        heating_temperature=float(np.round(rng.uniform(32.0, 40.0), 1)),
        cooling_temperature=float(np.round(rng.uniform(12.5, 15.5), 1)),
    )


def _climate(rng: np.random.Generator) -> Climate:
    kind = list(SITES)[int(rng.integers(len(SITES)))]
    source = str(rng.choice(SITES[kind]))
    season = list(SEASONS)[int(rng.integers(len(SEASONS)))]
    weeks = int(rng.integers(0 if season == "winter" else -3, 4))
    start = date(YEAR, *SEASONS[season]) + timedelta(weeks=weeks)
    warmer, wind = float(rng.uniform(-2.5, 2.5)), float(rng.uniform(0.7, 1.2))
    return Climate(source, kind, season, start.isoformat(), warmer, wind)
