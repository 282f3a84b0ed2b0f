"""Outlines of office floors: a rectangle, or one with notches, of a given area, as a mask of cells."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from thermal.case.signal_faults import runs
from thermal.errors import ThermalError

Mask = npt.NDArray[np.bool_]
Notch = tuple[float, float, float, float]  # left, top, width, height as fractions of the bounding box

AREA_TOLERANCE = 0.005  # -, of the area that was asked for
THIN_WING = (10.5, 15.0)  # m, two rows of rooms 4-6 m deep with a corridor between them
DEEP_WING = 23.0  # m, from here on a core with a corridor around it fits between two rows of rooms
_SMALLEST_NOTCH = 8.0  # m, so that a notch has rooms along its sides
_ASPECT = (1.2, 3.2)  # -, long over short side of the bounding box
_DRAWS = 300  # outlines to draw before any rectangle of the right area is taken


def draw_outline(rng: np.random.Generator, floor_area: float, cell_size: float, notched: bool) -> Mask:
    """Draw the outline of a floor whose wings are as deep as rooms, corridors and a core need them.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of the variety.
    floor_area : float
        Area inside the exterior wall [m2], positive.
    cell_size : float
        Side of a cell [m], positive.
    notched : bool
        True to draw among L, Z, T and U outlines and rectangles; False for a rectangle.

    Returns
    -------
    numpy.ndarray of bool, shape (n_row, n_col)
        True inside the exterior wall, with a margin of one cell for that wall.

    Raises
    ------
    ThermalError
        When no rectangle of such cells comes within 0.5 % of the area.
    """
    for _ in range(_DRAWS):
        notches = _draw_notches(rng) if notched else ()
        mask = _nearest_area(rng.uniform(*_ASPECT), notches, floor_area, cell_size)
        if mask is not None and _wings_fit(mask, cell_size):
            turned: Mask = np.rot90(mask, int(rng.integers(4)))
            return turned.copy()
    for aspect in np.linspace(*_ASPECT, 21):
        mask = _nearest_area(float(aspect), (), floor_area, cell_size)
        if mask is not None:
            return mask
    expected = f"one that whole cells of {cell_size} m come within {AREA_TOLERANCE:.1%} of"
    raise ThermalError("floor area", expected, f"{floor_area:.1f} m2 a floor", "pass a smaller cell_size")


def exterior_ring(mask: Mask) -> Mask:
    """Find the cells around an outline, corners included, so that the wall has no diagonal hole.

    Parameters
    ----------
    mask : numpy.ndarray of bool, shape (n_row, n_col)
        Outline with a margin of at least one cell.

    Returns
    -------
    numpy.ndarray of bool, shape (n_row, n_col)
        True on the exterior wall.
    """
    return grow(mask) & ~mask


def grow(mask: Mask) -> Mask:
    """Add the eight neighbours of every cell.

    Parameters
    ----------
    mask : numpy.ndarray of bool, shape (n_row, n_col)
        Any cells.

    Returns
    -------
    numpy.ndarray of bool, shape (n_row, n_col)
        These cells and their neighbours.
    """
    return np.asarray(ndimage.binary_dilation(mask, np.ones((3, 3))))


def facade_runs(mask: Mask) -> Iterator[tuple[int, int, int, bool, bool]]:
    """Find the straight stretches of an outline that look up, to the first row.

    Parameters
    ----------
    mask : numpy.ndarray of bool, shape (n_row, n_col)
        Outline with a margin of at least one cell.

    Yields
    ------
    tuple
        Row of the cells inside, first column, last column + 1, and whether the corner at its left end and the one at
        its right end are re-entrant.
    """
    exposed = mask.copy()
    exposed[1:] &= ~mask[:-1]
    for row in np.flatnonzero(exposed.any(axis=1)):
        for first, last in runs(exposed[row]):
            yield int(row), first, last + 1, bool(mask[row, first - 1]), bool(mask[row, last + 1])


def row_runs(mask: Mask) -> npt.NDArray[np.int_]:
    """Measure every straight run of cells along the rows.

    Parameters
    ----------
    mask : numpy.ndarray of bool, shape (n_row, n_col)
        Any cells.

    Returns
    -------
    numpy.ndarray of int, shape (n_run,)
        Lengths [cells].
    """
    edges = np.flatnonzero(np.diff(np.pad(mask, 1).ravel().astype(np.int8)))
    return edges[1::2] - edges[::2]


def run_lengths(mask: Mask) -> npt.NDArray[np.int_]:
    """Measure every straight run of cells, along rows and along columns.

    Parameters
    ----------
    mask : numpy.ndarray of bool, shape (n_row, n_col)
        Any cells.

    Returns
    -------
    numpy.ndarray of int, shape (n_run,)
        Lengths [cells].
    """
    return np.concatenate([row_runs(mask), row_runs(mask.T)])


def _draw_notches(rng: np.random.Generator) -> tuple[Notch, ...]:
    """Draw the notches of a rectangle (none), L, Z, T or U."""
    shape = rng.choice(["rectangle", "L", "Z", "T", "U"], p=[0.2, 0.3, 0.2, 0.1, 0.2])
    width, height = rng.uniform(0.15, 0.35, 2)
    if shape == "L":
        width, height = rng.uniform(0.25, 0.65, 2)
        return ((1.0 - width, 0.0, width, height),)
    if shape == "Z":
        return ((0.0, 0.0, width, height), (1.0 - width, 1.0 - height, width, height))
    if shape == "T":
        return ((0.0, 0.0, width, height), (1.0 - width, 0.0, width, height))
    if shape == "U":
        return ((rng.uniform(0.3, 0.7 - width), 0.0, width, height),)
    return ()


def _nearest_area(aspect: float, notches: tuple[Notch, ...], floor_area: float, cell_size: float) -> Mask | None:
    """Draw the outline of this shape whose area is nearest to the one asked for; None when that is not near enough."""
    cells = floor_area / cell_size**2
    free = 1.0 - sum(width * height for _, _, width, height in notches)
    depth = np.sqrt(cells / (aspect * free))
    near = range(-3, 4)
    sizes = [(round(depth) + rows, round(aspect * depth) + columns) for rows in near for columns in near]
    masks = [(abs(_area(*size, notches) - cells), size) for size in sizes if min(size) > 0]
    if not masks or min(masks)[0] > AREA_TOLERANCE * cells:
        return None
    n_row, n_column = min(masks)[1]
    mask = np.zeros((n_row + 2, n_column + 2), dtype=bool)
    mask[1:-1, 1:-1] = True
    for left, top, width, height in notches:
        mask[1:-1, 1:-1][_span(top, height, n_row), _span(left, width, n_column)] = False
    return mask


def _span(start: float, length: float, cells: int) -> slice:
    """Cells of a notch along one side; a notch at the far end ends there exactly."""
    first = cells - round(length * cells) if start + length > 1.0 - 1e-9 else round(start * cells)
    return slice(first, first + round(length * cells))


def _area(n_row: int, n_column: int, notches: tuple[Notch, ...]) -> int:
    """Cells of an outline."""
    return n_row * n_column - sum(round(height * n_row) * round(width * n_column) for _, _, width, height in notches)


def _wings_fit(mask: Mask, cell_size: float) -> bool:
    """Tell whether every wing is deep enough for its rooms, and every notch large enough."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    box = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    lengths = run_lengths(box) * cell_size
    if box.all():
        lengths = lengths.min(keepdims=True)
    elif (run_lengths(~box) * cell_size).min() < _SMALLEST_NOTCH:
        return False
    thin = (lengths >= THIN_WING[0]) & (lengths <= THIN_WING[1])
    return bool(np.all(thin | (lengths >= DEEP_WING)))
