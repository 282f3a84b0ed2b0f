"""What a spin-up leaves unknown, against the runs of the model with its zones held."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from calibration.estimation.filtered import BOUNDARY_SPREAD, ZONE_SPREAD, start_spread
from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.model.matrices import Matrices

ALL = np.ones(5, dtype=bool)


@cache
def matrices() -> Matrices:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return reduced_model(grid, [grid.network.start()]).matrices(grid.network.start())


def test_it_begins_with_steady_states_of_other_temperatures() -> None:
    modes = matrices().modal.modes
    columns = start_spread(modes, 300.0, 0, ALL)
    wanted = np.hstack([ZONE_SPREAD * np.eye(5), np.zeros((5, 1))])
    np.testing.assert_allclose(modes.observation @ columns, wanted, atol=1e-8)
    # what is not balanced in a steady state is heat given to zones
    flow = modes.conductance[:, None] * columns
    flow[:, -1] -= BOUNDARY_SPREAD * modes.boundary[:, 0]
    _, rest, _, _ = np.linalg.lstsq(modes.heating, flow, rcond=None)
    assert np.sqrt(rest).max() < 1e-6 * np.abs(flow).max()


@pytest.mark.parametrize("steps", [1, 20])
def test_it_decays_as_in_a_spin_up(steps: int) -> None:
    """The library's own runs with held zones, from the same states."""
    m = matrices()
    modes = m.modal.modes
    first, found = (start_spread(modes, 300.0, n, ALL) for n in (0, steps))
    still = [np.zeros((steps, n)) for n in (modes.boundary.shape[1], 5, 5)]
    for column, wanted in zip(first.T, found.T, strict=True):
        kept, _ = m.modal.hold(modes.states @ column[:, None], *still, np.array([steps - 1]), 300.0)
        scale = np.abs(first).max()
        np.testing.assert_allclose(modes.coordinates @ kept[:, 0], wanted, rtol=0, atol=1e-9 * scale)


def test_days_of_spin_up_leave_little() -> None:
    modes = matrices().modal.modes
    walls = [np.linalg.norm(modes.states @ start_spread(modes, 300.0, n, ALL)) for n in (1, 144, 864)]
    assert walls[0] > 2.0 * walls[1] > 6.0 * walls[2]


def test_zones_without_a_sensor_stay_free() -> None:
    held = ALL.copy()
    held[3] = False
    found = start_spread(matrices().modal.modes, 300.0, 10, held)
    assert found.shape[1] == 5
    assert np.isfinite(found).all()
    np.testing.assert_allclose((matrices().modal.modes.observation @ found)[held], 0.0, atol=1e-8)
