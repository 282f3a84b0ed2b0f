"""Course of a monitoring: alarms, what they are named, the model that carries a change on, and its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from calibration.errors import NotEnoughDataError
from calibration.monitoring.days import Days
from calibration.monitoring.dispersion import Dispersion
from calibration.monitoring.filter import DayFilter, Found, State, is_told, noise_of
from calibration.monitoring.watch import Alarm, Sought, Watch, sought
from calibration.progress import Progress
from thermal._types import BoolArray, FloatArray

#: Logarithm of the evidence that makes an alarm where it lasts [-]. Were days as the filter says, the mean time between
#: false alarms would be exp(12) days or more; days of a model that lacks physics are not, and 12 was chosen on the
#: development years of ``benchmarks/monitoring.py``, so that quiet ones have less than one alarm a year.
THRESHOLD = 12.0

#: Days for which the evidence has to stay over the threshold before it is an alarm [d], and multiple of the threshold
#: from which it is one at once [-]. Fronts and spells of days unlike others pass within days, a change does not.
LASTS, AT_ONCE = 3, 2.0

#: Days after an alarm by which a change is named [d]: evidence that is enough for an alarm is not always for a name.
NAMING_DAYS = 7

#: Share of the threshold under which an alarm is withdrawn once it may be named [-], and days after which it is where
#: its evidence stays between the two [d]: a few days unlike others take evidence away from a change that lasts, too.
_GONE, _LONGEST_WAIT = 0.5, 21

#: Share of the evidence for the end of a change from which an alarm closes it [-].
_CLOSES = 0.5

#: What is said where heat that names no cause explains a change best.
UNKNOWN_CAUSE = "unknown"


@dataclass(frozen=True)
class Event:
    """A change.

    Parameters
    ----------
    effect : str
        Id of the catalogue, or ``unknown``.
    zones : tuple of str
        Where; empty for the whole building.
    parameter : str
        Its strength.
    unit : str
        Of the strength.
    size : float
        What the strength has changed by [unit].
    deviation : float
        Standard error of it [unit].
    probability : float
        Of the effect, given that something has changed [-].
    probabilities : mapping of str to float
        Of all effects that have one per cent and more [-].
    since : int
        Day of the change.
    over : int
        Days over which it came; 0 is at once [d].
    alarm : int
        Day on which it was noticed.
    named : int
        Day on which it was named.
    log_evidence : float
        By then [-].
    end : int or None
        First day on which it is over; None while it lasts.
    end_alarm : int or None
        Day on which that was noticed.
    """

    effect: str
    zones: tuple[str, ...]
    parameter: str
    unit: str
    size: float
    deviation: float
    probability: float
    probabilities: dict[str, float]
    since: int
    over: int
    alarm: int
    named: int
    log_evidence: float
    end: int | None = None
    end_alarm: int | None = None


@dataclass(frozen=True)
class Course:
    """Statistics by day, and what was found.

    Parameters
    ----------
    events : tuple of Event
        In the order in which they were noticed.
    withdrawn : tuple of int
        Days of alarms whose evidence was gone a week later, or not enough for three weeks.
    waiting : int or None
        Day of an alarm that waits for its name where the telemetry ends; None where none does.
    evidence : ndarray, shape (n_day,)
        Logarithm of the evidence that something has changed [-]; NaN while nothing is watched or an alarm waits.
    size : ndarray, shape (n_day,)
        Mean square of the day's innovations over what is expected [-]; NaN where nothing was measured.
    carried : ndarray, shape (n_day,)
        Mean absolute error with the parameters and changes carried on [K].
    threshold : float
        Of the evidence [-].
    parameters : dict
        By name, where the model began and where the last day leaves it.
    told : ndarray of bool, shape (n_error,)
        Errors that the reference days show, and that are watched.
    """

    events: tuple[Event, ...]
    withdrawn: tuple[int, ...]
    waiting: int | None
    evidence: FloatArray
    size: FloatArray
    carried: FloatArray
    threshold: float
    parameters: dict[str, Any]
    told: BoolArray

    def daily(self, days: Days) -> pd.DataFrame:
        """Tabulate by day.

        Parameters
        ----------
        days : Days
            With the errors of the model as it is.
        """
        errors = days.errors[:, self.told]
        seen = np.isfinite(errors).any(axis=1)
        mae = np.full(len(days), np.nan)
        mae[seen] = np.nanmean(np.abs(errors[seen]), axis=1)
        columns = {"mae": mae, "mae_carried": self.carried, "size": self.size, "log_evidence": self.evidence}
        return pd.DataFrame(columns, index=pd.DatetimeIndex(days.dates, name="timestamp"))


def follow(
    days: Days, reference: int, ruled_out: Sequence[str] = (), progress: Progress | None = None,
    threshold: float = THRESHOLD,
) -> Course:
    """Go through the days.

    Parameters
    ----------
    days : Days
        Errors and their derivatives.
    reference : int
        First days, which are taken for sound.
    ruled_out : sequence of str
        Effects that are known not to change.
    progress : callable, optional
        Called with stage, done, total.
    threshold : float
        Logarithm of the evidence that makes an alarm where it lasts for more than three days, or is twice as large [-].

    Raises
    ------
    NotEnoughDataError
        When the reference days, or those after them, show too little.
    """
    told = is_told(days, reference)
    NotEnoughDataError.unless(
        told.any(), f"the {reference} reference days", "a zone with runs on more than a week of them", "none",
        "take other days, or more of them",
    )  # fmt: skip
    days = replace(days, errors=np.where(told, days.errors, np.nan))
    NotEnoughDataError.unless(
        np.isfinite(days.errors[reference:]).any(), "monitor", "a day with a usable run after the reference days",
        f"none of {len(days) - reference}", "look for sensors that are silent, and shorten the reference",
    )  # fmt: skip
    columns = tuple(replace(c, may_change=c.may_change and c.effect not in ruled_out) for c in days.columns)
    walk = _Walk(replace(days, columns=columns), reference, threshold)
    while walk.day < len(days):
        if progress is not None:
            progress("follow the days", walk.day, len(days))
        walk.advance()
    return walk.course(told)


class _Walk:
    """Goes on day by day; goes back to the day of a change once it is named, to carry it on from there."""

    def __init__(self, days: Days, reference: int, threshold: float) -> None:
        self.days, self.threshold = days, threshold
        self.what: Sought = sought(days)
        self.filter = DayFilter(days, noise_of(days, reference))
        self.dispersion = Dispersion(len(days), self.what.which.size)
        self.day, self.watched_from = 0, reference
        self.states: list[State] = [self.filter.start()]
        self.watch: Watch | None = None
        self.alarm: Alarm | None = None
        self.pending: int | None = None
        self.lasts = 0
        self.events: list[Event] = []
        self.places: list[int] = []
        self.lasting: list[int] = []
        self.withdrawn: list[int] = []
        self.evidence, self.size, self.carried = (np.full(len(days), np.nan) for _ in range(3))

    def advance(self) -> None:
        """Take in a day."""
        day, state = self.day, self.filter.grown(self.states[self.day])
        ahead, innovation = self.filter.step(state, day)
        self.states[day + 1 :] = [ahead]
        self.day += 1
        if innovation is None:
            if self.day == len(self.days) and self.watch is not None and self.alarm is not None:
                self._settle_if_noticed(day, self.alarm, self.watch)  # no later day will
            return
        self.size[day], self.carried[day] = self.filter.sizes[day], float(np.mean(np.abs(innovation.left)))
        if day < self.watched_from:
            self.dispersion.put(day, self.what.shown(self.days, day, innovation), innovation)
            return
        if self.watch is None:
            ends = [(place, size) for place, size in zip(self.places, self._sizes(state), strict=True)]
            self.lasting = [k for k, e in enumerate(self.events) if e.end is None]
            cap = self.threshold / 2.0  # no single day may raise an alarm
            found, n_state = self.filter.changes, state.mean.size
            lasting = [ends[k] for k in self.lasting]
            self.watch = Watch(self.what, n_state, self.dispersion, cap, lasting, found)
        alarm = self.watch.take(day, self.days, innovation, (state, ahead), self.pending)
        if self.pending is None:
            self.evidence[day] = alarm.log_evidence
            self.lasts = self.lasts + 1 if alarm.log_evidence > self.threshold else 0
            if self.lasts > LASTS or alarm.log_evidence > AT_ONCE * self.threshold:
                self.pending = day
        self.alarm = alarm
        self._settle_if_noticed(day, alarm, self.watch)

    def _sizes(self, state: State) -> list[float]:
        n = len(self.events)
        return state.mean[state.mean.size - n :].tolist() if n else []

    def _settle_if_noticed(self, day: int, alarm: Alarm, watch: Watch) -> None:
        if self.pending is not None:
            self._settle(day, alarm, watch, self.pending)

    def _settle(self, day: int, alarm: Alarm, watch: Watch, noticed: int) -> None:
        """Close what is over at once; name what is new once there are days enough."""
        over = int(np.argmax(alarm.ends)) if alarm.ends.size else -1
        if over >= 0 and alarm.ends[over] > _CLOSES:
            self._close(self.lasting[over], int(alarm.starts[alarm.share.size + over]), day, noticed)
            return
        if day - noticed < NAMING_DAYS and day + 1 < len(self.days):
            return
        if alarm.log_evidence < self.threshold:  # a few days unlike others look like a change and do not last
            if alarm.log_evidence < _GONE * self.threshold or day - noticed >= _LONGEST_WAIT:
                self.withdrawn.append(noticed)
                self.pending, self.lasts = None, 0
            return
        number, event = self._named(alarm, day, watch, noticed)
        for k in self.lasting:
            same = self.events[k].effect == event.effect and self.events[k].zones == event.zones
            if same and event.size * self.events[k].size < 0.0 and 2.0 * abs(event.size) > abs(self.events[k].size):
                self._close(k, event.since, day, noticed)
                return
        self.events.append(event)
        column = int(self.what.which[number])
        self.places.append(int(np.argmax((self.what.which == column) & (self.what.over == 0))))  # mended at once
        change = Found(column, event.since, None, event.over, self.days.columns[column].deviation)
        self.filter = self.filter.with_changes([*self.filter.changes, change])
        self._go_back(event.since, day)

    def _close(self, which: int, end: int, day: int, noticed: int) -> None:
        self.events[which] = replace(self.events[which], end=end, end_alarm=noticed)
        changes = list(self.filter.changes)
        changes[which] = replace(changes[which], end=end)
        self.filter = self.filter.with_changes(changes)
        self._go_back(end, day)

    def _go_back(self, start: int, day: int) -> None:
        """Filter anew from a day on, and watch again once today is past."""
        self.day = start
        self.states = self.states[: start + 1]
        self.watched_from, self.watch, self.pending, self.lasts = day + 1, None, None, 0

    def _named(self, alarm: Alarm, day: int, watch: Watch, noticed: int) -> tuple[int, Event]:
        """Tell the likeliest effect, then where it is; its strength by its place among what is sought."""
        columns = [self.days.columns[k] for k in self.what.which]
        names = [UNKNOWN_CAUSE if c.is_unknown else str(c.effect) for c in columns]
        shares: dict[str, float] = {}
        for name, share in zip(names, alarm.share.tolist(), strict=True):
            shares[name] = shares.get(name, 0.0) + share
        ranked = dict(sorted(shares.items(), key=lambda item: -item[1]))
        best = next(iter(ranked))
        number = int(np.argmax(np.where(np.array(names) == best, alarm.share, -1.0)))
        column, since = columns[number], int(alarm.starts[number])
        return number, Event(
            effect=best, zones=column.zones, parameter=column.name, unit=column.unit,
            size=watch.size(since, number), deviation=float("nan"), probability=ranked[best],
            probabilities={name: share for name, share in ranked.items() if share >= 0.01}, since=since,
            over=int(self.what.over[number]), alarm=noticed, named=day, log_evidence=alarm.log_evidence,
        )  # fmt: skip

    def course(self, told: BoolArray) -> Course:
        """Gather what was found, with what the last day knows of its size."""
        last = self.filter.grown(self.states[-1])
        n, columns = len(self.events), self.days.columns
        spread = np.sqrt(np.diag(last.covariance))
        events = []
        for k, event in enumerate(self.events):
            at = last.mean.size - n + k  # strengths that may change are estimated on a linear scale
            events.append(replace(event, size=float(last.mean[at]), deviation=float(spread[at])))
        parameters = {
            c.name: {"value": c.value, "unit": c.unit, "moved": float(last.mean[k]),
                     "deviation": float(spread[k])}
            for k, c in enumerate(columns) if c.spread > 0.0 and not c.is_unknown
        }  # fmt: skip
        return Course(
            tuple(events), tuple(self.withdrawn), self.pending, self.evidence, self.size, self.carried, self.threshold,
            parameters, told,
        )  # fmt: skip

