"""What is left of the errors, does it come back? Heat by weather and clock, fitted on some days and judged on others.

A model's errors hold what it lacks and what nobody could know: people who come and go, doors. What it lacks answers to
something: the sun, the wind, the hour. Such heat is fitted to the errors of three quarters of the tuning days, the
model's own parameters following, and must lower the errors of the quarter that is left, for each quarter in turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import MATTERS
from calibration.diagnosis.screen.drivers import BINS, OUTDOOR, SKY, SUNS, WEEKEND, WIND
from calibration.results import Plain
from thermal._types import BoolArray, FloatArray
from thermal.effects.effect import Chosen, Effect, EffectBuilder, strength
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import CONSTANT, Signal
from thermal.model.reduce import reduced_model

#: Parts of the tuning days, each left out once.
_PARTS = 4

#: Heat that is plausible [W/m2]: in a bin of the day or always; per kelvin, per 100 W/m2 of sun or of sky, and per
#: 10 m/s K of wind and how much warmer it is indoors.
_HEAT, _PER_KELVIN, _PER_WEATHER = 20.0, 1.0, 10.0

#: Standard errors over days that the best of eight choices of heat must reach [-]: 5 % over all of them.
_SURE = 2.5

#: Sizes that such heat may have over what is plausible [-]: the one that predicts best counts.
_TIGHTNESS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)

_SOURCE = "any cause: loads and losses of offices stay within"


@dataclass(frozen=True)
class Regular(Plain):
    """How much of the errors comes back on days that nothing was fitted to.

    Parameters
    ----------
    fall : float
        How far heat of the kind that does so most, or of all kinds, lowers the root mean square of their errors [K].
    sure : float
        Its standard errors over days [-].
    explains : float
        Mean squared error that it takes away [K²].
    shares : mapping of str to float
        Share of the squared error that heat of one kind takes away, by kind [-].
    """

    fall: float
    sure: float
    explains: float
    shares: dict[str, float]

    @property
    def counts(self) -> bool:
        """Whether it is beyond chance, as the best of several, and large enough to matter to a prediction."""
        return self.fall > MATTERS and self.sure > _SURE


def regular(models: ModelComparison, fit: Fit) -> Regular:
    """Judge what is left of the errors of a fitted model.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        The model.
    """
    kinds = _kinds(models.drivers)
    heat = _effect(kinds)
    built = models.build(fit.effects, (Chosen(heat),))
    theta = built.theta(fit.values)
    problem, model = models.problem(built, theta), reduced_model(built.grid, [theta])
    errors, days, jacobians = [], [], []
    for runs in problem.runs:
        error, slopes = problem.errors(model, theta, runs, slopes=True)
        middle = built.inputs.stamps[runs.starts + problem.steps // 2].normalize().asi8
        known = np.isfinite(error)
        errors.append(error[known])
        days.append(np.broadcast_to(middle[:, None, None], error.shape)[known])
        jacobians.append((np.asarray(slopes) * problem.slopes(theta))[known])
    table = _Table(np.concatenate(errors), np.concatenate(days), np.concatenate(jacobians), problem.effective_size())
    parameters = built.network.parameters
    own: BoolArray = np.array([p.effect != heat.id for p in parameters])
    prior = np.array([p.prior_deviation for p in parameters])
    base = np.array([p.base for p in parameters])
    inside = {kind: np.isin(base, [_name(kind, n) for n in range(len(s))]) for kind, s in kinds.items()}
    found = {kind: table.left_out(own, np.asarray(columns), prior) for kind, columns in inside.items()}
    shares = {kind: max(0.0, float(gained.sum())) / float(before.sum()) for kind, (before, gained) in found.items()}
    before, gained = max((*found.values(), table.left_out(own, ~own, prior)), key=lambda f: float(f[1].sum()))
    size, explains = (max(0.0, float(part.sum())) / table.error.size for part in (before, gained))
    spread = float(gained.std(ddof=1) / np.sqrt(gained.size)) if gained.size > 1 else np.inf
    fall = float(np.sqrt(size) - np.sqrt(size - explains))
    return Regular(fall, float(gained.mean()) / max(spread, 1e-300), explains, shares)


@dataclass(frozen=True)
class _Table:
    """Errors [K] with their days and derivatives, and how many independent ones they are."""

    error: FloatArray
    day: FloatArray
    jacobian: FloatArray
    count: float

    def left_out(self, own: BoolArray, heat: BoolArray, prior: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Squared error of each day that is left out, and how far heat of the best size lowers it [K²]."""
        days, index = np.unique(self.day, return_inverse=True)
        part = np.arange(days.size) * min(_PARTS, days.size) // days.size
        scale = self.count / float(np.sum(self.error**2))
        before, after = np.zeros(self.error.size), np.zeros((len(_TIGHTNESS), self.error.size))
        both = np.concatenate([np.flatnonzero(own), np.flatnonzero(heat)])
        size = int(own.sum())
        for p in range(part.max() + 1):
            out = part[index] == p
            inside, beside = self.jacobian[~out][:, both], self.jacobian[out][:, both]
            gram, score = inside.T @ inside, -inside.T @ self.error[~out]
            precision = prior[both] ** -2.0 / scale
            alone = np.linalg.solve(gram[:size, :size] + np.diag(precision[:size]), score[:size])
            before[out] = self.error[out] + beside[:, :size] @ alone
            for k, tightness in enumerate(_TIGHTNESS):
                held = np.concatenate([precision[:size], precision[size:] / tightness**2])
                after[k, out] = self.error[out] + beside @ np.linalg.solve(gram + np.diag(held), score)
        squared = np.asarray(np.bincount(index, before**2), dtype=float)
        gained = np.array([squared - np.bincount(index, a**2) for a in after])
        return squared, gained[int(np.argmax(gained.sum(axis=1)))]


def _kinds(inputs: InputProvider) -> dict[str, list[tuple[Signal, float]]]:
    """Signals that heat may answer to, by kind, with the heat that is plausible per unit."""
    kinds = {
        "always": [(CONSTANT, _HEAT)],
        "time of day": [(s, _HEAT) for s in BINS],
        "weekends": [(WEEKEND, _HEAT)],
        "outdoor temperature": [(OUTDOOR, _PER_KELVIN)],
        "sun": [(s, _PER_WEATHER) for s in SUNS],
        "wind": [(WIND, _PER_WEATHER)],
        "sky": [(SKY, _PER_WEATHER)],
    }
    return {kind: own for kind, own in kinds.items() if not inputs.lacks(own[0][0].inputs)}


def _name(kind: str, number: int) -> str:
    return f"heat by {kind} {number}"


def _effect(kinds: dict[str, list[tuple[Signal, float]]]) -> Effect:
    """Heat of each zone by every signal."""
    signals = {_name(kind, n): s for kind, own in kinds.items() for n, s in enumerate(own)}

    def build(builder: EffectBuilder) -> None:
        for room in builder.rooms:
            for name, (signal, _) in signals.items():
                builder.heat_air(room, builder.parameter(name, zone=room.name), signal, room.floor_area)

    identity = "regular"
    parameters = tuple(
        strength(name, f"W/m^2/({signal.unit})", most, _SOURCE, identity, -most)
        for name, (signal, most) in signals.items()
    )
    return Effect(
        id=identity, title="heat that comes back", equation="A Σ_k p_k s_k", source=_SOURCE, acts_on="air of each zone",
        confounders=(), separated_by="", parameters=parameters, build=build, zonal=True,
    )  # fmt: skip
