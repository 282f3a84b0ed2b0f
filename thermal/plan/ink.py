"""Ink of a drawing, and the walls among it."""

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from thermal._types import BoolArray, FloatArray
from thermal.errors import PlanError
from thermal.plan.drawing import Drawing
from thermal.plan.guard import check_pixels, extra
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
    depth = np.zeros(count + 1)
    np.maximum.at(depth, spaces.ravel(), ndimage.distance_transform_edt(~framed).ravel())  # no sort
    narrow = 2.0 * depth * pixel <= width + 2.0 * pixel
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


#: Side of a pixel that a drawing is worked on at [m]: a partition of 75 mm is four; coarser drawings are refined.
FINE, COARSE = 0.02, 0.025
_LEAST_CONTRAST = 30  # of 255, between paper and ink: a blank scan has some 10 of noise
_HAIRLINE = 0.2  # -, of a pixel: fainter lines are noise
_SHARP = 0.012  # m/px: in finer drawings the lines of windows are two pixels and need no care
_LEAST_ANGLE = 0.1  # deg: over 60 m that is 10 cm; coarse drawings seem to stand as askew as that
_LEAST_AGREEMENT = 0.3  # -, of the directions of edges: below it a drawing has no two main directions


@dataclass(frozen=True, eq=False)
class Ink:
    """What is drawn, upright.

    Parameters
    ----------
    mask : ndarray of bool, shape (n_row, n_col)
        True where there is ink.
    pixel : float
        Side of an element [m].
    turned : float
        Angle by which the drawing stood clockwise of upright [deg].
    placement : ndarray, shape (3, 3)
        Takes (column, row, 1) of the drawing to those of the mask [px].
    drawn_pixel : float
        Side of a pixel of the drawing [m]; 0 for one of vectors.
    """

    mask: BoolArray
    pixel: float
    turned: float
    placement: FloatArray
    drawn_pixel: float = 0.0


def ink_of(drawing: Drawing, scale: float, straighten: bool) -> Ink:
    """Find the ink of a drawing, turn it upright and bring it to a resolution that suits its walls.

    Parameters
    ----------
    drawing : Drawing
        In grey.
    scale : float
        Of the drawing [m/px].
    straighten : bool
        Whether to turn it upright.

    Returns
    -------
    Ink
        Thresholded after Otsu (1979, doi:10.1109/TSMC.1979.4310076).

    Raises
    ------
    PlanError
        The drawing is blank.
    OversizedFileError
        It is larger than any building at this scale.
    """
    block = max(1, int(FINE / scale))
    cover = _cover(drawing, block)
    angle = _main_angle(cover) if straighten else 0.0
    if abs(angle) >= _LEAST_ANGLE:
        # Steps of slanting walls pull the angle towards the grid's; what is left of it after a turn is hardly pulled.
        angle += _main_angle(_turned(cover, _upright(cover.shape, angle, 1), drawing.source))
    refine = math.ceil(scale * block / COARSE - 1e-9) if scale * block > COARSE else 1
    matrix = np.array([[1, 0, -drawing.corner[0]], [0, 1, -drawing.corner[1]], [0, 0, 1]], dtype=float)
    matrix = np.array([[1 / block, 0, 0.5 / block - 0.5], [0, 1 / block, 0.5 / block - 0.5], [0, 0, 1]]) @ matrix
    if abs(angle) >= _LEAST_ANGLE or refine > 1:
        turn = _upright(cover.shape, angle, refine)
        cover = _turned(cover, turn, drawing.source)
        matrix = turn @ matrix
    else:
        angle = 0.0
    mask = cover >= 0.5 if scale <= _SHARP else _with_hairlines(cover)
    return Ink(mask, scale * block / refine, angle, matrix, scale)


