"""Monitoring of a case: its telemetry day by day, since when something has changed, what, and when it was mended."""

from __future__ import annotations

import time
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.diagnosis.baseline import fit_baseline
from calibration.diagnosis.known import reasons_of
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.errors import CalibrationError, HorizonError, NotEnoughDataError
from calibration.evaluation.intervals import Interval, horizon_steps
from calibration.evaluation.settings import ModelSettings, load_parameters, read_settings
from calibration.monitoring.course import Course, Event, follow
from calibration.monitoring.days import MAY_CHANGE, NO_CAUSE, USUAL, Days, days_of_case
from calibration.progress import Progress
from calibration.results import Axes, Result, plain
from thermal._types import BoolArray, FloatArray, IntArray
from thermal.case.case import Case
from thermal.effects.catalogue import CATALOGUE
from thermal.inputs.normalisation import Normalisation, fit_normalisation
from thermal.inputs.provider import InputProvider, telemetry_inputs
from thermal.inputs.windows import WindowLaw, across, counted_on_one_side, on_one_side, steady

#: First weeks that are taken for sound by default, and the fewest days that can be [d].
REFERENCE_DAYS, _FEWEST_DAYS = 42, 14

#: Days whose mean temperature of a zone is usual for the season [d]: a week, so that days off are in it.
_SEASON = 7

#: Days of which a zone exceeds its largest heat 1 % of the time [d].
_PEAKS = 14

#: Zones beyond which a day has too many errors for one covariance.
_MOST_ZONES = 40


@dataclass(frozen=True)
class MonitorSettings:
    """How a case is monitored.

    Parameters
    ----------
    reference_days : int
        First days of the telemetry, which are taken for sound: model and noise are those of these days [d].
    horizon : str
        Of the runs: divides a day, such as ``6h``.
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    known : sequence of str, optional
        Effects that the fit of the reference days has in it; sun, leakage and people by default, as far as the case can
        tell them. Not beside a calibration, which has its own.
    ruled_out : sequence of str
        Effects that are known not to change.
    """

    reference_days: int = REFERENCE_DAYS
    horizon: str = "6h"
    dx: float | None = None
    known: Sequence[str] | None = None
    ruled_out: Sequence[str] = ()


@dataclass(frozen=True, repr=False)
class Monitoring(Result):
    """What a monitoring found.

    Parameters
    ----------
    case : str
        Name of the building.
    events : tuple of Event
        Changes, in the order in which they were noticed.
    course : Course
        Statistics by day, and the parameters as they were carried on.
    days : Days
        Errors by day.
    reference : Interval
        Telemetry that was taken for sound.
    untestable : mapping of str to str
        Effects that could not be watched, with the reason.
    settings : MonitorSettings
        How it was done.
    parameters : str
        Where the model is from.
    seconds : float
        Time it took [s].
    version : str
        Of the library.
    """

    case: str
    events: tuple[Event, ...]
    course: Course
    days: Days
    reference: Interval
    untestable: dict[str, str]
    settings: MonitorSettings
    parameters: str
    seconds: float
    version: str = field(default_factory=lambda: version("buildingmpc"))

    @property
    def is_watched(self) -> BoolArray:
        """Which days after the reference have a run, shape (n_day - reference_days,)."""
        return np.asarray(np.isfinite(self.course.size[self.settings.reference_days :]))

    @property
    def silent_zones(self) -> dict[str, str]:
        """Zones that could not be watched, or not at all times of the day, with the reason."""
        reasons = {}
        for number, zone in enumerate(self.days.zones):
            told = self.course.told[self.days.zone == number]
            if not told.all():
                part = "" if not told.any() else f" at {np.count_nonzero(~told)} of {told.size} times of the day"
                reasons[zone] = f"too few measured temperatures on the reference days{part}"
        return reasons

    @property
    def open_events(self) -> tuple[Event, ...]:
        """Changes that last until the end of the telemetry."""
        return tuple(e for e in self.events if e.end is None)

    def date(self, day: int) -> pd.Timestamp:
        """Return the midnight at which a day begins.

        Parameters
        ----------
        day : int
            Its number.
        """
        return self.days.dates[min(day, len(self.days) - 1)]

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``monitoring.json`` but for its sentence, which `mpc.reports` adds."""
        course = self.course
        content: dict[str, Any] = plain({
            "events": [self._event(e) for e in self.events],
            "withdrawn": [self.date(day) for day in course.withdrawn],
            "waiting": None if course.waiting is None else self.date(course.waiting),
            "watched": {"from": self.date(self.settings.reference_days), "to": self.days.dates[-1],
                        "days": int(self.is_watched.sum()), "days_without_a_run": int((~self.is_watched).sum()),
                        "silent_zones": self.silent_zones},
            "reference": self.reference, "threshold": course.threshold,
            "run_length_days": float(np.exp(course.threshold)),
            "parameters": course.parameters, "untestable": self.untestable, "model": self.parameters,
            "settings": vars(self.settings), "case": self.case, "seconds": self.seconds, "version": self.version,
        })  # fmt: skip
        return content

    def _event(self, event: Event) -> dict[str, Any]:
        days = {name: getattr(event, name) for name in ("since", "alarm", "named", "end", "end_alarm")}
        dated = {name: None if day is None else self.date(day).isoformat() for name, day in days.items()}
        return {**vars(event), **dated}

    def daily(self) -> pd.DataFrame:
        """Statistics by day: index ``timestamp``; ``mae``, ``mae_carried`` [K], ``size`` and ``log_evidence`` [-]."""
        return self.course.daily(self.days)

    def weekly(self) -> pd.DataFrame:
        """Mean errors by week from the first day on, as `daily` has them, and of each zone [K]."""
        errors = pd.DataFrame(np.abs(self.days.errors), index=self.days.dates).T.groupby(self.days.zone).mean().T
        errors = errors.set_axis(list(self.days.zones), axis=1)
        table = pd.concat([self.daily()[["mae", "mae_carried"]], errors], axis=1)
        weeks = table.groupby(np.arange(len(table)) // 7).mean()
        weeks.index = pd.DatetimeIndex(self.days.dates[::7], name="timestamp")
        return weeks

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the changes, one a row."""
        return pd.DataFrame([self._event(e) for e in self.events])

    def _summary(self) -> str:
        return f"{self.case}, {len(self.days)} days, {len(self.events)} changes, {len(self.open_events)} open"

    def _draw(self, axes: Axes) -> None:
        axes.plot(np.arange(len(self.days)), self.course.carried)
        axes.set(xlabel="day", ylabel="mean absolute error (K)")
        for event in self.events:
            axes.axvspan(event.since, event.end or len(self.days), alpha=0.2)


