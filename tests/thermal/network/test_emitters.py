"""Heat of devices that does not all go to the air: shares, closed forms, derivatives, and the lumped structure."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal import Building, SymbolicModel, ThermalNetwork, ZoneTable, build_network, load_bundled_case
from thermal.case.building import Commanded, Device, Layer, Location, Surface, ZoneEntry
from thermal.effects.catalogue import chosen
from thermal.inputs.provider import InputProvider
from thermal.model.modal import modal_model
from thermal.model.reduce import reduced_model
from thermal.network.emitters import pipes_at, shared_at
from thermal.network.structure import Structure
from thermal.units import air_density

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")
AIR = air_density(690.0) * 1006.0  # J/m3/K
SCREED = Layer(thickness=0.06, conductivity=1.2, density=2000.0, heat_capacity=1000.0)
FOAM = Layer(thickness=0.08, conductivity=0.035, density=30.0, heat_capacity=1450.0)
CONCRETE = Layer(thickness=0.2, conductivity=2.0, density=2400.0, heat_capacity=1000.0)
BARE = Structure(furniture=False, radiant=False, wall_nodes=1)


def house(emitter: str | None, floor: tuple[Layer, ...] = (SCREED, FOAM, CONCRETE), **other: Any) -> Building:
    """A room above a cellar, beside another above the ground, each with a heater."""
    faces: list[dict[str, Any]] = [
        {"name": "F", "kind": "floor", "zone": "room", "other": "cellar", "area": 20.0, "construction": "floor"},
        {"name": "G", "kind": "floor", "zone": "hall", "other": "ground", "area": 10.0, "construction": "floor"},
        {"name": "W", "kind": "wall", "zone": "room", "other": "outdoor", "area": 15.0, "azimuth": 180.0,
         "construction": "wall"},
        {"name": "I", "kind": "wall", "zone": "room", "other": "hall", "area": 9.0, "construction": "wall"},
        {"name": "B", "kind": "bridge", "zone": "hall", "other": "outdoor", "area": 2.0, "u_value": 5.0},
    ]  # fmt: skip
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0), ZoneEntry(name="hall", volume=26.0, floor_area=10.0))
    table = ZoneTable(zones, tuple(Surface(**f) for f in faces), {"floor": floor, "wall": (CONCRETE, FOAM)})
    heaters = tuple(
        Device(name=f"H_{z}", type="radiator", zone=z, emitter=cast(Any, emitter)) for z in ("room", "hall")
    )
    return Building("house", SITE, 0.0, table, devices=heaters, **other)


def heat_at(network: ThermalNetwork, theta: FloatArray | None = None) -> FloatArray:
    """Heat of each emitter's signal at the nodes, shape (n_node, n_signal) [W/W], with what enters the air already."""
    m = SymbolicModel(network).matrices(network.start() if theta is None else theta)
    mine = [k for k, s in enumerate(network.signals) if s.name.startswith("heat by")]
    driven = -sp.csr_matrix(m.flow).toarray()[:, m.n + len(network.boundaries) :][:, mine]
    return np.asarray(driven + network.heating.toarray()[:, : len(mine)])


def test_pipes_lie_at_the_foot_of_a_screed_and_in_the_middle_of_a_slab() -> None:
    assert pipes_at((SCREED, FOAM, CONCRETE)) == pytest.approx(0.05)
    assert pipes_at((CONCRETE, FOAM, SCREED)) == pytest.approx(0.05)  # 0.1 m of concrete at 2 W/m/K
    assert pipes_at((SCREED, CONCRETE)) == pytest.approx(0.05 + 0.05)
    assert pipes_at((FOAM, CONCRETE)) == pytest.approx(0.08 / 0.035)  # nothing lies before the insulation


def test_heat_between_two_nodes_is_shared_by_their_resistances() -> None:
    nodes, share = shared_at(0.3, np.array([7, 8, 9]), np.array([0.1, 0.25, 0.45]))
    assert nodes.tolist() == [8, 9] and share == pytest.approx([0.75, 0.25])
    for beyond, node in ((0.05, 7), (0.5, 9)):
        found, whole = shared_at(beyond, np.array([7, 8, 9]), np.array([0.1, 0.25, 0.45]))
        assert found.tolist() == [node] and whole.tolist() == [1.0]


