"""Certificate of a reduced model: two days under thermostats on the grid, and the same heat replayed in its modes."""

from dataclasses import dataclass

import numpy as np

from thermal._types import FloatArray
from thermal.model.matrices import Matrices
from thermal.model.step import IMPLICIT_EULER, Stepper

#: Length [h] and step [s] of the replay.
_HOURS, _STEP = 48.0, 300.0

#: Indoor and outdoor temperatures of the replay [K above freezing]: set-points by day and night, mean outdoors and its
#: daily swing.
_DAY, _NIGHT, _OUTDOOR, _SWING = 22.0, 17.0, 2.0, 6.0

#: Largest heat of a zone over that which alone holds it 20 K above the outdoors in the long run [-].
_OVERSIZE = 1.5

#: What counts as the long run [s].
_LONG_RUN = 30.0 * 86400.0


@dataclass(frozen=True)
class Certificate:
    """How far a reduced model is from its grid over two days of closed loop.

    Parameters
    ----------
    volumes, order : int
        Control volumes of the grid and states of the reduced model.
    hours, step : float
        Length [h] and step [s] of the replay.
    mean_difference, max_difference : float
        Of the zone means over all steps [K].
    """

    volumes: int
    order: int
    hours: float
    step: float
    mean_difference: float
    max_difference: float


@dataclass(frozen=True)
class Replay:
    """A run on the grid: what drove it, and the zone means.

    Parameters
    ----------
    boundary : ndarray, shape (n_time, n_boundary)
        Boundary temperatures [K above freezing].
    heat : ndarray, shape (n_time, n_zone)
        Heat given to the zones [W].
    zone : ndarray, shape (n_time, n_zone)
        Zone means over the steps [K above freezing].
    step : float
        Step [s].
    """

    boundary: FloatArray
    heat: FloatArray
    zone: FloatArray
    step: float

    @property
    def hours(self) -> float:
        """Length [h]."""
        return len(self.heat) * self.step / 3600.0


def closed_loop(matrices: Matrices) -> Replay:
    """Run the grid for two days under proportional thermostats with set-backs at times of their own.

    Parameters
    ----------
    matrices : Matrices
        On the grid, at the θ to certify.
    """
    stepper = Stepper(matrices, _STEP, IMPLICIT_EULER)
    n_zone, count = matrices.observation.shape[0], round(_HOURS * 3600.0 / _STEP)
    rng = np.random.default_rng(0)
    hour = np.arange(count) * _STEP / 3600.0
    begin, end = rng.uniform(5.0, 8.0, n_zone), rng.uniform(16.0, 20.0, n_zone)
    warm = (hour[:, None] % 24.0 > begin) & (hour[:, None] % 24.0 < end)
    setpoint = np.where(warm, _DAY, _NIGHT) + rng.uniform(-1.0, 1.0, n_zone)
    outdoor = _OUTDOOR + _SWING * np.sin(2.0 * np.pi * (hour - 9.0) / 24.0)
    boundary = np.repeat(outdoor[:, None], matrices.n_boundary, axis=1)
    per_joule = Stepper(matrices, _LONG_RUN, IMPLICIT_EULER).response[1]
    largest = _OVERSIZE * (_DAY - _OUTDOOR) / (_LONG_RUN * np.diag(per_joule))
    states = _NIGHT * matrices.uniform[:, None]
    zone, heat = np.empty((count, n_zone)), np.empty((count, n_zone))
    seen = np.full(n_zone, _NIGHT)
    for k in range(count):
        # a fifth of the way at each step, as valves do: stable at any heat capacity of the zone
        wanted = largest * np.clip(0.5 * (setpoint[k] - seen), 0.0, 1.0)
        heat[k] = wanted if k == 0 else heat[k - 1] + 0.2 * (wanted - heat[k - 1])
        states, mean, _, _ = stepper.advance(states, boundary[k][:, None], heat[k][:, None])
        zone[k] = seen = mean[:, 0]
    return Replay(boundary, heat, zone, _STEP)


def differences(matrices: Matrices, replay: Replay) -> tuple[float, float]:
    """Mean and largest difference of the zone means from a replay's [K].

    Parameters
    ----------
    matrices : Matrices
        Of a reduced model.
    replay : Replay
        On the grid.
    """
    start = _NIGHT * matrices.uniform[:, None]
    keep = np.arange(1, len(replay.heat) + 1)
    boundary, heat = replay.boundary[:, :, None], replay.heat[:, :, None]
    means, _ = matrices.modal.run(start, boundary, heat, keep, replay.step, IMPLICIT_EULER)
    error = np.abs(means[0] - replay.zone)
    return float(error.mean()), float(error.max())
