"""Cross-validation: calibrate on some days, judge on the others, in turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration.errors import CalibrationError, NotEnoughDataError
from calibration.evaluation.intervals import Interval, horizon_steps, merge
from calibration.evaluation.n_step import Evaluation
from calibration.evaluation.settings import INTERVALS, CalibrationSettings, ModelSettings, calibration_settings
from calibration.fit.calibrate import calibrate
from calibration.fit.least_squares import INTERRUPTED
from calibration.fit.result import ParameterEstimate
from calibration.progress import Progress
from calibration.results import Axes, Plain, Result
from thermal.case.case import Case
from thermal.errors import ThermalError
from thermal.model.case_replay import LEAST_SPIN_UP
from thermal.parameters import PARAMETERS

T = TypeVar("T")

#: An estimate that differs between folds by more than this times its standard error is said to move [-].
MOVES = 2.0


@dataclass(frozen=True)
class Fold(Plain):
    """A calibration without some days, judged on them.

    Parameters
    ----------
    held_out, tuning : tuple of Interval
        The days left out, and what it was calibrated on.
    mae, bias : float
        Errors on the days left out; NaN where the fold failed [K].
    by_day : mapping of str to float
        MAE of the runs whose targets lie on a day, by its local date [K].
    estimates, standard_errors : mapping of str to float
        Of the estimated parameters, on the estimation scale [-].
    failure : str, optional
        What went wrong.
    """

    held_out: tuple[Interval, ...]
    tuning: tuple[Interval, ...]
    mae: float = float("nan")
    bias: float = float("nan")
    by_day: Mapping[str, float] | None = None
    estimates: Mapping[str, float] | None = None
    standard_errors: Mapping[str, float] | None = None
    failure: str | None = None


@dataclass(frozen=True)
class ParameterSpread(Plain):
    """How far a parameter moves when days are left out.

    Parameters
    ----------
    name : str
        As in the model.
    deviation : float
        Standard deviation over the folds, on the estimation scale [-].
    jackknife_error : float
        Standard error by the delete-a-block jackknife, ``sqrt((K - 1)/K Σ (z_k - z̄)²)``: what differs between days is
        in it, other than in the error that each fold reports [-].
    standard_error : float
        Mean of the errors that the folds report [-].
    moves : bool
        Whether the first is more than twice the second.
    """

    name: str
    deviation: float
    jackknife_error: float
    standard_error: float
    moves: bool
    key: ClassVar[str] = "name"


@dataclass(frozen=True, repr=False)
class CrossValidation(Result):
    """Errors on days that were left out.

    Parameters
    ----------
    folds : tuple of Fold
        In the order of time.
    mae : float
        Mean over the folds [K].
    standard_error : float
        Of that mean, by the spread of the folds; they share most of their tuning data, so it is a rough one [K].
    parameters : tuple of ParameterSpread
        One an estimated parameter.
    """

    folds: tuple[Fold, ...]
    mae: float
    standard_error: float
    parameters: tuple[ParameterSpread, ...]

    def to_frame(self) -> pd.DataFrame:
        """Errors of each fold [K]."""
        rows = [{"start": f.held_out[0].start, "mae": f.mae, "bias": f.bias, "failure": f.failure} for f in self.folds]
        return pd.DataFrame(rows).rename_axis("fold")

    def _summary(self) -> str:
        return f"MAE {self.mae:.3f} ± {self.standard_error:.3f} K over {len(self.folds)} folds"

    def _draw(self, axes: Axes) -> None:
        table = self.to_frame()
        axes.bar([f"{start:%Y-%m-%d}" for start in table["start"]], table["mae"])
        axes.axhline(self.mae, linestyle="--", color="grey")
        axes.set(xlabel="days left out, from", ylabel="MAE [K]")


def cross_validate(
    case: Case,
    folds: int = 5,
    settings: ModelSettings | Mapping[str, Any] | None = None,
    *,
    intervals: Sequence[Interval] = (),
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> CrossValidation:
    """Calibrate K times, each without a block of days, and judge each on the days that it was not given.

    Blocks are whole days in a row, since errors an hour apart are almost the same error. The spin-up of any run may
    use telemetry of the days left out, its residuals may not: tuning intervals end a horizon before them, for the runs
    that are judged start there and what disturbs such a run disturbs both.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    folds : int
        Number of blocks K, at least two and at most one a day.
    settings : CalibrationSettings, or mapping of str to Any, optional
        Of each calibration, or these by name.
    intervals : sequence of Interval
        What to use; all the telemetry by default. Leave out what is to judge the final model.
    executor : Executor, optional
        Where to calibrate, any of `concurrent.futures`; it is left open. One after the other by default.
    progress : callable, optional
        Called with stage, done, total after each fold.

    Returns
    -------
    CrossValidation
        A fold that fails is reported beside the others.

    Raises
    ------
    CalibrationError
        When there are fewer days than folds, a setting is unknown, or fewer than two folds succeed.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> found = cross_validate(load_bundled_case(), 5, {"dx": 1.0})  # doctest: +SKIP
    >>> found.mae < 1.0  # doctest: +SKIP
    True
    """
    for name in settings if isinstance(settings, Mapping) else ():
        if name in INTERVALS:
            raise CalibrationError(f"settings: cross-validation chooses {name!r} itself; give `intervals` instead")
    chosen = calibration_settings(settings)
    parts = _folds(case, folds, intervals, horizon_steps(chosen.horizon, case.telemetry.step))
    tasks = [(case, held, tuning, chosen) for held, tuning in parts]
    done = in_order(_fold, tasks, executor, "cross-validate", progress)
    good = [fold for fold in done if fold.failure is None]
    if len(good) < 2:
        raise CalibrationError(f"cross-validation: fewer than two folds succeeded; the last said {done[-1].failure}")
    mae = np.array([fold.mae for fold in good])
    error = float(np.std(mae, ddof=1) / np.sqrt(mae.size))
    return CrossValidation(tuple(done), float(mae.mean()), error, _spreads(good))


def in_order(
    function: Callable[..., T],
    tasks: Sequence[tuple[Any, ...]],
    executor: Executor | None,
    stage: str,
    progress: Progress | None,
) -> list[T]:
    """Call a function with each of several arguments; answers stand in that order.

    Parameters
    ----------
    function : callable
        Importable by name, for executors of other processes.
    tasks : sequence of tuple
        Arguments of each call.
    executor : Executor or None
        Where to; None is here, one after the other.
    stage : str
        What the progress is called.
    progress : callable or None
        Called with stage, done, total after each.
    """
    spread = map if executor is None else executor.map  # which cancels what waits when it is left
    found: list[T] = []
    for answer in spread(function, *zip(*tasks, strict=True)):
        found.append(answer)
        if progress is not None:
            progress(stage, len(found), len(tasks))
    return found


def run_errors(evaluation: Evaluation) -> pd.Series[float]:
    """Error of each run, mean over zones of ``|T_real - T_sim|`` [K], by the stamp of its target.

    Parameters
    ----------
    evaluation : Evaluation
        Of any intervals.
    """
    ahead = pd.Timedelta(seconds=evaluation.steps * evaluation.step_seconds)
    errors = np.concatenate([np.nanmean(np.abs(p.error), axis=1) for p in evaluation.predictions])
    targets = np.concatenate([(p.start + ahead).to_numpy() for p in evaluation.predictions])
    index = pd.DatetimeIndex(targets, tz="UTC").tz_convert(evaluation.predictions[0].start.tz)
    found: pd.Series[float] = pd.Series(errors, index=index, dtype=float)
    return found.sort_index()


def local_days(stamps: pd.DatetimeIndex) -> NDArray[np.str_]:
    """Local date of each step by the stamp that ends it: midnight belongs to the day before.

    Parameters
    ----------
    stamps : DatetimeIndex
        In the building's time zone.
    """
    return np.asarray((stamps - pd.Timedelta(seconds=1)).strftime("%Y-%m-%d"), dtype=str)


def _folds(
    case: Case, count: int, intervals: Sequence[Interval], steps: int
) -> list[tuple[tuple[Interval, ...], tuple[Interval, ...]]]:
    """Held-out and tuning intervals of each fold."""
    stamps, step = case.stamps, case.telemetry.step
    used = np.zeros(len(stamps), dtype=np.int64)
    for number, interval in enumerate(merge(intervals) or [Interval(stamps[0], stamps[-1])], 1):
        used[(stamps >= interval.start) & (stamps <= interval.end)] = number
    of_day = local_days(stamps)
    days = np.unique(of_day[used > 0])
    CalibrationError.unless(2 <= count <= days.size, "folds", f"2 to {days.size}, the days of telemetry to use", count)
    room = steps + round((LEAST_SPIN_UP + 3600.0) / step)  # runs start on the hour
    found = []
    for block in np.array_split(days, count):
        held = np.isin(of_day, block)
        # a run that is judged starts up to N steps before its day, and what disturbs it then disturbs both
        near = np.convolve(held, np.ones(steps + 1), mode="full")[steps:] > 0.0
        tuning = _pieces(stamps, np.where(near, 0, used), room)
        if not tuning:
            raise NotEnoughDataError(
                f"folds: without {block[0]} to {block[-1]} no interval of {room * step / 3600:g} h is left to tune on; "
                "give more folds or more telemetry"
            )
        found.append((_pieces(stamps, np.where(held, used, 0), 2), tuning))
    return found


def _pieces(stamps: pd.DatetimeIndex, label: NDArray[np.int64], least: int) -> tuple[Interval, ...]:
    """Intervals of equal label other than zero, of at least so many stamps."""
    edges = np.flatnonzero(np.diff(label)) + 1
    parts = np.split(np.arange(label.size), edges)
    return tuple(Interval(stamps[p[0]], stamps[p[-1]]) for p in parts if label[p[0]] and p.size >= least)


def _fold(
    case: Case, held_out: tuple[Interval, ...], tuning: tuple[Interval, ...], settings: CalibrationSettings
) -> Fold:
    """Calibrate one fold, in whatever process."""
    try:
        result = calibrate(case, tuning, held_out, settings=settings)
    except (CalibrationError, ThermalError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Fold(held_out, tuning, failure=f"{type(error).__name__}: {error}")
    if result.solver.status == INTERRUPTED:  # the best so far is no fold
        raise KeyboardInterrupt
    evaluation = result.calibrated["held_out"]
    errors = run_errors(evaluation)
    by_day = errors.groupby(local_days(pd.DatetimeIndex(errors.index))).mean()
    known = {p.name: _on_scale(p, p.standard_error) for p in result.parameters if p.standard_error is not None}
    return Fold(
        held_out,
        tuning,
        evaluation.metrics.mae,
        evaluation.metrics.bias,
        {str(day): float(mae) for day, mae in by_day.items()},
        {name: z for name, (z, _) in known.items()},
        {name: error for name, (_, error) in known.items()},
    )


def _on_scale(estimate: ParameterEstimate, standard_error: float) -> tuple[float, float]:
    """Value and standard error on the estimation scale."""
    scale = PARAMETERS[estimate.name.partition("@")[0]]
    return scale.transform(estimate.value), standard_error / scale.slope(estimate.value)


def _spreads(folds: Sequence[Fold]) -> tuple[ParameterSpread, ...]:
    found = []
    for name in folds[0].estimates or {}:
        z = np.array([fold.estimates[name] for fold in folds if fold.estimates])
        reported = float(np.mean([fold.standard_errors[name] for fold in folds if fold.standard_errors]))
        jackknife = float(np.sqrt((z.size - 1) / z.size * np.sum((z - z.mean()) ** 2)))
        found.append(ParameterSpread(name, float(np.std(z, ddof=1)), jackknife, reported, jackknife > MOVES * reported))
    return tuple(found)
