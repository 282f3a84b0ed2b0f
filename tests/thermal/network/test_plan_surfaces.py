"""Networks of floor plans against a model written down cell by cell, with a node a surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import Building, FloorPlan, FloorPlans, SymbolicModel, ThermalNetwork, build_network
from thermal.case.building import Location
from thermal.case.plan import zone_floor_areas
from thermal.units import air_density

FloatArray = NDArray[np.float64]

SITE = Location(latitude=42.0, longitude=-88.0, elevation=120.0, timezone="Etc/GMT+6")
AIR = air_density(120.0) * 1006.0  # J/m3/K
TWO_ROOMS = ("#######", "#AA+BB#", "#AA+BB#", "#######")
# a partition that touches three zones and another exterior wall inside the plan; a stub of partition to the outside
JUNCTION = (".......", "######.", "#AAAA#.", "#B+CC#.", "#BB#C+.", "######.", ".......")


def plan(*rows: str, name: str = "F1", height: float = 3.0) -> FloorPlan:
    return FloorPlan(name, height, np.array([list(row) for row in rows]))


def building(
    *floors: FloorPlan,
    cell: float = 1.0,
    glazing: Mapping[str, Mapping[str, float]] | None = None,
    orientation: float = 0.0,
) -> Building:
    return Building("test", SITE, orientation, FloorPlans(cell, floors, glazing or {}))


def some_theta(network: ThermalNetwork) -> FloatArray:
    """Values away from the starts, so that no two parameters cancel."""
    rng = np.random.default_rng(11)
    return np.array(
        [p.inverse(p.transform(p.start) + 0.7 * p.prior_deviation * rng.standard_normal()) for p in network.parameters]
    )


class Explicit:
    """Nodes by name joined by conductances; every surface is a node of its own."""

    def __init__(self) -> None:
        self.index: dict[Any, int] = {}
        self.joined: list[tuple[int, int, float]] = []
        self.heat: dict[int, float] = {}

    def node(self, name: Any) -> int:
        return self.index.setdefault(name, len(self.index))

    def join(self, a: Any, b: Any, conductance: float) -> None:
        self.joined.append((self.node(a), self.node(b), conductance))

    def store(self, name: Any, heat: float) -> None:
        self.heat[self.node(name)] = self.heat.get(self.node(name), 0.0) + heat

    def transfer(self, s: float, weights: Mapping[Any, Mapping[Any, float]], boundaries: Sequence[Any]) -> FloatArray:
        """Zone means per watt in each zone and per kelvin of each boundary, at the Laplace variable s."""
        n = len(self.index)
        laplacian = np.zeros((n, n))
        for a, b, g in self.joined:
            laplacian[[a, b, a, b], [a, b, b, a]] += [g, g, -g, -g]
        for i, heat in self.heat.items():
            laplacian[i, i] += s * heat
        out = [self.index[b] for b in boundaries]
        free = [i for i in range(n) if i not in out]
        observe = np.zeros((len(weights), n))
        for z, shares in enumerate(weights.values()):
            for name, share in shares.items():
                observe[z, self.index[name]] = share
        inputs = np.hstack([observe.T[free], -laplacian[np.ix_(free, out)]])
        return np.asarray(observe[:, free] @ np.linalg.solve(laplacian[np.ix_(free, free)], inputs))


SIDES = {"north": (-1, 0), "south": (1, 0), "west": (0, -1), "east": (0, 1)}
OPPOSITE = {"south": "north", "east": "west"}


class ExplicitPlan:
    """The equations of docs/model.md for one floor, written down cell by cell and surface by surface."""

    def __init__(self, plans: FloorPlans, split: int, values: Mapping[str, float]) -> None:
        floor = plans.floors[0]
        tokens = np.kron(np.arange(floor.tokens.size).reshape(floor.tokens.shape), np.ones((split, split), dtype=int))
        self.cells = {
            (int(r), int(c)): str(floor.tokens.ravel()[i])
            for (r, c), i in np.ndenumerate(tokens)
            if floor.tokens.ravel()[i] != "."
        }
        self.v, self.model, self.height = values, Explicit(), floor.height
        self.cell, self.wall = plans.cell_size / split, plans.cell_size
        self.face, self.half = self.cell * self.height, self.cell / 2
        self.solid = {"#": self.wall / 0.15, "+": values.get("interior_wall_conductivity", np.nan)}
        self.zones = {z: [at for at, token in self.cells.items() if token == z] for z in floor.zone_names}
        self.opaque: dict[tuple[tuple[int, int], str], float] = {}
        for zone, by_side in plans.glazing.items():
            for side, area in by_side.items():
                self.window(zone, side, area)
        for at in self.cells:
            self.faces(at)
            self.wall_mass(at)
        for zone, area in zone_floor_areas(plans).items():
            self.room(zone, area)

    def surface(self, name: Any, at: Any, zone: str, area: float, behind: Any, conductance: float) -> None:
        """A massless surface between air, radiant node and what is behind it."""
        self.model.join((name, at), at, self.v["interior_film_coefficient"] * area)
        self.model.join((name, at), ("radiant", zone), self.v["radiant_coefficient"] * area)
        self.model.join((name, at), behind, conductance * area)

    def window(self, zone: str, side: str, area: float) -> None:
        dr, dc = SIDES[side]
        facing = [(r, c) for r, c in self.zones[zone] if self.cells.get((r + dr, c + dc)) == "#"]
        pane = 1.0 / (1.0 / self.v["window_u_value"] - 1.0 / 7.7)
        for r, c in facing:
            self.surface(f"glass {side}", (r, c), zone, area / len(facing), "outdoor", pane)
            k = 1
            while self.cells.get((r + k * dr, c + k * dc)) == "#":
                self.opaque[(r + k * dr, c + k * dc), side] = 1.0 - area / (len(facing) * self.face)
                k += 1

    def faces(self, at: tuple[int, int]) -> None:
        token = self.cells[at]
        for side, (dr, dc) in SIDES.items():
            there = (at[0] + dr, at[1] + dc)
            other = self.cells.get(there, ".")
            if token in self.zones and other in self.solid:
                area = self.face * self.opaque.get((there, side), 1.0)
                self.surface(f"wall {side}", at, token, area, there, self.solid[other] / self.half)
            elif token in self.solid and other == ".":
                insulation = self.wall / self.v["exterior_wall_conductivity"] if token == "#" else 0.0
                film = 1.0 / self.v["exterior_convection_coefficient"]
                area = self.face * self.opaque.get((at, side), 1.0)
                self.model.join(at, "outdoor", area / (film + insulation + self.half / self.solid[token]))
            elif side in ("south", "east") and token in self.solid and other in self.solid:
                both = [
                    (self.opaque.get((at, s), 1.0), self.opaque.get((there, s), 1.0)) for s in (side, OPPOSITE[side])
                ]
                area = self.face * min(max(pair) for pair in both)  # glass stands in a wall of several cells' depth
                self.model.join(at, there, area / (self.half / self.solid[token] + self.half / self.solid[other]))
            elif side in ("south", "east") and token == other:
                self.model.join(at, there, 0.026 * self.height)

    def wall_mass(self, at: tuple[int, int]) -> None:
        token = self.cells[at]
        if token in self.solid:
            heat = (
                150.0 * self.v["exterior_wall_heat_capacity"]
                if token == "#"
                else 60.0 * self.v["interior_wall_heat_capacity"]
            )
            left = min(self.opaque.get((at, side), 1.0) for side in SIDES)
            self.model.store(at, heat / self.wall * self.cell**2 * self.height * left)

    def room(self, zone: str, area: float) -> None:
        v, model, count = self.v, self.model, len(self.zones[zone])
        film, radiation = v["interior_film_coefficient"], v["radiant_coefficient"]
        p = v.get("shuffle_probability", 0.0)
        rate = (1.0 - (1.0 - p) * np.exp(-p)) / 300.0
        furniture = v["furniture_coupling"] * area / (film + radiation)
        model.store(("furniture", zone), v["furniture_heat_capacity"] * area)
        model.join(("furniture", zone), ("radiant", zone), furniture * radiation)
        for k in (0, 1):
            model.store(("slab", zone, k), v["slab_heat_capacity"] * area)
        model.join(("slab", zone, 0), ("slab", zone, 1), 2 * v["slab_coupling"] * 2 * area)
        for at in self.zones[zone]:
            model.store(at, AIR * area * self.height / count)
            model.join(("furniture", zone), at, furniture * film / count)
            self.surface("slab", at, zone, 2 * area / count, ("slab", zone, 0), 4 * v["slab_coupling"])
            if count > 1:
                model.join(("star", zone), at, rate * AIR * area * self.height / count)

    def transfer(self, s: float) -> FloatArray:
        weights = {z: {at: 1.0 / len(mine) for at in mine} for z, mine in self.zones.items()}
        return self.model.transfer(s, weights, ["outdoor"])


def transfer_of(network: ThermalNetwork, theta: FloatArray, s: float) -> FloatArray:
    m = SymbolicModel(network).matrices(theta)
    system = (m.flow[:, : m.n] + s * m.capacity).toarray()
    inputs = np.hstack([m.heating.toarray(), -m.flow[:, m.n :].toarray()])
    return np.asarray(m.observation @ np.linalg.solve(system, inputs))


EXPLICIT = {
    "two rooms": (building(plan(*TWO_ROOMS), glazing={"A": {"south": 2.0, "west": 1.5}}), 1),
    "two rooms, refined": (building(plan(*TWO_ROOMS), glazing={"A": {"south": 2.0, "west": 1.5}}), 2),
    "junctions": (
        building(plan(*JUNCTION, height=2.6), cell=0.7, glazing={"A": {"north": 4.0}, "C": {"east": 1.0}}),
        1,
    ),
    "junctions, refined": (building(plan(*JUNCTION, height=2.6), cell=0.7, glazing={"A": {"north": 4.0}}), 3),
}


@pytest.mark.parametrize("name", EXPLICIT)
def test_network_is_the_model_with_every_surface_a_node(name: str) -> None:
    """Transfer functions at several frequencies: elimination of surfaces, areas, masses, films, wherever walls meet."""
    house, split = EXPLICIT[name]
    plans = house.geometry
    assert isinstance(plans, FloorPlans)
    network = build_network(house, dx=plans.cell_size / split)
    theta = some_theta(network)
    values = {p.name: t for p, t in zip(network.parameters, theta, strict=True)}
    model = ExplicitPlan(plans, split, values)
    for s in (0.0, 1e-6, 1e-4, 1e-2):
        np.testing.assert_allclose(transfer_of(network, theta, s), model.transfer(s), rtol=1e-9)
