"""What a calibration found: parameters with what is known of them, errors before and after, solver status."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from scipy import stats

from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.case_model import GridCheck
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation
from calibration.evaluation.settings import ModelSettings, Objective
from calibration.fit.estimate import Estimate
from calibration.fit.told import Told
from calibration.identifiability.information import DETERMINED, Information
from calibration.results import Axes, Plain, Result, draw_rows, plain
from thermal._types import FloatArray
from thermal.case.estimated import estimate_entry
from thermal.effects.catalogue import effect_of
from thermal.parameters import Parameter

#: A bound counts as hit within this share of the range, on the estimation scale [-].
BOUND_SHARE = 0.01

#: Factor beyond which a lumped model is said to disagree with the drawing [-]: half as much again.
_FAR = 1.5

#: Multipliers that would be 1 if the drawing were right; more than its air follows a zone's air within minutes.
DRAWN_SUMS = (
    "mass_capacity_multiplier", "mass_coupling_multiplier", "air_boundary_multiplier", "mass_boundary_multiplier",
    "zone_coupling_multiplier",
)  # fmt: skip

#: Tails of a 90 % interval [-].
_TAILS = (0.05, 0.95)


@dataclass(frozen=True)
class ParameterEstimate(Plain):
    """One parameter after calibration.

    Parameters
    ----------
    name, unit : str
        As in the model.
    value : float
        Estimate [parameter units].
    lower, upper, start : float
        Physical range and start [parameter units].
    at_bound : bool
        Whether the estimate lies within 1 % of the range (on the estimation scale) of a bound.
    standard_error : float or None
        Posterior standard error [parameter units]; None for what was not estimated.
    identifiable : bool
        Whether the data halve the prior's spread, not only because priors hold the others, and no bound is hit.
    source : str
        Where the range comes from, or why the value was not estimated.
    interval90 : tuple of float or None
        Ends of the 90 % interval within the physical range [parameter units].
    """

    name: str
    unit: str
    value: float
    lower: float | None
    upper: float | None
    start: float
    at_bound: bool
    standard_error: float | None
    identifiable: bool
    source: str
    interval90: tuple[float, float] | None = None
    key: ClassVar[str] = "name"

    @property
    def base(self) -> str:
        """Name that the members of one group share."""
        return self.name.partition("@")[0]


@dataclass(frozen=True)
class Rung(Plain):
    """A structure that a calibration chose from.

    Parameters
    ----------
    name : str
        ``drawn``; ``named`` with what a diagnosis found or knows; ``radiator`` or ``floor`` with heat that radiates or
        that floors give, where the case does not say what gives it; ``wind`` with films that follow the wind; ``zoned``
        with slabs, furniture and losses by zone; ``people`` with people who have hours of their own in each zone, and
        ``people beside`` with them and what was found; ``lumped``; ``recurring``, ``lumped floor`` and ``shifted``,
        which are lumped with a gain that recurs from day to day, with floors that are heated, or with heat and weather
        moved in time. Those as drawn have the heat of ``radiator`` or ``floor`` too where that was kept. ``lumped`` has
        it in the air, but for what settings or case say; ``recurring`` and ``shifted`` have what the lumped one has
        that they stand on. ``found`` is a free structure with what was found in the place of what it has itself.
    left_out_mae : float
        Mean absolute error on tuning days that a fit has not seen [K]; NaN where there are too few days.
    parameters : int
        How many were estimated [-].
    chosen : bool
        Whether the result is that of this one.
    """

    name: str
    left_out_mae: float
    parameters: int
    chosen: bool


@dataclass(frozen=True)
class SolverReport(Plain):
    """How the solve went.

    Parameters
    ----------
    name, status : str
        Solver and its return status.
    success : bool
        Whether it converged.
    iterations : int
        Iterations of the best start, over all its rounds.
    seconds : float
        Wall time of the calibration [s].
    starts : int
        Number of starts.
    failures : tuple of str
        What went wrong in starts that failed.
    evaluations : int
        Evaluations of the errors with their derivatives, of the best start.
    settled : bool
        Whether its rounds of weighing and reducing ended because nothing moved any more.
    """

    name: str
    status: str
    success: bool
    iterations: int
    seconds: float
    starts: int
    failures: tuple[str, ...] = ()
    evaluations: int = 0
    settled: bool = True


@dataclass(frozen=True, repr=False)
class CalibrationResult(Result):
    """Outcome of `calibration.calibrate`.

    Parameters
    ----------
    case : str
        Name of the case.
    zones : tuple of str
        Zone names.
    parameters : tuple of ParameterEstimate
        Every parameter, estimated or nominal.
    theta : ndarray, shape (n_parameter,)
        θ of the network [parameter units].
    tuning, held_out : tuple of Interval
        Where it was fitted and where it is judged.
    uncalibrated, calibrated : mapping of str to Evaluation
        Errors at the start and at the estimate; keys ``tuning`` and ``held_out``.
    solver : SolverReport
        Status of the solve.
    grid_check : GridCheck
        Certificate of the reduced model that the numbers were made with.
    disturbance : DisturbanceModel or None
        Unmeasured heat and sensor noise that the standard errors follow.
    band_factors : mapping of str to float
        What the deviations of predictions are multiplied by for 90 % bands, by zone [-]; see `Forecaster.factors`.
    excess : float
        Mean square of the tuning errors, or of what a day's innovations pull at, over that which the disturbance makes
        [-]; far above 1, physics is missing.
    information : Information
        What the data determine.
    horizon : str
        Prediction horizon.
    settings : ModelSettings
        How the model was built and run.
    seed : int
        Seed of the starts.
    version : str
        Of the library.
    objective : {"multi_step", "innovations"}
        What was minimised.
    rungs : tuple of Rung
        Structures that days left out chose from; empty where there was no choice.
    told : Told or None
        What the data alone say of the parameters, which a fleet learns its population from.
    """

    case: str
    zones: tuple[str, ...]
    parameters: tuple[ParameterEstimate, ...]
    theta: FloatArray
    tuning: tuple[Interval, ...]
    held_out: tuple[Interval, ...]
    uncalibrated: Mapping[str, Evaluation]
    calibrated: Mapping[str, Evaluation]
    solver: SolverReport
    grid_check: GridCheck
    disturbance: DisturbanceModel | None
    band_factors: Mapping[str, float]
    excess: float
    information: Information
    horizon: str
    settings: ModelSettings
    seed: int
    version: str = field(default="")
    objective: Objective = "multi_step"
    rungs: tuple[Rung, ...] = ()
    told: Told | None = None

    def effects(self) -> list[dict[str, Any]]:
        """Effects in the model with their zones and parameters, an entry of ``calibration.json`` each."""
        return effect_entries(self.settings.effects, self.parameters)

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``calibration.json``."""
        content: dict[str, Any] = {
            "parameters": self.parameters,
            "uncalibrated": {name: e.metrics.to_dict() | e.beside for name, e in self.uncalibrated.items()},
            "calibrated": {name: e.metrics.to_dict() | e.beside for name, e in self.calibrated.items()},
            "effects": self.effects(),
        }
        names = ("solver", "grid_check", "disturbance", "band_factors", "excess", "information")
        intervals = {"tuning": self.tuning, "held_out": self.held_out}
        about = ("objective", "horizon", "settings", "case", "version", "seed")
        content |= {k: getattr(self, k) for k in names} | {"intervals": intervals}
        content |= {"rungs": self.rungs, "against_drawing": self.against_drawing()}
        content |= estimate_entry(self.calibrated["held_out"].estimated)
        found: dict[str, Any] = plain(content | {k: getattr(self, k) for k in about})
        return found

    def against_drawing(self) -> list[dict[str, Any]]:
        """Conductances and capacities that a lumped model finds to be far from the drawing's, the farthest first.

        Those whose 90 % interval of the factor [-] lies beyond a factor of 1.5 to either side.
        """
        far = [
            {"what": p.name, "factor": p.value, "interval90": p.interval90}
            for p in self.parameters
            if self.settings.structure.lumped
            and p.base in DRAWN_SUMS
            and p.interval90 is not None
            and not p.interval90[0] / _FAR < 1.0 < p.interval90[1] * _FAR
        ]
        return sorted(far, key=lambda entry: -abs(np.log(entry["factor"])))

    def to_frame(self) -> pd.DataFrame:
        """Parameters with their ranges, standard errors and 90 % intervals [parameter units]."""
        rows = {p.name: p.to_dict() for p in self.parameters}
        table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")
        ends = [p.interval90 or (np.nan, np.nan) for p in self.parameters]
        return table.drop(columns="interval90").assign(low90=[e[0] for e in ends], high90=[e[1] for e in ends])

    def _summary(self) -> str:
        before, after = (e["held_out"].metrics.mae for e in (self.uncalibrated, self.calibrated))
        return f"{self.case}, held-out MAE {after:.3f} K ({before:.3f} K before), {self.solver.status}"

    def _draw(self, axes: Axes) -> None:
        table = self.to_frame().dropna(subset="standard_error")
        width = table["upper"] - table["lower"]
        shares = table[["value", "low90", "high90"]].astype(float).sub(table["lower"], axis=0).div(width, axis=0)
        draw_rows(axes, shares, "share of the physical range [-], with 90 % intervals")
        axes.set_xlim(-0.02, 1.02)


