"""The disturbance that a calibration's standard errors follow: unmeasured heat in proportion to the zones' air."""

from __future__ import annotations

import numpy as np

from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.innovations import tune_disturbance
from calibration.fit.problem import Problem
from thermal._types import FloatArray
from thermal.model.reduce import ReducedModel, reduced_model
from thermal.network.network import ThermalNetwork

#: Zones beyond which it is tuned on a model of this order: 123 zones take minutes with the five hundred states of their
#: calibration.
_MANY_ZONES, _ORDER = 40, 300


def tune(problem: Problem, model: ReducedModel, theta: FloatArray) -> DisturbanceModel:
    """Unmeasured heat and sensor noise of the tuning intervals, by the likelihood of a Kalman filter's innovations.

    Parameters
    ----------
    problem : Problem
        What is fitted.
    model : ReducedModel
        That serves θ.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    """
    large = len(model.network.zones) > _MANY_ZONES
    tuned = tune_disturbance(
        reduced_model(problem.grid, [theta], order=_ORDER) if large else model,
        theta,
        problem.inputs,
        problem.stretches,
        weights=air_volumes(model.network),
        start=problem.disturbance,
        scheme=problem.scheme,
        covariance="steady",  # where sensors come and go exact gains take ten times as long
        curvature=False,
    )
    return tuned.disturbance


def air_volumes(network: ThermalNetwork) -> FloatArray:
    """Volume of each zone's air, shape (n_zone,) [m3].

    Parameters
    ----------
    network : ThermalNetwork
        Control volumes and faces.
    """
    air = next(c for c in network.capacities if c.name == "air")
    volumes = np.bincount(network.zone[air.node], air.weight, minlength=len(network.zones))
    return np.asarray(volumes, dtype=float)
