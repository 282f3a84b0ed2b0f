"""Errors of forecast outdoor air are learned from forecasts that were made."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.identified.forecast_error import ForecastError

STEP, DAY = 900.0, 96


def followed(deviation: float, days: int) -> float:
    """Deviation a day ahead that is learned where errors are a random walk."""
    rng, error, truth = np.random.default_rng(0), ForecastError(STEP), 280.0
    for _ in range(days * DAY):
        walk = np.concatenate([[0.0], np.cumsum(rng.normal(0.0, deviation / np.sqrt(DAY), DAY - 1))])
        error.made(truth + walk)
        error.came(truth)
    return float(error.ahead(DAY + 1)[DAY])


def test_errors_are_those_of_weather_services_until_others_were_seen() -> None:
    assert followed(0.5, 0) == followed(0.5, 0) == pytest.approx(2.0)
    assert followed(0.0, 1) > 1.6
    for deviation in (0.0, 0.7, 3.0):
        assert followed(deviation, 60) == pytest.approx(np.sqrt(deviation**2 + (4.0 - deviation**2) * 8.0 / 247.0), rel=0.1)


def test_a_step_that_was_not_measured_says_nothing() -> None:
    error = ForecastError(STEP)
    for _ in range(2 * DAY):
        error.made(np.full(DAY, 270.0))
        error.came(np.nan)
    assert error.ahead(3).tolist() == ForecastError(STEP).ahead(3).tolist()
