"""Power of the data before fitting: what they will tell of each parameter, from the inputs alone."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import ClassVar, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings, calibration_settings
from calibration.fit.problem import FIRST_DEVIATION, Problem, tuning_problem
from calibration.fit.starts import draw_starts
from calibration.identifiability.information import DETERMINED, Information, fisher_information, split_jacobian
from calibration.progress import Progress
from calibration.results import Axes, Plain, Result, draw_rows
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.errors import nearest
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model

#: Draws of the parameters beside their start, from the prior at half its spread as the starts of a calibration are.
DRAWS = 4

#: Measured temperatures are shifted by this much a zone to see which residuals are whose [K].
_MARK = 1000.0

Told = Literal["yes", "perhaps", "no"]


@dataclass(frozen=True)
class ParameterPower(Plain):
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
    """

    name: str
    ratio: float
    least: float
    most: float
    told: Told
    key: ClassVar[str] = "name"


@dataclass(frozen=True, repr=False)
class Power(Result):
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

    def to_frame(self) -> pd.DataFrame:
        """Share of the prior's deviation that will be left of each parameter [-]."""
        return pd.DataFrame([asdict(p) for p in self.parameters]).set_index("name")

    def _summary(self) -> str:
        told = sum(p.told == "yes" for p in self.parameters)
        return f"the data will tell {told} of {len(self.parameters)} parameters, {self.draws} draws beside the start"

    def _draw(self, axes: Axes) -> None:
        table = self.to_frame()[["ratio", "least", "most"]]
        draw_rows(axes, table, "share of the prior's deviation that will be left [-]")
        axes.axvline(DETERMINED, linestyle="--", color="grey")


def power_of_data(
    case: Case,
    tune: Sequence[Interval] = (),
    settings: ModelSettings | None = None,
    *,
    deviation: float | Mapping[str, float] = FIRST_DEVIATION,
    draws: int = DRAWS,
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
    settings : CalibrationSettings or ModelSettings, optional
        Model, what is fixed, horizon, and seed of the draws.
    deviation : float or mapping of str to float
        Standard deviation of the prediction error, for all zones or by zone, others at the default of 0.3 K; of a
        calibrated model, so more than a sensor's noise [K].
    draws : int
        Draws from the prior, at half its spread, beside the start.
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
    CalibrationError.unless(draws >= 0, "draws", "at least 0", draws)
    chosen = calibration_settings(settings)
    problem = tuning_problem(case, tune, chosen)
    spread = _deviations(problem.grid.network.zones, deviation)
    seen = np.flatnonzero(np.isfinite(problem.inputs.zone).any(axis=0))
    known = []
    for drawn in draw_starts(problem, draws + 1, chosen.seed):
        z = problem.point(problem.theta(drawn))  # within the bounds
        known.append(_information(problem, z, np.array(list(spread.values()))))
        if progress is not None:
            progress("power", len(known), draws + 1)
    ratios = np.array([[p.ratio for p in each.parameters] for each in known])
    parameters = tuple(_power(p.name, r) for p, r in zip(problem.parameters, ratios.T, strict=True))
    measured = {problem.grid.network.zones[i]: spread[problem.grid.network.zones[i]] for i in seen}
    return Power(parameters, known[0], measured, draws, chosen.seed)


def _deviations(zones: Sequence[str], deviation: float | Mapping[str, float]) -> dict[str, float]:
    """Deviation by zone, checked."""
    given = dict.fromkeys(zones, deviation) if isinstance(deviation, int | float) else dict(deviation)
    for zone, value in given.items():
        if zone not in zones:
            raise CalibrationError(f"deviation: no zone {zone!r} in the building; {nearest(zone, zones)}")
        if not 0.0 < value < np.inf:
            raise CalibrationError(f"deviation: expected a positive number of kelvin for {zone}, got {value!r}")
    return {zone: float(given.get(zone, FIRST_DEVIATION)) for zone in zones}


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


def _power(name: str, ratios: FloatArray) -> ParameterPower:
    """Judge one parameter by the ratios of its deviations at the start and at the draws."""
    told: Told = "yes" if (ratios < DETERMINED).all() else "perhaps" if (ratios < DETERMINED).any() else "no"
    return ParameterPower(name, float(ratios[0]), float(ratios.min()), float(ratios.max()), told)