@pytest.mark.parametrize("emitter", ["radiator", "baseboard", "floor", "ceiling", None])
@pytest.mark.parametrize("structure", [Structure(), BARE, Structure(lumped=True)])
def test_all_heat_arrives_and_all_of_it_leaves(emitter: str | None, structure: Structure) -> None:
    network = build_network(house(emitter), structure=replace(structure, emitter="floor"))
    heat = heat_at(network)
    assert heat.shape[1] == 2 and np.abs(heat.sum(axis=0) - 1.0).max() < 1e-9
    m = SymbolicModel(network).matrices(network.start())
    flow = sp.csr_matrix(m.flow).toarray()
    rest = np.linalg.solve(flow[:, : m.n], heat)  # steady, all boundaries at 0
    lost = -flow[:, m.n : m.n + len(network.boundaries)].sum(axis=1) @ rest
    assert np.abs(lost - 1.0).max() < 1e-9


def test_where_the_heat_arrives() -> None:
    shares = {}
    for emitter in ("radiator", "baseboard", "floor", "ceiling"):
        network = build_network(house(emitter))
        heat = heat_at(network)[:, 0]
        shares[emitter] = {k: heat[(network.kind == k) & (network.zone == 0)].sum() for k in ("air", "radiant", "slab")}
    assert shares["radiator"] == pytest.approx({"air": 0.67, "radiant": 0.33, "slab": 0.0})
    assert shares["baseboard"] == pytest.approx({"air": 0.8, "radiant": 0.2, "slab": 0.0})
    for emitter in ("floor", "ceiling"):
        assert shares[emitter] == pytest.approx({"air": 0.0, "radiant": 0.0, "slab": 1.0}, abs=1e-12)


def test_a_heated_screed_is_a_node_of_two() -> None:
    """Air and screed of the hall alone: steady state and time constants in closed form."""
    building = house("floor", floor=(SCREED,))
    network = build_network(building, structure=BARE)
    theta = network.values({"screed_heat_capacity_multiplier": 1.2, "screed_conductivity_multiplier": 0.8})
    film = dict(zip([p.name for p in network.parameters], theta, strict=True))["combined_film_coefficient"]
    m = SymbolicModel(network).matrices(theta)
    hall = np.flatnonzero((network.zone == 1) & np.isin(network.kind, ["air", "slab"]))
    flow, heat = sp.csr_matrix(m.flow).toarray(), heat_at(network, theta)
    # the partition's node and the room are far: what leads there is left out
    between = np.array([[0.0, -flow[hall[0], hall[1]]], [-flow[hall[1], hall[0]], 0.0]])
    outward = -flow[hall, m.n]
    k = np.diag(between.sum(axis=1) + outward) - between
    c = np.diag(sp.csr_matrix(m.capacity).toarray().diagonal()[hall])
    g = 10.0 / (1.0 / film + 0.03 / (0.8 * 1.2))  # half of the screed and the film, 10 m2
    ua, c_air, c_screed = 10.0, AIR * 26.0, 1.2 * 0.06 * 2000.0 * 1000.0 * 10.0
    assert heat[hall, 1] == pytest.approx([0.0, 1.0]) and between[0, 1] == pytest.approx(g)
    steady = np.linalg.solve(k, 500.0 * heat[hall, 1])
    assert steady == pytest.approx([500.0 / ua, 500.0 / ua + 500.0 / g], rel=1e-9)
    trace, product = (g + ua) / c_air + g / c_screed, g * ua / (c_air * c_screed)
    root = np.sqrt(trace**2 - 4.0 * product)
    assert la.eigh(k, c, eigvals_only=True) == pytest.approx([(trace - root) / 2, (trace + root) / 2], rel=1e-9)


