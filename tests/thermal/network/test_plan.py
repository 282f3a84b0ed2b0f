"""Networks of floor plans: what any cell size must keep, floors, diffusers, shuffle, scopes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from thermal import Building, FloorPlan, FloorPlans, SymbolicModel, ThermalNetwork, build_network, load_bundled_case
from thermal.case.building import Location
from thermal.case.plan import zone_floor_areas
from thermal.errors import ModelError
from thermal.shuffle.equivalent import mean_square_reach
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


def transfer_of(network: ThermalNetwork, theta: FloatArray, s: float) -> FloatArray:
    m = SymbolicModel(network).matrices(theta)
    system = (m.flow[:, : m.n] + s * m.capacity).toarray()
    inputs = np.hstack([m.heating.toarray(), -m.flow[:, m.n :].toarray()])
    return np.asarray(m.observation @ np.linalg.solve(system, inputs))


# What any cell size keeps


def total(network: ThermalNetwork, *names: str) -> float:
    """Sum of the weights of conductance classes."""
    return float(sum(c.weight.sum() for c in network.conductances if c.name in names))


def kept(network: ThermalNetwork, theta: FloatArray) -> dict[str, float]:
    """Capacities and areas of a network."""
    matrices = SymbolicModel(network).matrices(theta)
    diagonal = matrices.capacity.diagonal()
    found = {f"capacity of {k}": float(diagonal[network.kind == k].sum()) for k in np.unique(network.kind)}
    for number, zone in enumerate(network.zones):
        found[f"air of {zone}"] = float(diagonal[(network.kind == "air") & (network.zone == number)].sum())
    found["exterior wall to outdoor"] = total(network, "exterior_wall-outdoor")
    for kind in ("exterior_wall", "interior_wall", "window", "slab"):
        found[f"{kind} to rooms"] = total(network, f"radiant-{kind}")
        assert total(network, f"air-{kind}") == pytest.approx(found[f"{kind} to rooms"], rel=1e-12)
    return found


@pytest.mark.parametrize("dx", [0.1, 0.25, 0.7, 1.0, 1.5])
def test_capacities_and_areas_do_not_depend_on_the_cell_size(dx: float) -> None:
    house = load_bundled_case().building
    plain = build_network(house)
    theta = some_theta(plain)
    wanted = kept(plain, theta)
    if dx == 0.1:  # a fifth of the plan's cells, on a smaller plan
        house = building(plan(*JUNCTION), cell=0.5, glazing={"A": {"north": 3.0}})
        wanted = kept(build_network(house), theta)
    found = kept(build_network(house, dx=dx), theta)
    assert found == pytest.approx(wanted, rel=1e-12)


def test_areas_of_the_bundled_plan_are_those_of_its_drawing() -> None:
    house = load_bundled_case().building
    plans = house.geometry
    assert isinstance(plans, FloorPlans)
    floor, cell = plans.floors[0], plans.cell_size
    network = build_network(house, dx=1.0)
    theta = network.start()
    density = air_density(house.location.elevation)
    found = kept(network, theta)
    for zone, area in zone_floor_areas(plans).items():
        assert found[f"air of {zone}"] == pytest.approx(density * 1006.0 * area * floor.height, rel=1e-12)
    glass = sum(sum(sides.values()) for sides in plans.glazing.values())
    assert found["window to rooms"] == pytest.approx(glass, rel=1e-12)
    tokens = np.pad(floor.tokens, 1, constant_values=".")
    outer = sum(
        int(((tokens == "#") & (np.roll(tokens, step, axis) == ".")).sum()) for step in (1, -1) for axis in (0, 1)
    )
    assert found["exterior wall to outdoor"] == pytest.approx(outer * cell * floor.height - glass, rel=1e-12)
    assert found["slab to rooms"] == pytest.approx(2.0 * sum(zone_floor_areas(plans).values()), rel=1e-12)
    partitions = int((floor.tokens == "+").sum()) * cell**2 * floor.height
    assert found["capacity of interior_wall"] == pytest.approx(60.0 / cell * 1000.0 * partitions, rel=1e-12)


def held_air_loss(network: ThermalNetwork, theta: FloatArray) -> float:
    """Heat lost to outdoor per kelvin when all air is held 1 K above it [W/K]."""
    m = SymbolicModel(network).matrices(theta)
    stiffness = m.flow[:, : m.n].toarray()
    air = network.kind == "air"
    states = np.ones(m.n)
    states[~air] = np.linalg.solve(stiffness[np.ix_(~air, ~air)], -stiffness[np.ix_(~air, air)].sum(axis=1))
    return float(-(m.flow[:, m.n :].T @ states)[0])


def held_zone_loss(network: ThermalNetwork, theta: FloatArray) -> float:
    """The same when the zone means are held, by heat to all air alike [W/K]."""
    gain = transfer_of(network, theta, 0.0)[:, : len(network.zones)]
    return float(np.linalg.solve(gain, np.ones(len(network.zones))).sum())


@pytest.mark.parametrize("share", [0.0, 0.3])
@pytest.mark.parametrize("dx", [1.0, 0.5, 1.5])
def test_straight_walls_have_their_exact_resistance_at_any_cell_size(dx: float, share: float) -> None:
    """What 12 m more of a long building lose: film, structure and insulation in series, and a window beside them."""
    values = {
        "interior_film_coefficient": 5.1,
        "radiant_coefficient": 1e-9,  # else all surfaces of a zone see each other, and losses do not add
        "exterior_wall_conductivity": 0.31,
        "exterior_convection_coefficient": 14.0,
    }
    if share:
        values["window_u_value"] = 1.4
    losses = []
    for columns in (38, 50):
        rows = ("#" * columns, "#" + "A" * (columns - 2) + "#", "#" + "A" * (columns - 2) + "#", "#" * columns)
        glass = share * 3.0 * (columns - 2)
        network = build_network(building(plan(*rows), glazing={"A": {"south": glass}}), dx=dx)
        losses.append(held_air_loss(network, network.values(values)))
    wall = 1.0 / (1.0 / 5.1 + 0.15 + 1.0 / 0.31 + 1.0 / 14.0)
    glass_u = 1.0 / (1.0 / 5.1 + 1.0 / 1.4 - 1.0 / 7.7)
    exact = 36.0 * wall + 36.0 * ((1.0 - share) * wall + share * glass_u)
    assert losses[1] - losses[0] == pytest.approx(exact, rel=1e-9)


def test_steady_loss_of_a_building_hardly_depends_on_the_cell_size() -> None:
    """With all air held: 0.6 %, conduction along walls at corners and beside windows."""
    house = load_bundled_case().building
    plain = build_network(house)
    wanted = held_air_loss(plain, plain.start())
    for dx in (0.25, 1.0, 1.5):
        assert held_air_loss(build_network(house, dx=dx), plain.start()) == pytest.approx(wanted, rel=0.006)


def test_steady_loss_of_held_zones_depends_on_the_cell_size_by_what_the_shuffle_can_carry() -> None:
    """The paper's shuffle hands on a thin cell's air once in 300 s, so cells at walls cool: a few percent."""
    house = load_bundled_case().building
    plain = build_network(house)
    wanted = held_zone_loss(plain, plain.start())
    for dx in (1.0, 1.5):
        assert held_zone_loss(build_network(house, dx=dx), plain.start()) == pytest.approx(wanted, rel=0.03)


@pytest.mark.parametrize("dx", [0.3, 0.4, 0.0, -0.5, np.nan, np.inf])
def test_cell_sizes_that_a_plan_cannot_have_are_refused(dx: float) -> None:
    with pytest.raises(ModelError, match="cell size"):
        build_network(building(plan(*TWO_ROOMS)), dx=dx)


def test_refused_refinement_names_the_nearest_that_divides() -> None:
    with pytest.raises(ModelError, match=r"0\.4 m does not divide .*1\.0 m; nearest that does: (0\.5|0\.333)"):
        build_network(building(plan(*TWO_ROOMS)), dx=0.4)


def test_coarsening_that_swallows_a_zone_is_refused_by_its_name() -> None:
    with pytest.raises(ModelError, match="zone A"):
        build_network(building(plan(*TWO_ROOMS)), dx=8.0)


@pytest.mark.parametrize("dx", [2.0, 3.0])
def test_coarsening_never_merges_zones(dx: float) -> None:
    network = build_network(building(plan(*TWO_ROOMS)), dx=dx)
    air = network.kind == "air"
    assert sorted(set(network.zone[air])) == [0, 1]
    np.testing.assert_allclose(network.observation.sum(axis=1), 1.0)


# Floors, orientation, diffusers, shuffle, scopes


def test_orientation_does_not_matter_in_the_baseline() -> None:
    networks = [
        build_network(building(plan(*TWO_ROOMS), glazing={"A": {"south": 2.0}}, orientation=o)) for o in (0.0, 77.0)
    ]
    flows = [SymbolicModel(n).matrices(n.start()).flow.toarray() for n in networks]
    np.testing.assert_array_equal(*flows)


def test_turning_the_drawing_changes_nothing_but_names() -> None:
    """Transposed and mirrored plans, glazing with them, have the same transfer functions."""
    turned = ["".join(column) for column in zip(*TWO_ROOMS, strict=True)]
    mirrored = [row[::-1] for row in TWO_ROOMS]
    a = build_network(building(plan(*TWO_ROOMS), glazing={"A": {"south": 2.0, "west": 1.0}}))
    b = build_network(building(plan(*turned), glazing={"A": {"east": 2.0, "north": 1.0}}))
    c = build_network(building(plan(*mirrored), glazing={"A": {"south": 2.0, "east": 1.0}}))
    theta = some_theta(a)
    assert [p.name for p in a.parameters] == [p.name for p in b.parameters]
    for s in (0.0, 1e-4):
        wanted = transfer_of(a, theta, s)
        np.testing.assert_allclose(transfer_of(b, theta, s), wanted, rtol=1e-9)
        swap = [c.zones.index(z) for z in a.zones]
        np.testing.assert_allclose(transfer_of(c, theta, s)[np.ix_(swap, [*swap, 2])], wanted, rtol=1e-9)


def test_floors_exchange_no_heat() -> None:
    upper = [row.replace("A", "C").replace("B", "D") for row in TWO_ROOMS]
    house = building(plan(*TWO_ROOMS), plan(*upper, name="F2", height=3.4))
    network = build_network(house)
    m = SymbolicModel(network).matrices(network.start())
    count, part = connected_components(m.flow[:, : m.n], directed=False)
    assert count == 2
    floor_of = {int(f): {int(x) for x in part[network.place[:, 0] == f]} for f in (0, 1)}
    assert floor_of[0].isdisjoint(floor_of[1])
    single = build_network(building(plan(*TWO_ROOMS)))
    pair = transfer_of(network, network.start(), 1e-4)
    np.testing.assert_allclose(pair[:2, [0, 1, 4]], transfer_of(single, single.start(), 1e-4), rtol=1e-9)


def test_zones_that_touch_without_a_wall_exchange_no_air() -> None:
    network = build_network(building(plan("#####", "#AAB#", "#####")))
    a, b = (network.zone == 0) & (network.kind == "air"), (network.zone == 1) & (network.kind == "air")
    m = SymbolicModel(network).matrices(network.start())
    assert m.flow[:, : m.n].toarray()[np.ix_(a, b)].any() == np.False_


@pytest.mark.parametrize("dx", [1.0, 0.5, 2.0])
def test_diffusers_share_the_heat_of_their_zone(dx: float) -> None:
    house = building(plan(*TWO_ROOMS))
    mask = np.zeros((4, 7), dtype=bool)
    mask[1, 1] = True
    network = build_network(house, dx=dx, diffusers={"A": mask})
    heating = network.heating.toarray()
    np.testing.assert_allclose(heating.sum(axis=0), 1.0, rtol=1e-12)
    np.testing.assert_allclose(heating[:, 1], network.observation.toarray()[1])  # B: all its air alike
    fed = np.flatnonzero(heating[:, 0])
    assert (network.kind[fed] == "air").all()
    assert (network.zone[fed] == 0).all()
    assert fed.size == (4 if dx == 0.5 else 1)
    if dx < 2.0:
        assert (network.place[fed, 1:] * dx < 2.0).all()
        assert (network.place[fed, 1:] * dx >= 1.0).all()


@pytest.mark.parametrize(
    ("zone", "shape", "on"),
    [("Z", (4, 7), True), ("A", (3, 7), True), ("A", (4, 7), False)],
    ids=["name", "shape", "empty"],
)
def test_diffusers_that_do_not_fit_are_refused(zone: str, shape: tuple[int, int], on: bool) -> None:
    """An unknown zone, a mask of another shape, a mask without a cell of the zone."""
    with pytest.raises(ModelError):
        build_network(building(plan(*TWO_ROOMS)), diffusers={zone: np.full(shape, on)})


def test_short_reach_is_a_diffusivity_and_long_reach_a_star() -> None:
    house = building(plan("#########", "#AAAAAAA#", "#########"))
    near, far = build_network(house, reach=2.0), build_network(house, reach=3.0)
    assert "mixing" not in near.kind
    assert (far.kind == "mixing").sum() == 1
    (air,) = (k for k, c in enumerate(near.conductances) if c.name.startswith("air-air"))
    p = 0.3
    found = float(SymbolicModel(near).classes(near.values({"shuffle_probability": p}))[0][air])
    assert found == pytest.approx(0.026 + AIR * p * mean_square_reach(2.0, 1.0) / 600.0, rel=1e-12)


def test_random_shuffle_has_no_mean_of_it_in_the_network() -> None:
    network = build_network(building(plan(*TWO_ROOMS)), mean_shuffle=False)
    assert "mixing" not in network.kind
    assert "shuffle_probability" not in [p.name for p in network.parameters]
    (air,) = (k for k, c in enumerate(network.conductances) if c.name.startswith("air-air"))
    assert float(SymbolicModel(network).classes(network.start())[0][air]) == pytest.approx(0.026)


ZONE_SCOPES = (
    "interior_film_coefficient",
    "radiant_coefficient",
    "shuffle_probability",
    "slab_coupling",
    "slab_heat_capacity",
    "furniture_coupling",
    "furniture_heat_capacity",
    "window_u_value",
)


@pytest.mark.parametrize("name", ZONE_SCOPES)
def test_parameter_of_a_zone_acts_there_alone(name: str) -> None:
    """Equal values give the global model; another value in A changes what touches A's air and radiant node, nothing of B."""
    house = building(plan(*TWO_ROOMS), glazing={"A": {"south": 2.0}, "B": {"north": 3.0}})
    one, own = build_network(house), build_network(house, scopes={name: "zone"})
    names = [p.name for p in own.parameters]
    assert {f"{name}@A", f"{name}@B"} <= set(names)
    assert name not in names

    def matrices(network: ThermalNetwork, **given: float) -> tuple[FloatArray, FloatArray]:
        m = SymbolicModel(network).matrices(network.values(given))
        return m.flow.toarray(), m.capacity.diagonal()

    flow, heat = matrices(own)
    wanted_flow, wanted_heat = matrices(one)
    np.testing.assert_allclose(flow, wanted_flow, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(heat, wanted_heat, rtol=1e-12)
    start = next(p for p in own.parameters if p.name == f"{name}@A").start
    changed_flow, changed_heat = matrices(own, **{f"{name}@A": 0.8 * start})
    flow_moved = np.abs(changed_flow - flow) > 1e-9 * np.abs(flow).max()
    heat_moved = np.abs(changed_heat - heat) > 0
    assert flow_moved.any() or heat_moved.any()
    assert not flow_moved[own.zone == 1].any()
    assert not heat_moved[own.zone == 1].any()
    # and it is the derivative of the global parameter that the zones share
    slopes = []
    for network, wanted in ((one, [name]), (own, [f"{name}@A", f"{name}@B"])):
        m = SymbolicModel(network).matrices(network.start(), sensitivities=True)
        at = [[p.name for p in network.parameters].index(w) for w in wanted]
        slopes.append(sum(m.flow_sensitivities[i].toarray() for i in at))
        slopes.append(sum(m.capacity_sensitivities[i].toarray() for i in at))
    np.testing.assert_allclose(slopes[0], slopes[2], atol=1e-9)
    np.testing.assert_allclose(slopes[1], slopes[3], atol=1e-9)


@pytest.mark.parametrize(
    "name", ["exterior_wall_conductivity", "interior_wall_heat_capacity", "exterior_convection_coefficient"]
)
def test_parameter_without_a_zone_of_its_own_is_not_silently_global(name: str) -> None:
    """A wall belongs to several zones: a value a zone is either made or refused."""
    try:
        network = build_network(building(plan(*TWO_ROOMS)), scopes={name: "zone"})
    except ModelError as error:
        assert name in str(error)
    else:
        assert {f"{name}@A", f"{name}@B"} <= {p.name for p in network.parameters}


def test_unknown_parameter_of_a_scope_is_refused_by_name() -> None:
    with pytest.raises(ModelError, match="interior_film"):
        build_network(building(plan(*TWO_ROOMS)), scopes={"interior_film": "zone"})


def test_unknown_scope_is_refused_by_name() -> None:
    with pytest.raises(ModelError, match="room"):
        build_network(building(plan(*TWO_ROOMS)), scopes={"interior_film_coefficient": "room"})  # type: ignore[dict-item]
