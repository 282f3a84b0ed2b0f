"""Plans at other cell sizes: split factors, blocks and neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from thermal import FloorPlan
from thermal.errors import ModelError
from thermal.network.grid import floor_grid

PLAN = FloorPlan("F1", 3.0, np.array([list(row) for row in ("#######", "#AA+BB#", "#AA+BB#", "#######")]))


@pytest.mark.parametrize(
    ("cell", "dx", "wanted"),
    [(1.0, None, 1.0), (1.0, 1.0, 1.0), (1.0, 0.5, 0.5), (0.6, 0.2, 0.2), (0.5, 0.1, 0.1), (1.0, 1.0 / 3.0, 1.0 / 3.0)],
)
def test_refined_cells_are_those_asked_for(cell: float, dx: float | None, wanted: float) -> None:
    grid = floor_grid(PLAN, cell, dx)
    assert grid.cell == grid.spacing == pytest.approx(wanted, rel=1e-15)
    assert grid.token.size == round(PLAN.tokens.size * (cell / wanted) ** 2)


@pytest.mark.parametrize(("cell", "dx"), [(0.5, 0.75), (0.5, 1.5), (1.0, 2.0)])
def test_coarse_volumes_keep_the_cells_of_the_plan(cell: float, dx: float) -> None:
    grid = floor_grid(PLAN, cell, dx)
    assert grid.cell == cell
    assert grid.spacing == pytest.approx(dx)


@pytest.mark.parametrize("dx", [0.0, -1.0, np.nan, np.inf, -np.inf])
def test_cell_sizes_that_are_no_lengths_are_refused(dx: float) -> None:
    with pytest.raises(ModelError, match="positive"):
        floor_grid(PLAN, 1.0, dx)


def test_refined_grid_has_the_tokens_of_the_plan() -> None:
    grid = floor_grid(PLAN, 1.0, 0.25)
    assert grid.cell == grid.spacing == 0.25
    inner = grid.tokens[1:-1, 1:-1]
    np.testing.assert_array_equal(inner[::4, ::4], PLAN.tokens)
    np.testing.assert_array_equal(inner[3::4, 3::4], PLAN.tokens)
    assert (grid.tokens[0] == ".").all()
    assert grid.token.size == PLAN.tokens.size * 16
    assert np.unique(grid.volume[grid.volume >= 0]).size == grid.token.size


def test_coarse_volumes_hold_cells_of_one_token() -> None:
    grid = floor_grid(PLAN, 1.0, 3.0)
    assert grid.cell == 1.0
    assert grid.spacing == 3.0
    for number, token in enumerate(grid.token):
        cells = np.argwhere(grid.volume == number)
        assert {str(t) for t in grid.tokens[grid.volume == number]} == {str(token)}
        assert (np.ptp(cells, axis=0) < 3).all()
        assert ((cells - 1) // 3 == grid.place[number]).all()
    # block rows 0-2 and 3, columns 0-2, 3-5, 6: the corner block has two tokens, # and A
    assert sorted(str(t) for t in grid.token) == sorted(["#", "A", "#", "+", "B", "#", "#", "#", "#"])


def test_neighbours_are_pairs_of_cells_side_by_side() -> None:
    grid = floor_grid(PLAN, 1.0)
    here, there = grid.neighbours((0, 1))
    assert (there - here == 1).all()
    here, there = grid.neighbours((-1, 0))
    assert (here - there == grid.tokens.shape[1]).all()
    assert here.size == (grid.tokens.shape[0] - 1) * grid.tokens.shape[1]
