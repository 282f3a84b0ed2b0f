"""Where the heat of people goes in a building that has zones which nothing heats, cools or ventilates."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from thermal import Case, SymbolicModel, ThermalNetwork, build_network
from thermal.case.building import Building
from thermal.effects.catalogue import chosen
from thermal.effects.gains import daily_course, has_people
from thermal.network.structure import Structure

CaseOf = Callable[[str], Case]

FLOOR = {"A": 20.0, "B": 16.0}  # m2


def heat_by_zone(network: ThermalNetwork, signal: str, **values: float) -> dict[str, float]:
    """Heat that enters each zone for a signal of 1, by the difference from no strength [W]."""
    column = network.n_node + len(network.boundaries) + [s.name for s in network.signals].index(signal)
    nothing, with_it = (
        SymbolicModel(network).matrices(network.values(v)).flow.toarray()[: network.n_node, column]
        for v in ({}, values)
    )
    heat = nothing - with_it
    return {zone: float(heat[network.zone == k].sum()) for k, zone in enumerate(network.zones)}


@pytest.fixture
def building(lively_case: CaseOf) -> Building:
    return lively_case("table").building


@pytest.fixture
def unserved(building: Building) -> Building:
    """The same, with nothing in B."""
    devices = tuple(d for d in building.devices if d.zone != "B")
    assert "A" in {d.zone for d in devices} and len(devices) < len(building.devices)
    return replace(building, devices=devices)


def test_a_zone_without_a_device_has_a_share_of_peoples_heat(unserved: Building) -> None:
    network = build_network(unserved, effects=chosen(["internal_gains"]))
    for signal, name in (("presence", "internal_gain"), ("constant", "base_load")):
        heat = heat_by_zone(network, signal, **{name: 5.0, "internal_gain_unserved_share": 0.3})
        assert heat == pytest.approx({"A": 5.0 * FLOOR["A"], "B": 0.3 * 5.0 * FLOOR["B"]}, rel=1e-9)


def test_there_is_no_share_where_every_zone_is_served_or_no_device_says_which(building: Building) -> None:
    nobody = tuple(d for d in building.devices if d.zone is None)
    for devices in (building.devices, nobody):
        network = build_network(replace(building, devices=devices), effects=chosen(["internal_gains"]))
        assert not any(p.name == "internal_gain_unserved_share" for p in network.parameters)
        heat = heat_by_zone(network, "presence", internal_gain=5.0)
        assert heat == pytest.approx({zone: 5.0 * area for zone, area in FLOOR.items()}, rel=1e-9)


def test_rooms_that_are_named_have_hours_of_their_own(building: Building) -> None:
    network = build_network(building, effects=chosen({"internal_gains": ["A", "B"]}))
    names = [p.name for p in network.parameters if p.effect]
    assert len(names) == 14 and {name.partition("@")[2].partition(",")[0] for name in names} == {"A", "B"}
    assert {p.effect for p in network.parameters if p.effect} == {"internal_gains"}
    given = {"internal_gain_mean@A": 4.0, "internal_gain_wave@A, cos of 12 h": 2.0}
    for signal, strength in (("constant", 4.0), ("cos of 12 h", 2.0)):
        assert heat_by_zone(network, signal, **given) == pytest.approx({"A": strength * FLOOR["A"], "B": 0.0}, rel=1e-9)
    assert daily_course("A", given)[[0, 3, 6, 9, 12]] == pytest.approx([6.0, 4.0, 2.0, 4.0, 6.0])
    assert not daily_course("B", given).any()


def test_some_rooms_that_are_named_have_equipment(building: Building) -> None:
    network = build_network(building, effects=chosen({"internal_gains": ["A"]}))
    assert [p.name for p in network.parameters if p.effect] == [
        "equipment_gain@A", "scheduled_gain@A", "switched_heat@A",
    ]  # fmt: skip
    heat = heat_by_zone(network, "constant", **{"equipment_gain@A": 4.0})
    assert heat == pytest.approx({"A": 4.0 * FLOOR["A"], "B": 0.0}, rel=1e-9)
    heat = heat_by_zone(network, "presence", **{"scheduled_gain@A": 6.0})
    assert heat == pytest.approx({"A": 6.0 * FLOOR["A"], "B": 0.0}, rel=1e-9)
    heat = heat_by_zone(network, "heat seen on in A", **{"switched_heat@A": 900.0})
    assert heat == pytest.approx({"A": 900.0, "B": 0.0}, rel=1e-9)


def test_equipment_of_some_rooms_is_nobodys_heat(building: Building) -> None:
    for zones, people in (((), True), (("A", "B"), True), (("A",), False)):
        assert has_people(building, {"internal_gains": zones}) is people
    assert not has_people(building, {"solar_gain": ()})


def test_moisture_is_seen_by_what_cools_the_air(unserved: Building) -> None:
    network = build_network(unserved, effects=chosen(["latent_load"]))
    assert heat_by_zone(network, "presence", latent_load=5.0) == pytest.approx({"A": -5.0 * FLOOR["A"], "B": 0.0})


def test_the_lumped_model_knows_too(unserved: Building) -> None:
    network = build_network(unserved, structure=Structure(lumped=True), effects=chosen(["internal_gains"]))
    heat = heat_by_zone(network, "presence", internal_gain=5.0, internal_gain_unserved_share=0.3)
    assert heat["B"] / heat["A"] == pytest.approx(0.3 * FLOOR["B"] / FLOOR["A"], rel=1e-9)
