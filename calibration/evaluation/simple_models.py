"""Simple models on the runs of an evaluation: persistence, a ridge regression, and a coupled 2R2C network."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from calibration.errors import NotEnoughDataError
from calibration.evaluation.intervals import Interval, Runs, select_runs
from calibration.evaluation.n_step import Evaluation, spatial_metrics
from calibration.evaluation.two_node import TwoNode, TwoNodeData, fit_two_node
from calibration.evaluation.yardsticks import Yardsticks
from thermal._types import FloatArray, IntArray
from thermal.case.case import Case
from thermal.inputs.normalisation import Normalisation
from thermal.inputs.provider import IRRADIANCE, telemetry_inputs
from thermal.model.case_replay import SPIN_UP, Inputs
from thermal.network.commands import nominal_heat
from thermal.network.topology import Anatomy

#: Zones up to which every two are taken for neighbours, and beyond which a network of them is not fitted.
_ALL_COUPLED, _MOST_ZONES = 12, 40

#: Parts of the horizon that a regression sees apart.
_BLOCKS = 3

#: Strengths of the ridge that are tried, over the number of runs [-], and parts that days are put into to choose.
_RIDGES, _FOLDS = np.logspace(-5, 1, 7), 5

#: Runs below which tiles of the horizon are too few for a network, and starts follow each other by an hour.
_FEW_RUNS = 40

#: Times over which a regression sees how much a zone has warmed before its start [s].
_LAGS = (3600.0, 10800.0)

#: Why nothing can be fitted where it is so.
_UNSEEN = "no zone is measured on the tuning days"

#: Where solar irradiance is measured on the horizontal.
_GLOBAL = "global_horizontal_irradiance_sensor"


def with_yardsticks(
    evaluation: Evaluation,
    case: Case,
    inputs: Inputs,
    anatomy: Anatomy,
    tuned: Sequence[Interval],
    spin_up_seconds: float = SPIN_UP,
) -> Evaluation:
    """Put the errors of simple models on the same runs beside those of a model.

    Parameters
    ----------
    evaluation : Evaluation
        Of the model.
    case : Case
        Whose telemetry it is.
    inputs : Inputs
        The telemetry that the model was run on.
    anatomy : Anatomy
        Floor areas and neighbours of the zones.
    tuned : sequence of Interval
        What the simple models are fitted to; empty where the evaluation leaves nothing.
    spin_up_seconds : float
        Telemetry before an interval that the spin-up may use [s].

    Returns
    -------
    Evaluation
        The same with its yardsticks.
    """
    began, reasons, zones = time.perf_counter(), dict[str, str](), _seen(inputs, tuned)
    runs = _runs_of(evaluation, inputs, spin_up_seconds)
    last = [inputs.bridged[r.starts] - p.measured[:, -1] for r, p in zip(runs, evaluation.predictions, strict=True)]
    found: dict[str, float | None] = {"persistence": _mae(last), "arx": None, "rc": None}
    if not tuned:
        reasons = dict.fromkeys(("arx", "rc"), "all the telemetry is evaluated, so none is left to fit it to")
    elif not zones.any():
        reasons = dict.fromkeys(("arx", "rc"), _UNSEEN)
    else:
        simple = _SimpleModels(case, inputs, anatomy, zones, evaluation.steps)
        for name, method in (("arx", simple.regression), ("rc", simple.network)):
            try:
                found[name] = _mae(_errors(evaluation, inputs, zones, runs, method(tuned, runs, spin_up_seconds)))
            except (NotEnoughDataError, np.linalg.LinAlgError) as error:
                reasons[name] = str(error)
                continue
            if simple.remarks:
                reasons[name] = "; ".join(simple.remarks)
    seconds = time.perf_counter() - began
    return replace(evaluation, yardsticks=Yardsticks(**found, reasons=reasons, seconds=seconds))  # type: ignore[arg-type]


def regression_errors(
    evaluation: Evaluation,
    case: Case,
    inputs: Inputs,
    anatomy: Anatomy,
    tuned: Sequence[Interval],
    spin_up_seconds: float = SPIN_UP,
) -> list[FloatArray]:
    """Errors of a ridge regression on the runs of an evaluation, by prediction, shape (n_run, n_zone) each [K].

    Parameters
    ----------
    evaluation, case, inputs, anatomy, tuned
        As in `with_yardsticks`.
    spin_up_seconds : float
        Telemetry before an interval that the spin-up may use [s].

    Raises
    ------
    NotEnoughDataError
        When no zone is measured on the tuning days, or these are too few.
    """
    zones = _seen(inputs, tuned)
    if not zones.any():
        raise NotEnoughDataError(_UNSEEN)
    runs = _runs_of(evaluation, inputs, spin_up_seconds)
    simple = _SimpleModels(case, inputs, anatomy, zones, evaluation.steps)
    return _errors(evaluation, inputs, zones, runs, simple.regression(tuned, runs, spin_up_seconds))


def _runs_of(evaluation: Evaluation, inputs: Inputs, spin_up: float) -> list[Runs]:
    """Choose the runs of the predictions of an evaluation."""
    return [select_runs(inputs, p.interval, evaluation.steps, spin_up=spin_up) for p in evaluation.predictions]


def _errors(
    evaluation: Evaluation, inputs: Inputs, zones: np.ndarray, runs: Sequence[Runs], predicted: Sequence[FloatArray]
) -> list[FloatArray]:
    """Errors by prediction, zones that no sensor measures as they last were [K]."""
    errors = []
    for r, p, own in zip(runs, evaluation.predictions, predicted, strict=True):
        whole = inputs.held[r.starts].copy()
        whole[:, zones] = own
        errors.append(whole - p.measured[:, -1])
    return errors


def rest_of(stamps: pd.DatetimeIndex, intervals: Sequence[Interval]) -> list[Interval]:
    """Parts of the telemetry outside of some intervals, of two stamps or more each.

    Parameters
    ----------
    stamps : DatetimeIndex
        Of the telemetry.
    intervals : sequence of Interval
        In order, none overlapping another.
    """
    inside = np.zeros(len(stamps), dtype=bool)
    for i in intervals:
        inside |= np.asarray((stamps >= i.start) & (stamps <= i.end))
    part = np.cumsum(np.diff(inside, prepend=inside[0]))
    groups = [stamps[~inside & (part == k)] for k in np.unique(part)]
    return [Interval(g[0], g[-1]) for g in groups if len(g) > 1]


def _seen(inputs: Inputs, tuned: Sequence[Interval]) -> np.ndarray:
    """Zones that are measured on the tuning days."""
    rows = np.zeros(len(inputs), dtype=bool)
    for i in tuned:
        rows |= np.asarray((inputs.stamps >= i.start) & (inputs.stamps <= i.end))
    return np.asarray(np.isfinite(inputs.zone[rows]).any(axis=0))


def _mae(errors: Sequence[FloatArray]) -> float:
    return spatial_metrics(np.concatenate(errors)).mae


class _SimpleModels:
    """Telemetry of a case as the simple models see it."""

    def __init__(self, case: Case, inputs: Inputs, anatomy: Anatomy, seen: np.ndarray, steps: int) -> None:
        self.inputs, self.seen, self.steps, self.heat = inputs, seen, steps, inputs.heat.copy()
        self.boundary = inputs.boundary[:, : len(case.boundary_temperatures().columns)]
        names = case.building.zone_names
        self.remarks = []
        if not seen.all():
            unseen = [n for n, s in zip(names, seen, strict=True) if not s]
            self.remarks.append(f"without {len(unseen)} of {len(names)} zones, which no sensor measures")
        provider = telemetry_inputs(case, Normalisation())
        if _GLOBAL in provider.series:
            self.sun = np.nan_to_num(provider.series[_GLOBAL])[:, None]
        elif provider.measured(IRRADIANCE):
            self.sun = np.nan_to_num(provider.sun.horizontal)[:, None]
        else:
            self.sun = np.empty((len(inputs), 0))
            self.remarks.append("without irradiance, which is not measured")
        if case.building.commanded:
            sizes = {n: anatomy.rooms[n].floor_area for n in names}
            for zone, heat in nominal_heat(case.building.commanded, provider.commanded, sizes).items():
                self.heat[:, names.index(zone)] += heat
            self.remarks.append("with heat that no meter tells as their valves, dampers and counters are usually sized")
        self.areas = np.array([anatomy.rooms[n].floor_area for n, s in zip(names, seen, strict=True) if s])
        self.pairs = self._pairs([n for n, s in zip(names, seen, strict=True) if s], anatomy)

    @staticmethod
    def _pairs(names: Sequence[str], anatomy: Anatomy) -> IntArray:
        """Zones taken for neighbours: all of few, else those with a common partition or slab."""
        number = {name: i for i, name in enumerate(names)}
        if len(names) <= _ALL_COUPLED:
            pairs = [(i, j) for i in range(len(names)) for j in range(i)]
        else:
            touching = {tuple(sorted(pair)) for pair in (*anatomy.partitions, *anatomy.stacked)}
            pairs = sorted((number[a], number[b]) for a, b in touching if a in number and b in number)
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def _runs(self, tuned: Sequence[Interval], spin_up: float, least: float, every: float = 3600.0) -> list[Runs]:
        """Choose runs of the tuning intervals that start in them."""
        chosen = []
        for interval in tuned:
            try:
                found = select_runs(self.inputs, interval, self.steps, every=every, spin_up=spin_up, least=least)
            except NotEnoughDataError:
                continue
            inside = found.starts >= self.inputs.stamps.searchsorted(interval.start)
            if inside.any():
                chosen.append(Runs(found.begin, found.starts[inside], found.skipped))
        if not chosen:
            raise NotEnoughDataError("the tuning days hold no run of the horizon with all inputs")
        return chosen

    def regression(self, tuned: Sequence[Interval], judged: Sequence[Runs], spin_up: float) -> list[FloatArray]:
        """Ridge regression of the change over the horizon, a zone; predictions by interval [K]."""
        from statsmodels.regression.linear_model import OLS

        starts = np.concatenate([r.starts for r in self._runs(tuned, spin_up, 0.0)])
        inputs, steps, numbers = self.inputs, self.steps, np.flatnonzero(self.seen)
        day = (inputs.stamps[starts + steps] - pd.Timedelta(inputs.step, "s")).normalize().asi8
        days, index = np.unique(day, return_inverse=True)
        if days.size < 2:
            raise NotEnoughDataError("the strength of the ridge is chosen over days, and the runs are of one day")
        fold = index * min(_FOLDS, days.size) // days.size
        own, common = self._features(starts)
        further = [self._features(r.starts) for r in judged]
        changed = inputs.zone[starts + steps] - inputs.bridged[starts]
        predicted = [inputs.held[r.starts][:, self.seen].copy() for r in judged]
        for column, zone in enumerate(numbers):
            near = [column, *(int(b if a == column else a) for a, b in self.pairs if column in (a, b))]

            def regressors(parts: FloatArray, rest: FloatArray, near: list[int] = near) -> FloatArray:
                return np.hstack([parts[:, near].reshape(len(rest), -1), rest])

            known = np.isfinite(changed[:, zone])
            if np.unique(fold[known]).size < 2:
                continue
            X, y, part = regressors(own, common)[known], changed[known, zone], fold[known]
            centre, spread, middle = X.mean(axis=0), X.std(axis=0), y.mean()
            spread[spread < 1e-9 * np.maximum(1.0, np.abs(centre))] = np.inf
            X, y = (X - centre) / spread, y - middle
            scores = np.zeros(len(_RIDGES))
            for k in np.unique(part):
                there = part == k
                model = OLS(y[~there], X[~there])
                for i, ridge in enumerate(_RIDGES):
                    fitted = model.fit_regularized(alpha=ridge, L1_wt=0.0)
                    scores[i] += np.sum((X[there] @ fitted.params - y[there]) ** 2)
            best = OLS(y, X).fit_regularized(alpha=_RIDGES[int(np.argmin(scores))], L1_wt=0.0).params
            for values, (parts, rest) in zip(predicted, further, strict=True):
                values[:, column] += middle + (regressors(parts, rest) - centre) / spread @ best
        return predicted

    def _features(self, starts: IntArray) -> tuple[FloatArray, FloatArray]:
        """Collect what a regression sees of each zone, (n_run, n_zone, n), and of all together, (n_run, n)."""
        inputs = self.inputs
        edges = np.linspace(0, self.steps, min(_BLOCKS, self.steps) + 1).round().astype(int)

        def blocks(values: FloatArray) -> FloatArray:
            total = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0)])
            ends = [total[starts + 1 + e] for e in edges]
            return np.stack([(b - a) / n for a, b, n in zip(ends, ends[1:], np.diff(edges), strict=False)], axis=-1)

        heat = blocks(self.heat[:, self.seen])
        now = inputs.held[starts][:, self.seen]
        back = [np.maximum(0, starts - max(1, round(s / inputs.step))) for s in _LAGS]
        risen = [now - inputs.held[b][:, self.seen] for b in back]
        total = np.vstack([np.zeros(now.shape[1]), np.cumsum(self.heat[:, self.seen], axis=0)])
        before = np.maximum(0, starts - self.steps)
        past = (total[starts + 1] - total[before]) / np.maximum(1, starts + 1 - before)[:, None]
        own = np.concatenate([np.stack([now, *risen, past], axis=-1), heat], axis=-1)
        around = np.hstack([self.boundary, self.sun, self.heat[:, ~self.seen]])
        stamps = inputs.stamps[starts]
        angle = 2.0 * np.pi * np.asarray(stamps.hour + stamps.minute / 60.0) / 24.0
        common = [blocks(around).reshape(len(starts), -1), np.sin(angle)[:, None], np.cos(angle)[:, None]]
        return own, np.hstack(common)

    def network(self, tuned: Sequence[Interval], judged: Sequence[Runs], spin_up: float) -> list[FloatArray]:
        """Coupled 2R2C network; predictions by interval [K]."""
        if len(self.areas) > _MOST_ZONES:
            raise NotEnoughDataError(f"not fitted for more than {_MOST_ZONES} zones; there are {len(self.areas)}")
        inputs, seen = self.inputs, self.seen
        data = TwoNodeData(
            inputs.step, inputs.zone[:, seen], inputs.bridged[:, seen], inputs.held[:, seen], self.heat[:, seen],
            self.boundary, self.sun, self.areas, self.pairs,
        )  # fmt: skip
        least = min(spin_up, 43200.0)
        runs = self._runs(tuned, spin_up, least, self.steps * inputs.step)
        if sum(r.starts.size for r in runs) < _FEW_RUNS:
            runs = self._runs(tuned, spin_up, least)
        network: TwoNode = fit_two_node(data, runs, self.steps)
        return [network.predict(r, np.array([self.steps]))[:, 0] for r in judged]
