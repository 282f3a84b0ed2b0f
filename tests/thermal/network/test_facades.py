"""Parameters with one value a facade: names, where they act, what equal values give, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import Building, FloorPlan, FloorPlans, Structure, SymbolicModel, ThermalNetwork, ZoneTable, build_network
from thermal.case.building import Layer, Location, Surface, ZoneEntry
from thermal.errors import ModelError
from thermal.network.graph import GraphBuilder
from thermal.network.grid import floor_grid, wall_facades
from thermal.network.table import facade_of
from thermal.parameters import ENVELOPE_PARAMETERS, PARAMETERS, Scope
from thermal.pilot.building import generate_office

FloatArray = NDArray[np.float64]

SITE = Location(latitude=42.0, longitude=-88.0, elevation=120.0, timezone="Etc/GMT+6")
SIDES = {"north": (-1, 0), "south": (1, 0), "west": (0, -1), "east": (0, 1)}
TWO_ROOMS = ("#######", "#AA+BB#", "#AA+BB#", "#######")
JUNCTION = (".......", "######.", "#AAAA#.", "#B+CC#.", "#BB#C+.", "######.", ".......")
ISLAND = ("#####", "#AAA#", "#A#A#", "#AAA#", "#####")
GLAZING = {"A": {"south": 2.0, "west": 1.5}, "B": {"north": 3.0, "east": 1.0}}
ENVELOPE_OF_A_PLAN = tuple(n for n in ENVELOPE_PARAMETERS if not n.endswith("multiplier"))
ENVELOPE_OF_A_TABLE = ("exterior_convection_coefficient", *(n for n in ENVELOPE_PARAMETERS if n.endswith("multiplier")))


def plan_building(*rows: str, cell: float = 1.0, glazing: Mapping[str, Mapping[str, float]] | None = None) -> Building:
    floor = FloorPlan("F1", 3.0, np.array([list(row) for row in rows]))
    return Building("plan", SITE, 0.0, FloorPlans(cell, (floor,), glazing or {}))


LAYERS = (
    Layer(thickness=0.2, conductivity=1.4, density=2300.0, heat_capacity=1000.0),
    Layer(thickness=0.15, conductivity=0.035, density=20.0, heat_capacity=1450.0),
)


def surface(name: str, kind: str, azimuth: float | None = None, zone: str = "R", other: str = "outdoor") -> Surface:
    glass: dict[str, Any] = {"u_value": 1.1, "solar_transmittance": 0.5}
    rest = glass if kind == "window" else {"construction": "wall"}
    return Surface(name=name, kind=kind, zone=zone, other=other, area=5.0, azimuth=azimuth, **rest)  # type: ignore[arg-type]


def table_building(zone: str = "R") -> Building:
    """A room with walls and windows to three directions, roof, floor over a passage, attic and another room."""
    surfaces = (
        surface("W1", "wall", 0.0, zone), surface("W2", "wall", 100.0, zone), surface("W3", "wall", 180.0, zone),
        surface("G2", "window", 95.0, zone), surface("G3", "window", 200.0, zone), surface("R1", "ceiling", None, zone),
        surface("F1", "floor", None, zone), surface("G4", "window", None, zone, "attic"),
        surface("I1", "wall", None, zone, "hall"), surface("W4", "wall", -80.0, "hall"),
    )  # fmt: skip
    zones = (ZoneEntry(name=zone, volume=50.0, floor_area=20.0), ZoneEntry(name="hall", volume=20.0, floor_area=8.0))
    return Building("table", SITE, 0.0, ZoneTable(zones, surfaces, {"wall": LAYERS}))


PLANS = {
    "two rooms": (plan_building(*TWO_ROOMS, glazing=GLAZING), None),
    "refined": (plan_building(*TWO_ROOMS, glazing=GLAZING), 0.5),
    "merged": (plan_building(*TWO_ROOMS, cell=0.5, glazing={"A": {"south": 1.0}}), 0.75),
    "junctions": (plan_building(*JUNCTION, cell=0.7, glazing={"A": {"north": 4.0}, "C": {"east": 1.0}}), None),
    "an island": (plan_building(*ISLAND, glazing={"A": {"south": 2.0}}), None),
}
CASES = {
    **{f"{k}, {n}": (b, dx, n) for k, (b, dx) in PLANS.items() for n in ENVELOPE_OF_A_PLAN},
    **{f"table, {n}": (table_building(), None, n) for n in ENVELOPE_OF_A_TABLE},
}
#: With more nodes through a wall too, where the plan is not refined.
NODES = [(name, n) for name, (_, dx, _) in CASES.items() for n in (None, 2, 3) if n is None or dx != 0.5]


def matrices(network: ThermalNetwork, **given: float) -> tuple[FloatArray, FloatArray]:
    m = SymbolicModel(network).matrices(network.values(given))
    return m.flow.toarray(), m.capacity.diagonal()


# Equal values, and the sum of slopes


@pytest.mark.parametrize(("name", "nodes"), NODES)
def test_equal_values_are_the_global_model(name: str, nodes: int | None) -> None:
    house, dx, parameter = CASES[name]
    structure = Structure(wall_nodes=nodes)
    one = build_network(house, dx, structure=structure)
    own = build_network(house, dx, scopes={parameter: "facade"}, structure=structure)
    value = 1.3 * one.parameters[[p.name for p in one.parameters].index(parameter)].start
    members = [p.name for p in own.parameters if p.base == parameter]
    assert any("@facade:" in n for n in members)
    for found, wanted in zip(
        matrices(own, **dict.fromkeys(members, value)), matrices(one, **{parameter: value}), strict=True
    ):
        np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max())
    slopes = []
    for network, names in ((one, [parameter]), (own, members)):
        m = SymbolicModel(network).matrices(network.start(), sensitivities=True)
        at = [[p.name for p in network.parameters].index(n) for n in names]
        slopes += [
            sum(m.flow_sensitivities[i].toarray() for i in at),
            sum(m.capacity_sensitivities[i].toarray() for i in at),
        ]
    np.testing.assert_allclose(slopes[0], slopes[2], atol=1e-9 * max(1.0, np.abs(slopes[0]).max()))
    np.testing.assert_allclose(slopes[1], slopes[3], atol=1e-9 * max(1.0, np.abs(slopes[1]).max()))


# Where a facade's value acts


def looks(tokens: NDArray[np.str_], place: FloatArray, side: str) -> bool:
    """Whether the cell at a place of a plan has outside beyond it."""
    row, column = int(place[1]) + SIDES[side][0], int(place[2]) + SIDES[side][1]
    inside = 0 <= row < tokens.shape[0] and 0 <= column < tokens.shape[1]
    return not inside or str(tokens[row, column]) == "."


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("rows", [TWO_ROOMS, JUNCTION], ids=["two rooms", "junctions"])
@pytest.mark.parametrize("name", ["exterior_convection_coefficient", "exterior_wall_conductivity"])
def test_value_of_a_facade_acts_on_its_outer_faces_alone(name: str, rows: tuple[str, ...], side: str) -> None:
    """Exactly the wall cells with outside beyond them in that direction, and nothing but their way outdoors."""
    network = build_network(plan_building(*rows), scopes={name: "facade"})
    before, heat = matrices(network)
    start = next(p.start for p in network.parameters if p.base == name)
    after, heat_after = matrices(network, **{f"{name}@facade:{side}": 0.7 * start})
    np.testing.assert_array_equal(heat, heat_after)
    change = after - before
    np.testing.assert_array_equal(change[:, : network.n_node], np.diag(np.diag(change)))
    moved = change[:, network.n_node] != 0.0
    tokens = np.array([list(row) for row in rows])
    kinds = ("exterior_wall",) if name.endswith("conductivity") else ("exterior_wall", "interior_wall")
    wanted = [
        str(kind) in kinds and looks(tokens, place, side)
        for kind, place in zip(network.kind, network.place, strict=True)
    ]
    np.testing.assert_array_equal(moved, wanted)
    np.testing.assert_allclose(change[:, network.n_node], -np.diag(change), rtol=1e-9)


def test_mass_of_a_facade_is_its_side_and_half_of_its_corners() -> None:
    """South of two rooms: five cells whole and two corners half, of 450 kJ/K each, less the glass in two of them."""
    network = build_network(plan_building(*TWO_ROOMS, glazing={"A": {"south": 2.0}}),
                            scopes={"exterior_wall_heat_capacity": "facade"})  # fmt: skip
    _, before = matrices(network)
    _, after = matrices(network, **{"exterior_wall_heat_capacity@facade:south": 2000.0})
    gain = after - before
    row = {int(p[2]): float(g) for p, g in zip(network.place, gain, strict=True) if p[1] == 3}
    glass = 450e3 * (1.0 - 2.0 / 6.0)
    assert row == pytest.approx({0: 225e3, 1: glass, 2: glass, 3: 450e3, 4: 450e3, 5: 450e3, 6: 225e3})
    assert gain.sum() == pytest.approx(sum(row.values()), rel=1e-12)


@pytest.mark.parametrize("side", ["south", "west", "north", "east"])
def test_glass_of_a_facade_is_that_facades(side: str) -> None:
    """Only the zones with glass there, and only their air beside it and their radiant node."""
    network = build_network(plan_building(*TWO_ROOMS, glazing=GLAZING), scopes={"window_u_value": "facade"})
    before, _ = matrices(network)
    after, _ = matrices(network, **{f"window_u_value@facade:{side}": 1.0})
    moved = np.flatnonzero(np.abs(after - before).any(axis=1))
    zone = "A" if side in ("south", "west") else "B"
    assert set(network.zone[moved]) == {network.zones.index(zone)}
    assert set(network.kind[moved]) == {"air", "radiant"}
    column = {"west": 1, "east": 5}.get(side)
    beside = network.place[moved][network.kind[moved] == "air"]
    assert (beside[:, 2] == column).all() if column else (beside[:, 1] == (2 if side == "south" else 1)).all()


TABLE_GROUPS = {
    "exterior_convection_coefficient": {"north", "east", "south", "west", "roof", "floor"},
    "exterior_wall_conductivity_multiplier": {"north", "east", "south", "west"},
    "exterior_wall_heat_capacity_multiplier": {"north", "east", "south", "west"},
    "window_conductance_multiplier": {"east", "south", None},  # a window to the attic is of no facade
}


@pytest.mark.parametrize("name", TABLE_GROUPS)
def test_members_of_a_zone_table_are_the_directions_of_its_surfaces(name: str) -> None:
    network = build_network(table_building(), scopes={name: "facade"})
    members = {p.member: p for p in network.parameters if p.base == name}
    assert set(members) == TABLE_GROUPS[name]
    assert all(p.scope == ("global" if m is None else "facade") for m, p in members.items())
    assert set(network.groups) == {name}
    assert {network.parameters[i].member for i in network.groups[name]} == TABLE_GROUPS[name]


@pytest.mark.parametrize("member", ["north", "east", "south", "west"])
def test_value_of_a_direction_acts_on_its_surfaces_alone(member: str) -> None:
    """Beside the whole table, the same table with that wall left out: what is left does not depend on its value."""
    house = table_building()
    table = house.geometry
    assert isinstance(table, ZoneTable)
    wall = {"north": "W1", "east": "W2", "south": "W3", "west": "W4"}[member]
    without = ZoneTable(table.zones, tuple(s for s in table.surfaces if s.name != wall), table.constructions)
    scopes: dict[str, Scope] = {n: "facade" for n in ENVELOPE_OF_A_TABLE if n.startswith("exterior_wall")}
    names = [p.name for p in build_network(Building("less", SITE, 0.0, without), scopes=scopes).parameters]
    assert not any(n.endswith(f"@facade:{member}") for n in names)
    network = build_network(house, scopes=scopes)
    before, heat = matrices(network)
    changed = {f"{n}@facade:{member}": 1.7 for n in scopes}
    after, heat_after = matrices(network, **changed)
    wall_moved = heat_after != heat
    assert (network.kind[wall_moved] == "exterior_wall").all()
    chain = int(wall_moved.sum())
    assert chain == (network.kind == "exterior_wall").sum() / 4  # one of four alike
    moved = np.flatnonzero(np.abs(after - before).any(axis=1))
    room = network.zones.index("hall" if member == "west" else "R")
    others = np.setdiff1d(moved, np.flatnonzero(wall_moved))
    assert set(network.kind[others]) == {"air", "radiant"}
    assert set(network.zone[others]) == {room}


def test_value_of_a_zone_is_another_construction_of_its_outer_walls() -> None:
    house, name = table_building(), "exterior_wall_conductivity_multiplier"
    table = house.geometry
    assert isinstance(table, ZoneTable)
    better = tuple(layer.model_copy(update={"conductivity": 1.7 * layer.conductivity}) for layer in LAYERS)
    own = {"W1", "W2", "W3"}
    surfaces = tuple(s.model_copy(update={"construction": "other"}) if s.name in own else s for s in table.surfaces)
    drawn = Building("drawn", SITE, 0.0, ZoneTable(table.zones, surfaces, {**table.constructions, "other": better}))
    nodes = Structure(wall_nodes=2)  # as many through either construction
    wanted = matrices(build_network(drawn, structure=nodes))
    found = matrices(build_network(house, scopes={name: "zone"}, structure=nodes), **{f"{name}@R": 1.7})
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("name", [n for n in ENVELOPE_OF_A_TABLE if n.endswith("multiplier")])
def test_values_of_zones_act_on_these_alone(name: str) -> None:
    """Both zones have a wall and a window of one make, and a window between them, which is of neither."""
    bare = table_building()
    table = bare.geometry
    assert isinstance(table, ZoneTable)
    glass = (surface("G5", "window", 95.0, "hall"), surface("G6", "window", None, "R", "hall"))
    house = replace(bare, geometry=ZoneTable(table.zones, (*table.surfaces, *glass), table.constructions))
    network = build_network(house, scopes={name: "zone"})
    assert {p.name for p in network.parameters if p.base == name} - {name} == {f"{name}@R", f"{name}@hall"}
    before, after = matrices(network), matrices(network, **{f"{name}@R": 1.7})
    for one, other in zip(before, matrices(build_network(house)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-9)
    moved = np.abs(after[0] - before[0]).any(axis=1) | (after[1] != before[1])
    assert moved.any() and set(network.zone[moved]) == {network.zones.index("R")}


@pytest.mark.parametrize(
    ("azimuth", "wanted"),
    [(0.0, "north"), (44.9, "north"), (45.0, "east"), (134.9, "east"), (135.0, "south"), (180.0, "south"),
     (225.0, "west"), (-90.0, "west"), (314.9, "west"), (315.0, "north"), (-45.0, "north"), (360.0, "north"),
     (-360.0, "north"), (np.nextafter(-45.0, -90.0), "north")],
)  # fmt: skip
def test_facade_of_an_azimuth_is_the_nearest_direction(azimuth: float, wanted: str) -> None:
    """Half way it is the next one clockwise; round-off there is no error."""
    assert facade_of(surface("W", "wall", azimuth)) == wanted


def test_horizontal_surfaces_are_roof_or_floor_and_inner_ones_nothing() -> None:
    assert facade_of(surface("C", "ceiling")) == "roof"
    assert facade_of(surface("C", "ceiling", 180.0)) == "roof"
    assert facade_of(surface("F", "floor")) == "floor"
    assert facade_of(surface("I", "wall", 180.0, other="attic")) is None


# Walls of a plan


def test_wall_cells_belong_to_the_facades_they_are_nearest_to() -> None:
    rows = ("........", ".######.", ".######.", ".##AA##.", ".##AA##.", ".######.", ".######.", "........")
    grid = floor_grid(FloorPlan("F1", 3.0, np.array([list(row) for row in rows])), 1.0)
    shares = wall_facades(grid)
    at = {(r, c): {f: float(s[r + 1, c + 1]) for f, s in shares.items() if s[r + 1, c + 1]}
          for r in range(8) for c in range(8)}  # fmt: skip
    assert at[1, 3] == at[2, 3] == {"north": 1.0}
    assert at[3, 6] == at[3, 5] == {"east": 1.0}
    assert at[1, 1] == {"north": 0.5, "west": 0.5}
    assert at[2, 2] == {"north": 0.5, "west": 0.5}  # behind the corner: half of what is behind each side
    assert at[3, 3] == at[0, 0] == {}
    wall = grid.tokens == "#"
    np.testing.assert_allclose(sum(shares.values())[wall], 1.0, rtol=1e-12)


def test_wall_that_no_wall_joins_to_the_outside_keeps_a_value_of_its_own() -> None:
    network = build_network(plan_building(*ISLAND), scopes={"exterior_wall_heat_capacity": "facade"})
    members = [p.member for p in network.parameters if p.base == "exterior_wall_heat_capacity"]
    assert set(members) == {*SIDES, None}
    _, before = matrices(network)
    _, after = matrices(network, exterior_wall_heat_capacity=2000.0)
    np.testing.assert_array_equal(network.place[np.flatnonzero(after - before)], [[0, 2, 2]])


# Names, classes and refusals


def test_parameters_know_their_group_and_member() -> None:
    scopes: dict[str, Scope] = {"window_u_value": "facade", "slab_coupling": "zone"}
    network = build_network(plan_building(*TWO_ROOMS, glazing=GLAZING), scopes=scopes)
    found = {p.name: (p.base, p.scope, p.member) for p in network.parameters}
    assert found["window_u_value@facade:south"] == ("window_u_value", "facade", "south")
    assert found["slab_coupling@A"] == ("slab_coupling", "zone", "A")
    assert found["radiant_coefficient"] == ("radiant_coefficient", "global", None)
    assert {k: len(v) for k, v in network.groups.items()} == {"window_u_value": 4, "slab_coupling": 2}
    for base, members in network.groups.items():
        for i in members:
            p, common = network.parameters[i], PARAMETERS[base]
            assert (p.start, p.lower, p.upper, p.unit) == (common.start, common.lower, common.upper, common.unit)


def test_wall_thickness_scales_the_range_of_every_facade() -> None:
    network = build_network(plan_building(*TWO_ROOMS, cell=0.5), scopes={"exterior_wall_conductivity": "facade"})
    starts = [p.start for p in network.parameters if p.base == "exterior_wall_conductivity"]
    assert starts == [0.5 * PARAMETERS["exterior_wall_conductivity"].start] * 4


def test_a_zone_named_as_a_facade_is_not_confused_with_it() -> None:
    house = table_building("south")
    scopes: dict[str, Scope] = {"interior_film_coefficient": "zone", "exterior_wall_conductivity_multiplier": "facade"}
    names = {p.name for p in build_network(house, scopes=scopes).parameters}
    assert {"interior_film_coefficient@south", "exterior_wall_conductivity_multiplier@facade:south"} <= names
    with pytest.raises(ModelError, match=r"zones \['facade:south'\] are named as the facades"):
        build_network(table_building("facade:south"), scopes=scopes)
    assert build_network(table_building("facade:south")).zones[0] == "facade:south"


@pytest.mark.parametrize("structure", [Structure(), Structure(wall_nodes=3, radiant=False)], ids=str)
@pytest.mark.parametrize("kind", ["plan", "table"])
def test_a_class_has_one_conductance(monkeypatch: pytest.MonkeyPatch, kind: str, structure: Structure) -> None:
    """With every scope at once: no two expressions share a key, so none is lost in another's class."""
    met: dict[tuple[str, str], set[str]] = {}
    for what in ("face", "capacity"):
        add = getattr(GraphBuilder, what)

        def record(self: GraphBuilder, key: str, value: Any, *rest: Any, add: Any = add, what: str = what) -> None:
            met.setdefault((what, key), set()).add(str(ca.SX(value)))
            add(self, key, value, *rest)

        monkeypatch.setattr(GraphBuilder, what, record)
    inner = (
        ("interior_film_coefficient", "radiant_coefficient") if structure.radiant else ("combined_film_coefficient",)
    )
    inner = (*inner, "furniture_coupling", "furniture_heat_capacity")
    if kind == "plan":
        house, outer = plan_building(*TWO_ROOMS, glazing=GLAZING), ENVELOPE_OF_A_PLAN
        inner = (*inner, "slab_coupling", "slab_heat_capacity", "shuffle_probability")
    else:
        house, outer = table_building(), ENVELOPE_OF_A_TABLE
    build_network(house, scopes={**dict.fromkeys(inner, "zone"), **dict.fromkeys(outer, "facade")}, structure=structure)  # type: ignore[arg-type]
    assert {k: v for k, v in met.items() if len(v) > 1} == {}


