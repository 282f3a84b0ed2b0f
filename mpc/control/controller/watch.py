"""What a controller notices: readings that cannot be, stuck sensors, far from the model, comfort out of reach."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from scipy.special import ndtr

from mpc.control.controller.ranges import READINGS
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.solution import Solution
from mpc.errors import ControlError
from thermal._types import BoolArray, FloatArray
from thermal.case.points import numbers

_RATE_SECONDS = 300.0  # s: over less time a rate says nothing, sensors lag and means jump
_SAME = 1e-6  # K: readings that differ by less are one and the same
_FEWEST = 6  # readings that must be the same, whatever the sensor
_MOST = 288  # readings: a sensor that needs more to tell is not watched
_FAR = 6.0  # deviations of an innovation
_FAR_KELVIN = 1.0  # K: what is nearer than this is not worth saying
_RESTART = 3  # steps in which most zones are far, after which the state is started anew


class PossibleReadings:
    """Takes readings that no sensor can give, or that moved faster than they can, for missing.

    Parameters
    ----------
    columns : sequence of str
        What is read, ``ENTITY/POINT``.

    Notes
    -----
    Ranges and rates are those of `mpc.control.controller.ranges.READINGS`. A rate counts from the last reading
    that was taken, over the time since; so a value that stays becomes possible again by itself. A reading that was
    taken later than now was taken by a wrong clock: it says nothing.
    """

    def __init__(self, columns: Sequence[str]) -> None:
        types = {column: READINGS.get(column.rpartition("/")[2]) for column in columns}
        self._types = {column: kind for column, kind in types.items() if kind is not None}
        #: Last reading that was taken of each column that has a rate, and when [unit inside the library, stamp].
        self.memory: dict[str, tuple[float, pd.Timestamp]] = {}

    def update(self, measurements: Mapping[str, float], now: pd.Timestamp, reasons: list[str]) -> dict[str, float]:
        """Take in a step's readings; give them without those that cannot be, and say which.

        Parameters
        ----------
        measurements : mapping of str to float
            By ``ENTITY/POINT`` [library's units].
        now : pandas.Timestamp
            End of the step.
        reasons : list of str
            Where it is said.
        """
        kept, read = dict(measurements), [column for column in self._types if column in measurements]
        for column, value in zip(read, numbers([measurements[column] for column in read]).tolist(), strict=True):
            if trouble := self._trouble(column, value, now):
                kept[column] = np.nan
                reasons.append(f"{column}: {trouble}: it counts as missing")
        return kept

    def _trouble(self, column: str, value: float, now: pd.Timestamp) -> str:
        """Say what is wrong with a reading; nothing where it can be."""
        kind = self._types[column]
        if np.isnan(value):
            return ""
        if not kind.possible(value):
            return f"{kind.told(value)} is outside of {kind.told(kind.lowest)} to {kind.told(kind.highest)}"
        last, when = self.memory.get(column, (value, now))
        last, when = (value, now) if now < when else (last, when)
        elapsed = max((now - when).total_seconds(), _RATE_SECONDS)
        if abs(value - last) > kind.largest_rate * elapsed / 3600.0:
            before = f"{kind.told(last)} {elapsed / 60.0:.0f} min before"
            return f"{kind.told(value)} after {before} is faster than it can move"
        if np.isfinite(kind.largest_rate):
            self.memory[column] = (value, now)
        return ""


class StuckSensors:
    """Recognises zone sensors that repeat one value.

    Parameters
    ----------
    zones : sequence of str
        Names.
    deviation : ndarray, shape (n_zone,)
        Standard deviation of the sensors' noise [K], positive.
    false_alarm : float
        Largest probability with which a healthy sensor is taken for stuck in a step [-], below 1; with 0 no sensor is
        watched.
    resolution : float
        To which sensors round [K]; 0 where they do not. The default is that of most building automation.

    Raises
    ------
    ControlError
        When a number is out of its range.

    Notes
    -----
    A healthy sensor of noise σ that rounds to h repeats a value at most with probability ``p = 2 Φ(h / 2σ) - 1``, in
    the middle between two steps of its scale and where the zone stands still. m equal readings in a row have a
    probability of at most ``p^(m-1)``; m is the least for which that is not above the false alarm, and 6. A sensor
    whose noise shows so little against its resolution that m exceeds 288, a day at 5 minutes, is not watched.
    """

    def __init__(
        self, zones: Sequence[str], deviation: FloatArray, false_alarm: float = 1e-5, resolution: float = 0.1
    ) -> None:
        possible = 0.0 <= false_alarm < 1.0 and resolution >= 0.0 and (deviation > 0.0).all()
        found = f"{false_alarm}, {resolution} K, {deviation}"
        ControlError.unless(possible, "stuck sensors", "a probability, a resolution, positive deviations", found)
        self.zones = tuple(zones)
        repeat = 2.0 * ndtr(0.5 * max(resolution, _SAME) / np.asarray(deviation)) - 1.0
        rare = np.log(false_alarm) if false_alarm > 0.0 else -np.inf
        needed = np.ceil(1.0 + rare / np.log(np.minimum(repeat, 1.0 - 1e-12)))
        #: Sensors whose standing still could be told, shape (n_zone,).
        self.watched = needed <= _MOST
        #: Equal readings after which a sensor counts as stuck, shape (n_zone,); of no meaning where it is not watched.
        self.needed = np.clip(needed, _FEWEST, _MOST).astype(np.int64)
        self._last, self._count = np.full(len(self.zones), np.nan), np.zeros(len(self.zones), dtype=np.int64)

    def update(self, zone: FloatArray) -> BoolArray:
        """Take in a step's readings; tell which sensors are stuck, shape (n_zone,).

        Parameters
        ----------
        zone : ndarray, shape (n_zone,)
            Temperatures [K]; NaN where missing.
        """
        same = np.abs(zone - self._last) <= _SAME
        self._count = np.where(same, self._count + 1, np.isfinite(zone).astype(np.int64))
        self._last = np.where(same, self._last, zone)
        return np.asarray(self.watched & (self._count >= self.needed))

    @property
    def memory(self) -> FloatArray:
        """Last values and how often each was read, shape (2, n_zone), to be saved [K, -]."""
        return np.vstack([self._last, self._count])

    @memory.setter
    def memory(self, kept: FloatArray) -> None:
        self._last, self._count = kept[0].copy(), kept[1].astype(np.int64)


class FarFromModel:
    """Notices that zones are far from what the model predicted.

    Parameters
    ----------
    zones : sequence of str
        Names.
    deviation : ndarray, shape (n_zone,)
        Of the innovations according to the filter [K].
    """

    def __init__(self, zones: Sequence[str], deviation: FloatArray) -> None:
        self.zones, self.limit = tuple(zones), np.maximum(_FAR * deviation, _FAR_KELVIN)
        self.count = 0

    def update(self, innovation: FloatArray, reasons: list[str]) -> bool:
        """Name the zones that are far; tell whether the state should be started anew.

        Parameters
        ----------
        innovation : ndarray, shape (n_zone,)
            Measured minus predicted [K]; NaN where missing.
        reasons : list of str
            Where it is said.
        """
        reported, size = np.isfinite(innovation), np.abs(np.nan_to_num(innovation))
        far = size > self.limit
        for k in np.argsort(-size)[: min(3, int(far.sum()))]:
            reasons.append(
                f"zone {self.zones[k]!r} is {innovation[k]:+.1f} K from what its model predicted, more than the "
                f"{self.limit[k]:.1f} K of its sensor and unmeasured heat"
            )
        self.count = self.count + 1 if far.sum() > 0.5 * max(int(reported.sum()), 1) else 0
        if self.count < _RESTART:
            return False
        self.count = 0
        reasons.append(f"most zones were far from the model for {_RESTART} steps: its state is started anew")
        return True


_NOTABLE = 0.3  # K outside of a band
_NAMED = 3  # zones


def explain_comfort(
    problem: ControlProblem, data: HorizonData, solution: Solution, zones: Sequence[str], now: pd.Timestamp
) -> list[str]:
    """Name the zones that a plan leaves outside of their band, the worst first, and the ranges that it exhausts then.

    Parameters
    ----------
    problem : ControlProblem
        What was solved.
    data : HorizonData
        With these parameters.
    solution : Solution
        Its outcome.
    zones : sequence of str
        Names of the zones.
    now : pandas.Timestamp
        Start of the horizon.
    """
    zone = solution.rollout.zone[1:]
    lack, excess = data.lower - zone, zone - data.upper
    outside = np.maximum(lack, excess)
    stamps, block_of = problem.predictor.horizon.stamps(now), problem.predictor.horizon.block_of
    said = []
    for k in np.argsort(-outside.max(axis=0))[:_NAMED]:
        row = int(outside[:, k].argmax())
        if outside[row, k] < _NOTABLE:
            break
        cold = lack[row, k] > excess[row, k]
        edge = float((data.lower if cold else data.upper)[row, k])
        limits = _exhausted(problem, solution.plan[block_of[row]])
        why = f"; {' and '.join(limits)}" if limits else "; more would cost more than comfort is worth"
        said.append(
            f"zone {zones[k]!r} stays {outside[row, k]:.1f} K {'below' if cold else 'above'} {edge - 273.15:.1f} degC "
            f"at {stamps[row]:%Y-%m-%d %H:%M}{why}"
        )
    return said


def _exhausted(problem: ControlProblem, values: np.ndarray) -> list[str]:
    said = []
    for channel, value in zip(problem.predictor.channels, values, strict=True):
        near = 1e-3 * (channel.upper - channel.lower)
        if value >= channel.upper - near:
            said.append(f"{channel.name} is at its upper limit of {channel.upper:g} {channel.unit}")
        elif value <= channel.lower + near:
            said.append(f"{channel.name} is at its lower limit of {channel.lower:g} {channel.unit}")
    return said
