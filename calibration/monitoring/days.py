"""What each day of the telemetry says: errors of runs, and what a unit of all that may change would do to them.

The calibrated model is run from midnight to midnight in runs of the horizon, with every effect of the catalogue in it
at strength 0, so that the sensitivities of its errors to all strengths come from the code that calibration uses. A day
is then a vector of errors and a matrix, and all that follows is linear algebra.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from calibration.diagnosis.refit.comparison import Built, ModelComparison, is_strength
from calibration.errors import NotEnoughDataError
from calibration.evaluation.intervals import Interval, Runs, select_runs
from calibration.progress import Progress
from thermal._types import BoolArray, FloatArray, IntArray
from thermal.effects.catalogue import effect_of
from thermal.effects.effect import zones_of
from thermal.effects.unknown import UNKNOWN
from thermal.inputs.provider import InputProvider
from thermal.model.case_replay import Inputs, replay_inputs
from thermal.model.reduce import SHIFTS, reduced_model
from thermal.parameters import Parameter
from thermal.units import AIR_HEAT_CAPACITY

#: Effects that may begin or end from one day to the next. Of walls, roofs, grounds, films and neighbours the strengths
#: are learnt as the seasons show them, like the parameters of the baseline.
MAY_CHANGE = (
    "solar_gain", "infiltration", "window_opening", "ventilation", "internal_gains", "hidden_mass", "zone_mixing",
    "wrong_station", "clock_shift", "flow_gain", "duct_loss", "capacity_limit", "valve_leak", "sensor_bias",
    "sensor_lag",
)  # fmt: skip

#: Heat that names no cause: where it explains a change best, the change is of unknown cause.
NO_CAUSE = ("heat_always", "heat_by_cold", "heat_by_occupancy")

#: Effects that a fit of the first weeks has in it where the case can tell them: any office has windows, leaks, people.
USUAL = ("solar_gain", "infiltration", "internal_gains")

#: Strengths whose errors are far from linear in them, and where secants are taken that stand for their tangent
#: [parameter units]: at little lost capacity only the hours of the largest load count, and an open door evens out what
#: its tangent takes for a heat that never ends. Each secant is sought for itself.
_SECANTS = {"capacity_lost": (0.2, 0.6), "door_airflow": (0.1,)}

#: Share of people's heat that rooms without a device get, and the strengths that it is a share of: what begins may be
#: everywhere alike, whatever the share was (seeds 21, 29, 69, 77 of the houses of ``benchmarks/monitoring.py``).
_ELSEWHERE, _GAINS = "internal_gain_unserved_share", ("internal_gain", "internal_gain_at_home", "base_load")

#: Limits of strengths beside that what is positive stays so: a share of all that a terminal gives, or a meter reads.
_LIMITS = {"capacity_lost": (0.0, 1.0), "flow_gain": (-1.0, np.inf)}

#: Area of a window, which air passes by one of several laws.
_WINDOW = "opened_window_area"

#: Strength of a clock that is wrong by an hour: weather that is moved tells it, sun and all, and not its tangent.
_CLOCK = "weather_clock_shift"

#: Deviation of a strength that no fit had, before the data, over that of a diagnosis [-]: the first weeks are taken for
#: sound, so that what is not there is not there. What a strength may have been from the beginning takes up a change of
#: it: at 0.3 the sensor's bias, the meter and the terminal of a zone together took nine tenths of what a meter that
#: began to read wrong says on a day five weeks later (development seed 35 of ``benchmarks/monitoring.py``), and what
#: the model lacks, taken for faults of old, moved errors that were quiet.
_SELDOM = 0.03

#: Days after a sensor has begun to read wrong in which the walls behind do not know of it yet [d].
ONSET = 6

#: Telemetry whose runs share a spin-up [d]: bounds the memory that sensitivities take.
_CHUNK = 28


@dataclass(frozen=True)
class Column:
    """A number that errors depend on.

    Parameters
    ----------
    name : str
        Of the parameter.
    unit : str
        Its unit.
    effect : str or None
        Effect that it belongs to; None for the baseline.
    zones : tuple of str
        Where; empty for the whole building.
    deviation : float
        Standard deviation of a change of it on the estimation scale, before the data [-].
    spread : float
        Standard deviation of what it was from the beginning [-].
    away : float
        Centre of its prior, counted from where the model is [-].
    value : float
        Where the model is [parameter unit].
    may_change : bool
        Whether it may change from one day to the next.
    present : bool
        Whether the model has it, or the effect that it belongs to.
    limits : tuple of float
        Least and most that a strength can be, infinite where nothing limits it: no leak is less than nothing, no
        terminal loses more than all that it can give, no meter errs by less than -1 of what it reads [parameter unit].
    """

    name: str
    unit: str
    effect: str | None
    zones: tuple[str, ...]
    deviation: float
    spread: float
    away: float
    value: float
    may_change: bool
    present: bool
    limits: tuple[float, float]

    @property
    def is_unknown(self) -> bool:
        """Whether it names no cause."""
        return self.effect in UNKNOWN


@dataclass(frozen=True)
class Days:
    """Errors of every day, and their derivatives.

    Parameters
    ----------
    dates : DatetimeIndex, length n_day
        Local midnights at which the days begin.
    errors : ndarray, shape (n_day, n_error)
        Simulated minus measured zone temperatures [K]; NaN where there is none.
    slopes : ndarray, shape (n_day, n_error, n_column)
        Their derivatives on the estimation scale [K].
    columns : tuple of Column
        What they are derivatives by.
    onset : ndarray, shape (n_onset, n_error, n_column)
        What is to be added to the derivatives on the first days of a change, the day of the change first [K].
    zone : ndarray of int, shape (n_error,)
        Zone of each error.
    zones : tuple of str
        Names of the zones.
    """

    dates: pd.DatetimeIndex
    errors: FloatArray
    slopes: FloatArray
    columns: tuple[Column, ...]
    onset: FloatArray
    zone: IntArray
    zones: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.dates)

    @property
    def days_off(self) -> BoolArray:
        """Which days are Saturdays and Sundays."""
        return np.asarray(self.dates.day_of_week >= 5)


def days_of_case(
    models: ModelComparison,
    effects: Mapping[str, Sequence[str]],
    values: Mapping[str, float],
    candidates: Sequence[str],
    moved: Mapping[float, ModelComparison] | None = None,
    draughts: Sequence[InputProvider] = (),
    progress: Progress | None = None,
) -> Days:
    """Run the model over all the telemetry, with the sensitivities to all that may be or change.

    Parameters
    ----------
    models : ModelComparison
        The case.
    effects : mapping of str to sequence of str
        Effects of the calibrated model, with their zones.
    values : mapping of str to float
        Its parameters by name [parameter units].
    candidates : sequence of str
        Effects that it lacks, and that the case can tell.
    moved : mapping of float to ModelComparison, optional
        The case with its weather said so much later [h], twice, which says what a wrong clock does; none where the
        weather's clock is not watched.
    draughts : sequence of InputProvider
        The case with windows that air passes by another law, each of which is sought, too.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    NotEnoughDataError
        When no day has a usable run.
    """
    built = models.build({**effects, **{e: () for e in candidates if e not in effects}})
    theta = built.theta(values)
    clocks = {hours: replay_inputs(m.case, built.network, m.drivers) for hours, m in (moved or {}).items()}
    by_law = [replay_inputs(models.case, built.network, drivers) for drivers in draughts]
    replay = _Replay(models, built, theta, clocks, by_law)
    own, dates = built.network.parameters, replay.dates
    by = [*range(len(theta)), *replay.further]
    errors, slopes = np.full((len(dates), *replay.shape), np.nan), np.zeros((len(dates), *replay.shape, len(by)))
    chunks = range(0, len(dates), _CHUNK)
    for number, begin in enumerate(chunks):
        if progress is not None:
            progress("run the days", number, len(chunks))
        part = slice(begin, min(begin + _CHUNK, len(dates)))
        errors[part], slopes[part] = replay.with_slopes(part)
    NotEnoughDataError.unless(np.isfinite(errors).any(), "telemetry", "a day with a run of the horizon", "none")
    onset = np.zeros((ONSET, *replay.shape, len(by)))
    for i, p in enumerate(own):
        if p.base == "sensor_bias" and p.member is not None:
            onset[..., i] = replay.onset_of_bias(built.network.zones.index(p.member), errors, slopes[..., i])
    n_error = errors[0].size
    by_day, at_onset = slopes.reshape(len(dates), n_error, -1), onset.reshape(ONSET, n_error, -1)
    columns = [_column(own[i], theta[i], own[i].effect in effects or own[i].effect is None) for i in by]
    # a further secant is no further strength
    columns[len(theta) :] = [replace(c, spread=0.0, away=0.0) for c in columns[len(theta) :]]
    told = np.abs(by_day).max(axis=(0, 1)) > 0.0
    return Days(
        dates, errors.reshape(len(dates), -1), by_day[..., told],
        tuple(c for c, t in zip(columns, told, strict=True) if t), at_onset[..., told],
        np.broadcast_to(np.arange(replay.shape[-1]), replay.shape).ravel(), built.network.zones,
    )  # fmt: skip


def coming(over: int, onset: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of a change that has come by each of its first days, and what its first days add to its derivatives.

    A change that comes over days comes in equal parts at the midnights of these, and in half a part at the first and
    the last. Each part has the first days of a change at once after it.

    Parameters
    ----------
    over : int
        Days over which it comes; 0 is at once [d].
    onset : ndarray, shape (n_onset, ...)
        What is added on the first days of a change that comes at once [K].

    Returns
    -------
    tuple of ndarray
        Shares, shape (n_onset + over,) [-], all 1 later; what is added, shape (n_onset + over, ...), nothing later.

    Examples
    --------
    >>> coming(2, np.array([1.0]))
    (array([0.25, 0.75, 1.  ]), array([0.25, 0.5 , 0.25]))
    """
    part = np.full(over + 1, 1.0 / max(1, over))
    if over:
        part[[0, -1]] *= 0.5
    added = np.zeros((len(onset) + over, *onset.shape[1:]))
    for day, share in enumerate(part):
        added[day : day + len(onset)] += share * onset
    shares = np.append(np.cumsum(part), np.ones(max(0, len(added) - len(part))))
    return shares[: len(added)], added


