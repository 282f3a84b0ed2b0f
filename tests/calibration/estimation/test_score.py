"""Derivatives of the likelihood against central differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import DisturbanceModel, KalmanFilter, StateSpace
from calibration.estimation.kalman import Filtered
from calibration.estimation.smoother import log_likelihood_slopes
from calibration.estimation.state_space import state_space
from thermal import Inputs
from thermal.model.matrices import Matrices

FloatArray = NDArray[np.float64]

REFERENCE = 293.15
STEP = 300.0
START = np.full((9, 1), REFERENCE)


Pencil, Telemetry = Callable[..., Matrices], Callable[..., Inputs]

AIRFLOWS, FLOW = ((0, 1), (1, 2)), np.array([0.05, 0.02])


def record(telemetry: Telemetry, space: StateSpace, kind: str, swing: float = 0.0) -> Inputs:
    """Something like telemetry; the likelihood of any numbers has derivatives."""
    rng = np.random.default_rng(0)
    zone = REFERENCE + np.cumsum(0.1 * rng.standard_normal((150, 3)), axis=0)
    airflow = FLOW * rng.uniform(1.0 - swing, 1.0 + swing, (150, 2)) if space.flow is not None else None
    inputs = telemetry(zone, 300.0 * rng.random((150, 3)), np.full((150, 1), 288.0), airflow)
    if kind == "complete":
        return inputs
    zone[20:25, 1] = zone[40:80, 0] = zone[100:102] = np.nan
    known = inputs.complete.copy()
    known[60:66] = False
    return replace(inputs, zone=zone, complete=known)


def filtered(
    space: StateSpace, inputs: Inputs, drive: FloatArray, keep: float, noise: FloatArray, covariance: str = "exact"
) -> Filtered:
    """Filter with numbers of each zone's own, φ for all."""
    tau = -STEP / np.log(keep)
    sigma = np.sqrt(drive / (1.0 - keep**2))
    disturbance = DisturbanceModel(sigma, tau, np.sqrt(noise))
    kalman = KalmanFilter(space, disturbance, covariance=covariance, tolerance=0.0)  # type: ignore[arg-type]
    return kalman.filter(inputs, 0, len(inputs) - 1, START)


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("covariance", ["exact", "steady"])
@pytest.mark.parametrize("kind", ["complete", "gaps"])
def test_slopes_are_those_of_differences(
    mixed: bool, covariance: str, kind: str, pencil: Pencil, telemetry: Telemetry
) -> None:
    modes = pencil().modal.modes
    space = state_space(modes, STEP, airflows=AIRFLOWS, flow=FLOW) if mixed else state_space(modes, STEP)
    inputs = record(telemetry, space, kind)
    if covariance == "steady":  # which leaves its steady covariance where inputs are incomplete
        inputs = replace(inputs, complete=np.ones(150, dtype=bool))
    drive, keep, noise = np.array([40.0, 25.0, 60.0]) ** 2, 0.93, np.array([0.05, 0.08, 0.11]) ** 2
    by_drive, by_keep, by_noise = log_likelihood_slopes(filtered(space, inputs, drive, keep, noise, covariance))

    def difference(d_drive: FloatArray, d_keep: float, d_noise: FloatArray) -> float:
        up, down = (
            filtered(
                space, inputs, drive + s * d_drive, keep + s * d_keep, noise + s * d_noise, covariance
            ).log_likelihood
            for s in (1.0, -1.0)
        )
        return 0.5 * (up - down)

    none = np.zeros(3)
    for z, unit in enumerate(np.eye(3)):
        size = 1e-4 * drive[z]
        assert by_drive[z] * size == pytest.approx(difference(size * unit, 0.0, none), rel=1e-4, abs=1e-7)
        size = 1e-4 * noise[z]
        assert by_noise[z] * size == pytest.approx(difference(none, 0.0, size * unit), rel=1e-4, abs=1e-7)
    assert by_keep * 1e-5 == pytest.approx(difference(none, 1e-5, none), rel=1e-4, abs=1e-7)


def test_airflows_that_change_are_taken_as_given(pencil: Pencil, telemetry: Telemetry) -> None:
    """Their heat follows the filtered temperatures, whose own derivative is left out: 30 % of swing make 1 %."""
    space = state_space(pencil().modal.modes, STEP, airflows=AIRFLOWS, flow=FLOW)
    inputs = record(telemetry, space, "gaps", swing=0.3)
    drive, noise = np.array([40.0, 25.0, 60.0]) ** 2, np.array([0.05, 0.08, 0.11]) ** 2
    by_drive, _, by_noise = log_likelihood_slopes(filtered(space, inputs, drive, 0.93, noise))
    up, down = (filtered(space, inputs, s * drive, 0.93, noise).log_likelihood for s in (1.0001, 0.9999))
    assert by_drive @ drive == pytest.approx((up - down) / 2e-4, rel=0.01)
    up, down = (filtered(space, inputs, drive, 0.93, s * noise).log_likelihood for s in (1.0001, 0.9999))
    assert by_noise @ noise == pytest.approx((up - down) / 2e-4, rel=0.01)


def test_zone_without_a_sensor_tells_nothing_of_its_noise(pencil: Pencil, telemetry: Telemetry) -> None:
    space = state_space(pencil().modal.modes, STEP)
    inputs = record(telemetry, space, "complete")
    zone = inputs.zone.copy()
    zone[:, 1] = np.nan
    by_drive, _, by_noise = log_likelihood_slopes(
        filtered(space, replace(inputs, zone=zone), np.full(3, 900.0), 0.9, np.full(3, 0.01))
    )
    assert by_noise[1] == 0.0
    assert abs(by_drive[1]) < 0.05 * abs(by_drive[0])
