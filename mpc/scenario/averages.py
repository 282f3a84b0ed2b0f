"""From one clock to another: exact means over steps of what is known at other stamps."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from thermal._types import FloatArray


def means_of_readings(times: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Average straight lines between readings over steps, exactly.

    Parameters
    ----------
    times : ndarray, shape (n_reading,)
        When they were taken [s]; rising.
    values : ndarray, shape (n_reading,)
        What they were [any].
    edges : ndarray, shape (n_steps + 1,)
        Edges of the steps [s], within the times.

    Returns
    -------
    ndarray, shape (n_steps,)
        Means [as given].
    """
    width = np.diff(times)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * width)])
    k = np.clip(np.searchsorted(times, edges, side="right") - 1, 0, len(width) - 1)
    into = edges - times[k]
    slope = np.diff(values)[k] / width[k]
    integral = total[k] + values[k] * into + 0.5 * slope * into**2
    return np.asarray(np.diff(integral) / np.diff(edges))


def means_of_means(source: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Average over steps what is known as means over other intervals, keeping those means.

    The integral of the values is known at the edges of their intervals. Between them it is a monotone cubic (Fritsch
    and Carlson 1980, doi:10.1137/0717021), whose derivative is continuous, and not negative where the values are not.

    Parameters
    ----------
    source : ndarray, shape (n_interval + 1,)
        Edges of the intervals [s].
    values : ndarray, shape (n_interval,)
        Means over them [any].
    edges : ndarray, shape (n_steps + 1,)
        Edges of the steps [s], within those of the intervals.

    Returns
    -------
    ndarray, shape (n_steps,)
        Means [as given]; where steps and intervals are the same, the values themselves.
    """
    start = np.searchsorted(source, edges[0])
    same = source[start : start + len(edges)]
    if len(same) == len(edges) and (same == edges).all():
        return np.asarray(values[start : start + len(edges) - 1])
    integral = np.concatenate([[0.0], np.cumsum(values * np.diff(source))])
    return np.asarray(np.diff(PchipInterpolator(source, integral)(edges)) / np.diff(edges))


def means_by_shape(source: FloatArray, values: FloatArray, pieces: FloatArray, shape: FloatArray) -> FloatArray:
    """Spread means over intervals to their pieces in proportion to a shape, keeping the means.

    Parameters
    ----------
    source : ndarray, shape (n_interval + 1,)
        Edges of the intervals [s].
    values : ndarray, shape (n_interval,)
        Means over them [any].
    pieces : ndarray, shape (n_piece + 1,)
        Edges of equal pieces [s], each within one interval; together they cover the intervals from first to last.
    shape : ndarray, shape (n_piece,)
        Not negative [-]; where it is 0 throughout an interval, the value is spread evenly.

    Returns
    -------
    ndarray, shape (n_piece,)
        Means over the pieces [as given].
    """
    owner = np.searchsorted(source, 0.5 * (pieces[1:] + pieces[:-1])) - 1
    count = np.bincount(owner, minlength=len(values))
    mean = np.bincount(owner, shape, minlength=len(values)) / np.maximum(count, 1)
    even = mean[owner] <= 0.0
    return np.asarray(values[owner] * np.where(even, 1.0, shape / np.where(even, 1.0, mean[owner])))
