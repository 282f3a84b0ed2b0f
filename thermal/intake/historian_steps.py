"""Sums of a historian's samples over steps: of samples one by one, or of packed days by slots of five minutes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from thermal._types import BoolArray, FloatArray, IntArray
from thermal.intake.resample import LEAST_COVERED, step_means

#: PostgreSQL counts microseconds from 2000, this many after 1970 [us].
_EPOCH = 946_684_800_000_000

#: A sample as PostgreSQL sends it: time [us since 2000], value.
_SAMPLE = np.dtype([("time", ">i8"), ("value", ">f8")])

#: Length of a slot [us], and slots of a day: the first is that before midnight, for a sample at midnight is of its.
_SLOT, SLOTS = 300_000_000, 289


def samples_of_rows(rows: Sequence[tuple[int, bytes]]) -> tuple[IntArray, Any]:
    """Read packed samples.

    Parameters
    ----------
    rows : sequence of tuple of int and bytes
        Id of a point, and its samples.

    Returns
    -------
    tuple of ndarray, shape (n_sample,)
        Ids, and samples with ``time`` [us since 2000] and ``value``.
    """
    lengths = [len(blob) // _SAMPLE.itemsize for _, blob in rows]
    samples = np.frombuffer(b"".join(blob for _, blob in rows), dtype=_SAMPLE)
    return np.repeat(np.array([point for point, _ in rows], dtype=np.int64), lengths), samples


def slots_of(points: IntArray, samples: Any, day: pd.Timestamp) -> tuple[IntArray, FloatArray, IntArray]:
    """Add samples up over slots.

    Parameters
    ----------
    points, samples : ndarray, shape (n_sample,)
        Of `samples_of_rows`.
    day : Timestamp
        Midnight in UTC.

    Returns
    -------
    tuple of ndarray
        Ids, shape (n_point,); sums and counts of finite values, shape (n_point, n_slot).
    """
    values = samples["value"].astype(float)
    slots = (samples["time"].astype(np.int64) - (day.value // 1000 - _EPOCH) - 1) // _SLOT + 1
    ids, rows = np.unique(points, return_inverse=True)
    known = np.isfinite(values)
    of, size = (rows * SLOTS + slots)[known], len(ids) * SLOTS
    sums = np.bincount(of, weights=values[known], minlength=size).reshape(-1, SLOTS)
    counts = np.bincount(of, minlength=size).reshape(-1, SLOTS)
    return ids.astype("<i4"), sums.astype("<f8"), counts.astype("<u4")


def slots_of_row(row: Sequence[bytes]) -> tuple[IntArray, FloatArray, IntArray]:
    """Read what `slots_of` gave, array by array.

    Parameters
    ----------
    row : sequence of bytes
        Ids, sums and counts.
    """
    points = np.frombuffer(row[0], dtype="<i4")
    sums, counts = (np.frombuffer(part, dtype=kind) for part, kind in zip(row[1:], ("<f8", "<u4"), strict=True))
    return points, sums.reshape(-1, SLOTS), counts.reshape(-1, SLOTS)


class StepSums:
    """Means of many points over steps, filled a day at a time.

    Parameters
    ----------
    ids : list of int
        Of the points.
    ends : DatetimeIndex, shape (n_step,)
        Of the steps.
    step : float
        Length of the steps [s].
    """

    def __init__(self, ids: list[int], ends: pd.DatetimeIndex, step: float) -> None:
        self._rows = np.full(max(ids) + 1, -1)
        self._rows[ids] = np.arange(len(ids))
        self._ends, self._step, self._width = ends, step, round(step * 1e6)
        self._begin = ends[0].value // 1000 - self._width - _EPOCH
        self._sums = np.zeros((len(ids), len(ends)))
        self._counts = np.zeros((len(ids), len(ends)), dtype=np.uint32)
        self._dense, self._sparse = np.zeros(len(ids), dtype=int), np.zeros(len(ids), dtype=int)
        self._kept: dict[int, list[tuple[IntArray, FloatArray]]] = {}

    def add(self, points: IntArray, samples: Any) -> None:
        """Add the samples of a day.

        Parameters
        ----------
        points, samples : ndarray, shape (n_sample,)
            Of `samples_of_rows`.
        """
        times, values = samples["time"].astype(np.int64) - self._begin, samples["value"].astype(float)
        steps = (times - 1) // self._width  # a sample at the end of a step is of that step
        known = (steps >= 0) & (steps < len(self._ends)) & np.isfinite(values)
        rows, steps, values, times = self._rows[points[known]], steps[known], values[known], times[known]
        if not len(rows):
            return
        first, span = int(steps.min()), int(steps.max() - steps.min()) + 1
        of, size = rows * span + steps - first, len(self._dense) * span
        counts = np.bincount(of, minlength=size).reshape(-1, span)
        sums = np.bincount(of, weights=values, minlength=size).reshape(-1, span)
        self._sums[:, first : first + span] += sums
        self._counts[:, first : first + span] += counts.astype(np.uint32)
        few = self._judged(slice(None), counts.sum(axis=1), span)
        self._keep(rows, times, values, few[rows])

    def _judged(self, rows: IntArray | slice, total: IntArray, span: int) -> BoolArray:
        """Note which points have a sample a step on a day of so many steps; return which have fewer, if any."""
        some, dense = total > 0, total >= span
        self._dense[rows] += dense & some
        self._sparse[rows] += ~dense & some
        return ~dense & some

    def _keep(self, rows: IntArray, times: IntArray, values: FloatArray, sparse: BoolArray) -> None:
        """Keep samples of points with fewer than a step has."""
        order = np.lexsort((times[sparse], rows[sparse]))
        sorted_rows, at = rows[sparse][order], np.flatnonzero(sparse)[order]
        for group in np.split(at, np.flatnonzero(np.diff(sorted_rows)) + 1) if len(at) else ():
            self._kept.setdefault(int(rows[group[0]]), []).append((times[group], values[group]))

    def has_slots(self, day: pd.Timestamp) -> bool:
        """Tell whether steps consist of whole slots.

        Parameters
        ----------
        day : Timestamp
            Midnight in UTC at which a day's slots begin.
        """
        return self._width % _SLOT == 0 and (day.value // 1000 - _EPOCH - self._begin) % _SLOT == 0

    def add_slots(self, day: pd.Timestamp, points: IntArray, sums: FloatArray, counts: IntArray) -> IntArray:
        """Add a day's slots; return the points of which `keep` wants the samples too: those with fewer than steps.

        Parameters
        ----------
        day : Timestamp
            Midnight in UTC.
        points : ndarray, shape (n_point,)
            Ids.
        sums, counts : ndarray, shape (n_point, n_slot)
            Of `slots_of` [as the samples].
        """
        begins = day.value // 1000 - _EPOCH - self._begin + (np.arange(SLOTS) - 1) * _SLOT
        steps = begins // self._width
        known = (steps >= 0) & (steps < len(self._ends)) & counts.any(axis=0)
        if not known.any():
            return np.empty(0, dtype=np.int64)
        steps, sums, counts = steps[known], sums[:, known], counts[:, known]
        starts = np.flatnonzero(np.diff(steps, prepend=-1))
        rows = self._rows[points]
        at = np.ix_(rows, steps[starts])
        self._sums[at] += np.add.reduceat(sums, starts, axis=1)
        self._counts[at] += np.add.reduceat(counts, starts, axis=1, dtype=np.uint32)
        few = self._judged(rows, counts.sum(axis=1, dtype=np.int64), int(steps[-1] - steps[0]) + 1)
        return np.asarray(points[few])

    def keep(self, points: IntArray, samples: Any) -> None:
        """Keep the samples of points that `add_slots` named.

        Parameters
        ----------
        points, samples : ndarray, shape (n_sample,)
            Of `samples_of_rows`.
        """
        times, values = samples["time"].astype(np.int64) - self._begin, samples["value"].astype(float)
        known = (times > 0) & (times <= len(self._ends) * self._width) & np.isfinite(values)
        self._keep(self._rows[points[known]], times[known], values[known], np.ones(int(known.sum()), dtype=bool))

    def means(self, row: int, name: str) -> FloatArray | None:
        """Means of a point, shape (n_step,); None without samples.

        Parameters
        ----------
        row : int
            Of the point among the ids.
        name : str
            Of it: setpoints and commands hold.
        """
        if self._dense[row] + self._sparse[row] == 0:
            return None
        if self._dense[row] >= self._sparse[row]:
            counts = self._counts[row]
            least = max(1.0, LEAST_COVERED * float(np.median(counts[counts > 0])))
            return np.where(counts >= least, self._sums[row] / np.maximum(1, counts), np.nan)
        times = np.concatenate([t for t, _ in self._kept[row]]) + self._begin + _EPOCH
        values = np.concatenate([v for _, v in self._kept[row]])
        stamps = pd.DatetimeIndex(times.astype("datetime64[us]")).tz_localize("UTC")
        return step_means(pd.Series(values, index=stamps), self._ends, self._step, holds=_holds(name))


def _holds(name: str) -> bool:
    return name.endswith(("setpoint", "command"))
