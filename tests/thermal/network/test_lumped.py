"""The lumped structure: its sums are the drawing's, and it steps like any network."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import scipy.sparse as sp

from thermal.case.building import Building
from thermal.data import load_bundled_case
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.model.matrices import SymbolicModel
from thermal.network.build import build_network
from thermal.network.network import ThermalNetwork
from thermal.network.structure import Structure


@pytest.fixture(scope="module")
def building() -> Building:
    return load_bundled_case().building


def _steady_loss(network: ThermalNetwork) -> np.ndarray:
    """Heat that each zone takes to stay 1 K above all boundaries [W/K], with every zone's air at one temperature."""
    m = SymbolicModel(network).matrices(network.start())
    flow = sp.csr_matrix(m.flow)[:, : m.n].toarray()
    observed = (sp.csr_matrix(network.observation) != 0).astype(float).toarray()
    air = observed.sum(axis=0) > 0
    rest = ~air
    loss = observed[:, air] @ (flow[air][:, air].sum(axis=1) - _eliminated(flow, air, rest))
    return np.asarray(loss)


def _eliminated(flow: np.ndarray, air: np.ndarray, rest: np.ndarray) -> np.ndarray:
    inside = flow[np.ix_(rest, rest)] + 1e-9 * np.eye(rest.sum())
    return np.asarray((flow[np.ix_(air, rest)] @ np.linalg.solve(inside, flow[np.ix_(rest, air)])).sum(axis=1))


def test_a_lumped_building_loses_what_the_drawing_loses(building: Building) -> None:
    drawn = build_network(building, dx=1.0)
    lumped = build_network(replace(building, geometry_quality="generic"), dx=1.0, structure=Structure(lumped=True))
    assert lumped.n_node == 2 * len(lumped.zones)
    # the least conductances, 0.01 W/m2/K, that let a multiplier find what no drawing shows are all that is added
    surveyed = build_network(building, dx=1.0, structure=Structure(lumped=True))
    added = _steady_loss(surveyed) - _steady_loss(drawn)
    assert (added > -1e-6).all()
    assert (added < 0.0101 * np.array([drawn.anatomy.rooms[z].floor_area for z in drawn.zones])).all()
    assert _steady_loss(lumped).sum() >= _steady_loss(surveyed).sum() * 0.999


def test_heat_capacities_are_the_drawings_where_it_follows_the_zone(building: Building) -> None:
    drawn, lumped = (build_network(building, dx=1.0, structure=Structure(lumped=k)) for k in (False, True))
    values = {}
    for network in (drawn, lumped):
        heat = ca.Function("c", [network.symbols], [ca.vertcat(*[c.value for c in network.capacities])])
        theta = network.start()
        for i, p in enumerate(network.parameters):
            if p.base == "air_capacity_multiplier":
                theta[i] = 1.0
        each = np.array(heat(theta)).ravel()
        values[network.n_node] = sum(k * c.weight.sum() for k, c in zip(each, network.capacities, strict=True))
    assert 0.4 * values[drawn.n_node] < values[lumped.n_node] <= values[drawn.n_node] * (1.0 + 1e-9)


def test_generic_geometry_joins_all_zones_and_surveyed_the_drawn_ones(building: Building) -> None:
    def pairs(quality: str) -> int:
        network = build_network(replace(building, geometry_quality=quality), dx=1.0, structure=Structure(lumped=True))
        return sum(p.base == "zone_coupling_multiplier" for p in network.parameters)

    count = len(building.zone_names)
    assert pairs("generic") == count * (count - 1) // 2
    assert 0 < pairs("surveyed") <= pairs("generic")


def test_priors_are_as_wide_as_the_geometry_is_unknown(building: Building) -> None:
    widths = []
    for quality in ("surveyed", "approximate", "generic"):
        network = build_network(replace(building, geometry_quality=quality), dx=1.0, structure=Structure(lumped=True))
        widths.append(next(p.prior_deviation for p in network.parameters if p.base == "mass_capacity_multiplier"))
    assert widths == pytest.approx([np.log(3) / 2, np.log(6) / 2, np.log(30) / 2])


def test_the_sun_takes_irradiance_and_enters_from_five_directions(building: Building) -> None:
    sunny = build_network(building, dx=1.0, structure=Structure(lumped=True, sun=True))
    apertures = [p for p in sunny.parameters if p.base == "solar_aperture"]
    assert len(apertures) == 5 * len(building.zone_names)
    assert {s.name for s in sunny.signals} >= {"sun from south", "sun from roof", "constant"}
    assert all(p.lower == 0.0 for p in apertures)


def test_a_recurring_gain_is_its_wave_times_the_floor(building: Building) -> None:
    network = build_network(building, dx=1.0, structure=Structure(lumped=True, recurring=True))
    theta = network.start()
    names = [p.name for p in network.parameters]
    zone = network.zones[1]
    theta[names.index(f"recurring_gain@{zone}, cos of 12 h")] = 2.0
    inputs = telemetry_inputs(load_bundled_case())
    signals = signal_values(network.signals, inputs)
    brought = SymbolicModel(network).matrices(theta)
    columns = brought.flow.toarray()[:, brought.n + len(network.boundaries) :]
    assert columns.shape[1] == signals.shape[1]
    heat = -signals @ columns[: network.n_node].T
    expected = 2.0 * network.anatomy.rooms[zone].floor_area * np.cos(4.0 * np.pi * inputs.clock / 24.0)
    air = int(network.anatomy.rooms[zone].air[0])
    assert heat[:, air] == pytest.approx(expected, abs=1e-9)
    assert np.delete(heat, air, axis=1) == pytest.approx(0.0)
