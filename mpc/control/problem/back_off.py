"""Constraint back-off: bands narrowed by what the filter's covariance and the forecast's error make of the zones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtri

from calibration.estimation.kalman import KalmanFilter
from mpc.control.problem.data import HorizonData
from mpc.control.problem.horizon import Horizon
from mpc.errors import ControlError
from mpc.scenario.forecaster import ErrorGrowth
from thermal._types import BoolArray, FloatArray
from thermal.errors import describe
from thermal.model.modal import ModalModel
from thermal.model.step import IMPLICIT_EULER, Scheme


@dataclass(frozen=True, eq=False)
class BackOff:
    """Narrows comfort bands so that each edge is missed with a given probability.

    Parameters
    ----------
    kalman : KalmanFilter
        Of the observer.
    modes : ModalModel
        That its state space was made of.
    horizon : Horizon
        Steps.
    violation : float
        Probability of missing an edge of a zone's band at a step [-], above 0 and up to 0.5; not that of any of them.
    recourse : float
        Lead from which on later actions are taken to correct what is measured by then: beyond it deviations stay as
        they are there [s]. Infinite by default: open loop, as if no action followed.
    outdoor : ErrorGrowth, optional
        Error of the outdoor temperature's forecast; none by default.
    scheme : Scheme
        Of time, as the predictor's.

    Raises
    ------
    ControlError
        When a number is out of its range.

    Notes
    -----
    With A_k and Q_k those of (25) at the horizon's own steps, the outdoor error a further state,

    ``P_k+1 = A_k P_k A_k' + Q_k,  σ_k² = diag(C P_k C'),  lower + q σ_k <= T_k <= upper - q σ_k``,  q the normal
    quantile of the violation (van Hessem and Bosgra 2002, doi:10.1109/CDC.2002.1185062). P_0 is the steady covariance
    of the prediction. Sensors' noise does not count: the zone's own temperature is what is felt. A band that is too
    narrow for both edges shrinks to its middle.
    """

    kalman: KalmanFilter
    modes: ModalModel
    horizon: Horizon
    violation: float = 0.05
    recourse: float = np.inf
    outdoor: ErrorGrowth | None = None
    scheme: Scheme = IMPLICIT_EULER

    def __post_init__(self) -> None:
        if not (0.0 < self.violation <= 0.5 and self.recourse > 0.0):
            found = f"{self.violation!r}, {self.recourse!r} s"
            raise ControlError(describe("back-off", "a probability up to 0.5 and a positive time", found))

    @property
    def quantile(self) -> float:
        """Of the normal law, q [-]."""
        return float(-ndtri(self.violation))

    @cached_property
    def deviation(self) -> FloatArray:
        """Standard deviation of each zone at the end of each step, shape (N, n_zone) [K]."""
        return self.deviations(np.ones(self.kalman.space.n_zone, dtype=bool))

    def deviations(self, measured: BoolArray) -> FloatArray:
        """Give the deviations where only some sensors report, shape (N, n_zone) [K].

        Parameters
        ----------
        measured : ndarray of bool, shape (n_zone,)
            Zones with a sensor.
        """
        r, zones = self.kalman.space.order, self.kalman.space.n_zone
        modes, output, growth = self.modes, self.modes.output, self.outdoor or ErrorGrowth(0.0, 3600.0)
        p = np.zeros((r + zones + 1,) * 2)
        p[:-1, :-1] = self.kalman.steady(measured)[0]
        found: list[FloatArray] = []
        parts = {dt: modes.propagator(float(dt), self.scheme) for dt in np.unique(self.horizon.steps)}
        for dt, end in zip(self.horizon.steps, self.horizon.edges[1:], strict=True):
            keep, added = self.kalman.disturbance.discrete(float(dt))
            fading = np.exp(-dt / growth.time_constant)
            # the forecast's error acts in the step that it belongs to, as scenarios draw it
            p[-1] *= fading
            p[:, -1] *= fading
            p[-1, -1] += growth.deviation**2 * (1.0 - fading**2)
            part = parts[dt]
            step = np.zeros_like(p)
            step[:r, :r] = np.diag(part.end)
            step[:r, r:-1] = part.end_gain[:, None] * modes.heating
            step[:r, -1] = part.end_gain * modes.boundary[:, 0]
            step[r:-1, r:-1], step[-1, -1] = keep * np.eye(zones), 1.0
            p = step @ p @ step.T
            p[np.arange(r, r + zones), np.arange(r, r + zones)] += np.broadcast_to(added**2, (zones,))
            if found and end > self.recourse + 1e-6:
                found.append(found[-1])
            else:
                found.append(np.sqrt(np.einsum("zi,ij,zj->z", output, p[:r, :r], output).clip(0.0)))
        return np.array(found)

    def narrow(self, data: HorizonData) -> HorizonData:
        """Narrow the bands of a horizon.

        Parameters
        ----------
        data : HorizonData
            With the bands that are to be kept.
        """
        return _narrowed(data, self.quantile * self.deviation)


@dataclass(frozen=True)
class Margin:
    """Narrows comfort bands by the same everywhere.

    Parameters
    ----------
    width : float
        At each edge [K], none negative.

    Raises
    ------
    ControlError
        When it is negative or not a number.

    Notes
    -----
    A zone that is expected at the edge of its band will be outside of it half of the time. With a normal error of
    deviation σ the expected excess of an expected x beyond the edge is ``σ φ(x/σ) + x Φ(x/σ)``; a margin m with a
    softness of 2 m (see `ControlProblem`), a parabola from x = -m to m and x from there on, is that within 0.05 σ at
    m = 1.5 σ.
    """

    width: float

    def __post_init__(self) -> None:
        if not self.width >= 0.0:
            raise ControlError(describe("margin", "0 K or more", f"{self.width!r} K"))

    def narrow(self, data: HorizonData) -> HorizonData:
        """Narrow the bands of a horizon; one that is too narrow for both edges shrinks to its middle.

        Parameters
        ----------
        data : HorizonData
            With the bands that are to be kept.
        """
        return _narrowed(data, self.width)


def _narrowed(data: HorizonData, room: float | FloatArray) -> HorizonData:
    middle = 0.5 * (data.lower + data.upper)
    lower, upper = np.minimum(data.lower + room, middle), np.maximum(data.upper - room, middle)
    return replace(data, lower=lower, upper=upper)