def _turned(cover: FloatArray, turn: FloatArray, source: str) -> FloatArray:
    """Apply `turn` to a drawing, on a sheet that holds all of it."""
    corners = turn @ np.array([[0, cover.shape[1], 0, cover.shape[1]], [0, 0, *[cover.shape[0]] * 2], [1] * 4])
    shape = tuple(math.ceil(x) + 1 for x in (corners[1].max(), corners[0].max()))
    check_pixels(shape[1], shape[0], source)
    warp = extra("skimage.transform").warp
    return np.asarray(warp(cover, np.linalg.inv(turn), output_shape=shape, order=1, cval=0.0), dtype=float)


def _main_angle(cover: FloatArray) -> float:
    """Angle of the walls against the edges of the drawing, clockwise [deg]; 0 where it has no two main directions.

    Gradients g of the smoothed drawing stand across its walls, at angles φ that repeat every 90 degrees:
    ``4 angle = arg Σ |g|² exp(4iφ)``.
    """
    picture = np.asarray(cover, dtype=np.float32)
    down, across = (ndimage.gaussian_filter(picture, 2.0, order=order) for order in ((1, 0), (0, 1)))
    gradient = across.astype(np.complex64) + 1j * down
    weight = np.abs(gradient) ** 2
    total = float(weight.sum(dtype=float))
    # |g|² exp(4iφ) = g⁴ / |g|²
    fourth = np.divide(gradient**4, weight, out=np.zeros_like(gradient), where=weight > 1e-12)
    vector = complex(fourth.sum(dtype=complex))
    if total <= 0.0 or abs(vector) < _LEAST_AGREEMENT * total:
        return 0.0
    return math.degrees(np.angle(vector)) / 4.0


def _cover(drawing: Drawing, block: int) -> FloatArray:
    """Share of ink in blocks of pixels; white on black is turned over."""
    grey = drawing.grey
    contrast = int(grey.max()) - int(grey.min()) if grey.size else 0
    found, where = f"one shade of grey (contrast {contrast} of 255)", drawing.source
    PlanError.unless(contrast >= _LEAST_CONTRAST, where, "walls darker than the paper", found, "is the drawing blank?")
    threshold = float(extra("skimage.filters").threshold_otsu(grey))
    dark = grey <= threshold
    light, black = float(grey[~dark].mean()), float(grey[dark].mean())
    if dark.mean() > 0.5:
        grey, threshold, light, black = 255 - grey, 254.0 - threshold, 255.0 - black, 255.0 - light
    # Grey is a pixel on the edge of a wall, or a line thinner than a pixel: half ink at the threshold.
    shares = np.interp(np.arange(256), [black, threshold + 0.5, light], [1.0, 0.5, 0.0]).astype(np.float32)
    padded = np.pad(shares[grey], [(0, -n % block) for n in grey.shape])
    rows, columns = (n // block for n in padded.shape)
    return np.asarray(padded.reshape(rows, block, columns, block).mean(axis=(1, 3)), dtype=float)


def _with_hairlines(cover: FloatArray) -> BoolArray:
    """Find ink, and lines thinner than a pixel, such as the panes of a window, which close walls too."""
    dark = cover >= 0.5
    square = np.ones((3, 3))
    body = ndimage.binary_opening(dark, square)
    faint = (cover - ndimage.grey_opening(cover, (5, 5)) > _HAIRLINE) & ~body
    # The edge of a thin wall looks the same: a line begins apart from all that is solid, and runs on to it.
    apart = faint & ~ndimage.binary_dilation(body, square)
    lines = ndimage.binary_dilation(apart, square, iterations=2, mask=faint) if apart.any() else apart
    thin: BoolArray = extra("skimage.morphology").skeletonize(dark | lines)
    found: BoolArray = dark | (thin & lines)
    return found


def _upright(shape: tuple[int, ...], angle: float, refine: int) -> FloatArray:
    """Take (column, row, 1) of a drawing to those of the drawing turned back by `angle` and refined."""
    cosine, sine = (refine * f(math.radians(angle)) for f in (math.cos, math.sin))
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    corners = turn @ np.array([[0, shape[1], 0, shape[1]], [0, 0, shape[0], shape[0]], [1] * 4], dtype=float)
    turn[0, 2], turn[1, 2] = -corners[0].min(), -corners[1].min()
    return turn
