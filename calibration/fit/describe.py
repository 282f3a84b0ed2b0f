"""An estimate in the terms of a result: parameters with intervals, bounds hit, and what the data determine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from calibration.fit.estimate import Estimate
from calibration.fit.result import ParameterEstimate
from calibration.identifiability.information import Information
from thermal._types import FloatArray
from thermal.parameters import Parameter

#: A bound counts as hit within this share of the range, on the estimation scale [-].
BOUND_SHARE = 0.01

#: Tails of a 90 % interval [-].
_TAILS = (0.05, 0.95)

#: Share of the prior's deviation below which the data determine a parameter [-].
_DETERMINED = 0.5


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
        Values that were never estimated, with their units.
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
        Values that were never estimated, with their units.
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
    identifiable = bool(deviation < _DETERMINED * p.prior_deviation and not at_bound)
    first, last = (float(np.clip(p.inverse(float(end)), p.lower, p.upper)) for end in ends)
    error = float(deviation * p.slope(value))
    return ParameterEstimate(
        p.name, p.unit, value, p.lower, p.upper, p.start, at_bound, error, identifiable, p.source, (first, last)
    )