@pytest.mark.parametrize("name", sorted(set(PARAMETERS) - set(ENVELOPE_PARAMETERS)))
def test_facade_of_what_is_no_envelope_is_refused_and_says_what_is(name: str) -> None:
    for house in (plan_building(*TWO_ROOMS), table_building()):
        with pytest.raises(ModelError, match=rf"\['{name}'\] belong to no facade; .*'exterior_wall_conductivity'"):
            build_network(house, scopes={name: "facade"})


@pytest.mark.parametrize(
    ("house", "name", "scope", "message"),
    [
        (plan_building(*TWO_ROOMS), "window_u_value", "facade", "is no parameter of this building"),
        (plan_building(*TWO_ROOMS), "window_conductance_multiplier", "facade", "is no parameter of this building"),
        (table_building(), "exterior_wall_conductivity", "facade", "is no parameter of this building"),
        (plan_building(*TWO_ROOMS), "exterior_wall_conductivity", "zone", "no single zone .* global and facade fit"),
        (table_building(), "slab_conductivity_multiplier", "zone", "no single zone .* only the global scope fits"),
    ],
)
def test_scopes_that_nothing_takes_are_refused(house: Building, name: str, scope: Scope, message: str) -> None:
    with pytest.raises(ModelError, match=f"{name} .*{message}|{name} {message}"):
        build_network(house, scopes={name: scope})