class _Replay:
    """Runs of the model from midnight to midnight, half way and at their end."""

    def __init__(
        self, models: ModelComparison, built: Built, theta: FloatArray, moved: Mapping[float, Inputs],
        draughts: Sequence[Inputs],
    ) -> None:  # fmt: skip
        self.built, self.theta, self.spin_up = built, theta, models.settings.spin_up_seconds
        self.moved, self.draughts = moved, draughts
        # a basis of this θ alone interpolates tangents too, as in a screening
        self.model = reduced_model(built.grid, [theta], shifts=SHIFTS)
        self.problem = models.problem(built, theta)
        self.scale = self.problem.slopes(theta)
        metered = models.drivers.gives("supply_flow")
        self.flow = models.drivers.supply_flow if metered else np.zeros_like(built.inputs.heat)
        steps = self.problem.steps
        self.kept = np.searchsorted(self.problem.keep, sorted({max(1, steps // 2), steps}))
        self.kept = np.unique(np.minimum(self.kept, self.problem.keep.size - 1))
        self.every = steps * built.inputs.step
        self.shape = round(86400.0 / self.every), self.kept.size, len(built.network.zones)
        stamps = built.inputs.stamps
        last = stamps[-1] - pd.Timedelta(seconds=built.inputs.step)  # a stamp ends its step
        self.dates = pd.date_range(stamps[0].normalize(), last.normalize(), freq="D")

    @property
    def further(self) -> list[int]:
        """Parameters that have further derivatives, once for each."""
        own = self.built.network.parameters
        secants = [i for i, p in enumerate(own) for _ in _SECANTS.get(p.base, ())[1:]]
        return secants + self._everywhere + self._windows * len(self.draughts)

    @property
    def _windows(self) -> list[int]:
        """Areas of windows."""
        return [i for i, p in enumerate(self.built.network.parameters) if p.base == _WINDOW]

    @property
    def _everywhere(self) -> list[int]:
        """Strengths of people's heat, where there are rooms that get a share of it alone."""
        own = self.built.network.parameters
        return [i for i, p in enumerate(own) if p.base in _GAINS] if any(p.base == _ELSEWHERE for p in own) else []

    def with_slopes(self, part: slice) -> tuple[FloatArray, FloatArray]:
        """Errors of some days (n_day, n_run, n_kept, n_zone) [K], and their derivatives on the estimation scale.

        Derivatives by the parameters, and after them the further ones.
        """
        errors, slopes = self._run(part, self.theta, self.built.inputs, slopes=True)
        further = []
        for i, p in enumerate(self.built.network.parameters):
            if at := _SECANTS.get(p.base, ()):
                slopes[..., i], *others = (self._secant(part, errors, i, step, self.theta) for step in at)
                further += others
            elif p.base == _CLOCK and self.moved:
                hours = sorted(self.moved)
                earlier, later = (self._run(part, self.theta, self.moved[h])[0] for h in hours)
                slopes[..., i] = np.nan_to_num(later - earlier) / (hours[1] - hours[0])
        if everywhere := self._everywhere:
            shares = np.array([p.base == _ELSEWHERE for p in self.built.network.parameters])
            alike = np.where(shares, 1.0, self.theta)
            before = self._run(part, alike, self.built.inputs)[0]
            further += [self._secant(part, before, i, 1.0, alike) for i in everywhere]
        for inputs in self.draughts:
            by_area = self._run(part, self.theta, inputs, slopes=True)[1]
            further += [by_area[..., i] for i in self._windows]
        scale = np.append(self.scale, self.scale[self.further])
        return errors, np.stack([*np.moveaxis(slopes, -1, 0), *further], axis=-1) * scale

    def _secant(self, part: slice, errors: FloatArray, number: int, step: float, theta: FloatArray) -> FloatArray:
        """Secant of the errors over a step of a parameter, within its range: upwards, or downwards from its end."""
        own = self.built.network.parameters[number]
        room = own.upper - theta[number]
        taken = min(step, room) if room > 0.5 * step else -min(step, theta[number] - own.lower)
        there = theta + (np.arange(theta.size) == number) * taken
        return np.asarray(np.nan_to_num(self._run(part, there, self.built.inputs)[0] - errors) / taken)

    def onset_of_bias(self, zone: int, errors: FloatArray, slopes: FloatArray) -> FloatArray:
        """First days of a sensor that begins to read 1 K more, (n_onset, n_run, n_kept, n_zone) [K], less later ones.

        The walls behind do not know of it at first, while the model holds them at what the sensor says. This passes
        within days, alike at any time of the year, and is taken from one midnight in the middle of the telemetry.
        """
        begin = len(self.dates) // 2
        part = slice(begin, begin + ONSET)
        if part.stop > len(self.dates):
            return np.zeros((ONSET, *self.shape))
        inputs = self.built.inputs
        rows = np.asarray(inputs.stamps > self.dates[begin])
        step = rows[:, None] & (np.arange(self.shape[-1]) == zone)
        warmer = replace(
            inputs, zone=inputs.zone + step, bridged=inputs.bridged + step, held=inputs.held + step,
            heat=inputs.heat - AIR_HEAT_CAPACITY * self.flow * step,
        )  # fmt: skip
        moved = self._run(part, self.theta, warmer)[0] - errors[part]
        return np.nan_to_num(-moved - slopes[part])

    def _run(
        self, part: slice, theta: FloatArray, inputs: Inputs, slopes: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Run some days; NaN where there is no run."""
        dates = self.dates[part]
        errors = np.full((len(dates), *self.shape), np.nan)
        moved = np.zeros((*errors.shape, theta.size)) if slopes else np.zeros(0)
        interval = Interval(dates[0], dates[-1] + pd.DateOffset(days=1))
        problem = replace(self.problem, inputs=inputs)
        try:
            runs = select_runs(inputs, interval, problem.steps, inputs.step, self.spin_up)
        except NotEnoughDataError:
            return errors, moved
        day, place, starts = self._places(runs, dates)
        if starts.size:
            found, by_theta = problem.errors(self.model, theta, Runs(runs.begin, starts, runs.skipped), slopes)
            errors[day, place] = found[:, self.kept]
            if by_theta is not None:
                moved[day, place] = np.where(np.isfinite(found[:, self.kept, :, None]), by_theta[:, self.kept], 0.0)
        return errors, moved

    def _places(self, runs: Runs, dates: pd.DatetimeIndex) -> tuple[IntArray, IntArray, IntArray]:
        """Day and place in it of the runs that tile the days from midnight on, and their starts."""
        stamps = self.built.inputs.stamps[runs.starts]
        seconds = np.asarray(stamps.hour * 3600 + stamps.minute * 60 + stamps.second)
        place = seconds // self.every
        day = dates.get_indexer(stamps.normalize())
        chosen = (seconds % self.every == 0) & (place < self.shape[0]) & (day >= 0)
        return day[chosen], place[chosen].astype(np.int64), runs.starts[chosen]


def _column(p: Parameter, value: float, present: bool) -> Column:
    """Tell what a parameter is to a monitoring."""
    zonal = effect_of(p.effect).takes_zones if p.effect is not None else False
    zones = zones_of([p.member]) if zonal and p.member is not None else ()
    changes = is_strength(p.name, p.effect) and p.effect in (*MAY_CHANGE, *NO_CAUSE)
    limits = _LIMITS.get(p.base, (0.0 if p.lower == 0.0 else -np.inf, np.inf))
    return Column(
        p.name, p.unit, p.effect, zones, p.prior_deviation, p.prior_deviation * (1.0 if present else _SELDOM),
        p.transform(p.start) - p.transform(value), float(value),
        may_change=changes, present=present, limits=limits if changes else (-np.inf, np.inf),
    )  # fmt: skip
