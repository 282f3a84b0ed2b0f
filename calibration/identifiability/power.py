"""Power of the data before fitting: what they will tell of each parameter, from the inputs alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval, default_intervals, horizon_steps, merge
from calibration.evaluation.n_step import Progress
from calibration.evaluation.settings import ModelSettings
from calibration.fit.problem import FIRST_DEVIATION, Loss, Problem
from calibration.fit.starts import tuning_runs
from calibration.identifiability.information import Information, fisher_information, split_jacobian
from calibration.identifiability.information_search import DETERMINED
from mpc.reports.identifiability import spoken
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.errors import nearest
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model
from thermal.model.replay import replay_inputs
from thermal.parameters import Parameter

#: Draws of the parameters beside their start, from the prior at half its spread as the starts of a calibration are.
DRAWS, DRAW_SPREAD = 4, 0.5

#: Measured temperatures are shifted by this much a zone to see which residuals are whose [K].
_MARK = 1000.0

Told = Literal["yes", "perhaps", "no"]


@dataclass(frozen=True)
class ParameterPower:
    """What data will tell of one parameter.

    Parameters
    ----------
    name : str
        As in the model.
    ratio : float
        Posterior over prior deviation with the parameters at their start [-].
    least, most : float
        The same over the start and all draws [-].
    told : {"yes", "perhaps", "no"}
        Whether the data halve the deviation wherever the parameters lie, for some of the draws, or for none.
    sentence : str
        That in words.
    """

    name: str
    ratio: float
    least: float
    most: float
    told: Told
    sentence: str


@dataclass(frozen=True)
class Power:
    """What data will tell, before anything is fitted.

    Parameters
    ----------
    parameters : tuple of ParameterPower
        One an estimated parameter, in order.
    information : Information
        All that is known of the start, also which combinations will be determined.
    deviation : mapping of str to float
        Error that was assumed, by zone [K].
    draws, seed : int
        Draws beside the start, and their seed.
    """

    parameters: tuple[ParameterPower, ...]
    information: Information
    deviation: Mapping[str, float]
    draws: int
    seed: int

    @property
    def sentences(self) -> tuple[str, ...]:
        """One a parameter, then what the data determine at the start, combinations included."""
        return (*(p.sentence for p in self.parameters), *self.information.sentences)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        return {
            "parameters": {p.name: {k: v for k, v in asdict(p).items() if k != "name"} for p in self.parameters},
            "information": self.information.to_dict(),
            "deviation": dict(self.deviation),
            "draws": self.draws,
            "seed": self.seed,
            "sentences": list(self.sentences),
        }


def power_of_data(
    case: Case,
    tune: Sequence[Interval] = (),
    settings: ModelSettings | None = None,
    *,
    fixed: Mapping[str, float] | None = None,
    horizon: str = "6h",
    deviation: float | Mapping[str, float] = FIRST_DEVIATION,
    draws: int = DRAWS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Power:
    """Tell what data will say of each parameter before fitting them.

    The derivatives of the predictions follow from weather, heat and the states that runs start from. Measured
    temperatures enter by these starts only, and the errors not at all, so the answer is the same for any building
    behind the data. What it takes instead is the size of the error that a calibrated model will make; each zone counts
    as one observation of it a day, which is the most that a calibration takes it for.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune : sequence of Interval
        First two thirds of the telemetry by default.
    settings : ModelSettings, optional
        How the model is built and run.
    fixed : mapping of str to float, optional
        Parameters that keep a given value [parameter units].
    horizon : str
        Prediction horizon, such as ``6h``.
    deviation : float or mapping of str to float
        Standard deviation of the prediction error, for all zones or by zone, others at the default of 0.3 K; of a
        calibrated model, so more than a sensor's noise [K].
    draws : int
        Draws from the prior, at half its spread, beside the start.
    seed : int
        Seed of the draws.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    CalibrationError
        When a deviation is not positive, a zone unknown, or an interval has no usable run.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> power = power_of_data(load_bundled_case(), settings=ModelSettings(dx=1.5), draws=0)
    >>> {p.name: p.told for p in power.parameters}["shuffle_probability"]
    'no'
    """
    if draws < 0:
        raise CalibrationError(f"draws: expected at least 0, came {draws}")
    problem = tuning_problem(case, tune, settings, fixed=fixed, horizon=horizon)
    spread = _deviations(problem.grid.network.zones, deviation)
    seen = np.flatnonzero(np.isfinite(problem.inputs.zone).any(axis=0))
    measured = [problem.grid.network.zones[i] for i in seen]
    points = _points(problem, draws, seed)
    known = []
    for done, z in enumerate(points, 1):
        known.append(_information(problem, z, np.array(list(spread.values()))))
        if progress is not None:
            progress("power", done, len(points))
    ratios = np.array([[p.ratio for p in each.parameters] for each in known])
    parameters = tuple(_power(p, r) for p, r in zip(problem.parameters, ratios.T, strict=True))
    return Power(parameters, known[0], {z: spread[z] for z in measured}, draws, seed)


def tuning_problem(
    case: Case,
    tune: Sequence[Interval] = (),
    settings: ModelSettings | None = None,
    *,
    fixed: Mapping[str, float] | None = None,
    horizon: str = "6h",
    loss: Loss = "linear",
) -> Problem:
    """Make the least-squares problem of a case's tuning intervals.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune : sequence of Interval
        First two thirds of the telemetry by default.
    settings : ModelSettings, optional
        How the model is built and run.
    fixed : mapping of str to float, optional
        Parameters that keep a given value [parameter units].
    horizon : str
        Prediction horizon, such as ``6h``.
    loss : {"linear", "pseudo_huber"}
        What an error costs.

    Returns
    -------
    Problem
        On the grid, at the start.

    Raises
    ------
    CalibrationError
        When an interval has no usable run.
    """
    chosen = settings or ModelSettings()
    network = chosen.network(case.building)
    inputs = replay_inputs(case, network)
    steps = horizon_steps(horizon, inputs.step)
    intervals = merge(tune) or default_intervals(case)[0]
    runs = tuning_runs(inputs, intervals, steps, chosen.spin_up_seconds)
    free = tuple(i for i, p in enumerate(network.parameters) if p.name not in (fixed or {}))
    start = network.values(fixed or {})
    return Problem(SymbolicModel(network), inputs, runs, steps, free, start, chosen.stepping, loss=loss)


def _deviations(zones: Sequence[str], deviation: float | Mapping[str, float]) -> dict[str, float]:
    """Deviation by zone, checked."""
    given = dict.fromkeys(zones, deviation) if isinstance(deviation, int | float) else dict(deviation)
    for zone, value in given.items():
        if zone not in zones:
            raise CalibrationError(f"deviation: no zone {zone!r} in the building; {nearest(zone, zones)}")
        if not 0.0 < value < np.inf:
            raise CalibrationError(f"deviation: expected a positive number of kelvin for {zone}, came {value!r}")
    return {zone: float(given.get(zone, FIRST_DEVIATION)) for zone in zones}


def _points(problem: Problem, draws: int, seed: int) -> list[FloatArray]:
    """Start and draws on the estimation scale, within the bounds."""
    spread = np.array([p.prior_deviation for p in problem.parameters])
    centre = np.array([p.transform(p.start) for p in problem.parameters])
    rng = np.random.default_rng(seed)
    further = [centre + DRAW_SPREAD * spread * rng.standard_normal(spread.size) for _ in range(draws)]
    return [problem.point(problem.theta(z)) for z in (problem.point(problem.start), *further)]


def _information(problem: Problem, z: FloatArray, deviation: FloatArray) -> Information:
    """Information of the data at a point, each zone with its own deviation."""
    model = reduced_model(problem.grid, [problem.theta(z)])
    data, prior = split_jacobian(replace(problem, deviation=1.0), model, z)
    data = data / deviation[_zones_of_rows(problem, model, z), None]
    return fisher_information(problem.parameters, data, prior.T @ prior, nominal=problem.grid.network.nominal)


def _zones_of_rows(problem: Problem, model: SymbolicModel, z: FloatArray) -> NDArray[np.int64]:
    """Zone of each residual: told by the errors' answer to temperatures shifted by a mark for each zone."""
    inputs, theta = problem.inputs, problem.theta(z)
    marks = _MARK * np.arange(inputs.zone.shape[1])
    marked = replace(problem, inputs=replace(inputs, zone=inputs.zone - marks))
    moved = marked.residuals_only(model, theta) - problem.residuals_only(model, theta)
    return np.rint(moved / _MARK).astype(np.int64)


def _power(parameter: Parameter, ratios: FloatArray) -> ParameterPower:
    """Judge one parameter by the ratios of its deviations at the start and at the draws."""
    told: Told = "yes" if (ratios < DETERMINED).all() else "perhaps" if (ratios < DETERMINED).any() else "no"
    first, least, most = (f"{100 * r:.0f} %" for r in (ratios[0], ratios.min(), ratios.max()))
    span = f" ({least} to {most} over the prior)" if ratios.size > 1 and least != most else ""
    left = f"{first} of the prior's deviation will be left{span}"
    verb = {"yes": "will tell", "perhaps": "may tell", "no": "will not tell"}[told]
    sentence = f"These data {verb} the {spoken(parameter)}: {left}."
    return ParameterPower(parameter.name, float(ratios[0]), float(ratios.min()), float(ratios.max()), told, sentence)
