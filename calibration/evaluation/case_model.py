"""A case with its model and parameters, ready to run: what calibration, evaluation and replay have in common."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from calibration.errors import CalibrationError, FilterError, NotEnoughDataError
from calibration.estimation.bands import Forecaster
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.intervals import Interval, Runs, horizon_steps, merge, select_runs
from calibration.evaluation.n_step import HORIZONS, Evaluation, EvaluationSettings, evaluate_model
from calibration.evaluation.settings import ModelSettings, load_parameters, read_settings
from calibration.evaluation.simple_models import rest_of, with_yardsticks
from calibration.progress import Progress
from calibration.results import Plain
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.model.case_replay import Inputs, free_runs, replay_inputs, spin_up
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model

#: Runs of the check of a reduced model on the grid, and the interval of telemetry they are spread over [days].
CHECK_RUNS, CHECK_DAYS = 6, 2.0

#: Largest difference between reduced model and grid that reported errors may carry [K]; else they come from the grid.
CHECK_TOLERANCE = 0.01


@dataclass(frozen=True)
class GridCheck(Plain):
    """The calibrated reduced model replayed beside the grid.

    Parameters
    ----------
    volumes, order : int
        Control volumes of the grid and states of the reduced model.
    runs : int
        Runs compared.
    max_difference, mean_difference : float
        Of zone means over all steps of these runs [K].
    """

    volumes: int
    order: int
    runs: int
    max_difference: float
    mean_difference: float


@dataclass(frozen=True)
class CaseModel:
    """A case, its model on the grid, and one θ.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    settings : ModelSettings
        How the model is built and run.
    grid : SymbolicModel
        On the grid.
    inputs : Inputs
        The telemetry as inputs of a replay.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    source : str
        Where they come from, in a few words.
    disturbance : DisturbanceModel or None
        Unmeasured heat and sensors that belong to them.
    band_factors : mapping of str to float
        Of the bands of predictions, by zone [-]; see `Forecaster.factors`.
    """

    case: Case
    settings: ModelSettings
    grid: SymbolicModel
    inputs: Inputs
    theta: FloatArray
    source: str
    disturbance: DisturbanceModel | None = None
    band_factors: Mapping[str, float] = field(default_factory=dict)

    def certified(
        self, interval: Interval, steps: int, reduced: ReducedModel | None = None
    ) -> tuple[SymbolicModel, GridCheck]:
        """Reduce the model where that is accurate enough, and return the grid where it is not.

        A few runs are replayed on both and their zone means compared.

        Parameters
        ----------
        interval : Interval
            The runs are spread over its first two days, or all of it where these have none.
        steps : int
            N of the runs that are compared.
        reduced : ReducedModel, optional
            That is accurate at θ; made here by default.

        Raises
        ------
        NotEnoughDataError
            When the interval has no usable run.
        """
        reduced, inputs = reduced or reduced_model(self.grid, [self.theta]), self.inputs
        runs = _check_runs(inputs, interval, steps, self.settings.spin_up_seconds)
        starts = np.unique(runs.starts[np.linspace(0, runs.starts.size - 1, CHECK_RUNS).astype(int)])
        means = []
        for model in (self.grid, reduced):
            matrices = model.matrices(self.theta)
            states, _ = spin_up(matrices, inputs, runs.begin, starts)
            scheme = self.settings.stepping
            means.append(free_runs(matrices, inputs, starts, steps, states, scheme=scheme)[0])
        off = np.abs(means[0] - means[1])
        order = reduced.projection.shape[1] if reduced.projection is not None else reduced.network.n_node
        check = GridCheck(self.grid.network.n_node, order, starts.size, float(off.max()), float(off.mean()))
        return (reduced if check.max_difference <= CHECK_TOLERANCE else self.grid), check

    def evaluate(
        self,
        model: SymbolicModel,
        intervals: Sequence[Interval],
        settings: EvaluationSettings,
        progress: Progress | None = None,
    ) -> Evaluation:
        """N-step prediction error of one of its models, stepped and spun up as its settings say.

        Parameters
        ----------
        model : SymbolicModel
            On the grid or reduced.
        intervals : sequence of Interval
            Where the targets lie.
        settings : EvaluationSettings
            Horizons and what is kept.
        progress : callable, optional
            Called with stage, done, total.
        """
        own = replace(settings, scheme=self.settings.stepping, spin_up_seconds=self.settings.spin_up_seconds)
        found = evaluate_model(model, self.theta, self.inputs, intervals, own, progress)
        carried = None
        if self.disturbance is not None and isinstance(model, ReducedModel):
            forecaster = Forecaster(model, self.inputs, self.disturbance, own)
            carried = forecaster.judge(self.theta, intervals, self.band_factors)
        return replace(found, carried=carried, estimated=self.case.estimated)


def case_model(
    case: Case, parameters: str | Path | None = None, *, dx: float | None = None, scheme: str | None = None
) -> CaseModel:
    """Make a case's model with the parameters of a file, or those before calibration.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    parameters : str or Path, optional
        A ``calibration.json``; its settings are taken over where the arguments say nothing.
    dx : float, optional
        Distance between control volumes of a plan [m].
    scheme : str, optional
        ``implicit_euler`` or ``tr_bdf2``.

    Raises
    ------
    CalibrationError
        When the file cannot be read, or is of another building.
    """
    settings = read_settings(parameters) if parameters is not None else {}
    settings |= {k: v for k, v in (("dx", dx), ("scheme", scheme)) if v is not None}
    chosen = ModelSettings(**settings)
    network = chosen.network(case.building)
    theta = load_parameters(parameters, network) if parameters is not None else network.start()
    source = Path(parameters).name if parameters is not None else "uncalibrated start values"
    disturbance, factors = (None, {}) if parameters is None else read_disturbance(parameters, network.zones)
    inputs = replay_inputs(case, network)
    return CaseModel(case, chosen, SymbolicModel(network), inputs, theta, source, disturbance, factors)


def read_disturbance(path: str | Path, zones: Sequence[str]) -> tuple[DisturbanceModel | None, dict[str, float]]:
    """Read unmeasured heat, sensors and factors of bands from a ``calibration.json``, as far as it has them.

    Parameters
    ----------
    path : str or Path
        The file, which `load_parameters` could read.
    zones : sequence of str
        Of the building.

    Raises
    ------
    CalibrationError
        When they are not as `calibrate` writes them.
    """
    content = json.loads(Path(path).read_text(encoding="utf-8"))
    entry = content.get("disturbance")
    if entry is None:
        return None, {}
    factors = content.get("band_factors") or {}
    usable = isinstance(factors, dict) and set(factors) <= set(zones)
    if not usable or not all(isinstance(v, int | float) and 0.0 < v < float("inf") for v in factors.values()):
        raise CalibrationError(f"{path}: band_factors: expected a positive number by zone, found {factors}")
    try:
        found = DisturbanceModel(**entry)
    except (FilterError, TypeError, ValueError, AttributeError) as error:
        raise CalibrationError(
            f"{path}: disturbance: expected what `calibrate` writes, found {entry} ({error})"
        ) from error
    sizes = {np.size(found.deviation), np.size(found.sensor_deviation)}
    expected = f"one number, or one for each of {len(zones)} zones"
    CalibrationError.unless(sizes <= {1, len(zones)}, f"{path}: disturbance", expected, entry)
    return found, factors


def read_tuning(path: str | Path) -> list[Interval]:
    """Read what a ``calibration.json`` was tuned on, so that simple models see no more; nothing where it has none.

    Parameters
    ----------
    path : str or Path
        The file, which `load_parameters` could read.

    Raises
    ------
    CalibrationError
        When its intervals are not as `calibrate` writes them.
    """
    content = json.loads(Path(path).read_text(encoding="utf-8"))
    entries = (content.get("intervals") or {}).get("tuning") or []
    try:
        ends = [[pd.Timestamp(entry[key]).tz_convert("UTC") for key in ("start", "end")] for entry in entries]
        return [Interval(*pair) for pair in ends]
    except (TypeError, KeyError, ValueError, CalibrationError) as error:
        raise CalibrationError(f"{path}: intervals.tuning", "what `calibrate` writes", f"{entries}") from error


def evaluate_case(
    case: Case,
    intervals: Sequence[Interval] = (),
    *,
    parameters: str | Path | None = None,
    horizon: str = "6h",
    dx: float | None = None,
    scheme: str | None = None,
    trajectories: bool = False,
    progress: Progress | None = None,
) -> Evaluation:
    """N-step prediction error of a case's model, calibrated or not.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    intervals : sequence of Interval
        Where the targets lie; all the telemetry by default.
    parameters : str or Path, optional
        A ``calibration.json`` of this case; start values by default.
    horizon : str
        Prediction horizon, such as ``6h``.
    dx : float, optional
        Distance between control volumes of a plan [m].
    scheme : str, optional
        ``implicit_euler`` or ``tr_bdf2``.
    trajectories : bool
        Keep every step of the runs instead of the last only.
    progress : callable, optional
        Called with stage, done, total.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> evaluate_case(load_bundled_case(), dx=1.0).metrics.mae < 1.0
    True
    """
    ready = case_model(case, parameters, dx=dx, scheme=scheme)
    parts = merge(intervals) or [Interval(ready.inputs.stamps[0], ready.inputs.stamps[-1])]
    model, _ = ready.certified(parts[0], horizon_steps(horizon, ready.inputs.step))
    found = ready.evaluate(model, parts, EvaluationSettings(horizon, trajectories, HORIZONS), progress)
    tuned = [] if parameters is None else read_tuning(parameters)
    rest, spin_up = tuned or rest_of(ready.inputs.stamps, parts), ready.settings.spin_up_seconds
    return with_yardsticks(found, case, ready.inputs, ready.grid.network.anatomy, rest, spin_up)


def _check_runs(inputs: Inputs, interval: Interval, steps: int, spin_up_seconds: float) -> Runs:
    """Choose the runs of a check: at the beginning of the interval where there are any."""
    begin = max(interval.start, inputs.stamps[0])
    length = pd.Timedelta(days=CHECK_DAYS) + steps * pd.Timedelta(seconds=inputs.step)
    for part in (Interval(begin, min(interval.end, begin + length)), interval):
        try:
            runs = select_runs(inputs, part, steps, spin_up=spin_up_seconds)
        except NotEnoughDataError:
            if part is interval:
                raise
            continue
        if runs.starts.size:
            return runs
    raise NotEnoughDataError(f"interval {interval.start} to {interval.end}: every run misses telemetry")
