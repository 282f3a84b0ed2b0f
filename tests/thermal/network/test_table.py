"""Networks of zone tables: against a model with every surface a node, and each kind of surface by hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import Building, SymbolicModel, ThermalNetwork, ZoneTable, build_network
from thermal.case.building import Airflow, Layer, Location, Surface, ZoneEntry
from thermal.errors import ThermalError
from thermal.units import air_density

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")
AIR = air_density(690.0) * 1006.0  # J/m3/K


def layer(thickness: float, conductivity: float, density: float, heat_capacity: float) -> Layer:
    return Layer(thickness=thickness, conductivity=conductivity, density=density, heat_capacity=heat_capacity)


CONSTRUCTIONS = {
    "outer": (layer(0.02, 0.7, 1400.0, 900.0), layer(0.3, 0.4, 900.0, 1000.0), layer(0.1, 0.035, 20.0, 1450.0)),
    "inner": (layer(0.1, 0.33, 1000.0, 1000.0),),
    "slab": (layer(0.05, 1.4, 2000.0, 1000.0), layer(0.2, 2.1, 2400.0, 1000.0)),
}
SURFACES: dict[str, dict[str, Any]] = {
    "W1": {"kind": "wall", "zone": "room", "other": "outdoor", "area": 12.0, "azimuth": 180.0, "construction": "outer"},
    "W2": {"kind": "wall", "zone": "hall", "other": "outdoor", "area": 7.0, "azimuth": 0.0, "construction": "outer"},
    "I1": {"kind": "wall", "zone": "room", "other": "hall", "area": 9.0, "construction": "inner"},
    "M1": {"kind": "wall", "zone": "hall", "other": "hall", "area": 4.0, "construction": "inner"},
    "F1": {"kind": "floor", "zone": "room", "other": "ground", "area": 20.0, "construction": "slab"},
    "F2": {"kind": "floor", "zone": "hall", "other": "cellar", "area": 10.0, "construction": "slab"},
    "C1": {"kind": "ceiling", "zone": "room", "other": "attic", "area": 20.0, "construction": "slab"},
    "R1": {"kind": "ceiling", "zone": "hall", "other": "outdoor", "area": 10.0, "construction": "slab"},
    "G1": {"kind": "window", "zone": "room", "other": "outdoor", "area": 3.0, "azimuth": 180.0, "u_value": 1.1,
           "solar_transmittance": 0.5},
    "G2": {"kind": "window", "zone": "hall", "other": "attic", "area": 1.0, "u_value": 1.9, "solar_transmittance": 0.5},
    "G3": {"kind": "window", "zone": "room", "other": "hall", "area": 1.5, "u_value": 2.2, "solar_transmittance": 0.5},
    "B1": {"kind": "bridge", "zone": "room", "other": "outdoor", "area": 2.0, "u_value": 0.7},
    "B2": {"kind": "bridge", "zone": "hall", "other": "room", "area": 1.0, "u_value": 0.4},
    "O1": {"kind": "opening", "zone": "room", "other": "hall", "area": 1.9},
}  # fmt: skip


def house(*names: str, airflows: tuple[Airflow, ...] = ()) -> Building:
    """Two rooms with the surfaces named; all when none is."""
    surfaces = tuple(Surface(name=n, **SURFACES[n]) for n in (names or SURFACES))
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0), ZoneEntry(name="hall", volume=26.0, floor_area=10.0))
    return Building("test", SITE, 0.0, ZoneTable(zones, surfaces, CONSTRUCTIONS), airflows=airflows)


def some_theta(network: ThermalNetwork) -> FloatArray:
    """Values away from the starts, so that no two parameters cancel."""
    rng = np.random.default_rng(5)
    z = [p.transform(p.start) + 0.7 * p.prior_deviation * rng.standard_normal() for p in network.parameters]
    return np.array([p.inverse(v) for p, v in zip(network.parameters, z, strict=True)])


def transfer_of(network: ThermalNetwork, theta: FloatArray, s: float) -> FloatArray:
    """Zone means per watt in each zone and per kelvin of each boundary, at the Laplace variable s."""
    m = SymbolicModel(network).matrices(theta)
    system = (m.flow[:, : m.n] + s * m.capacity).toarray()
    inputs = np.hstack([m.heating.toarray(), -m.flow[:, m.n :].toarray()])
    return np.asarray(m.observation @ np.linalg.solve(system, inputs))


class ExplicitTable:
    """The equations of docs/model.md for a zone table, every surface a node of its own."""

    def __init__(self, building: Building, values: Mapping[str, float], chains: Mapping[str, list[int]]) -> None:
        self.index: dict[Any, int] = {}
        self.joined: list[tuple[int, int, float]] = []
        self.heat: dict[int, float] = {}
        self.v, self.building, self.chains = values, building, chains
        table = building.geometry
        assert isinstance(table, ZoneTable)
        self.table = table
        self.zones = [z.name for z in table.zones]
        for zone in table.zones:
            film, radiation = values["interior_film_coefficient"], values["radiant_coefficient"]
            furniture = values["furniture_coupling"] * zone.floor_area / (film + radiation)
            self.store(zone.name, AIR * zone.volume)
            self.store(("furniture", zone.name), values["furniture_heat_capacity"] * zone.floor_area)
            self.join(("furniture", zone.name), zone.name, furniture * film)
            self.join(("furniture", zone.name), ("radiant", zone.name), furniture * radiation)
        for surface in table.surfaces:
            getattr(self, surface.kind if surface.kind in ("window", "bridge", "opening") else "layers")(surface)

    def node(self, name: Any) -> int:
        return self.index.setdefault(name, len(self.index))

    def join(self, a: Any, b: Any, conductance: float) -> None:
        self.joined.append((self.node(a), self.node(b), conductance))

    def store(self, name: Any, heat: float) -> None:
        self.heat[self.node(name)] = heat

    def face(self, name: Any, zone: str, area: float, behind: Any, conductance: float) -> None:
        self.join(name, zone, self.v["interior_film_coefficient"] * area)
        self.join(name, ("radiant", zone), self.v["radiant_coefficient"] * area)
        self.join(name, behind, conductance * area)

    def opening(self, s: Surface) -> None:
        self.join(s.zone, s.other, self.v["opening_exchange_velocity"] * AIR * s.area)

    def bridge(self, s: Surface) -> None:
        self.join(s.zone, s.other, float(s.u_value or 0.0) * s.area)

    def window(self, s: Surface) -> None:
        rated, multiplier = float(s.u_value or 0.0), self.v["window_conductance_multiplier"]
        if s.other in self.zones:
            self.join(s.zone, s.other, multiplier * rated * s.area)
            return
        outer = 1.0 / self.v["exterior_convection_coefficient"] if s.other == "outdoor" else 0.13
        pane = (1.0 / rated - 1.0 / 7.7 - 1.0 / 25.0) / multiplier
        self.face(s.name, s.zone, s.area, s.other, 1.0 / (pane + outer))

    def layers(self, s: Surface) -> None:
        group = "slab" if s.kind != "wall" else "exterior_wall" if s.other == "outdoor" else "interior_wall"
        conduct, store = (self.v[f"{group}_{k}_multiplier"] for k in ("conductivity", "heat_capacity"))
        cuts: list[tuple[float, float]] = []
        for part, count in zip(
            self.table.constructions[str(s.construction)], self.chains[str(s.construction)], strict=True
        ):
            thickness = part.thickness / count
            cuts += [
                (thickness / part.conductivity / conduct, thickness * part.density * part.heat_capacity * store)
            ] * count
        for k, (_, heat) in enumerate(cuts):
            self.store((s.name, k), heat * s.area)
        for k in range(len(cuts) - 1):
            self.join((s.name, k), (s.name, k + 1), s.area / (0.5 * cuts[k][0] + 0.5 * cuts[k + 1][0]))
        last, end = (s.name, len(cuts) - 1), 0.5 * cuts[-1][0]
        self.face((s.name, "near"), s.zone, s.area, (s.name, 0), 2.0 / cuts[0][0])
        if s.other in self.zones:
            self.face((s.name, "far"), s.other, s.area, last, 1.0 / end)
        elif s.other == "outdoor":
            self.join(last, "outdoor", s.area / (end + 1.0 / self.v["exterior_convection_coefficient"]))
        elif s.other != "ground":
            self.join(last, s.other, s.area / (end + 0.13))

    def transfer(self, s: float) -> FloatArray:
        n = len(self.index)
        laplacian = np.zeros((n, n))
        for a, b, g in self.joined:
            laplacian[[a, b, a, b], [a, b, b, a]] += [g, g, -g, -g]
        for i, heat in self.heat.items():
            laplacian[i, i] += s * heat
        out = [self.index[b] for b in ("outdoor", *self.building.measured_boundaries)]
        free = [i for i in range(n) if i not in out]
        zones = [free.index(self.index[z]) for z in self.zones]
        inputs = np.hstack([np.eye(len(free))[:, zones], -laplacian[np.ix_(free, out)]])
        return np.asarray(np.linalg.solve(laplacian[np.ix_(free, free)], inputs)[zones])


# sublayers of each layer: its thickness over sqrt(k / (rho c) * 1800 s), rounded up
CHAINS = {"outer": [1, 11, 3], "inner": [5], "slab": [2, 6]}


def test_sublayers_resolve_half_an_hour() -> None:
    for name, counts in CHAINS.items():
        depths = [np.sqrt(p.conductivity / p.density / p.heat_capacity * 1800.0) for p in CONSTRUCTIONS[name]]
        assert counts == [int(np.ceil(p.thickness / d)) for p, d in zip(CONSTRUCTIONS[name], depths, strict=True)]


def test_network_is_the_model_with_every_surface_a_node() -> None:
    """Transfer functions at several frequencies; the explicit model is worked out surface by surface in the test."""
    building = house()
    network = build_network(building)
    assert network.boundaries == ("outdoor", "cellar", "attic")
    theta = some_theta(network)
    values = {p.name: t for p, t in zip(network.parameters, theta, strict=True)}
    model = ExplicitTable(building, values, CHAINS)
    for s in (0.0, 1e-6, 1e-4, 1e-2):
        np.testing.assert_allclose(transfer_of(network, theta, s), model.transfer(s), rtol=1e-9)


@pytest.mark.parametrize("name", sorted(SURFACES))
def test_each_surface_alone_is_the_explicit_one(name: str) -> None:
    building = house(name, *(["W1"] if name != "W1" else []))
    network = build_network(building)
    theta = some_theta(network)
    values = {p.name: t for p, t in zip(network.parameters, theta, strict=True)}
    model = ExplicitTable(building, values, CHAINS)
    np.testing.assert_allclose(transfer_of(network, theta, 1e-4), model.transfer(1e-4), rtol=1e-9)


def steady_exchange(network: ThermalNetwork, theta: FloatArray, boundary: str) -> float:
    """Heat to a boundary at 0 with all air and radiant nodes at 1 K [W/K]."""
    m = SymbolicModel(network).matrices(theta)
    room = np.isin(network.kind, ("air", "radiant"))
    stiffness = m.flow[:, : m.n].toarray()
    states = np.ones(m.n)
    states[~room] = np.linalg.solve(stiffness[np.ix_(~room, ~room)], -stiffness[np.ix_(~room, room)].sum(axis=1))
    return float(-(m.flow[:, m.n :].toarray()[:, network.boundaries.index(boundary)] @ states))


RATED_FILMS = {"interior_film_coefficient": 2.7, "radiant_coefficient": 5.0, "exterior_convection_coefficient": 25.0}


def test_window_at_rated_films_has_its_rated_u_value() -> None:
    """A room at one temperature, 7.7 W/m2/K inside and 25 outside: exactly u_value times area."""
    network = build_network(house("G1"))
    assert steady_exchange(network, network.values(RATED_FILMS), "outdoor") == pytest.approx(3.0 * 1.1, rel=1e-12)


def test_window_to_a_boundary_has_its_film_instead_of_the_outer_one() -> None:
    network = build_network(house("G2"))
    inside = {k: v for k, v in RATED_FILMS.items() if not k.startswith("exterior")}
    u_value = 1.0 / (1.0 / 1.9 - 1.0 / 25.0 + 0.13)
    assert steady_exchange(network, network.values(inside), "attic") == pytest.approx(u_value, rel=1e-12)


@pytest.mark.parametrize(("name", "area"), [("W1", 12.0), ("R1", 10.0)])
def test_wall_at_rated_films_has_the_u_value_of_its_layers(name: str, area: float) -> None:
    """Two layers or three in series with both films, hand-worked: no sublayer changes the resistance."""
    network = build_network(house(name))
    layers = CONSTRUCTIONS[SURFACES[name]["construction"]]
    u_value = 1.0 / (1.0 / 7.7 + sum(p.thickness / p.conductivity for p in layers) + 1.0 / 25.0)
    assert steady_exchange(network, network.values(RATED_FILMS), "outdoor") == pytest.approx(area * u_value, rel=1e-12)


def test_surface_to_ground_is_mass_with_an_adiabatic_back() -> None:
    building = house("F1", "B1")
    network = build_network(building)
    assert network.boundaries == ("outdoor",)
    assert steady_exchange(network, network.start(), "outdoor") == pytest.approx(2.0 * 0.7, rel=1e-12)
    heat = SymbolicModel(network).matrices(network.start()).capacity.diagonal()[network.kind == "slab"].sum()
    assert heat == pytest.approx(20.0 * (0.05 * 2000.0 + 0.2 * 2400.0) * 1000.0, rel=1e-12)


def test_heat_capacity_is_that_of_the_layers_and_the_air() -> None:
    network = build_network(house())
    heat = SymbolicModel(network).matrices(network.start()).capacity.diagonal()
    outer = 0.02 * 1400.0 * 900.0 + 0.3 * 900.0 * 1000.0 + 0.1 * 20.0 * 1450.0
    assert heat[network.kind == "exterior_wall"].sum() == pytest.approx(19.0 * outer, rel=1e-12)
    assert heat[network.kind == "interior_wall"].sum() == pytest.approx(13.0 * 0.1 * 1e6, rel=1e-12)
    np.testing.assert_allclose(heat[network.kind == "air"], [AIR * 50.0, AIR * 26.0], rtol=1e-12)


def test_opening_exchanges_the_same_air_both_ways() -> None:
    network = build_network(house("O1", "B1"))
    theta = network.values({"opening_exchange_velocity": 0.11})
    flow = SymbolicModel(network).matrices(theta).flow.toarray()
    room, hall = np.flatnonzero(network.kind == "air")
    assert flow[room, hall] == flow[hall, room] == pytest.approx(-0.11 * AIR * 1.9, rel=1e-12)


def test_bridge_and_glass_between_zones_join_the_airs() -> None:
    network = build_network(house("B2", "G3", "B1"))
    flow = SymbolicModel(network).matrices(network.start()).flow.toarray()
    room, hall = np.flatnonzero(network.kind == "air")
    assert flow[room, hall] == pytest.approx(-(0.4 * 1.0 + 2.2 * 1.5), rel=1e-12)


def test_airflows_are_pairs_of_zone_numbers() -> None:
    flows = (Airflow(source="hall", target="room", device="fan", fraction=0.5),)
    assert build_network(house(airflows=flows)).airflows == ((1, 0),)


@pytest.mark.parametrize("u_value", [0.5, 1.1, 2.8, 3.5, 5.7, 5.9, 7.0])
def test_windows_conduct_at_every_value_of_their_range(u_value: float) -> None:
    """Single glazing too: no parameter inside its range may make a face's conductance negative."""
    surface = Surface(name="G", kind="window", zone="room", other="outdoor", area=3.0, azimuth=0.0, u_value=u_value,
                      solar_transmittance=0.5)  # fmt: skip
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0),)
    network = build_network(Building("glass", SITE, 0.0, ZoneTable(zones, (surface,), {})))
    for ends in ("lower", "start", "upper"):
        theta = np.array([getattr(p, ends) for p in network.parameters])
        kappa = np.asarray(SymbolicModel(network).classes(theta)[0]).ravel()
        assert (kappa > 0).all()