def monitor(
    case: Case,
    parameters: str | Path | None = None,
    settings: MonitorSettings | None = None,
    *,
    progress: Progress | None = None,
) -> Monitoring:
    """Go through the telemetry day by day with the parameters carried on, and say since when something has changed.

    Parameters
    ----------
    case : Case
        Building and telemetry, of three weeks at least.
    parameters : str or Path, optional
        A ``calibration.json``; else the model is fitted to the reference days.
    settings : MonitorSettings, optional
        How it is done.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    NotEnoughDataError
        When no week is left to watch, or too few temperatures were measured.
    CalibrationError
        When a setting is out of range, `parameters` and known effects are given together, the building has more than 40
        zones, or an effect is not of the catalogue.
    """
    began, chosen = time.perf_counter(), settings or MonitorSettings()
    CalibrationError.unless(
        parameters is None or chosen.known is None, "monitor", "a calibration or effects to fit", "both",
        "a calibration has its effects in it; leave one of the two out",
    )  # fmt: skip
    reference = _reference(case, chosen)
    CalibrationError.unless(
        len(case.building.zone_names) <= _MOST_ZONES, "monitor", f"at most {_MOST_ZONES} zones",
        len(case.building.zone_names), "diagnose its weeks one by one",
    )  # fmt: skip
    given = ModelSettings(**read_settings(parameters)) if parameters is not None else ModelSettings()
    made = replace(given, effects={}, dx=chosen.dx if chosen.dx is not None else given.dx)
    models = ModelComparison(case, made, [reference], horizon=chosen.horizon)
    usual = fit_normalisation(case, [(reference.start, reference.end)])
    laws = (on_one_side, counted_on_one_side(across), counted_on_one_side(steady))
    drivers, *draughts = _of_seasons(case, usual, chosen.horizon, laws)
    models.drivers = drivers
    untestable = models.untestable()
    said = reasons_of(chosen.known or (), chosen.ruled_out, untestable)
    untestable |= {e: said[e] for e in chosen.ruled_out}
    if parameters is not None:
        network = given.network(case.building)
        theta = load_parameters(parameters, network)
        values = {p.name: float(v) for p, v in zip(network.parameters, theta, strict=True)}
        effects = {name: tuple(zones) for name, zones in dict(given.effects).items()}
    else:
        known = chosen.known if chosen.known is not None else [e for e in USUAL if e not in untestable]
        models, fit = fit_baseline(models, {name: () for name in known})
        models.drivers = drivers
        values, effects = fit.values, dict(fit.effects)
    # what is in the model is watched like all else
    untestable = {e: why for e, why in untestable.items() if e not in effects or e in chosen.ruled_out}
    candidates = [e for e in CATALOGUE if e not in untestable and not (set(CATALOGUE[e].requires) - set(effects))]
    hour = max(1, round(3600.0 / case.step)) * case.step / 3600.0  # whole steps
    moved = {h: _moved(models, h) for h in (-hour, hour)} if "clock_shift" in {*effects, *candidates} else None
    by_law = draughts if "window_opening" in {*effects, *candidates} else ()
    days = days_of_case(models, effects, values, [*candidates, *NO_CAUSE], moved, by_law, progress)
    course = follow(days, chosen.reference_days, chosen.ruled_out, progress)
    watched = {e: r for e, r in untestable.items() if e in MAY_CHANGE}
    source = Path(parameters).name if parameters is not None else "fitted to the reference days"
    return Monitoring(
        case.building.name, course.events, course, days, reference, watched, chosen, source,
        time.perf_counter() - began,
    )  # fmt: skip


