"""Outdoor air that fans bring, against its equation by day, in the evening and at night."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from thermal import Case, SymbolicModel, build_network
from thermal.effects.catalogue import chosen
from thermal.effects.effect import ALIKE
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.units import air_density

CaseOf = Callable[[str], Case]
VOLUME, REFERENCE = {"A": 50.0, "B": 40.0}, 293.15  # m3, K
AIR = air_density(690.0) * 1006.0  # J/m3/K


def brought(case: Case, zones: tuple[str, ...], values: dict[str, float], hour: int) -> dict[str, float]:
    """Heat that the effect brings to each zone at its usual temperature [W], by the difference from no strength."""
    network = build_network(case.building, effects=chosen({"ventilation": zones}))
    drivers = telemetry_inputs(case)
    stamp = int(np.argmax(case.telemetry.frame.index.hour == hour))
    full = np.concatenate([
        drivers.usual[stamp, network.zone] - REFERENCE, np.zeros(len(network.boundaries)),
        signal_values(network.signals, drivers)[stamp],
    ])  # fmt: skip
    full[network.n_node] = drivers.outdoor[stamp] - REFERENCE
    none = {p.name: 0.0 for p in network.parameters if p.effect}
    with_it, without = (
        -np.asarray(SymbolicModel(network).matrices(network.values(v)).flow @ full) for v in ({**none, **values}, none)
    )
    return {z: float((with_it - without)[network.zone == k].sum()) for k, z in enumerate(network.zones)}


@pytest.mark.parametrize("hour", [2, 7, 14, 20, 23])
def test_fans_bring_air_with_people_and_at_night(lively_case: CaseOf, hour: int) -> None:
    case = lively_case("table")
    drivers, stamp = telemetry_inputs(case), int(np.argmax(case.telemetry.frame.index.hour == hour))
    heat = brought(case, (), {"ventilation_with_people@A": 2.0, "ventilation_at_night@B": 3.0}, hour)
    people, night = float(drivers.occupancy[stamp]), float(hour < 6 or hour >= 22)
    for k, (zone, rate) in enumerate({"A": 2.0 * people, "B": 3.0 * night}.items()):
        colder = float(drivers.outdoor[stamp] - drivers.usual[stamp, k])
        assert heat[zone] == pytest.approx(AIR * VOLUME[zone] * rate / 3600.0 * colder, rel=1e-9, abs=1e-9)


def test_fans_of_all_zones_share_a_rate(lively_case: CaseOf) -> None:
    case = lively_case("table")
    heat = brought(case, ALIKE, {"ventilation_at_night": 1.5}, 2)
    apart = brought(case, (), {f"ventilation_at_night@{z}": 1.5 for z in VOLUME}, 2)
    assert heat == pytest.approx(apart, rel=1e-12) and all(watts < 0.0 for watts in heat.values())
