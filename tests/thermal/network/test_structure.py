"""Structures of the baseline: what each holds, its steady state by hand, and what a file of settings says of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calibration.errors import CalibrationError
from calibration.evaluation.settings import ModelSettings, read_settings
from thermal import (
    Building,
    FloorPlan,
    FloorPlans,
    Structure,
    SymbolicModel,
    ThermalNetwork,
    ZoneTable,
    build_network,
    load_bundled_case,
)
from thermal.case.building import Layer, Location, Surface, ZoneEntry
from thermal.errors import ModelError
from thermal.units import air_density

SITE = Location(latitude=42.0, longitude=-88.0, elevation=120.0, timezone="Etc/GMT+6")
AIR = air_density(120.0) * 1006.0  # J/m3/K
ROWS = ("#######", "#AA+BB#", "#AA+BB#", "#######")
LAYERS = (
    Layer(thickness=0.2, conductivity=1.4, density=2300.0, heat_capacity=1000.0),
    Layer(thickness=0.15, conductivity=0.035, density=20.0, heat_capacity=1450.0),
)
STRUCTURES = [
    Structure(furniture=furniture, wall_nodes=nodes, radiant=radiant)
    for furniture in (True, False)
    for nodes in (None, 1, 2, 3)
    for radiant in (True, False)
]


def plan_building(*rows: str) -> Building:
    floor = FloorPlan("F1", 3.0, np.array([list(row) for row in rows or ROWS]))
    return Building("plan", SITE, 0.0, FloorPlans(1.0, (floor,), {"A": {"south": 2.0}} if not rows else {}))


def table_building() -> Building:
    """One room with 12 m2 of wall and 3 m2 of window."""
    wall = Surface(name="W", kind="wall", zone="R", other="outdoor", area=12.0, azimuth=0.0, construction="wall")
    glass = Surface(name="G", kind="window", zone="R", other="outdoor", area=3.0, azimuth=0.0, u_value=1.1,
                    solar_transmittance=0.5)  # fmt: skip
    room = ZoneEntry(name="R", volume=50.0, floor_area=20.0)
    return Building("table", SITE, 0.0, ZoneTable((room,), (wall, glass), {"wall": LAYERS}))


BUILDINGS = {"plan": plan_building(), "table": table_building()}


def names(network: ThermalNetwork) -> set[str]:
    return {p.name for p in network.parameters}


def loss(network: ThermalNetwork, **values: float) -> float:
    """Heat lost outdoors per kelvin when all air is held 1 K above it [W/K]."""
    m = SymbolicModel(network).matrices(network.values(values))
    stiffness = m.flow[:, : m.n].toarray()
    air = network.kind == "air"
    states = np.ones(m.n)
    states[~air] = np.linalg.solve(stiffness[np.ix_(~air, ~air)], -stiffness[np.ix_(~air, air)].sum(axis=1))
    return float(-(m.flow[:, m.n :].T @ states)[0])


# What a structure holds


def test_the_baseline_is_what_it_was() -> None:
    """Counted and added up by hand on a plan of 4 x 7 cells of 1 m."""
    network = build_network(BUILDINGS["plan"])
    kinds = {str(k): int(n) for k, n in zip(*np.unique(network.kind, return_counts=True), strict=True)}
    assert kinds == {
        "air": 8, "exterior_wall": 18, "furniture": 2, "interior_wall": 2, "mixing": 2, "radiant": 2, "slab": 8
    }  # fmt: skip
    assert [p.name for p in network.parameters] == [
        "interior_film_coefficient", "radiant_coefficient", "shuffle_probability", "slab_coupling",
        "slab_heat_capacity", "furniture_coupling", "furniture_heat_capacity", "window_u_value",
        "interior_wall_conductivity", "exterior_wall_conductivity", "exterior_convection_coefficient",
        "exterior_wall_heat_capacity", "interior_wall_heat_capacity",
    ]  # fmt: skip
    glass = 1.0 - 2.0 / 6.0  # left of two wall cells south of A
    wanted = {
        "air": AIR * 10.0 * 3.0,
        "exterior_wall": 150e3 * 3.0 * (16 + 2 * glass),
        "interior_wall": 60e3 * 3.0 * 2,
        "slab": 1.5e5 * 2 * 10.0,
        "furniture": 1.5e4 * 10.0,
    }
    heat = SymbolicModel(network).matrices(network.start()).capacity.diagonal()
    assert {k: float(heat[network.kind == k].sum()) for k in wanted} == pytest.approx(wanted, rel=1e-12)


def test_the_baseline_is_the_default_everywhere() -> None:
    for house in BUILDINGS.values():
        plain, named = build_network(house), build_network(house, structure=Structure())
        assert [p.name for p in plain.parameters] == [p.name for p in named.parameters]
        flows = [SymbolicModel(n).matrices(n.start()).flow.toarray() for n in (plain, named)]
        np.testing.assert_array_equal(*flows)


def test_structure_of_the_paper_is_air_and_walls() -> None:
    assert Structure.paper() == Structure(furniture=False, slab_nodes=0, wall_nodes=1, radiant=False)
    network = build_network(BUILDINGS["plan"], structure=Structure.paper())
    assert set(network.kind) == {"air", "exterior_wall", "interior_wall", "mixing"}
    assert network.n_node == 8 + 18 + 2 + 2
    assert names(network) == {
        "combined_film_coefficient", "shuffle_probability", "window_u_value", "exterior_convection_coefficient",
        "exterior_wall_conductivity", "exterior_wall_heat_capacity", "interior_wall_conductivity",
        "interior_wall_heat_capacity",
    }  # fmt: skip
    table = build_network(BUILDINGS["table"], structure=Structure.paper())
    assert list(table.kind) == ["air", "exterior_wall"]
    assert names(table) == {
        "combined_film_coefficient", "window_conductance_multiplier", "exterior_convection_coefficient",
        "exterior_wall_conductivity_multiplier", "exterior_wall_heat_capacity_multiplier",
    }  # fmt: skip


@pytest.mark.parametrize("name", BUILDINGS)
@pytest.mark.parametrize("structure", STRUCTURES, ids=str)
def test_a_parameter_is_there_when_its_part_is(name: str, structure: Structure) -> None:
    network = build_network(BUILDINGS[name], structure=structure)
    films = {"interior_film_coefficient", "radiant_coefficient", "combined_film_coefficient"}
    assert names(network) & films == ({*list(films)} - {"combined_film_coefficient"} if structure.radiant
                                      else {"combined_film_coefficient"})  # fmt: skip
    assert {n for n in names(network) if n.startswith("furniture")} == (
        {"furniture_coupling", "furniture_heat_capacity"} if structure.furniture else set()
    )
    assert ("radiant" in network.kind) == structure.radiant
    assert ("furniture" in network.kind) == structure.furniture
    model = SymbolicModel(network)
    m = model.matrices(network.start(), sensitivities=True)
    moved = [abs(a).sum() + abs(b).sum() for a, b in zip(m.flow_sensitivities, m.capacity_sensitivities, strict=True)]
    assert all(change > 0 for change in moved), "a parameter that nothing depends on"


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_slabs_are_two_chains_of_any_length(count: int) -> None:
    """Resistance of each from face to back is 1/U_s whatever the number of nodes; so is the heat capacity."""
    network = build_network(BUILDINGS["plan"], structure=Structure(slab_nodes=count))
    room = network.anatomy.rooms["A"]
    slab = (network.kind == "slab") & (network.zone == room.number)
    assert sorted(room.floor + room.ceiling) == np.flatnonzero(slab).tolist()
    assert ("slab_coupling" in names(network)) == ("slab_heat_capacity" in names(network)) == (count > 0)
    m = SymbolicModel(network).matrices(network.start())
    for chain in (room.floor, room.ceiling):
        assert len(chain) == count
        if not count:
            continue
        assert m.capacity.diagonal()[list(chain)].sum() == pytest.approx(1.5e5 * 5.0, rel=1e-12)
        rows = m.flow[:, : m.n].toarray()[np.ix_(chain, chain)]
        np.testing.assert_allclose(np.diag(rows, 1), -count * 10.0 * 5.0, rtol=1e-12)
        surface = 1.0 / (rows.sum() / 5.0) - 1.0 / 7.5  # film off: half a layer
        assert surface + (count - 0.5) / (count * 10.0) == pytest.approx(1.0 / 10.0, rel=1e-9)


# Steady states by hand


@pytest.mark.parametrize("structure", STRUCTURES, ids=str)
def test_steady_loss_of_a_room_is_that_of_its_resistances(structure: Structure) -> None:
    """Wall and window in parallel; with a radiant node its temperature from the balance of what it sees."""
    h_c, h_r, h, h_e, u_f = 2.7, 4.6, 6.9, 17.0, 3.1
    network = build_network(BUILDINGS["table"], structure=structure)
    given = {"interior_film_coefficient": h_c, "radiant_coefficient": h_r, "combined_film_coefficient": h,
             "exterior_convection_coefficient": h_e, "furniture_coupling": u_f}  # fmt: skip
    found = loss(network, **{k: v for k, v in given.items() if k in names(network)})
    wall = 1.0 / (0.2 / 1.4 + 0.15 / 0.035 + 1.0 / h_e)
    glass = 1.0 / (1.0 / 1.1 - 1.0 / 7.7 - 1.0 / 25.0 + 1.0 / h_e)
    behind, areas = np.array([wall, glass]), np.array([12.0, 3.0])
    if not structure.radiant:
        assert found == pytest.approx(float(areas @ (1.0 / (1.0 / h + 1.0 / behind))), rel=1e-10)
        return
    total = h_c + h_r + behind
    furniture = 20.0 * u_f * h_c * h_r / (h_c + h_r) ** 2 if structure.furniture else 0.0  # air to radiant node
    radiant = (areas @ (h_r * h_c / total) + furniture) / (areas @ (h_r - h_r**2 / total) + furniture)
    surface = (h_c + h_r * radiant) / total
    assert found == pytest.approx(float(areas @ (behind * surface)), rel=1e-10)


@pytest.mark.parametrize("radiant", [True, False])
@pytest.mark.parametrize("nodes", [None, 1, 2, 3])
def test_steady_loss_of_a_wall_of_a_plan_is_that_of_its_resistances(nodes: int | None, radiant: bool) -> None:
    """What 12 m more of a long building lose: film, structure of 0.15 m2K/W, insulation and film in series."""
    values = {"exterior_wall_conductivity": 0.31, "exterior_convection_coefficient": 14.0}
    values |= {"interior_film_coefficient": 5.1, "radiant_coefficient": 1e-9} if radiant else {"combined_film_coefficient": 5.1}  # fmt: skip
    losses = []
    for columns in (38, 50):
        inner = "#" + "A" * (columns - 2) + "#"
        house = plan_building("#" * columns, inner, inner, "#" * columns)
        losses.append(loss(build_network(house, structure=Structure(wall_nodes=nodes, radiant=radiant)), **values))
    wall = 1.0 / (1.0 / 5.1 + 0.15 + 1.0 / 0.31 + 1.0 / 14.0)
    assert losses[1] - losses[0] == pytest.approx(72.0 * wall, rel=1e-9)


def test_one_film_is_both_where_a_room_is_at_one_temperature() -> None:
    """Air and radiant node alike: h_c + h_r; a window then has its rated u-value at 7.7 W/m2/K."""
    for name, house in BUILDINGS.items():
        apart, one = (build_network(house, structure=Structure(furniture=False, radiant=r)) for r in (True, False))
        m = SymbolicModel(apart).matrices(apart.values({"interior_film_coefficient": 2.7, "radiant_coefficient": 5.0}))
        stiffness = m.flow[:, : m.n].toarray()
        held = np.isin(apart.kind, ("air", "radiant", "mixing"))
        states = np.ones(m.n)
        states[~held] = np.linalg.solve(stiffness[np.ix_(~held, ~held)], -stiffness[np.ix_(~held, held)].sum(axis=1))
        assert loss(one) == pytest.approx(float(-(m.flow[:, m.n :].T @ states)[0]), rel=1e-10), name


@pytest.mark.parametrize("name", BUILDINGS)
@pytest.mark.parametrize("structure", [*STRUCTURES, Structure.paper(), Structure(slab_nodes=3)], ids=str)
def test_conductances_are_symmetric_and_energy_is_kept(name: str, structure: Structure) -> None:
    """Heat in, heat lost and heat stored over implicit steps: to 1e-9 of what comes in."""
    network = build_network(BUILDINGS[name], structure=structure)
    m = SymbolicModel(network).matrices(network.start())
    flow, capacity, n = m.flow.toarray(), m.capacity.diagonal(), m.n
    np.testing.assert_array_equal(flow[:, :n], flow[:, :n].T)
    np.testing.assert_allclose(flow.sum(axis=1), 0.0, atol=1e-11 * np.abs(flow).max())
    assert np.linalg.eigvalsh(flow[:, :n]).min() > 0.0
    state, outdoor, step = np.full(n, 293.15), 268.15, 300.0
    heat = m.heating.toarray() @ np.full(len(network.zones), 700.0)
    for _ in range(20):
        right = capacity * state + step * (heat - flow[:, n] * outdoor)
        after = np.linalg.solve(np.diag(capacity) + step * flow[:, :n], right)
        lost = -float(flow[:, n] @ (after - outdoor))
        stored = float(capacity @ (after - state)) / step
        assert stored == pytest.approx(heat.sum() - lost, abs=1e-9 * heat.sum())
        state = after


def test_a_zone_without_surfaces_has_no_radiant_node() -> None:
    """An open zone inside another one, without furniture and slabs: a node that sees nothing would be singular."""
    rows = ("#######", "#AAAAA#", "#ABBBA#", "#AAAAA#", "#######")
    network = build_network(plan_building(*rows), structure=Structure(furniture=False, slab_nodes=0))
    assert network.zone[network.kind == "radiant"].tolist() == [0]
    floating = build_network(plan_building(*rows))
    assert (floating.kind == "radiant").sum() == 2


# Refusals


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("furniture", 1),
        ("radiant", "yes"),
        ("slab_nodes", -1),
        ("slab_nodes", 2.0),
        ("slab_nodes", True),
        ("slab_nodes", None),
        ("slab_nodes", 101),
        ("wall_nodes", 0),
        ("wall_nodes", 10**9),
        ("wall_nodes", "3"),
    ],
)
def test_a_structure_that_cannot_be_built_is_refused_by_its_field(field: str, value: Any) -> None:
    with pytest.raises(ModelError, match=rf"structure\.{field}: expected .* got {value!r}"):
        replace(Structure(), **{field: value})


def test_scope_of_what_a_structure_lacks_is_refused() -> None:
    with pytest.raises(ModelError, match=r"furniture_coupling is no parameter of this building with Structure\(furn"):
        build_network(BUILDINGS["plan"], scopes={"furniture_coupling": "zone"}, structure=Structure.paper())


# Settings of a calibration


@pytest.mark.parametrize("structure", [Structure(), Structure.paper(), Structure(wall_nodes=3, slab_nodes=4)])
def test_settings_come_back_from_their_file(tmp_path: Path, structure: Structure) -> None:
    settings = ModelSettings(dx=1.0, scopes={"window_u_value": "facade"}, structure=structure)
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"settings": settings.to_dict()}), encoding="utf-8")
    again = ModelSettings(**read_settings(path))
    assert again == settings
    networks = [s.network(load_bundled_case().building) for s in (settings, again)]
    assert names(networks[0]) == names(networks[1])
    assert ("radiant" in networks[0].kind) == structure.radiant


@pytest.mark.parametrize("kind", BUILDINGS)
def test_a_building_that_is_turned_looks_elsewhere_and_is_else_the_same(kind: str) -> None:
    there, turned = (build_network(BUILDINGS[kind], structure=Structure(turned=angle)) for angle in (0.0, -30.0))
    assert [(p.azimuth + 30.0) % 360.0 for p in turned.anatomy.panes] == [p.azimuth for p in there.anatomy.panes]
    assert {round((a + 30.0) % 360.0, 9): v for (_, a), v in turned.anatomy.facades.items()} == {
        a: v for (_, a), v in there.anatomy.facades.items()
    }
    walls = [[f.outlook.azimuth for f in n.anatomy.outer if f.outlook.tilt == 90.0] for n in (turned, there)]
    assert [(a + 30.0) % 360.0 for a in walls[0]] == walls[1] and walls[1]
    assert turned.parameters == there.parameters


def test_settings_without_structure_are_those_of_the_baseline(tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"settings": {"dx": 0.5}}), encoding="utf-8")
    assert ModelSettings(**read_settings(path)).structure == Structure()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"structure": "paper"}, r"settings\.structure: expected a mapping with keys among \['emitter', 'furniture'.*'paper'"),
        ({"structure": {"furnitur": True}}, r"settings\.structure: expected a mapping .*furnitur"),
        ({"structure": {"wall_nodes": 0}}, r"settings\.structure\.wall_nodes: expected a whole number from 1 to 100"),
        ({"structure": {"radiant": "no"}}, r"settings\.structure\.radiant: expected true or false, got 'no'"),
        ({"structure": {"turned": 270}}, r"settings\.structure\.turned: expected -180 to 180 deg, got 270"),
        ({"scopes": ["window_u_value"]}, r"settings\.scopes: expected a mapping to global, facade, zone"),
        ({"scopes": {"window_u_value": "side"}}, r"settings\.scopes: expected .*side"),
    ],
)
def test_settings_that_nobody_wrote_are_refused(tmp_path: Path, settings: dict[str, Any], message: str) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"settings": settings}), encoding="utf-8")
    with pytest.raises(CalibrationError, match=message):
        read_settings(path)


def test_settings_take_a_structure_only() -> None:
    with pytest.raises(CalibrationError, match="structure: expected a Structure, found 'paper'"):
        ModelSettings(structure="paper")  # type: ignore[arg-type]
