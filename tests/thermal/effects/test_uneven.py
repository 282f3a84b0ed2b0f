"""Rooms that differ in what acts on all of them: people, leaks, the sun."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from calibration.evaluation.settings import calibration_settings
from thermal import Case, ModelError, SymbolicModel, ThermalNetwork, build_network
from thermal.case.building import Building
from thermal.effects.catalogue import chosen
from thermal.network.structure import MAY_DIFFER, Structure

CaseOf = Callable[[str], Case]

#: Strengths of each effect, and what a room's share of it is called.
STRENGTHS: dict[str, tuple[dict[str, float], str]] = {
    "internal_gains": ({"internal_gain": 9.0, "base_load": 2.0}, "internal_gain_room_share"),
    "infiltration": (
        {"infiltration_rate": 0.4, "infiltration_by_wind": 0.1, "infiltration_by_stack": 0.05}, "infiltration_room_share",
    ),
    "solar_gain": ({"solar_heat_gain_coefficient": 0.4}, "solar_room_share"),
}  # fmt: skip


@pytest.fixture(params=["table", "plan"])
def building(lively_case: CaseOf, request: pytest.FixtureRequest) -> Building:
    return lively_case(request.param).building


def terms(network: ThermalNetwork, **values: float) -> Any:
    """What an effect adds to the equations of all nodes, shape (n_node, n_node + n_boundary)."""
    model = SymbolicModel(network)
    nothing, something = (model.matrices(network.values(v)).flow.toarray() for v in ({}, values))
    return something - nothing


@pytest.mark.parametrize("effect", MAY_DIFFER)
def test_each_room_has_a_share_of_its_own(building: Building, effect: str) -> None:
    strengths, share = STRENGTHS[effect]
    even = build_network(building, effects=chosen([effect]))
    uneven = build_network(building, effects=chosen([effect]), structure=Structure(uneven=(effect,)))
    whole = terms(even, **strengths)
    np.testing.assert_allclose(terms(uneven, **strengths), whole, rtol=1e-9, atol=1e-9)
    rooms = [p.member for p in uneven.parameters if p.base == share]
    assert rooms and not any(p.base == share for p in even.parameters)
    for room in rooms:
        moved = terms(uneven, **strengths, **{f"{share}@{room}": 1.7})
        own = np.abs(moved - whole).max(axis=1) > 1e-9
        np.testing.assert_allclose(moved[own], 1.7 * whole[own], rtol=1e-9, atol=1e-9)
        number = uneven.zones.index(str(room))
        assert own.any() and set(uneven.zone[own]) <= {number, -1}
        assert own[(uneven.zone == number) & (np.abs(whole).max(axis=1) > 1e-9)].all()


def test_rooms_that_are_named_have_strengths_and_no_shares(building: Building) -> None:
    zones = building.zone_names[:1]
    network = build_network(
        building, effects=chosen({"internal_gains": zones}), structure=Structure(uneven=("internal_gains",))
    )
    assert not any("room_share" in p.name for p in network.parameters)


def test_a_structure_comes_back_from_a_file_and_other_effects_are_refused() -> None:
    read = calibration_settings(None, {"structure": {"uneven": ["infiltration", "solar_gain"]}})
    assert read.structure == Structure(uneven=("infiltration", "solar_gain"))
    for wrong in (("zone_mixing",), "infiltration", None, 1, [["infiltration"]]):
        with pytest.raises(ModelError, match="structure.uneven: expected some of"):
            Structure(uneven=wrong)  # type: ignore[arg-type]