def effect_entries(
    effects: Mapping[str, Sequence[str]], parameters: Sequence[ParameterEstimate]
) -> list[dict[str, Any]]:
    """Effects of a model with their zones and parameters, an entry of ``calibration.json`` each.

    Parameters
    ----------
    effects : mapping of str to sequence of str
        Ids, each with its zones.
    parameters : sequence of ParameterEstimate
        Of the model.
    """
    entries = []
    for name, zones in effects.items():
        own = {p.name for p in effect_of(name).parameters}
        values = {p.name: {"value": p.value, "unit": p.unit} for p in parameters if p.name.partition("@")[0] in own}
        entries.append({"effect": name, "zones": list(zones), "parameters": values})
    return entries


def describe(
    found: Estimate, information: Information, nominal: Mapping[str, tuple[float, str]]
) -> tuple[ParameterEstimate, ...]:
    """Parameters with standard errors, intervals, bounds and what the data determine.

    Parameters
    ----------
    found : Estimate
        From `estimate`.
    information : Information
        Of this estimate: a parameter that is known only because priors hold the others is not determined by the data.
    nominal : mapping of str to (float, str)
        Values that were never estimated, with their units [that unit].
    """
    deviations = dict(zip(found.problem.free, np.sqrt(np.diag(found.covariance)), strict=True))
    described = describe_parameters(found.problem.grid.network.parameters, found.theta, deviations, nominal)
    told = {p.name for p in information.parameters if p.status == "determined"}
    return tuple(replace(p, identifiable=p.identifiable and p.name in told) for p in described)