@pytest.mark.parametrize("kind", ["bridge", "window"])
def test_massless_surfaces_to_ground_are_adiabatic_or_refused(kind: str) -> None:
    """`other: ground` is adiabatic in the baseline; a surface without mass to it does nothing, or is named in an error."""
    given = {"solar_transmittance": 0.5} if kind == "window" else {}
    surface = Surface(name="S1", kind=kind, zone="room", other="ground", area=3.0, u_value=1.1, **given)  # type: ignore[arg-type]
    bridge = Surface(name="B1", **SURFACES["B1"])
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0),)
    building = Building("ground", SITE, 0.0, ZoneTable(zones, (surface, bridge), {}))
    try:
        network = build_network(building)
    except ThermalError as error:
        assert "S1" in str(error)
    else:
        assert steady_exchange(network, network.start(), "outdoor") == pytest.approx(1.4, rel=1e-12)


def test_scopes_of_a_zone_table_give_each_zone_its_own_film() -> None:
    network = build_network(house(), scopes={"interior_film_coefficient": "zone"})
    names = [p.name for p in network.parameters]
    assert {"interior_film_coefficient@room", "interior_film_coefficient@hall"} <= set(names)
    model = SymbolicModel(network)
    m = model.matrices(network.start(), sensitivities=True)
    only_hall = m.flow_sensitivities[names.index("interior_film_coefficient@hall")].toarray()
    room_air = np.flatnonzero((network.kind == "air") & (network.zone == 0))
    assert not only_hall[room_air].any()
    assert only_hall.any()
