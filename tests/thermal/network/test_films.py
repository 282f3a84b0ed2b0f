"""Films: in series, at a massless surface against its node, and as they follow wind and temperature difference."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pandas as pd
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.thermal.conftest import listed_building
from thermal.case.building import Building
from thermal.data import load_bundled_case
from thermal.inputs.normalisation import Normalisation
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import signal_values
from thermal.model.matrices import SymbolicModel
from thermal.network.build import build_network
from thermal.network.network import ThermalNetwork
from thermal.network.structure import RATED_OUTSIDE_FILM, Structure, series, surface_mesh

FloatArray = NDArray[np.float64]
WINDY, STILL = Structure(wind_films=True), Structure(natural_films=True)


@pytest.fixture
def flat() -> Building:
    return listed_building()


def eliminated(conductances: list[float]) -> FloatArray:
    """Schur complement of a star's centre: conductances between its arms, by dense algebra."""
    n = len(conductances)
    laplacian = np.diag([*conductances, sum(conductances)])
    laplacian[:n, n] = laplacian[n, :n] = -np.array(conductances)
    left = laplacian[:n, :n] - np.outer(laplacian[:n, n], laplacian[n, :n]) / laplacian[n, n]
    return np.asarray(-left)


@pytest.mark.parametrize("values", [(2.5, 5.0, 13.3), (1.0, 8.0, 0.01), (6.0, 1e-6, 400.0)])
def test_mesh_of_a_surface_is_its_schur_complement(values: tuple[float, float, float]) -> None:
    mesh = eliminated(list(values))
    found = surface_mesh(*values)
    assert found == pytest.approx((mesh[0, 2], mesh[1, 2], mesh[0, 1]), rel=1e-12)


def test_mesh_carries_the_flows_of_the_surface_node() -> None:
    """Hand-worked: air 20, radiant node 22, solid 10; the surface settles at (2*20 + 4*22 + 6*10) / 12 = 15.6667."""
    to_air, to_radiant, across = surface_mesh(2.0, 4.0, 6.0)
    surface = 188.0 / 12.0
    assert to_air * (20 - 10) + across * (20 - 22) == pytest.approx(2.0 * (20 - surface))
    assert to_radiant * (22 - 10) + across * (22 - 20) == pytest.approx(4.0 * (22 - surface))
    assert to_air * (20 - 10) + to_radiant * (22 - 10) == pytest.approx(6.0 * (surface - 10))


def test_series_of_hand_worked_resistances() -> None:
    assert series(2.0, 3.0, 6.0) == pytest.approx(1.0)  # 1/2 + 1/3 + 1/6
    assert series(7.3) == pytest.approx(7.3)


def test_room_at_one_temperature_sees_both_films_in_parallel() -> None:
    to_air, to_radiant, _ = surface_mesh(2.7, 5.0, 3.3)
    assert to_air + to_radiant == pytest.approx(series(7.7, 3.3), rel=1e-14)


def test_expressions_are_differentiable() -> None:
    film = ca.SX.sym("film")
    to_air = surface_mesh(film, 5.0, 13.3)[0]
    slope = ca.Function("slope", [film], [ca.jacobian(to_air, film)])
    # d/dh (h g / (h + r + g)) = g (r + g) / (h + r + g)^2
    assert float(slope(2.5)) == pytest.approx(13.3 * 18.3 / 20.8**2, rel=1e-13)


def losses(network: ThermalNetwork, factor: dict[str, float], signals: FloatArray) -> FloatArray:
    """Heat that keeps zones and measured spaces 10 K above outdoors in a steady state, with films times factors [W], shape (n_zone,)."""
    theta = [factor.get(p.base, 1.0) * p.start for p in network.parameters]
    m = SymbolicModel(network).matrices(np.array(theta))
    flow = sp.csr_matrix(m.flow).toarray()
    stiff, driven = flow[:, : m.n], -flow[:, m.n :]
    outside = np.concatenate([[0.0], np.full(len(network.boundaries) - 1, 10.0), signals])
    air = np.flatnonzero(np.asarray((network.observation != 0).sum(axis=0)).ravel())
    rest = np.setdiff1d(np.arange(m.n), air)
    state = np.full(m.n, 10.0)
    heat = driven @ outside
    inner = stiff[np.ix_(rest, rest)] + 1e-9 * np.eye(rest.size)
    state[rest] = np.linalg.solve(inner, heat[rest] - stiff[np.ix_(rest, air)] @ state[air])
    given = stiff @ state - heat
    return np.asarray([given[air][network.zone[air] == z].sum() for z in range(len(network.zones))])


@pytest.mark.parametrize("plan", [True, False])
def test_films_that_follow_the_wind_lose_what_films_of_that_size_lose(plan: bool, flat: Building) -> None:
    """Heat at the films in place of a change of them, to first order: against the change itself, by differences."""
    building = load_bundled_case().building if plan else flat
    network = build_network(building, 1.0 if plan else None, structure=WINDY)
    assert [s.name for s in network.signals] == ["wind on films"]
    small, none = 1e-4, np.zeros(1)
    found = (losses(network, {}, none + 10.0 * small) - losses(network, {}, none)) / small
    more, less = ({"exterior_convection_coefficient": 1.0 + sign * small} for sign in (1.0, -1.0))
    if plan:  # the rated film of a window is a part of its u-value
        u_value = next(p.start for p in network.parameters if p.name == "window_u_value")
        for sign, factors in ((1.0, more), (-1.0, less)):
            factors["window_u_value"] = 1.0 + sign * small * u_value / RATED_OUTSIDE_FILM
    expected = (losses(network, more, none) - losses(network, less, none)) / (2.0 * small)
    assert expected.max() > 1.0
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-3 * expected.max())