def _of_seasons(
    case: Case, normalisation: Normalisation, horizon: str, laws: Sequence[WindowLaw] = (on_one_side,)
) -> list[InputProvider]:
    """Read the inputs, and let a window of every zone stand open in them, so that its strength is the area that does.

    Air leaves at what was measured where a run begins, and goes on as is usual for the season: as the mean of the week
    before at the same time of the day does. Later temperatures of a run would hand the model the errors that it is to
    be judged by, and the season alone does not know that a room with an open window has become cold. One for each law
    by which air passes windows.
    """
    read = telemetry_inputs(case, normalisation)
    read.openings = np.ones_like(read.openings)
    read.largest_heat = np.maximum(read.largest_heat, _largest_heat(case))
    by_law, seasonal = [copy(read) for _ in laws], copy(read)
    if read.gives("through_windows"):
        zone, stamps = case.zone_temperatures(), case.stamps
        at_this_time = zone.groupby([stamps.hour, stamps.minute, stamps.second])
        week = at_this_time.transform(lambda of: of.shift().rolling(_SEASON, min_periods=1).mean())
        usual = np.where(week.notna(), week, read.usual)
        unlike = np.nan_to_num(zone.to_numpy() - usual)
        seasonal.usual = usual + unlike[_begin_of_run(case, horizon)]
        for drivers, law in zip(by_law, laws, strict=True):
            drivers.through_windows = seasonal.windows_by(law)
    return by_law


def _begin_of_run(case: Case, horizon: str) -> IntArray:
    """Row at which the run that each row belongs to begins, shape (n_time,): values stand for the step before."""
    before = case.stamps - pd.Timedelta(seconds=case.step)
    seconds = np.asarray(before.hour * 3600 + before.minute * 60 + before.second)
    run = seconds // (horizon_steps(horizon, case.step) * case.step)
    first = np.flatnonzero(np.append(True, (np.diff(run) != 0) | np.asarray(before.date[1:] != before.date[:-1])))
    length = np.diff(np.append(first, len(before)))
    return np.repeat(np.maximum(first - 1, 0), length)


def _largest_heat(case: Case) -> FloatArray:
    """Largest heat that terminals were seen to give before each day, shape (n_time, n_zone) [W]: cooling in spring."""
    enough = round(0.5 * _PEAKS * 86400.0 / case.step)
    within = case.zone_heat().abs().rolling(f"{_PEAKS}D", min_periods=enough).quantile(0.99)
    by_day = within.groupby(case.stamps.normalize()).last().cummax().ffill().shift()
    return np.asarray(by_day.fillna(0.0).reindex(case.stamps.normalize()))


def _moved(models: ModelComparison, hours: float) -> ModelComparison:
    """Move the weather of a case."""
    moved = replace(models, case=models.case.with_weather_moved(hours))
    (moved.drivers,) = _of_seasons(moved.case, models.drivers.normalisation, models.horizon)
    return moved


def _reference(case: Case, settings: MonitorSettings) -> Interval:
    """First days of the telemetry."""
    days = settings.reference_days
    CalibrationError.unless(days >= _FEWEST_DAYS, "reference_days", f"{_FEWEST_DAYS} or more", days)
    every = horizon_steps(settings.horizon, case.step) * case.step
    divides = 86400.0 % every == 0.0
    HorizonError.unless(divides, "horizon", "a duration that divides a day, such as 6h", settings.horizon)
    stamps = case.stamps
    end = stamps[0].normalize() + pd.DateOffset(days=days)
    whole = (stamps[-1] - stamps[0]) / pd.Timedelta(days=1)
    NotEnoughDataError.unless(
        whole >= days + 7, "monitor", f"{days} reference days and a week to watch after them", f"{whole:.1f} days"
    )
    return Interval(stamps[0], end)
