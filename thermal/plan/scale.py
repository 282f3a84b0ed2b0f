"""The scale of a drawing: from two points and their distance, from a known length, from the scale on paper."""

from __future__ import annotations

import math

from thermal.errors import PlanError, describe

Point = tuple[float, float]

#: Range of scales that are believed [m/px]: a detail at 1:20 and 600 dots per inch, walls of one pixel.
FINEST, COARSEST = 5e-4, 0.5


def scale_from_points(first: Point, second: Point, distance: float) -> float:
    """Scale of a drawing from two points of it, two clicks, and how far apart they are in the building.

    Parameters
    ----------
    first, second : tuple of float
        Column and row of each [px].
    distance : float
        Between them [m].

    Returns
    -------
    float
        [m/px].

    Raises
    ------
    PlanError
        The points coincide, the distance is not positive, or no building is drawn at that scale.

    Examples
    --------
    >>> scale_from_points((100, 50), (500, 50), 8.0)
    0.02
    """
    numbers = (*first, *second, distance)
    if not all(math.isfinite(x) for x in numbers):
        raise PlanError(describe("scale", "two points and a distance, finite", repr(numbers)))
    return scale_from_length(math.dist(first, second), distance)


def scale_from_length(pixels: float, length: float) -> float:
    """Scale of a drawing from a length on it that is known, such as a dimension line's.

    Parameters
    ----------
    pixels : float
        Length on the drawing [px].
    length : float
        The same in the building [m].

    Returns
    -------
    float
        [m/px].

    Raises
    ------
    PlanError
        One is not positive, or no building is drawn at that scale.

    Examples
    --------
    >>> scale_from_length(500.0, 12.5)
    0.025
    """
    if not (pixels > 0 and length > 0):
        raise PlanError(describe("scale", "a positive length in px and in m", f"{pixels} px and {length} m"))
    return checked_scale(length / pixels)


def scale_from_paper(ratio: float, dots_per_inch: float) -> float:
    """Scale of a page that was printed to scale.

    Parameters
    ----------
    ratio : float
        100 for 1:100 [-].
    dots_per_inch : float
        Resolution of the drawing [1/inch].

    Returns
    -------
    float
        [m/px].

    Raises
    ------
    PlanError
        One is not positive, or no building is drawn at that scale.

    Examples
    --------
    >>> round(scale_from_paper(100, 150), 5)
    0.01693
    """
    return scale_from_length(dots_per_inch, 0.0254 * ratio)


def checked_scale(metres_per_pixel: float) -> float:
    """Refuse a scale at which no building is drawn.

    Parameters
    ----------
    metres_per_pixel : float
        Scale [m/px].

    Returns
    -------
    float
        The same [m/px].

    Raises
    ------
    PlanError
        It is out of the range of plans.
    """
    if not FINEST <= metres_per_pixel <= COARSEST:
        expected = f"{FINEST:g} to {COARSEST:g} m for a pixel"
        advice = "are points in pixels and distances in metres?"
        raise PlanError(describe("scale", expected, f"{metres_per_pixel:g} m", advice))
    return metres_per_pixel