def inputs_of(building: Building, **series: FloatArray) -> InputProvider:
    stamps = pd.date_range("2024-01-01", periods=len(series["outdoor"]), freq="1h", tz=building.location.timezone)
    usual = {zone: (293.15,) * 48 for zone in building.zone_names}
    return InputProvider(building, stamps, 3600.0, series, Normalisation(usual=usual, wind=4.0))


def test_films_in_the_wind_add_no_parameter_and_rest_at_its_mean(flat: Building) -> None:
    plain, following = (build_network(flat, structure=k) for k in (Structure(), WINDY))
    assert plain.parameters == following.parameters
    inputs = inputs_of(flat, outdoor=np.full(3, 283.15), wind_speed_sensor=np.array([4.0, 1.5, 0.0]))
    (wind,) = signal_values(following.signals, inputs).T
    assert wind == pytest.approx(10.0 * (np.array([20.0, 10.0, 4.0]) / 20.0 - 1.0))


@pytest.mark.parametrize("plan", [True, False])
def test_natural_convection_moves_heat_from_the_air_to_the_surfaces(plan: bool, flat: Building) -> None:
    building = load_bundled_case().building if plan else flat
    plain, following = (build_network(building, 1.0 if plan else None, structure=k) for k in (Structure(), STILL))
    assert plain.parameters == following.parameters and len(following.signals) == len(building.zone_names)
    driven = -sp.csr_matrix(SymbolicModel(following).matrices(following.values({})).flow).toarray()
    for zone, heat in enumerate(driven[:, following.n_node + len(following.boundaries) :].T):
        here = following.zone == zone
        assert heat[here & (following.kind == "radiant")].sum() == pytest.approx(1.0)
        assert heat[here & (following.kind == "air")].sum() == pytest.approx(-1.0)
        assert heat.sum() == pytest.approx(0.0, abs=1e-12) and not heat[~here].any()


def test_rooms_whose_heaters_warm_surfaces_keep_their_films(flat: Building) -> None:
    drawn = build_network(flat, structure=replace(STILL, emitter="floor"))
    # B's heater is behind no air terminal as A's is
    assert [s.name for s in drawn.signals if s.name.startswith("natural convection")] == ["natural convection of A"]


@pytest.mark.parametrize("watts", [-2000.0, -150.0, 150.0, 900.0, 2000.0])
def test_heat_that_is_moved_makes_the_difference_of_natural_convection(watts: float, flat: Building) -> None:
    """A room's air between walls at rest: 1.31 A |T|^(4/3), integrated, against a film of one coefficient."""
    zone, capacity = flat.zone_names[0], 6e4
    network = build_network(flat, structure=STILL)
    (signal,) = (s for s in network.signals if s.name == f"natural convection of {zone}")
    heat = np.zeros((2, len(flat.zone_names)))
    heat[:, 0] = watts
    (moved, _) = signal_values([signal], inputs_of(flat, outdoor=np.full(2, 283.15), heat=heat))[:, 0]
    zero_at = signal_values([signal], inputs_of(flat, outdoor=np.full(2, 283.15), heat=0.0 * heat))
    assert not zero_at.any()
    # q - own^(1/4) |q|^(3/4) is 0 for the heat at which both films let as much pass, 8.3 W/m2 at 4 K
    own = (abs(watts - moved) / abs(watts) ** 0.75) ** 4
    surface, film = own / (1.31 * 4.0 ** (4.0 / 3.0)), 1.31 * 4.0 ** (1.0 / 3.0)
    assert 1.5 < surface / flat.geometry.zones[0].floor_area < 8.0
    exact = solve_ivp(
        lambda _, t: (watts - 1.31 * surface * np.sign(t) * np.abs(t) ** (4.0 / 3.0)) / capacity, (0.0, 3600.0), [0.0],
        rtol=1e-9, atol=1e-9,
    ).y[0, -1]  # fmt: skip
    after_an_hour = 1.0 - np.exp(-film * surface * 3600.0 / capacity)
    linear, ours = (q / (film * surface) * after_an_hour for q in (watts, watts - moved))
    assert ours == pytest.approx(exact, rel=0.02)
    assert abs(linear / exact - 1.0) > (0.1 if abs(watts) > 1000.0 else 0.02)


def test_planned_heat_is_passed_on_by_the_secant_of_a_usual_one(flat: Building) -> None:
    network = build_network(flat, structure=STILL)
    assert not network.emitted.any()  # nobody has told what is usual
    known = replace(network, normalisation=Normalisation(heat=dict.fromkeys(flat.zone_names, 3000.0)))
    for zone, row in enumerate(known.emitted):
        convection = known.anatomy.rooms[flat.zone_names[zone]].convection
        assert convection is not None and known.signals[zone].name == convection.signal.name
        assert row[zone] == pytest.approx(float(convection.passed_on(np.array(1500.0))) / 1500.0)
        assert np.delete(row, zone).tolist() == [0.0]
