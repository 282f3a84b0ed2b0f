"""From ink to walls: faces of a wall are filled, thin strokes and specks left out."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from thermal._types import BoolArray
from thermal.plan.survey import PlanSettings

_SPECK = 0.35  # m: smaller pieces of ink that stand alone are letters and symbols, not piers between doors


def walls_of(ink: BoolArray, pixel: float, settings: PlanSettings) -> BoolArray:
    """Find the walls in what is drawn.

    Parameters
    ----------
    ink : ndarray of bool, shape (n_row, n_col)
        What is drawn.
    pixel : float
        Side of an element [m].
    settings : PlanSettings
        What counts as a wall.

    Returns
    -------
    ndarray of bool, shape (n_row, n_col)
        Solid walls, with gaps at doors.
    """
    solid = _fill_narrow(ink, pixel, settings.thickest_wall)
    least = settings.thinnest_wall / pixel
    if least > 2.0:
        # A stroke of n pixels has distances up to (n + 1) / 2 to the nearest pixel beside it, a ragged one half less.
        reach = least / 2.0
        core = ndimage.distance_transform_edt(solid) >= reach - 1e-6
        solid = ndimage.distance_transform_edt(~core) < reach - 1e-6 if core.any() else core
    return _without_specks(solid, pixel)


def _fill_narrow(ink: BoolArray, pixel: float, width: float) -> BoolArray:
    """Fill closed spaces that are nowhere wider than a wall: between its faces, between the panes of a window.

    Parameters
    ----------
    ink : ndarray of bool, shape (n_row, n_col)
        What is drawn.
    pixel : float
        Side of an element [m].
    width : float
        Of the widest space to fill [m].

    Returns
    -------
    ndarray of bool, shape (n_row, n_col)
        Ink and what was filled.
    """
    framed = np.pad(ink, 1)
    spaces, count = ndimage.label(~framed)
    depth = ndimage.maximum(ndimage.distance_transform_edt(~framed), spaces, np.arange(count + 1))
    narrow = 2.0 * np.asarray(depth) * pixel <= width + 2.0 * pixel
    narrow[[0, spaces[0, 0]]] = False
    filled: BoolArray = framed | narrow[spaces]
    return filled[1:-1, 1:-1]


def _without_specks(ink: BoolArray, pixel: float) -> BoolArray:
    pieces, _ = ndimage.label(ink, np.ones((3, 3)))
    keep = [False]
    for rows, columns in ndimage.find_objects(pieces):
        keep.append(np.hypot(rows.stop - rows.start, columns.stop - columns.start) * pixel >= _SPECK)
    kept: BoolArray = np.asarray(keep)[pieces]
    return kept
