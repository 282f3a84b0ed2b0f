"""Comparison of models of one case: with some effects of the catalogue each, fitted to the same telemetry."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from calibration.diagnosis.refit.fit import Found, evidence_of, solve
from calibration.diagnosis.screen.seen import seen_at_first
from calibration.errors import NotEnoughDataError
from calibration.evaluation import intervals
from calibration.evaluation.intervals import Interval, horizon_steps
from calibration.evaluation.n_step import Evaluation, EvaluationSettings, evaluate_model
from calibration.evaluation.settings import CalibrationSettings, ModelSettings, calibration_settings
from calibration.fit.left_out import Known
from calibration.fit.problem import Problem
from calibration.fit.result import ParameterEstimate, describe_parameters
from calibration.fit.tuning_runs import tuning_runs
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.effects.catalogue import CATALOGUE, chosen, effect_of, is_effect
from thermal.inputs.normalisation import fit_normalisation
from thermal.inputs.provider import InputProvider, telemetry_inputs
from thermal.model.case_replay import Inputs, replay_inputs
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel
from thermal.network.build import Blueprint, Extension, blueprint
from thermal.network.network import ThermalNetwork
from thermal.network.topology import Anatomy

#: Effects in a model, each with its zones; none is the whole building.
Effects = Mapping[str, Sequence[str]]

#: Share of its plausible range that the strength of an effect has where a fit begins [-].
TYPICAL = 0.25

#: Evaluations of a fit: models are compared by what they explain, which the last digits of θ do not change.
EVALUATIONS = 18

#: Fewest held-out days that may take turns with those that tune.
_LEAST_DAYS = 3

#: Parameters on the linear scale that are no strength: they act on one.
_SHIFTS = ("internal_gain_delay",)


@dataclass(frozen=True)
class Built:
    """A model with some effects, and the telemetry that drives it.

    Parameters
    ----------
    network : ThermalNetwork
        Control volumes, faces and sources.
    grid : SymbolicModel
        On the grid.
    inputs : Inputs
        The telemetry.
    """

    network: ThermalNetwork
    grid: SymbolicModel
    inputs: Inputs

    def theta(self, known: Mapping[str, float], strength: float = 0.0) -> FloatArray:
        """θ with known values by name; strengths of other effects at a share of their range [parameter units].

        Parameters
        ----------
        known : mapping of str to float
            Values [parameter units]; a common one is that of every zone.
        strength : float
            Share of the upper end of the range [-].
        """
        parameters = self.network.parameters
        at = [p.start + strength * (p.upper - p.start) * is_strength(p.name, p.effect) for p in parameters]
        common = [start if p.effect else known.get(p.base, start) for p, start in zip(parameters, at, strict=True)]
        return np.array([known.get(p.name, start) for p, start in zip(parameters, common, strict=True)])


def is_strength(name: str, effect: str | None) -> bool:
    """Whether a parameter is the strength of an effect: absent at 0, and so at its start.

    Parameters
    ----------
    name : str
        Name of the parameter.
    effect : str or None
        Effect that it belongs to.
    """
    if effect is None:
        return False
    kinds = {p.name: p for p in effect_of(effect).parameters} if is_effect(effect) else {}
    kind = kinds.get(name.partition("@")[0])
    return kind is None or (kind.scale == "linear" and kind.start == 0.0 and kind.name not in _SHIFTS)


#: Share of its prior deviation from which a parameter's standard error says that the data tell nothing of it [-].
_UNTOLD = 0.999


@dataclass(frozen=True)
class Fit:
    """A model with some effects, fitted to the tuning intervals.

    Parameters
    ----------
    effects : mapping of str to tuple of str
        Effects with their zones.
    built : Built
        The model.
    problem : Problem
        What was fitted.
    model : ReducedModel
        Reduced, and accurate at the estimate.
    found : Found
        The estimate.
    evidence : float
        Logarithm of the marginal likelihood of the tuning errors, but for a constant [-]; see `evidence_of`.
    settings : ModelSettings
        How the model without effects is built and run.
    """

    effects: Mapping[str, tuple[str, ...]]
    built: Built
    problem: Problem
    model: ReducedModel
    found: Found
    evidence: float
    settings: ModelSettings

    @cached_property
    def theta(self) -> FloatArray:
        """Parameters, shape (n_parameter,) [parameter units]."""
        return self.problem.theta(self.found.point)

    @property
    def weighed(self) -> Problem:
        """The problem with the deviation of its errors, which the fit has found beside its parameters."""
        return replace(self.problem, deviation=float(np.sqrt(self.found.mean_square)))

    @property
    def known(self) -> Known:
        """What other fits begin from, and what days are left out of."""
        return Known(self.weighed, self.model, self.point)

    @property
    def point(self) -> FloatArray:
        """The estimate on the estimation scale, (n_free,) [-]."""
        return self.found.point

    @cached_property
    def by_zone(self) -> FloatArray:
        """Mean squared tuning error of each zone, shape (n_zone,) [K²]; 0 where nothing is measured."""
        errors = [self.problem.errors(self.model, self.theta, r, slopes=False)[0] for r in self.problem.runs]
        squared = np.concatenate([e.reshape(-1, e.shape[-1]) for e in errors]) ** 2
        known = np.isfinite(squared)
        return np.asarray(np.where(known, squared, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1))

    @property
    def change(self) -> float:
        """Root mean square of how far measured zone temperatures change over the horizon [K]."""
        zone, steps = self.built.inputs.zone, self.problem.steps
        return float(np.sqrt(np.nanmean((zone[steps:] - zone[:-steps]) ** 2)))

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the parameters on the estimation scale, shape (n_parameter, n_parameter) [-]."""
        return np.asarray(np.linalg.inv(self.found.jacobian.T @ self.found.jacobian))

    @cached_property
    def deviations(self) -> FloatArray:
        """Standard errors of the parameters on the estimation scale, shape (n_parameter,) [-]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def members(self, effect: str) -> dict[str, float]:
        """Zones, or pairs of zones, that have a strength of an effect, with the largest over its standard error [-].

        Parameters
        ----------
        effect : str
            One of `effects`.
        """
        beyond: dict[str, float] = {}
        for p, z, deviation in zip(self.problem.parameters, self.point, self.deviations, strict=True):
            if p.effect == effect and p.member and is_strength(p.name, effect):
                beyond[p.member] = max(beyond.get(p.member, 0.0), float(abs(z)) / deviation)
        return beyond

    @cached_property
    def told(self) -> frozenset[str]:
        """Names of the parameters of which the data tell anything: they are surer than before."""
        both = zip(self.problem.parameters, self.deviations.tolist(), strict=True)
        return frozenset(p.name for p, deviation in both if deviation < _UNTOLD * p.prior_deviation)

    @cached_property
    def values(self) -> dict[str, float]:
        """Parameters by name [parameter units]."""
        names = (p.name for p in self.built.network.parameters)
        return dict(zip(names, self.theta.tolist(), strict=True))

    def describe(self) -> tuple[ParameterEstimate, ...]:
        """Parameters with what is known of each."""
        known = dict(zip(self.problem.free, self.deviations.tolist(), strict=True))
        network = self.built.network
        return describe_parameters(network.parameters, self.theta, known, network.nominal)

    def evaluate(self, intervals: Sequence[Interval], horizon: str, trajectories: bool = False) -> Evaluation:
        """Predict hourly on some intervals.

        Parameters
        ----------
        intervals : sequence of Interval
            That hold the targets of the runs.
        horizon : str
            Such as ``6h``.
        trajectories : bool
            Keep every step.
        """
        s = self.settings
        runs = EvaluationSettings(horizon, trajectories, scheme=s.stepping, spin_up_seconds=s.spin_up_seconds)
        return evaluate_model(self.model, self.theta, self.built.inputs, intervals, runs)


@dataclass
class ModelComparison:
    """A case with intervals and settings, on which models are built and fitted.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    settings : ModelSettings
        Of the baseline.
    tune, hold_out : sequence of Interval
        As in `calibration.calibrate`.
    horizon : str
        Prediction horizon.
    weights : Problem, optional
        Whose errors count as many and whose groups spread as far; one error a day and zone by default.
    """

    case: Case
    settings: ModelSettings = field(default_factory=ModelSettings)
    tune: Sequence[Interval] = ()
    hold_out: Sequence[Interval] = ()
    horizon: str = "6h"
    weights: Problem | None = None

    def __post_init__(self) -> None:
        self.tuned, self.judged = intervals.default_intervals(self.case, self.tune, self.hold_out)

    def built_as(self, settings: ModelSettings) -> "ModelComparison":
        """Give the same case, days and inputs with a baseline that is built otherwise.

        Parameters
        ----------
        settings : ModelSettings
            Of that baseline.
        """
        other = replace(self, settings=settings, tune=self.tuned, hold_out=self.judged)
        other.drivers = copy(self.drivers)  # a search may see other windows open about it
        return other

    @property
    def calibration(self) -> CalibrationSettings:
        """Settings of a calibration of the baseline."""
        return calibration_settings(self.settings, {"horizon": self.horizon})

    def alternate(self, inputs: Inputs) -> bool:
        """Let tuning and held-out days take turns where no intervals were given; whether they do now.

        Parameters
        ----------
        inputs : Inputs
            The telemetry; days without a run are left out, and too few of them leave the intervals as they were.
        """
        if self.tune or self.hold_out:
            return False
        steps, spin_up = horizon_steps(self.horizon, inputs.step), self.settings.spin_up_seconds
        try:
            tuned, judged = intervals.alternating_intervals(self.case)
            tuning_runs(inputs, tuned, steps, spin_up)
            judged = [i for i in judged if intervals.select_runs(inputs, i, steps, spin_up=spin_up).starts.size]
        except NotEnoughDataError:
            return False
        if len(judged) < _LEAST_DAYS:
            return False
        self.tuned, self.judged = tuned, judged
        self.__dict__.pop("drivers", None)  # counted by the days that tune
        return True

    @cached_property
    def drivers(self) -> InputProvider:
        """Sun, sky, wind and schedules of the case, and when windows are seen to stand open, or heat to be on."""
        drivers = telemetry_inputs(self.case, fit_normalisation(self.case, ((i.start, i.end) for i in self.tuned)))
        seen_at_first(self.case, drivers, self.settings).give(drivers)
        return drivers

    @cached_property
    def blueprint(self) -> Blueprint:
        """The building without effects."""
        s = self.settings
        return blueprint(self.case.building, s.dx, s.reach, s.scopes, structure=s.structure)

    @cached_property
    def anatomy(self) -> Anatomy:
        """What the building's volumes and faces are part of."""
        return self.settings.network(self.case.building).anatomy

    def untestable(self) -> dict[str, str]:
        """Effects that the case cannot tell, with the reason."""
        reasons = {e.id: e.untestable(self.drivers, self.anatomy) for e in CATALOGUE.values()}
        return {name: reason for name, reason in reasons.items() if reason is not None}

    def build(self, effects: Effects, further: Sequence[Extension] = ()) -> Built:
        """Make a model with effects.

        Parameters
        ----------
        effects : mapping of str to sequence of str
            Effects with their zones.
        further : sequence of Extension
            What else to add.
        """
        network = self.blueprint.network((*chosen(effects), *further))
        return Built(network, SymbolicModel(network), replay_inputs(self.case, network, self.drivers))

    def problem(self, built: Built, theta: FloatArray) -> Problem:
        """Least squares over the tuning intervals, of every parameter.

        Parameters
        ----------
        built : Built
            The model.
        theta : ndarray, shape (n_parameter,)
            Where it begins [parameter units].
        """
        steps = horizon_steps(self.horizon, built.inputs.step)
        runs = tuning_runs(built.inputs, self.tuned, steps, self.settings.spin_up_seconds)
        free = tuple(range(len(theta)))
        problem = Problem(built.grid, built.inputs, runs, steps, free, theta, self.settings.stepping)
        if self.weights is None:
            return problem
        known = self.weights
        return replace(problem, effective=known.effective_size(), shrinkage=known.shrinkage, capped=known.capped)

    def fit(
        self,
        effects: Effects,
        starts: Sequence[Mapping[str, float]],
        built: Built | None = None,
        evaluations: int = EVALUATIONS,
        least: float = -np.inf,
    ) -> Fit:
        """Fit a model with effects from several starts; the one of most evidence is kept.

        Parameters
        ----------
        effects : mapping of str to sequence of str
            Effects with their zones.
        starts : sequence of mapping of str to float
            Values by name [parameter units]; what they do not name starts at its prior, strengths at a quarter of their
            range.
        built : Built, optional
            The model, where it is at hand.
        evaluations : int
            Most evaluations of errors with derivatives from a start.
        least : float
            Evidence below which a fit is of no use: one that cannot reach it is given up before its end [-].
        """
        built = built or self.build(effects)
        best: Fit | None = None
        for known in starts:
            theta = built.theta(known, TYPICAL)
            problem = self.problem(built, theta)
            model, found = solve(problem, built.grid, theta, evaluations, least=least)
            value = evidence_of(problem, found)
            if best is None or value > best.evidence:
                zones = {e: tuple(z) for e, z in effects.items()}
                best = Fit(zones, built, problem, model, found, value, self.settings)
        if best is None:
            raise ValueError("fit: expected at least one start")
        return best
