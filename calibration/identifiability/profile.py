"""Profile likelihood: how far one parameter may move while all others follow to keep up with the data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from calibration.errors import CalibrationError
from calibration.evaluation.n_step import Progress
from calibration.fit.estimate import Estimate
from calibration.identifiability.profile_section import ProfileSection
from mpc.reports.identifiability import spoken
from thermal._types import FloatArray
from thermal.errors import nearest
from thermal.parameters import Parameter

#: Confidence levels of the intervals [-].
LEVELS = (0.90, 0.95)


@dataclass(frozen=True)
class ProfileInterval:
    """Values that a profile does not exclude at one level of confidence.

    Parameters
    ----------
    level : float
        Confidence [-].
    lower, upper : float
        Ends; the bound of the physical range where open [parameter units].
    open_lower, open_upper : bool
        Whether nothing within the physical range is excluded on that side.
    """

    level: float
    lower: float
    upper: float
    open_lower: bool
    open_upper: bool


@dataclass(frozen=True)
class Profile:
    """Profile of one parameter.

    Parameters
    ----------
    name, unit : str
        Of the parameter.
    with_prior : bool
        Whether it is of the posterior, or of the data alone.
    estimate : float
        Value at the minimum [parameter units].
    values : ndarray, shape (n,)
        Where the parameter was held, increasing [parameter units].
    deviance : ndarray, shape (n,)
        Twice the rise of the negative logarithm above its minimum [-].
    thetas : ndarray, shape (n, n_parameter)
        θ there, the other parameters estimated anew [parameter units].
    intervals : tuple of ProfileInterval
        One a level.
    estimate_deviance : float
        Deviance of the estimate that it started from [-]: well above zero when a lower optimum was met on the way, and
        always with the data alone.
    unconverged : int
        Points whose solver stopped early: their deviance may be too large.
    sentence : str
        The first interval in words.
    """

    name: str
    unit: str
    with_prior: bool
    estimate: float
    values: FloatArray
    deviance: FloatArray
    thetas: FloatArray
    intervals: tuple[ProfileInterval, ...]
    estimate_deviance: float
    unconverged: int
    sentence: str

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        names = ("name", "unit", "with_prior", "estimate", "estimate_deviance", "unconverged", "sentence")
        plain = {k: getattr(self, k) for k in names}
        return {
            **plain,
            "values": self.values.tolist(),
            "deviance": self.deviance.tolist(),
            "intervals": [{k: getattr(i, k) for k in i.__dataclass_fields__} for i in self.intervals],
        }


def profile_likelihood(
    found: Estimate,
    names: Sequence[str] | None = None,
    *,
    with_prior: bool = True,
    levels: Sequence[float] = LEVELS,
    progress: Progress | None = None,
) -> tuple[Profile, ...]:
    """Hold a parameter at values around its estimate, estimate all others anew, and see what the fit loses.

    By Wilks (1938) the deviance ``D(x) = 2 min_z [ℓ(x, z) - ℓ_min]`` of the true value is chi-square with one degree
    of freedom, so the values with ``D`` below its quantile are an interval that, other than a standard error, follows
    a curved or one-sided likelihood. Errors of a run are strongly correlated in time, and ``D`` would be far too large
    if each counted; the weights of `Problem.weighted` count them as its effective number of observations, at the
    deviation that was found, and so does ``D``.

    Parameters
    ----------
    found : Estimate
        From `estimate`: where to start. Each point has a reduced model of its own.
    names : sequence of str, optional
        Estimated parameters; all by default.
    with_prior : bool
        Profile of the posterior; else of the data alone, where what they leave open runs on to its physical range.
    levels : sequence of float
        Confidence levels, between 0 and 1 [-].
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    tuple of Profile
        One a name.

    Raises
    ------
    CalibrationError
        When a name is not an estimated parameter, or a level not between 0 and 1.
    """
    known = [p.name for p in found.problem.parameters]
    for name in names or ():
        if name not in known:
            raise CalibrationError(f"profile: {name!r} is not estimated; {nearest(name, known)}")
    if not levels or not all(0.0 < level < 1.0 for level in levels):
        raise CalibrationError(f"levels: expected confidence levels between 0 and 1, came {list(levels)}")
    roots = {float(level): float(np.sqrt(chi2.ppf(level, 1))) for level in levels}
    chosen = list(known if names is None else names)
    sections: list[ProfileSection] = []
    residual = found.problem.weighted(found.model, found.problem.point(found.theta))[0]
    data = None if with_prior else found.problem.residuals_only(found.model, found.theta).size
    first = 0.5 * float(np.sum(residual[:data] ** 2))
    for done, name in enumerate(chosen, 1):
        optimum = sections[-1].best if sections else None
        sections.append(ProfileSection(found, known.index(name), with_prior, optimum))
        sections[-1].complete(sorted(roots.values()))
        if progress is not None:
            progress("profile", done, len(chosen))
    for section in sections:  # all count from the least optimum that any of them has met
        section.complete(sorted(roots.values()), sections[-1].best)
    return tuple(_profile(section, roots, first) for section in sections)


def _profile(section: ProfileSection, roots: Mapping[float, float], first: float) -> Profile:
    """Collect points and crossings in the units of the parameter."""
    parameter = section.parameter
    points = sorted(section.points, key=section.x)
    intervals = []
    for level, root in roots.items():
        (low, low_open), (high, high_open) = (section.crossing(side, root) for side in (-1.0, 1.0))
        intervals.append(ProfileInterval(level, parameter.inverse(low), parameter.inverse(high), low_open, high_open))
    return Profile(
        name=parameter.name,
        unit=parameter.unit,
        with_prior=section.with_prior,
        estimate=parameter.inverse(section.x(section.best)),
        values=np.array([parameter.inverse(section.x(p)) for p in points]),
        deviance=np.array([section.root(p) ** 2 for p in points]),
        thetas=np.array([section.problem.theta(p.z) for p in points]),
        intervals=tuple(intervals),
        estimate_deviance=2.0 * (first - section.best.cost),
        unconverged=sum(not p.converged for p in points),
        sentence=_sentence(parameter, intervals[0], section.with_prior),
    )


def _sentence(parameter: Parameter, interval: ProfileInterval, with_prior: bool) -> str:
    name, unit = spoken(parameter), "" if parameter.unit == "1" else f" {parameter.unit}"
    lower, upper = f"{interval.lower:.3g}{unit}", f"{interval.upper:.3g}{unit}"
    source = "data and prior" if with_prior else "the data alone"
    sure = f"with {100 * interval.level:g} % confidence by {source}"
    name = name[0].upper() + name[1:]
    if interval.open_lower and interval.open_upper:
        return f"{name}: nothing between {lower} and {upper}, its physical range, is excluded {sure}."
    if interval.open_lower:
        return f"{name}: at most {upper} {sure}; no lower limit within its physical range."
    if interval.open_upper:
        return f"{name}: at least {lower} {sure}; no upper limit within its physical range."
    return f"{name}: {interval.lower:.3g} to {upper} {sure}."
