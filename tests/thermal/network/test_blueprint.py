"""Networks from one blueprint against those built from scratch: none leaves a trace in the next."""

from __future__ import annotations

import numpy as np
import pytest

from thermal import SymbolicModel, ThermalNetwork, build_network, load_bundled_case
from thermal.effects.catalogue import CATALOGUE, chosen
from thermal.network.build import blueprint

SETS: tuple[dict[str, tuple[str, ...]], ...] = (
    {name: () for name in CATALOGUE if name not in ("neighbour", "interfloor_exchange")},
    {},
    {"hidden_mass": (), "sensor_lag": ()},
)


def same(found: ThermalNetwork, wanted: ThermalNetwork) -> bool:
    """Whether matrices, signals and parameters are the same to the last bit."""
    theta = wanted.start() + 0.1 * np.array([p.upper - p.start for p in wanted.parameters])
    a, b = (SymbolicModel(network).matrices(theta) for network in (found, wanted))
    return (
        [p.name for p in found.parameters] == [p.name for p in wanted.parameters]
        and [s.name for s in found.signals] == [s.name for s in wanted.signals]
        and len(found.anatomy.outer) == len(wanted.anatomy.outer)
        and all(
            (getattr(a, name) != getattr(b, name)).nnz == 0 for name in ("capacity", "flow", "heating", "observation")
        )
    )


@pytest.mark.parametrize("dx", [1.0, 2.0])
def test_networks_of_a_blueprint_are_those_built_for_themselves(dx: float) -> None:
    building = load_bundled_case().building
    baseline = blueprint(building, dx)
    for effects in SETS:
        extensions = chosen(effects)
        assert same(baseline.network(extensions), build_network(building, dx, effects=extensions)), effects
