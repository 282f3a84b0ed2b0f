"""Models that a diagnosis leaves possible: sets of effects by their probability, parameters by their covariance.

What a controller or a policy is to stand that must not trust one model: it is tried, or trained, on draws of these.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calibration.diagnosis.decide.verdict import levelled, probabilities
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.refit.comparison import Fit
from calibration.diagnosis.refit.search import accepted_from
from calibration.errors import CalibrationError, FilterError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.drawn import DrawnModel
from calibration.evaluation.settings import ModelSettings, told_settings
from calibration.results import plain
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.errors import some_of

#: Probability below which a set of effects is left out [-].
_LEAST = 0.01

#: Eigenvalue of a covariance, on the estimation scale, that rounding may take below zero [-].
_SMALL = 1e-9

#: Draws for one that lies within the parameters' ranges; the last counts, cut at them.
_TRIES = 100


@dataclass(frozen=True)
class Possible:
    """Models with one set of effects: a normal distribution of their parameters on the estimation scale.

    Parameters
    ----------
    probability : float
        That these are the effects that are there [-].
    settings : ModelSettings
        How they are built, with the effects.
    values : mapping of str to float
        The likeliest parameters by name [parameter units].
    estimated : tuple of str
        Names of those that were fitted.
    covariance : ndarray, shape (n_estimated, n_estimated)
        Of these, on the estimation scale [-].
    """

    probability: float
    settings: ModelSettings
    values: Mapping[str, float]
    estimated: tuple[str, ...]
    covariance: FloatArray

    def draw(self, building: Building, count: int, rng: np.random.Generator) -> list[dict[str, float]]:
        """Draw parameters by name [parameter units]: of those within all ranges, where they are to be had.

        Parameters
        ----------
        building : Building
            That the diagnosis was made of.
        count : int
            How many.
        rng : numpy.random.Generator
            Makes the draws.

        Raises
        ------
        CalibrationError
            When the building has no such parameters.
        """
        parameters = {p.name: p for p in self.settings.network(building).parameters}
        other = sorted(set(self.values) ^ set(parameters))
        found = f"those of another: {some_of(other, most=3)}"
        CalibrationError.unless(not other, "posterior", f"parameters of {building.name}", found)
        estimated = [parameters[name] for name in self.estimated]
        likely = np.array([p.transform(self.values[p.name]) for p in estimated])
        lower, upper = np.array([[p.lower, p.upper] for p in estimated]).reshape(-1, 2).T
        drawn = list[dict[str, float]]()
        for points in rng.multivariate_normal(likely, self.covariance, size=(count, _TRIES), method="eigh"):
            tried = np.array([[p.inverse(z) for z in row] for p, row in zip(estimated, points.T, strict=True)])
            inside = ((tried >= lower[:, None]) & (tried <= upper[:, None])).all(axis=0)
            taken = np.clip(tried[:, int(np.argmax(inside)) if inside.any() else -1], lower, upper)
            drawn.append(dict(self.values) | dict(zip(self.estimated, taken.tolist(), strict=True)))
        return drawn


@dataclass(frozen=True)
class Posterior:
    """What a diagnosis leaves possible.

    Parameters
    ----------
    models : tuple of Possible
        By sets of effects; their probabilities sum to 1.
    disturbance : DisturbanceModel or None
        Heat that the likeliest of them leaves unexplained, where it is known.
    zones : tuple of str
        Of the building, by which it is known again.

    Examples
    --------
    >>> from calibration import diagnose
    >>> from thermal.data import load_bundled_case
    >>> case = load_bundled_case()
    >>> found = posterior_of(diagnose(case, dx=1.0), case.building)  # doctest: +SKIP
    >>> [sorted(one.settings.effects) for one in found.draw(case.building, 8)]  # doctest: +SKIP
    """

    models: tuple[Possible, ...]
    disturbance: DisturbanceModel | None
    zones: tuple[str, ...]

    def draw(self, building: Building, count: int, seed: int = 0) -> tuple[DrawnModel, ...]:
        """Draw models, those with the same effects side by side.

        Parameters
        ----------
        building : Building
            That the diagnosis was made of.
        count : int
            How many.
        seed : int
            Of the draws.

        Raises
        ------
        CalibrationError
            When the building is another one.
        """
        same = tuple(building.zone_names) == self.zones
        advice = "give the building that the diagnosis was made of"
        CalibrationError.unless(same, "posterior", f"a building with the zones {some_of(self.zones, most=3)}",
                                f"{building.name} with {some_of(building.zone_names, most=3)}", advice)  # fmt: skip
        rng, drawn = np.random.default_rng(seed), list[DrawnModel]()
        counts = rng.multinomial(count, [one.probability for one in self.models])
        for one, times in zip(self.models, counts.tolist(), strict=True):
            if times:
                values = one.draw(building, times, rng)
                drawn += [DrawnModel(one.settings, v, self.disturbance) for v in values]
        return tuple(drawn)

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``posterior.json``."""
        models = [vars(one) | {"settings": one.settings.to_dict()} for one in self.models]
        content: dict[str, Any] = plain({"models": models, "disturbance": self.disturbance, "zones": self.zones})
        return content


