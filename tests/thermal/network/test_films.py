"""Films: in series, at a massless surface against its node, and as they follow wind and temperature difference."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pandas as pd
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

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
BOTH = Structure(wind_films=True, natural_films=True)


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


@pytest.mark.parametrize(
    ("films", "signal"),
    [
        (("exterior_convection_coefficient",), "wind on films"),
        (("interior_film_coefficient",), "natural convection"),
    ],
)
@pytest.mark.parametrize("plan", [True, False])
def test_films_that_follow_lose_what_films_of_that_size_lose(
    films: tuple[str, ...], signal: str, plan: bool, flat: Building
) -> None:
    """Heat at the films in place of a change of them, to first order: against the change itself, by differences."""
    building = load_bundled_case().building if plan else flat
    network = build_network(building, 1.0 if plan else None, structure=BOTH)
    names = [s.name for s in network.signals]
    small, none = 1e-4, np.zeros(len(names))
    moved = none.copy()
    moved[names.index(signal)] = 10.0 * small
    found = (losses(network, {}, moved) - losses(network, {}, none)) / small
    more, less = ({name: 1.0 + sign * small for name in films} for sign in (1.0, -1.0))
    if plan and signal == "wind on films":  # the rated film of a window is a part of its u-value
        u_value = next(p.start for p in network.parameters if p.name == "window_u_value")
        for sign, factors in ((1.0, more), (-1.0, less)):
            factors["window_u_value"] = 1.0 + sign * small * u_value / RATED_OUTSIDE_FILM
    expected = (losses(network, more, none) - losses(network, less, none)) / (2.0 * small)
    assert expected.max() > 1.0
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-3 * expected.max())


def test_films_add_no_parameter_and_rest_at_their_mean(flat: Building) -> None:
    plain, following = (build_network(flat, structure=k) for k in (Structure(), BOTH))
    assert plain.parameters == following.parameters
    usual = {zone: (293.15,) * 48 for zone in flat.zone_names}
    stamps = pd.date_range("2024-01-01", periods=3, freq="1h", tz=flat.location.timezone)
    series = {"outdoor": np.full(3, 283.15), "wind_speed_sensor": np.array([4.0, 1.5, 0.0])}
    inputs = InputProvider(flat, stamps, 3600.0, series, Normalisation(usual=usual, wind=4.0))
    wind, convection = signal_values(following.signals, inputs).T
    assert wind == pytest.approx(10.0 * (np.array([20.0, 10.0, 4.0]) / 20.0 - 1.0))
    assert convection == pytest.approx(0.0)  # the film's own value is for 10 K
    warmer = InputProvider(flat, stamps, 3600.0, {**series, "outdoor": np.full(3, 213.15)}, inputs.normalisation)
    assert signal_values(following.signals, warmer)[:, 1] == pytest.approx(80.0 * (8.0 ** (1 / 3) - 1.0))
