"""Judging one signal: impossible values, flat lines, spikes. Numbers in, stretches out."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal._types import BoolArray, FloatArray
from thermal.case.points import PointType

Stretch = tuple[int, int, str]  # first and last position, what was seen

# A temperature that repeats itself to the last digit for 6 h is not measured: sensors of the shared cases (0.02 K
# steps and 0.0001 K) do so for 35 minutes at most. 24 samples keep half-hourly telemetry from being judged on twelve.
FLAT_SECONDS = 6 * 3600.0
FLAT_SAMPLES = 24
# A quiet room and a coarse sensor make long repeats by themselves: a flat line is four times as long as they are.
FLAT_FACTOR = 4.0
# Above 0.05 K, or in means over more than 10 minutes, which hold no noise, a well controlled room can repeat itself
# for hours. There, and for cellars and the like, a flat line must also begin or end with a jump of over three steps.
FINE_RESOLUTION = 0.05  # K
FINE_STEP = 600.0  # s
FLAT_JUMP = 3.5  # sensor steps
# Above 0.15 K, or above 10 minutes, a room held for a weekend can pass even that: 72 h.
MEDIUM_RESOLUTION = 0.15  # K
COARSE_FLAT_SECONDS = 72 * 3600.0
# A week at one value needs no jump: no room is held so well.
CERTAIN_FLAT_SECONDS = 7 * 24 * 3600.0
# A flow stays at its minimum for all of a working day: what stands is held for longer.
STUCK_SECONDS = 24 * 3600.0
# While it is flat, the outdoors must have moved by so much; else a standstill says nothing.
OUTDOOR_RANGE = 0.5  # K
# A whole record at one value: a day of it, with the outdoors moving, is enough.
CONSTANT_SECONDS = 24 * 3600.0
# There and back: air in a room with an open door moved by 0.8 K and back within one 5-minute step of a shared case.
SPIKE_SIZE = 2.0  # K, for steps up to 10 minutes
SPIKE_SIZE_HOURLY = 5.0  # K, for steps of an hour; linear in between: more can happen in an hour
SPIKE_DEVIATIONS = 10.0  # robust standard deviations of the step to step difference
SPIKE_SECONDS = 1800.0
SPIKE_SAMPLES = 3
SPIKE_RETURN = 1.0 / 3.0  # before and after agree to a third of the jump


def runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Find the stretches where a mask is true.

    Parameters
    ----------
    mask
        Shape (n_time,).

    Returns
    -------
    list of tuple
        First and last position of each stretch.

    Examples
    --------
    >>> runs(np.array([True, True, False, True]))
    [(0, 1), (3, 3)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], np.asarray(mask, dtype=bool), [False]))))
    return [(int(first), int(last) - 1) for first, last in zip(edges[::2], edges[1::2], strict=True)]


def impossible_values(values: FloatArray, point: PointType) -> list[Stretch]:
    """Find values outside the physically possible range of a point.

    Parameters
    ----------
    values
        Shape (n_time,) [unit inside the library]; NaN = missing.
    point
        Point type, with its range.

    Returns
    -------
    list of tuple
        First and last position, and the most extreme value, of each stretch.
    """
    bad = ~np.isnan(values) & ~point.possible(values)
    found = []
    for first, last in runs(bad):
        stretch = values[first : last + 1]
        worst = stretch[np.argmax(np.maximum(point.lowest - stretch, stretch - point.highest))]
        found.append((first, last, f"{worst:g} is outside {point.lowest:g} to {point.highest:g} (SI)"))
    return found


def flat_lines(
    values: FloatArray, reference: FloatArray | None, step: float, *, is_input: bool = False
) -> list[Stretch]:
    """Find stretches where a temperature sensor repeats itself for too long to be measuring.

    Parameters
    ----------
    values
        Shape (n_time,) [K]; NaN = missing.
    reference
        Outdoor temperature, shape (n_time,) [K]; None for the outdoor sensor itself, or without one.
    step
        Time from a stamp to the next [s].
    is_input
        Whether it is the outdoors or a measured boundary: there a constant may be an assumption rather than a sensor,
        and a cellar does stand still.

    Returns
    -------
    list of tuple
        First and last position of each stretch.
    """
    present = np.flatnonzero(np.isfinite(values))
    series = values[present]
    if series.size < 2:
        return []
    starts = np.concatenate(([0], np.flatnonzero(np.diff(series) != 0.0) + 1))
    ends = np.concatenate((starts[1:], [series.size])) - 1
    seconds = (ends - starts + 1) * step
    resolution = _resolution(series)
    if resolution is None:
        long_enough = seconds[0] >= CONSTANT_SECONDS and series.size >= FLAT_SAMPLES
        moved = reference is not None and _moved(reference[present[0] : present[-1] + 1])
        return _pieces(present, seconds[0]) if long_enough and moved and not is_input else []
    sparse = step > FINE_STEP
    limit = COARSE_FLAT_SECONDS if sparse or resolution > MEDIUM_RESOLUTION else FLAT_SECONDS
    longest = max(limit, FLAT_SAMPLES * step, FLAT_FACTOR * _ordinary(seconds))
    needs_jump = is_input or sparse or resolution > FINE_RESOLUTION
    found = []
    for run in np.flatnonzero(seconds >= longest):
        first, last = int(starts[run]), int(ends[run])
        jumps = [series[first] - series[max(first - 1, 0)], series[last] - series[min(last + 1, series.size - 1)]]
        jumped = bool(np.max(np.abs(jumps)) > FLAT_JUMP * resolution)
        moved = reference is None or _moved(reference[present[first] : present[last] + 1])
        certain = seconds[run] >= CERTAIN_FLAT_SECONDS and not is_input
        if moved and (jumped or certain or not needs_jump):
            found += _pieces(present[first : last + 1], seconds[run])
    return found


def stuck_meters(values: FloatArray, others: Sequence[FloatArray], step: float) -> list[Stretch]:
    """Find stretches where a flow or the temperature of supplied air repeats itself while those of others move.

    Parameters
    ----------
    values
        Shape (n_time,) [unit inside the library]; NaN = missing.
    others
        The same point of other devices, shape (n_time,) each [unit inside the library].
    step
        Time from a stamp to the next [s].

    Returns
    -------
    list of tuple
        First and last position of each stretch of a day or more.

    Notes
    -----
    A control holds what it comes back to: values seen at another time too, zero, the smallest and the largest are not
    judged, and neither is a meter that never shows another: a constant flow is how some terminals work. Half of the
    others must move meanwhile, or the column may be assumed.
    """
    present = np.flatnonzero(np.isfinite(values))
    series, found = values[present], []
    for first, last in runs(np.concatenate(([False], np.diff(series) == 0.0))):
        value, positions = series[last], present[first - 1 : last + 1]
        seconds, returns = positions.size * step, (series == value).sum() > positions.size
        if value == 0.0 or returns or seconds < STUCK_SECONDS:
            continue
        moved = [bool(np.diff(o[np.isfinite(o)]).any()) for o in (v[positions] for v in others)]
        if series.min() < value < series.max() and 0 < len(moved) <= 2 * sum(moved):
            found += _pieces(positions, seconds)
    return found


def spikes(values: FloatArray, step: float) -> list[Stretch]:
    """Find short jumps of a temperature, there and back.

    Parameters
    ----------
    values
        Shape (n_time,) [K]; NaN = missing.
    step
        Time from a stamp to the next [s].

    Returns
    -------
    list of tuple
        First and last position, and the size, of each spike: at most 30 minutes and three samples long.
    """
    differences = np.diff(values)
    finite = differences[np.isfinite(differences)]
    if finite.size == 0:
        return []
    scatter = 1.4826 * float(np.median(np.abs(finite - np.median(finite))))
    slope = (SPIKE_SIZE_HOURLY - SPIKE_SIZE) / 3000.0
    size = max(SPIKE_SIZE + slope * max(step - 600.0, 0.0), SPIKE_DEVIATIONS * scatter)
    widest = max(1, min(SPIKE_SAMPLES, int(SPIKE_SECONDS // step)))
    found, behind = [], 0
    with np.errstate(invalid="ignore"):
        candidates = np.flatnonzero(np.abs(differences) > size) + 1
    for position in candidates.tolist():
        width = _spike_width(values, position, widest, size) if position >= behind else 0
        if width:
            jump = values[position] - values[position - 1]
            found.append((position, position + width - 1, f"{jump:+.1f} K and back"))
            behind = position + width
    return found


def _spike_width(values: FloatArray, first: int, widest: int, size: float) -> int:
    """Count the samples of the spike that begins at `first`; 0 when there is none."""
    before = values[first - 1]
    for width in range(1, widest + 1):
        if first + width >= len(values):
            break
        inside, after = values[first : first + width], values[first + width]
        sign = np.sign(inside[0] - before)
        height = min(float(np.min(sign * (inside - before))), float(np.min(sign * (inside - after))))
        if height > size and abs(after - before) <= SPIKE_RETURN * height:
            return width
    return 0


def _resolution(series: FloatArray) -> float | None:
    """Smallest step of a sensor [K]: the fifth percentile of its changes; None when it never changes."""
    changes = np.abs(np.diff(series))
    changes = changes[changes > 0.0]
    return float(np.quantile(changes, 0.05)) if changes.size else None


def _ordinary(seconds: FloatArray) -> float:
    """Length of long but ordinary repeats [s]: of the samples in repeats below 6 h, 98 % lie in one no longer."""
    short = np.sort(seconds[seconds < FLAT_SECONDS])
    if short.size == 0:
        return 0.0
    covered = np.cumsum(short) / short.sum()
    return float(short[np.searchsorted(covered, 0.98)])


def _moved(reference: FloatArray) -> bool:
    """Whether the outdoors moved; yes, too, when its own sensor was out (flat, say) for most of the time."""
    finite = reference[np.isfinite(reference)]
    return bool(2 * finite.size < reference.size or np.ptp(finite) >= OUTDOOR_RANGE)


def _pieces(positions: NDArray[np.intp], seconds: float) -> list[Stretch]:
    """Cut a flat line at the gaps inside it."""
    parts = np.split(positions, np.flatnonzero(np.diff(positions) > 1) + 1)
    return [(int(part[0]), int(part[-1]), f"the same value for {seconds / 3600.0:.1f} h") for part in parts]