def describe_parameters(
    parameters: Sequence[Parameter],
    theta: FloatArray,
    deviations: Mapping[int, float],
    nominal: Mapping[str, tuple[float, str]],
) -> tuple[ParameterEstimate, ...]:
    """Parameters of a network with what is known of each.

    Parameters
    ----------
    parameters : sequence of Parameter
        Of the network.
    theta : ndarray, shape (n_parameter,)
        Their values [parameter units].
    deviations : mapping of int to float
        Standard errors on the estimation scale [-], by position; the others were fixed.
    nominal : mapping of str to (float, str)
        Values that were never estimated, with their units [that unit].
    """
    described = [_estimated(p, float(theta[i]), deviations.get(i)) for i, p in enumerate(parameters)]
    for name, (value, unit) in nominal.items():
        source = "nominal: enters only as a product with the heat capacity"
        described.append(ParameterEstimate(name, unit, value, None, None, value, False, None, False, source))
    return tuple(described)


def _estimated(p: Parameter, value: float, deviation: float | None) -> ParameterEstimate:
    if deviation is None:
        source = "fixed by the user"
        return ParameterEstimate(p.name, p.unit, value, p.lower, p.upper, p.start, False, None, False, source)
    low, high, z = p.transform(p.lower), p.transform(p.upper), p.transform(value)
    at_bound = bool(min(z - low, high - z) < BOUND_SHARE * (high - low))
    # a normal on the estimation scale, cut at the physical range: the truth does not leave it either
    ends = stats.truncnorm((low - z) / deviation, (high - z) / deviation, loc=z, scale=deviation).ppf(_TAILS)
    deviation = min(deviation, p.prior_deviation)  # the data never make a parameter less certain than its range does
    identifiable = bool(deviation < DETERMINED * p.prior_deviation and not at_bound)
    first, last = (float(np.clip(p.inverse(float(end)), p.lower, p.upper)) for end in ends)
    error = float(deviation * p.slope(value))
    return ParameterEstimate(
        p.name, p.unit, value, p.lower, p.upper, p.start, at_bound, error, identifiable, p.source, (first, last)
    )
