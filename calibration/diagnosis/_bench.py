"""One case on the bench: models with some effects of the catalogue, fitted and compared on the same telemetry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from calibration._estimate import Estimate, estimate
from calibration._evaluate import Predictions, evaluate_model
from calibration._intervals import Interval, default_intervals, horizon_steps
from calibration._problem import Problem
from calibration._settings import ModelSettings
from calibration._starts import tuning_runs
from thermal import Case, Inputs, SymbolicModel, ThermalNetwork, build_network, reduced_model, replay_inputs
from thermal.effects import CATALOGUE, chosen
from thermal.network import Anatomy, Extension
from thermal.signals import Drivers

FloatArray = NDArray[np.float64]

#: Effects in a model, each with its zones; none is the whole building.
Effects = Mapping[str, Sequence[str]]

#: Share of its plausible range that the strength of an effect has where a basis is made and a fit begins [-].
TYPICAL = 0.25


#: Rounds of a fit: models are compared by what they explain, which the last digits of θ do not change.
_ROUNDS = 2


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
            Values [parameter units].
        strength : float
            Share of the upper end of the range [-].
        """
        parameters = self.network.parameters
        at = [p.start + strength * (p.upper - p.start) * is_strength(p.name, p.effect) for p in parameters]
        return np.array([known.get(p.name, start) for p, start in zip(parameters, at, strict=True)])


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
    kinds = {p.name: p for p in CATALOGUE[effect].parameters} if effect in CATALOGUE else {}
    kind = kinds.get(name.partition("@")[0])
    return kind is None or (kind.scale == "linear" and kind.start == 0.0 and kind.name not in SHIFTS)


#: Parameters on the linear scale that are no strength: they act on one.
SHIFTS = ("internal_gain_delay",)


@dataclass(frozen=True)
class Fit:
    """A model with some effects, fitted to the tuning intervals.

    Parameters
    ----------
    effects : mapping of str to tuple of str
        Effects with their zones.
    built : Built
        The model.
    estimate : Estimate
        Of its parameters.
    evidence : float
        Logarithm of the marginal likelihood of the tuning errors, but for a constant [-]; see `evidence_of`.
    """

    effects: Mapping[str, tuple[str, ...]]
    built: Built
    estimate: Estimate
    evidence: float

    @cached_property
    def values(self) -> dict[str, float]:
        """Parameters by name [parameter units]."""
        names = (p.name for p in self.built.network.parameters)
        return dict(zip(names, self.estimate.theta.tolist(), strict=True))

    @property
    def mean_square(self) -> float:
        """Mean square of the tuning errors [K²]."""
        error = self.estimate.problem.residuals_only(self.estimate.model, self.estimate.theta)
        return float(np.mean(error**2))


@dataclass
class Bench:
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
    """

    case: Case
    settings: ModelSettings = field(default_factory=ModelSettings)
    tune: Sequence[Interval] = ()
    hold_out: Sequence[Interval] = ()
    horizon: str = "6h"

    def __post_init__(self) -> None:
        self.tuned, self.judged = default_intervals(self.case, self.tune, self.hold_out)

    @cached_property
    def drivers(self) -> Drivers:
        """Sun, sky, wind and schedules of the case."""
        return Drivers(self.case)

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
        s = self.settings
        network = build_network(
            self.case.building, s.dx, s.reach, s.scopes, structure=s.structure, effects=(*chosen(effects), *further)
        )
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
        return Problem(built.grid, built.inputs, runs, steps, free, theta, self.settings.stepping)

    def fit(self, effects: Effects, starts: Sequence[Mapping[str, float]], built: Built | None = None) -> Fit:
        """Fit a model with effects from several starts; the one of most evidence is kept.

        Parameters
        ----------
        effects : mapping of str to sequence of str
            Effects with their zones.
        starts : sequence of mapping of str to float
            Values by name; what they do not name starts at its prior, strengths at a quarter of their range.
        built : Built, optional
            The model, where it is at hand.
        """
        built = built or self.build(effects)
        best: Fit | None = None
        for known in starts:
            theta = built.theta(known, TYPICAL)
            problem = self.problem(built, theta)
            if best is not None:
                problem = replace(problem, deviation=best.estimate.problem.deviation)
            model = reduced_model(built.grid, [theta])
            found = estimate(problem, problem.point(theta), model=model, most_rounds=_ROUNDS)
            value = evidence_of(found)
            if best is None or value > best.evidence:
                best = Fit({e: tuple(z) for e, z in effects.items()}, built, found, value)
        if best is None:
            raise ValueError("fit: expected at least one start")
        return best

    def predictions(
        self, fit: Fit, intervals: Sequence[Interval] = (), trajectories: bool = False
    ) -> list[Predictions]:
        """Hourly N-step predictions of a fitted model, one entry an interval.

        Parameters
        ----------
        fit : Fit
            The model.
        intervals : sequence of Interval
            Where the targets lie; held out by default.
        trajectories : bool
            Keep every step.
        """
        e, s = fit.estimate, self.settings
        found = evaluate_model(
            e.model, e.theta, fit.built.inputs, intervals or self.judged, self.horizon,
            trajectories=trajectories, scheme=s.stepping, spin_up_seconds=s.spin_up_seconds,
        )  # fmt: skip
        return list(found.predictions)


def evidence_of(found: Estimate) -> float:
    """Logarithm of the marginal likelihood of an estimate's errors, but for a constant [-].

    Laplace's approximation about the estimate (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572): errors are
    normal with the deviation that they have and count as one a day and zone, priors are normal on the estimation scale
    and cut at the physical range, ``-n/2 log(mean e²) - ½ |Λ^½ (z - z_0)|² - ½ log |H| + ½ log |Λ|`` with
    ``H = J'J + Λ``, and the share of the posterior within the range over that of the prior for every strength.

    Parameters
    ----------
    found : Estimate
        Of one model.
    """
    problem, z = found.problem, found.point
    error = problem.residuals_only(found.model, found.theta)
    mean = float(np.mean(error**2))
    problem = replace(problem, deviation=float(np.sqrt(mean)))
    residual, jacobian = problem.weighted(found.model, z)
    prior, count = residual[-z.size :], problem.effective_size()
    hessian = jacobian.T @ jacobian
    whiten = jacobian[-z.size :]
    value = -0.5 * count * np.log(mean) - 0.5 * float(prior @ prior)
    value += np.linalg.slogdet(whiten)[1] - 0.5 * np.linalg.slogdet(hessian)[1]
    spread = np.sqrt(np.diag(np.linalg.inv(hessian)))
    lower, upper = problem.bounds
    for i, p in enumerate(problem.parameters):
        if p.scale == "linear":
            deviation = p.prior_deviation
            value += _log_inside((lower[i] - z[i]) / spread[i], (upper[i] - z[i]) / spread[i])
            value -= _log_inside((lower[i] - p.start) / deviation, (upper[i] - p.start) / deviation)
    return float(value)


def _log_inside(low: float, high: float) -> float:
    """Logarithm of the share of a standard normal between two points."""
    return float(log_ndtr(high) + np.log1p(-np.exp(min(log_ndtr(low) - log_ndtr(high), -1e-12))))
