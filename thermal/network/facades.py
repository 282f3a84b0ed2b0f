"""Which facade a surface or a wall belongs to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.case.schema import Surface
from thermal.errors import ModelError
from thermal.network.grid import FACADES, FloorGrid

#: Directions of a zone table's facades, each a quarter of the compass that begins 45 degrees before its own azimuth.
_COMPASS = ("north", "east", "south", "west")

#: Horizontal surfaces to outdoor by kind.
_HORIZONTAL = {"ceiling": "roof", "floor": "floor"}


def facade_of(surface: Surface) -> str | None:
    """Facade of a surface of a zone table: its direction, ``roof`` or ``floor``; None when it does not face outdoor.

    Parameters
    ----------
    surface : Surface
        Of azimuth α; the facade is that whose own azimuth is nearest, the next one clockwise half way between two.

    Raises
    ------
    ModelError
        When it is a wall or a window to outdoor without azimuth.
    """
    if surface.other != "outdoor":
        return None
    if surface.kind in _HORIZONTAL:
        return _HORIZONTAL[surface.kind]
    if surface.azimuth is None:
        raise ModelError(
            f"surface {surface.name}: expected an azimuth [deg], since a parameter has one value a facade, came none"
        )
    return _COMPASS[int((surface.azimuth + 45.0) % 360.0 // 90.0) % 4]


def wall_facades(grid: FloorGrid) -> dict[str, NDArray[np.float64]]:
    """Share of each cell of exterior wall that belongs to each facade of a plan.

    A cell with outer faces belongs to their facades in equal parts, one behind it to those of the wall cells that are
    nearest to it on the way outside. Exterior wall that no wall joins to the outside belongs to none.

    Parameters
    ----------
    grid : FloorGrid
        Cells of a floor.

    Returns
    -------
    dict
        Shares by facade, each of the shape of the grid's tokens; they sum to 1, or to 0 for a cell of no facade.
    """
    wall, outside = grid.tokens == "#", grid.tokens == "."
    shares = np.array([wall & _beyond(outside, step) for step in FACADES.values()], dtype=float)
    known = shares.any(axis=0)
    shares[:, known] /= shares[:, known].sum(axis=0)
    while True:  # one ring of cells inwards at a time
        reached = np.sum([[_beyond(share, step) for share in shares] for step in FACADES.values()], axis=0)
        ring = wall & ~known & (reached.sum(axis=0) > 0.0)
        if not ring.any():
            return dict(zip(FACADES, shares, strict=True))
        shares[:, ring] = reached[:, ring] / reached[:, ring].sum(axis=0)
        known |= ring


def _beyond(cells: NDArray[np.generic], step: tuple[int, int]) -> NDArray[np.generic]:
    """Value of the next cell in a direction; the rim of outside cells is its own neighbour across the grid."""
    return np.roll(cells, (-step[0], -step[1]), axis=(0, 1))