def test_windows_that_face_no_facade_are_refused_a_facade() -> None:
    attic = surface("G", "window", None, "R", "attic")
    table = ZoneTable((ZoneEntry(name="R", volume=50.0, floor_area=20.0),), (attic,), {})
    with pytest.raises(ModelError, match="window_conductance_multiplier belongs to no single facade"):
        build_network(Building("b", SITE, 0.0, table), scopes={"window_conductance_multiplier": "facade"})


def test_a_wall_without_azimuth_is_refused_by_its_name() -> None:
    table = ZoneTable((ZoneEntry(name="R", volume=50.0, floor_area=20.0),), (surface("W7", "wall"),), {"wall": LAYERS})
    house = Building("b", SITE, 0.0, table)
    assert build_network(house).zones == ("R",)
    with pytest.raises(ModelError, match=r"surface W7: expected an azimuth"):
        build_network(house, scopes={"exterior_convection_coefficient": "facade"})


def test_a_building_of_123_zones_gets_a_dozen_parameters_more() -> None:
    house = Building("pilot", SITE, 0.0, generate_office(0))
    network = build_network(house, dx=1.5, scopes=dict.fromkeys(ENVELOPE_OF_A_PLAN, "facade"))
    assert len(network.zones) == 123
    assert len(network.parameters) == 13 + 3 * 4
    assert {base: len(members) for base, members in network.groups.items()} == dict.fromkeys(ENVELOPE_OF_A_PLAN, 4)
    assert len(network.conductances) < 50