@pytest.mark.parametrize("lumped", [False, True])
def test_derivatives_are_those_of_differences(lumped: bool) -> None:
    network = build_network(house(None), structure=Structure(lumped=lumped, emitter="floor"))
    model, theta = SymbolicModel(network), network.start() * 1.1 + 0.01
    names = [p.base for p in network.parameters]
    mine = {"floor_heat_share", "radiator_radiant_share", "screed_conductivity_multiplier"}
    assert mine | {"screed_heat_capacity_multiplier"} <= set(names)
    exact = model.matrices(theta, True)
    for i in (i for i, name in enumerate(names) if name in mine or name.startswith("screed")):
        step = 1e-5 * theta[i] * np.eye(theta.size)[i]
        up, down = model.matrices(theta + step), model.matrices(theta - step)
        for wanted, above, below in (
            (exact.flow_sensitivities[i], up.flow, down.flow),
            (exact.capacity_sensitivities[i], up.capacity, down.capacity),
        ):
            moved = (sp.csr_matrix(above) - sp.csr_matrix(below)).toarray() / (2e-5 * theta[i])
            scale = max(float(np.abs(moved).max()), 1e-12)
            assert np.abs(sp.csr_matrix(wanted).toarray() - moved).max() < 1e-6 * scale


def test_layers_that_no_drawing_has_are_laid() -> None:
    building = house("ceiling")
    assert (heat_at(build_network(building))[:, 0] > 0.0).sum() == 1
    plan = load_bundled_case().building
    heated = replace(plan, devices=(Device(name="H", type="other", zone="F1_N", emitter="floor"),))
    for slab_nodes in (2, 0):
        network = build_network(heated, dx=1.0, structure=Structure(slab_nodes=slab_nodes))
        (node,) = np.flatnonzero(heat_at(network)[:, 0] > 1e-9)
        assert network.kind[node] == "slab" and network.zone[node] == network.zones.index("F1_N")
        assert len(network.anatomy.rooms["F1_N"].floor) == slab_nodes


def test_a_lumped_layer_gives_its_heat_where_the_drawing_does() -> None:
    drawn, lumped = (build_network(house("floor"), structure=Structure(lumped=k)) for k in (False, True))
    screed, beside = (np.flatnonzero((lumped.kind == "screed") & (lumped.zone == zone))[0] for zone in (0, 1))
    m = SymbolicModel(lumped).matrices(lumped.start())
    whole = -sp.csr_matrix(m.flow).toarray()[:, : m.n + len(lumped.boundaries)]
    row = whole[screed] - whole[screed, beside] / whole[beside, beside] * whole[beside]  # the hall's gets no heat
    row[[screed, beside]] = 0.0
    detailed = SymbolicModel(drawn).matrices(drawn.start())
    flow = sp.csr_matrix(detailed.flow).toarray()
    air = np.isin(np.arange(detailed.n), np.flatnonzero(drawn.kind == "air"))
    heat = heat_at(drawn)[:, 0]
    warmed = np.linalg.solve(flow[~air][:, : detailed.n][:, ~air], heat[~air])  # airs and boundaries at 0
    airs = -flow[air][:, : detailed.n][:, ~air] @ warmed
    cellar = -flow[~air, detailed.n + drawn.boundaries.index("cellar")] @ warmed
    at = lumped.boundaries.index("cellar") + m.n
    assert row[: m.n][np.flatnonzero(lumped.kind == "air")] / row.sum() == pytest.approx(airs, abs=2e-3)
    assert row[at] / row.sum() == pytest.approx(cellar, rel=2e-3) and 0.01 < cellar < 0.2


def sums(building: Building, structure: Structure) -> tuple[FloatArray, FloatArray, float]:
    """Rise of the zones by 1000 and 500 W in the air, and where the emitters give it, with boundaries at 0 [K], and C."""
    network = build_network(building, structure=structure)
    theta = network.start()
    for i, parameter in enumerate(network.parameters):
        theta[i] = 1.0 if parameter.base == "air_capacity_multiplier" else theta[i]
    m = SymbolicModel(network).matrices(theta)
    flow = sp.csr_matrix(m.flow).toarray()[:, : m.n]
    given, emitted = network.heating.toarray() @ np.array([1000.0, 500.0]), network.emitted @ np.array([1000.0, 500.0])
    driven = -sp.csr_matrix(m.flow).toarray()[:, m.n + len(network.boundaries) :]
    emitted = given + driven @ emitted
    rises = (sp.csr_matrix(network.observation).toarray() @ np.linalg.solve(flow, q) for q in (given, emitted))
    return *rises, float(sp.csr_matrix(m.capacity).sum())


