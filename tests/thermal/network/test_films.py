"""Series resistances and the elimination of a massless surface, against the surface solved for as a node."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from thermal.network.structure import series, surface_mesh

FloatArray = NDArray[np.float64]


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
