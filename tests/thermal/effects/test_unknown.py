"""Heat of unknown cause: what enters the zones, by zone and with strengths that zones share."""

from collections.abc import Callable

import numpy as np
import pytest

from thermal import Case, SymbolicModel, build_network
from thermal.effects.catalogue import CATALOGUE, chosen, effect_of, is_effect
from thermal.effects.effect import Chosen
from thermal.effects.unknown import ANSWERS_TO, METERED, UNKNOWN, heat_of, inputs_of, tied
from thermal.errors import EffectError
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import signal_values

CaseOf = Callable[[str], Case]

#: Early afternoon of the first day.
STAMP = 80


def entering(case: Case, effect: Chosen, values: dict[str, float]) -> dict[str, float]:
    """Heat that an effect brings to the air of each zone at a stamp [W]."""
    network = build_network(case.building, effects=(effect,))
    rng = np.random.default_rng(0)
    signals = signal_values(network.signals, telemetry_inputs(case))[STAMP]
    full = np.concatenate([rng.normal(size=network.n_node), rng.normal(size=len(network.boundaries)), signals])
    none = dict.fromkeys(values, 0.0)
    with_it, without = (
        -np.asarray(SymbolicModel(network).matrices(network.values(v)).flow @ full) for v in (values, none)
    )
    heat = with_it - without
    found = {name: float(heat[network.zone == k].sum()) for k, name in enumerate(network.zones)}
    assert heat.sum() == pytest.approx(sum(found.values()), rel=1e-9, abs=1e-9)
    inside = {"radiant"} if effect.effect.acts_on.startswith("surfaces") else {"air"}
    assert {str(k) for k in network.kind[heat != 0.0]} <= inside
    return found


@pytest.mark.parametrize("name", UNKNOWN)
def test_heat_is_in_proportion_to_what_it_answers_to_zone_by_zone(name: str, lively_case: CaseOf) -> None:
    case = lively_case("plan")
    inputs, rooms = telemetry_inputs(case), build_network(case.building).anatomy.rooms
    zones, rng = ("B", "D"), np.random.default_rng(1)
    strengths = {zone: rng.uniform(-0.2, 0.2, len(UNKNOWN[name].parameters)) for zone in zones}
    values = {
        p.of("zone", zone).name: float(strength)
        for zone in zones
        for p, strength in zip(UNKNOWN[name].parameters, strengths[zone], strict=True)
    }
    heat = entering(case, Chosen(UNKNOWN[name], zones), values)
    for zone, room in rooms.items():
        unit = heat_of(name, zone, room.floor_area, inputs)[STAMP]
        expected = float(unit @ strengths[zone]) if zone in zones else 0.0
        assert heat[zone] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", ["heat_by_sun", METERED])
def test_shared_strengths_bring_the_heat_of_the_same_ones_zone_by_zone(name: str, lively_case: CaseOf) -> None:
    case, count = lively_case("plan"), len(UNKNOWN[name].parameters)
    weights = {"A": np.linspace(0.5, 1.0, count), "C": np.linspace(2.0, 0.0, count)}
    shared = tied(name, "some heat", weights, 0.5)
    assert [p.upper for p in shared.parameters] == [0.5 * p.upper for p in UNKNOWN[name].parameters]
    given = {p.name: 0.1 for p in shared.parameters}
    apart = {
        p.of("zone", zone).name: 0.1 * float(w)
        for zone, weight in weights.items()
        for p, w in zip(UNKNOWN[name].parameters, weight, strict=True)
    }
    one, other = entering(case, Chosen(shared), given), entering(case, Chosen(UNKNOWN[name], ("A", "C")), apart)
    assert one == pytest.approx(other, rel=1e-9, abs=1e-9)
    assert any(one.values())


def test_it_is_no_candidate_and_yet_an_effect() -> None:
    assert not set(UNKNOWN) & set(CATALOGUE) and set(UNKNOWN) == set(ANSWERS_TO)
    assert all(is_effect(name) and effect_of(name) is UNKNOWN[name] for name in UNKNOWN)
    both = chosen({"heat_by_wind": ("A",), "infiltration": ()})
    assert [c.effect.id for c in both] == ["infiltration", "heat_by_wind"]
    assert inputs_of(METERED) == ("heat",) and "sun" in inputs_of("heat_by_sun")
    with pytest.raises(EffectError, match="not in the catalogue"):
        effect_of("heat_by_magic")