def posterior_of(diagnosis: Diagnosis, building: Building) -> Posterior:
    """Gather what a diagnosis leaves possible.

    Sets of effects are those of its search: without what a round accepted, with it, and with another effect that the
    round fitted in its place. Where another structure predicts better, that structure is all there is, its parameters
    independent of each other.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.
    building : Building
        That it was made of.
    """
    better = diagnosis.better
    zones = building.zone_names
    if better is not None:
        parameters = {p.name: p for p in better.settings.network(building).parameters}
        known = {p.name: p.standard_error / parameters[p.name].slope(p.value) for p in better.parameters
                 if p.standard_error is not None and p.name in parameters}  # fmt: skip
        spread = np.array([min(error, parameters[name].prior_deviation) for name, error in known.items()])
        values = {p.name: p.value for p in better.parameters if p.name in parameters}
        only = Possible(1.0, better.settings, values, tuple(known), np.diag(spread**2))
        return Posterior((only,), better.disturbance, zones)
    # heat of unknown cause is handed on where no effect explains what is missing
    corrected = diagnosis.taken is not diagnosis.final
    chances = [(1.0, diagnosis.taken)] if corrected else _chances(diagnosis)
    kept = [(share, fit) for share, fit in chances if share >= _LEAST]
    whole = sum(share for share, _ in kept)
    models = tuple(_possible(share / whole, fit, diagnosis) for share, fit in kept)
    return Posterior(models, diagnosis.disturbance, zones)


def _chances(diagnosis: Diagnosis) -> list[tuple[float, Fit]]:
    """Fits of a search with the probability that each has all that is there."""
    judged = {c.effect: c.probability for c in diagnosis.verdict.candidates}
    found, real = list[tuple[float, Fit]](), 1.0
    for r in diagnosis.rounds:
        if r.accepted is None or real == 0.0:  # nothing is known to follow what is not there
            break
        share, none = probabilities(levelled(r), accepted_from(r.own))
        own = r.accepted.screened.effect
        others = {x.screened.effect: x.fit for x in r.refits if x.screened.effect != own}
        fitted = share[own] + sum(share[e] for e in others)
        # one that a later round accepted is judged by that round too, which says nothing of this one
        there = min(1.0 - none, judged[own] / real + sum(min(judged[e] / real, share[e]) for e in others))
        found.append((real * (1.0 - there), r.before))
        found += [(real * there * share[e] / fitted, fit) for e, fit in others.items()]
        real *= there * share[own] / fitted
    return [*found, (real, diagnosis.rounds[-1].after)]


def _possible(probability: float, fit: Fit, diagnosis: Diagnosis) -> Possible:
    names = tuple(p.name for p in fit.problem.parameters)
    settings = replace(fit.settings, effects=fit.effects, normalisation=diagnosis.settings.normalisation)
    return Possible(probability, settings, fit.values, names, fit.covariance)


def read_posterior(path: str | Path) -> Posterior:
    """Read what a diagnosis left possible.

    Parameters
    ----------
    path : str or Path
        A ``posterior.json``.

    Raises
    ------
    CalibrationError
        When the file cannot be read, or holds something else.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise CalibrationError(f"{path}: expected a posterior as `diagnose` writes it, found {error}") from error
    try:
        models, heat = tuple(_read(one, path) for one in content["models"]), content["disturbance"]
        if not np.isclose(sum(one.probability for one in models), 1.0) or min(one.probability for one in models) < 0.0:
            raise ValueError("probabilities that are not 0 or more and 1 together")
        return Posterior(models, None if heat is None else DisturbanceModel(**heat), tuple(content["zones"]))
    except (KeyError, TypeError, ValueError, FilterError) as error:
        raise CalibrationError(f"{path}: expected a posterior as `diagnose` writes it, found {error!r}") from error


def _read(entry: Mapping[str, Any], path: Path) -> Possible:
    estimated = tuple(entry["estimated"])
    covariance = np.array(entry["covariance"], dtype=float).reshape(len(estimated), len(estimated))
    settings = ModelSettings(**told_settings(entry["settings"], path))
    values = {name: float(value) for name, value in entry["values"].items()}
    if not (np.isfinite(covariance).all() and np.isfinite(list(values.values())).all()):
        raise ValueError("numbers that are not finite")
    if not (np.allclose(covariance, covariance.T) and np.linalg.eigvalsh(covariance).min(initial=0.0) >= -_SMALL):
        raise ValueError("a covariance that is none")
    if not set(estimated) <= set(values):
        raise ValueError("estimated parameters without values")
    return Possible(float(entry["probability"]), settings, values, estimated, covariance)