def both(kinds: tuple[str, str], floor: tuple[Layer, ...]) -> Building:
    """The house with two emitters in the room, those of the hall first."""
    plain = house("floor", floor=floor)
    mine = [Device(name=f"E{n}", type="other", zone="room", emitter=cast(Any, kind)) for n, kind in enumerate(kinds)]
    return replace(plain, devices=(plain.devices[1], *mine))


@pytest.mark.parametrize("emitter", ["floor", "ceiling", "both"])
@pytest.mark.parametrize("floor", [(SCREED, FOAM, CONCRETE), (SCREED, CONCRETE), (SCREED,)])
@pytest.mark.parametrize("structure", [Structure(), Structure(wall_nodes=2), BARE])
def test_a_lumped_building_counts_its_heated_layers_once(
    emitter: str, floor: tuple[Layer, ...], structure: Structure
) -> None:
    building = both(("floor", "ceiling"), floor) if emitter == "both" else house(emitter, floor=floor)
    lumped = replace(structure, lumped=True)
    drawn, found = sums(building, structure), sums(building, lumped)
    plain, kept = sums(house(None, floor=floor), structure), sums(house(None, floor=floor), lumped)
    # what lumping itself changes without emitters: the least conductances, and what follows the boundaries
    slack = np.abs(1.0 - kept[0] / plain[0]) + 0.005
    assert (np.abs(1.0 - found[0] / drawn[0]) < slack).all(), "heat of the air"
    assert (np.abs(1.0 - found[1] / drawn[1]) < slack).all(), "heat of the layers"
    assert kept[2] * 0.999 < found[2] < drawn[2] * 1.001


def test_a_slab_is_heated_from_both_sides() -> None:
    """Floor of a room and ceiling of that below in one slab: no layer is made up, with one emitter or with two."""
    layers = (SCREED, CONCRETE, SCREED)
    between = Surface(name="S", kind="floor", zone="room", other="hall", area=10.0, construction="between")
    buildings = {}
    for kinds in (("floor", None), (None, "ceiling"), ("floor", "ceiling")):
        plain = house(None)
        table = cast(ZoneTable, plain.geometry)
        constructions = {**table.constructions, "between": layers}
        table = ZoneTable(table.zones, (*table.surfaces[2:], between), constructions)
        own = tuple(d.model_copy(update={"emitter": k}) for d, k in zip(plain.devices, kinds, strict=True))
        buildings[kinds] = replace(plain, geometry=table, devices=own)
    networks = {kinds: build_network(b) for kinds, b in buildings.items()}
    assert len({n.n_node for n in networks.values()}) == 1
    heated = networks["floor", "ceiling"].anatomy.heated
    for key in (("floor", None), (None, "ceiling")):
        ((side, (alone,)),) = networks[key].anatomy.heated.items()
        (layer,) = heated[side]
        assert layer.node.tolist() == alone.node.tolist() and layer.share == pytest.approx(alone.share)
    slabs = [heat_at(n)[n.kind == "slab"].sum(axis=0) for n in networks.values()]
    assert [s.tolist() for s in slabs] == [pytest.approx([1.0]), pytest.approx([1.0]), pytest.approx([1.0, 1.0])]
    # lumped, the pipes in one place are two nodes
    for building in buildings.values():
        drawn, found = sums(building, Structure()), sums(building, Structure(lumped=True))
        assert found[0] == pytest.approx(drawn[0], rel=0.03) and found[1] == pytest.approx(drawn[1], rel=0.03)


def test_effects_of_a_meter_follow_the_heat() -> None:
    network = build_network(house("floor"), effects=chosen({"flow_gain": (), "clock_shift": ()}))
    theta = network.values({"flow_gain@room": 0.1, "heat_clock_shift": 0.5})
    m = SymbolicModel(network).matrices(theta)
    driven = -sp.csr_matrix(m.flow).toarray()[:, m.n + len(network.boundaries) :]
    slab, air = ((network.kind == kind) & (network.zone == 0) for kind in ("slab", "air"))
    column = {s.name: k for k, s in enumerate(network.signals)}
    emitted, rate = column["heat by floor in room"], column["change of heat by floor in room"]
    assert driven[slab, emitted].sum() == pytest.approx(1.1) and driven[air, emitted].sum() == pytest.approx(-1.1)
    assert driven[slab, rate].sum() == pytest.approx(-0.5) and driven[air, rate].sum() == pytest.approx(0.5)
    assert driven[air, column["heat of room"]].sum() == pytest.approx(0.1)


