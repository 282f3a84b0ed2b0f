"""Twenty-eight small buildings whose components are drawn at random: four of each thing that heats or cools."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from energyplus_trials.frame import Objects

from foreign_models.flats import Flat, flats
from foreign_models.flats import description as of_flats
from foreign_models.foreign_plant import ForeignPlant
from foreign_models.heat_pump import Chiller, HeatPump
from foreign_models.house import House, house
from foreign_models.house import description as of_house
from foreign_models.objects import Fabric
from foreign_models.office import Office, office
from foreign_models.office import description as of_office
from foreign_models.radiators import Dwelling, dwelling
from foreign_models.radiators import description as of_dwelling
from foreign_models.rooms import Rooms
from foreign_models.shop import Shop, shop
from foreign_models.shop import description as of_shop

#: Stream of random numbers, and buildings of each kind.
SEED, EACH = 2025, 4

#: Places with winters, of those that EnergyPlus brings.
PLACES = (
    "USA_VA_Sterling-Washington.Dulles.Intl.AP.724030_TMY3", "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3",
    "USA_CO_Golden-NREL.724666_TMY3", "USA_NJ_Newark.Intl.AP.725020_TMY3",
)  # fmt: skip


#: Places with summers.
HOT = (
    "USA_AZ_Phoenix-Sky.Harbor.Intl.AP.722780_TMY3", "USA_FL_Tampa.Intl.AP.722110_TMY3",
    "USA_CA_Fresno.Air.Terminal.723890_TMY3", "USA_OK_Oklahoma.City-Will.Rogers.World.AP.723530_TMY3",
    "USA_VA_Sterling-Washington.Dulles.Intl.AP.724030_TMY3",
)  # fmt: skip


def drawn_plants() -> dict[str, ForeignPlant]:
    """Draw the buildings by name; the same whatever is done with them."""
    found = {}
    cooled = [_cooled_shop, _cooled_office]
    for number, draw in enumerate([_house, _flats, _shop] * EACH + [_office, _dwelling] * EACH + cooled * EACH):
        rng = np.random.default_rng([SEED, number])
        about, model, description = draw(rng)
        place = str(rng.choice(HOT if draw in cooled else PLACES))
        found[f"drawn_{number + 1}"] = ForeignPlant(about, model, description, place, draw in cooled)
    return found


_Parts = tuple[str, Callable[[], Objects], Callable[[], dict[str, Any]]]


def _fabric(rng: np.random.Generator) -> Fabric:
    """Draw a fabric: of the seventies to that of today."""
    wall = float(rng.uniform(0.04, 0.16))
    glass = (float(rng.uniform(1.1, 2.6)), float(rng.uniform(0.35, 0.65)))
    leaks, heavy = float(rng.uniform(0.2, 0.7)), bool(rng.random() < 0.5)
    return Fabric(wall, 1.5 * wall, wall, glass, leaks, heavy, float(rng.uniform(1.0, 4.0)))


def _loss(fabric: Fabric, area: float, envelope: float, glass: float, height: float) -> float:
    """Heat that a building loses at 35 K, walls, glass and air [W]."""
    walls = 0.035 / fabric.wall * envelope + fabric.glass[0] * glass
    return 35.0 * (walls + 0.33 * fabric.air_changes * area * height)


def _gain(fabric: Fabric, area: float, envelope: float, glass: float, height: float, inside: float) -> float:
    """Heat that a building gains while it is 12 K warmer outdoors, with sun on a third of its glass [W]."""
    return 12.0 / 35.0 * _loss(fabric, area, envelope, glass, height) + 600.0 * fabric.glass[1] * glass / 3.0 + inside


def _heat_pump(rng: np.random.Generator, need: float, times: tuple[float, float]) -> HeatPump:
    """Draw a heat pump of some times what a building needs [W]."""
    return HeatPump(
        round(need * float(rng.uniform(*times)), -2), float(rng.uniform(3.5, 4.8)), float(rng.uniform(0.1, 0.5)),
        float(rng.uniform(0.2, 0.4)),
    )  # fmt: skip


def _house(rng: np.random.Generator) -> _Parts:
    """Draw a house with a heated floor."""
    fabric, length, width = _fabric(rng), float(rng.uniform(9.0, 16.0)), float(rng.uniform(8.0, 13.0))
    south = float(rng.uniform(0.04, 0.1)) * length * width
    need = _loss(fabric, length * width, 2.0 * length * width + 5.4 * (length + width), 1.75 * south, 2.7)
    machine = _heat_pump(rng, need, (1.2, 1.8))
    of = House(fabric, length, width, south=south, machine=machine, people=float(rng.integers(1, 6)),
               appliances=float(rng.uniform(100.0, 500.0)))  # fmt: skip
    about = f"House of {of.area:.0f} m2, heated floor, heat pump of {machine.capacity / 1e3:.1f} kW"
    return about, partial(house, of), partial(of_house, of)


def _flats(rng: np.random.Generator) -> _Parts:
    """Draw one to three flats with baseboards."""
    fabric, listed = _fabric(rng), {}
    need = _loss(fabric, 70.0, 40.0, 12.0, 2.6)
    for k in range(int(rng.integers(1, 4))):
        begin = int(rng.integers(6, 10))
        out = (begin, begin + int(rng.integers(0, 12)))
        power = round(need * float(rng.uniform(1.3, 2.0)), -2)
        listed[f"FLAT_{k + 1}"] = Flat(float(rng.integers(1, 5)), power, out, float(rng.uniform(60.0, 250.0)))
    watts = sum(flat.power for flat in listed.values())
    about = f"{'Flat' if len(listed) == 1 else f'{len(listed)} flats'} of 70 m2, baseboards of {watts / 1e3:.1f} kW"
    return about, partial(flats, listed, fabric), partial(of_flats, listed)


def _shop_of(rng: np.random.Generator) -> Shop:
    """Draw a shop."""
    fabric, length, depth = _fabric(rng), float(rng.uniform(8.0, 20.0)), float(rng.uniform(8.0, 14.0))
    height, opens = float(rng.uniform(2.8, 4.0)), (int(rng.integers(6, 11)), int(rng.integers(17, 22)))
    glass = float(rng.uniform(0.2, 0.34)) * length * height
    need = _loss(fabric, length * depth, 2.0 * length * depth + 2.0 * length * height, glass, height)
    capacity, resistance = (round(need * float(rng.uniform(*of)), -2) for of in ((1.2, 2.0), (0.3, 0.8)))
    return Shop(fabric, length, depth, height, glass, float(rng.integers(2, 12)), float(rng.uniform(200.0, 900.0)),
                capacity, resistance, opens)  # fmt: skip


def _shop(rng: np.random.Generator) -> _Parts:
    """Draw a shop with a unitary heat pump."""
    of = _shop_of(rng)
    about = f"Shop of {of.area:.0f} m2, unitary heat pump of {of.capacity / 1e3:.1f} kW"
    return about, partial(shop, of), partial(of_shop, of)


def _cooled_shop(rng: np.random.Generator) -> _Parts:
    """Draw a shop that its unitary heat pump cools."""
    of = _shop_of(rng)
    walls = 2.0 * of.area + 2.0 * of.length * of.height
    need = _gain(of.fabric, of.area, walls, of.glass, of.height, 75.0 * of.people + of.appliances)
    of = replace(of, cooled=True, capacity=round(need * float(rng.uniform(1.2, 2.0)), -2))
    about = f"Shop of {of.area:.0f} m2 in summer, unitary heat pump of {of.capacity / 1e3:.1f} kW"
    return about, partial(shop, of), partial(of_shop, of)


def _rooms(rng: np.random.Generator, long: tuple[float, float], height: tuple[float, float]) -> Rooms:
    """Draw two to six rooms, whose sides are within `long` and whose heights are within `height` [m]."""
    columns, rows = ((2, 1), (3, 1), (1, 2), (2, 2), (3, 2))[int(rng.integers(5))]
    length, depth, tall = (round(float(rng.uniform(*of)), 1) for of in (long, long, height))
    share = float(rng.uniform(0.15, 0.35))
    return Rooms(columns, rows, length, depth, tall, (share * length * tall, share * depth * tall))


def _loss_of(fabric: Fabric, rooms: Rooms) -> float:
    """Heat that rooms on the ground and under the roof lose at 35 K [W]."""
    area, (walls, glass) = len(rooms.names) * rooms.area, rooms.outer
    return _loss(fabric, area, 2.0 * area + walls - glass, glass, rooms.height)


def _office_of(rng: np.random.Generator) -> Office:
    """Draw an office."""
    fabric, rooms = _fabric(rng), _rooms(rng, (7.0, 14.0), (2.7, 3.4))
    count, need = len(rooms.names), _loss_of(fabric, rooms)
    coil = round(need / count * float(rng.uniform(1.5, 2.5)), -2)
    machine = _heat_pump(rng, need, (1.7, 2.4))
    begin = int(rng.integers(6, 10))
    return Office(fabric, rooms, machine, coil, round(rooms.area / float(rng.uniform(10.0, 25.0))),
                  rooms.area * float(rng.uniform(1.0, 5.0)), (begin, begin + int(rng.integers(8, 12))))  # fmt: skip


def _told(of: Office) -> str:
    count = len(of.rooms.names)
    return f"Office of {count * of.rooms.area:.0f} m2, {count} fan coils of {of.coil / 1e3:.1f} kW"


def _office(rng: np.random.Generator) -> _Parts:
    """Draw an office with fan coils on one heat pump."""
    of = _office_of(rng)
    about = f"{_told(of)}, heat pump of {of.machine.capacity / 1e3:.1f} kW"
    return about, partial(office, of), partial(of_office, of)


def _cooled_office(rng: np.random.Generator) -> _Parts:
    """Draw an office whose fan coils one chiller cools."""
    of = _office_of(rng)
    count, (walls, glass) = len(of.rooms.names), of.rooms.outer
    area, inside = count * of.rooms.area, count * (75.0 * of.people + of.appliances)
    need = _gain(of.fabric, area, area + walls - glass, glass, of.rooms.height, inside)
    coil = round(need / count * float(rng.uniform(1.5, 2.5)), -2)
    chiller = Chiller(
        round(need * float(rng.uniform(1.3, 2.0)), -2), float(rng.uniform(2.6, 3.6)), float(rng.uniform(0.1, 0.4)),
        float(rng.uniform(0.2, 0.4)),
    )  # fmt: skip
    of = replace(of, coil=coil, chiller=chiller)
    about = f"{_told(of)} in summer, chiller of {chiller.capacity / 1e3:.1f} kW"
    return about, partial(office, of), partial(of_office, of)


def _dwelling(rng: np.random.Generator) -> _Parts:
    """Draw a dwelling with radiators on a gas boiler."""
    fabric, rooms = _fabric(rng), _rooms(rng, (3.5, 6.5), (2.4, 2.9))
    count, need = len(rooms.names), _loss_of(fabric, rooms)
    radiator = round(need / count * float(rng.uniform(1.3, 2.0)), -2)
    boiler = round(need * float(rng.uniform(1.1, 2.0)), -2)
    begin = int(rng.integers(6, 10))
    of = Dwelling(fabric, rooms, radiator, boiler, float(rng.integers(1, 3)), float(rng.uniform(30.0, 120.0)),
                  (begin, begin + int(rng.integers(0, 10))))  # fmt: skip
    about = (f"Dwelling of {count * rooms.area:.0f} m2, {count} rooms with radiators of {radiator / 1e3:.1f} kW, "
             f"gas boiler of {boiler / 1e3:.1f} kW")  # fmt: skip
    return about, partial(dwelling, of), partial(of_dwelling, of)