def test_heat_over_a_limit_is_taken_from_the_layer() -> None:
    network = build_network(house("floor"), effects=chosen({"capacity_limit": ("room",)}))
    told = {"heat": np.array([[900.0, 1.0]]), "emitted": np.array([[900.0, 1.0]])}
    most = np.array([[1000.0, 0.0]])
    inputs = cast(InputProvider, SimpleNamespace(
        zones=("room", "hall"), largest_heat=most, values=told.__getitem__, **told
    ))  # fmt: skip
    theta = network.values({"capacity_lost@room": 0.2})
    m = SymbolicModel(network).matrices(theta)
    driven = -sp.csr_matrix(m.flow).toarray()[:, m.n + len(network.boundaries) :]
    values = np.array([float(s.of(inputs)[0]) for s in network.signals])
    heat = driven @ values + network.heating @ told["heat"][0]
    slab = (network.kind == "slab") & (network.zone == 0)
    assert heat[slab].sum() == pytest.approx(800.0) and heat[(network.kind == "air") & (network.zone == 0)] == 0.0


def test_a_valve_opens_a_floor_too() -> None:
    told = (Commanded("H_room", "room", "valve", ("H_room/valve",)),)
    network = build_network(house("floor", commanded=told))
    column = [s.name for s in network.signals].index("valve of H_room")
    m = SymbolicModel(network).matrices(network.start())
    heat = -sp.csr_matrix(m.flow).toarray()[:, m.n + len(network.boundaries) + column]
    slab = (network.kind == "slab") & (network.zone == 0)
    assert heat[slab].sum() == pytest.approx(60.0 * 20.0) and heat.sum() == pytest.approx(1200.0)


def test_what_is_not_said_goes_to_the_air_as_before() -> None:
    assert build_network(house(None)).signals == build_network(house("air")).signals == ()
    vav = replace(house(None), devices=(Device(name="V", type="vav", zone="room"),))
    assert build_network(vav, structure=Structure(emitter="floor")).signals == ()


def test_priors_are_as_wide_as_the_geometry_leaves_them() -> None:
    widths = [
        next(p.prior_deviation for p in build_network(house("floor", geometry_quality=q)).parameters if "screed" in p.name)
        for q in ("surveyed", "approximate", "generic")
    ]
    assert widths == pytest.approx(np.log([2.0, 3.0, 6.0]) / 2.0)
    zoned = build_network(house("floor"), scopes={"screed_heat_capacity_multiplier": "zone"})
    assert {p.member for p in zoned.parameters if p.base == "screed_heat_capacity_multiplier"} == {"room", "hall"}
    key = next(c for c in zoned.capacities if c.name == "screed@hall")
    assert ca.depends_on(key.value, zoned.symbols)


def test_planned_heat_reaches_the_layer_too() -> None:
    """Modes that a controller predicts with: heat of zones and the signals that follow from it are one matrix."""
    network = build_network(house("floor"), effects=chosen({"flow_gain": ()}))
    grid = SymbolicModel(network)
    matrices = reduced_model(grid, [network.start()]).matrices(network.start())
    modes, heat = modal_model(matrices), np.array([700.0, 300.0])
    signals = network.emitted @ heat
    assert signals.tolist() == [700.0, 300.0, 0.0, 0.0]
    apart = modes.heating @ heat + modes.boundary[:, len(network.boundaries) :] @ signals
    assert np.abs(modes.heated_by_devices @ heat - apart).max() < 1e-9 * np.abs(apart).max()
    assert modes.uniform @ modes.heated_by_devices == pytest.approx([1.0, 1.0], abs=1e-9)
    shared = house("floor")
    beside = replace(shared, devices=(*shared.devices, Device(name="V", type="vav", zone="room")))
    assert build_network(beside).emitted.tolist() == [[0.0, 0.0], [0.0, 1.0]]
