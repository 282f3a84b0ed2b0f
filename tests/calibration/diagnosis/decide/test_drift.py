"""Growth of the error: processes whose slope is known, and a twin whose zone lacks heat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import Interval
from calibration.diagnosis.decide.where import DriftCurve, drift_of
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.errors import NotEnoughDataError
from calibration.evaluation.settings import ModelSettings
from mpc.reports.drift_words import drift_sentence, end_words, growth_words
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin

FloatArray = NDArray[np.float64]

STEP = 300.0
RUNS = 2000
TIME = STEP * np.arange(1, 289)


def curve(errors: FloatArray) -> DriftCurve:
    """Of runs whose errors are known, shape (n_run, n_step)."""
    keep = np.unique(np.round(np.geomspace(1, 288, 48)).astype(int)) - 1
    return DriftCurve(TIME[keep], np.sqrt(np.mean(errors**2, axis=0))[keep])


def walks(seed: int) -> FloatArray:
    return 0.05 * np.cumsum(np.random.default_rng(seed).normal(size=(RUNS, 288)), axis=1)


def relaxing(seed: int, settling: float) -> FloatArray:
    """Runs whose zone lacks a heat of its own each, and settles to it."""
    heat = np.random.default_rng(seed).normal(size=(RUNS, 1))
    return heat * -np.expm1(-TIME / settling)


def noise(seed: int, deviation: float) -> FloatArray:
    return np.random.default_rng(seed).normal(0.0, deviation, (RUNS, 288))


def test_sensors_that_read_wrong_have_no_slope() -> None:
    bias = np.random.default_rng(0).normal(0.0, 0.3, (RUNS, 1)) + noise(1, 0.1)
    found = curve(bias)
    assert found.kind == "sensors" and abs(found.slope) < 0.05
    assert "from the first step" in growth_words(found)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_random_walk_has_slope_one_half(seed: int) -> None:
    found = curve(walks(seed))
    assert found.kind == "random" and found.slope == pytest.approx(0.5, abs=0.04)
    assert "square root" in growth_words(found) and "still grows" in end_words(found)


def test_random_heat_that_a_zone_forgets_levels_off_with_slope_one_half() -> None:
    keep, errors = np.exp(-STEP / 7200.0), np.zeros((RUNS, 288))
    drawn = np.random.default_rng(3).normal(size=(RUNS, 288))
    for k in range(288):
        errors[:, k] = keep * errors[:, k - 1] * (k > 0) + drawn[:, k]
    found = curve(errors)
    assert found.kind == "random" and found.slope == pytest.approx(0.5, abs=0.1)
    assert "four fifths" in end_words(found)


@pytest.mark.parametrize("settling", [3600.0, 14400.0, 1e7])
def test_persistent_heat_has_slope_one_and_then_levels_off(settling: float) -> None:
    found = curve(relaxing(0, settling))
    assert found.kind == "persistent" and found.slope == pytest.approx(1.0, abs=0.05)
    assert ("still grows" in end_words(found)) == (settling > 86400.0)
    assert "missing for hours" in growth_words(found)


def test_noise_of_the_sensors_hides_no_slope() -> None:
    walk, heat = curve(walks(0) + noise(1, 0.08)), curve(relaxing(0, 14400.0) + noise(1, 0.05))
    assert walk.kind == "random" and walk.slope == pytest.approx(0.5, abs=0.08)
    assert heat.kind == "persistent" and heat.slope == pytest.approx(1.0, abs=0.1)


def test_air_that_settles_before_the_walls_is_persistent_all_the_same() -> None:
    found = curve(0.5 * relaxing(0, 720.0) + 0.5 * relaxing(0, 18000.0))
    assert found.kind == "persistent"


def test_a_wrong_mass_makes_a_hump() -> None:
    amplitude = np.random.default_rng(0).normal(size=(RUNS, 1))
    found = curve(amplitude * (np.exp(-TIME / 5400.0) - np.exp(-TIME / 900.0)))
    assert found.kind == "hump" and found.hump is not None
    at, top, low = found.hump
    exact = np.log(5400.0 / 900.0) / (1.0 / 900.0 - 1.0 / 5400.0)
    assert at == pytest.approx(exact, abs=2.0 * STEP) and low < 0.5 * top
    assert "mass" in growth_words(found)


def test_the_sentence_tells_both_models() -> None:
    text = drift_sentence("with the effect found", curve(relaxing(0, 3600.0)), curve(noise(0, 0.1)))
    assert "in proportion to time" in text and "With the effect found it is there from the first step" in text
    assert "With" not in drift_sentence("", curve(walks(0)))


def test_a_zone_that_lacks_heat_drifts_in_proportion_to_time() -> None:
    """Free runs of a twin, and of the same with a meter that loses a constant heat: against the step response."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.002, 0.004))
    case, _ = generate_twin(
        building, 3, TwinSettings(days=9.0, step_seconds=300.0, dx=1.0, meter="exact", ranges=quiet)
    )
    models = ModelComparison(case, ModelSettings(dx=1.0))
    fit = models.fit({}, [{}])
    before = drift_of(fit, models.judged)
    assert before.seconds[0] == 300.0 and before.seconds[-1] == 86400.0
    inputs = fit.built.inputs
    robbed = replace(fit, built=replace(fit.built, inputs=replace(inputs, heat=inputs.heat - 300.0)))
    after = drift_of(robbed, models.judged)
    assert after.kind == "persistent" and (after.rms > before.rms).all()
    short = drift_of(fit, [Interval(case.stamps[0], case.stamps[200])])
    assert short.seconds[-1] == 86400.0 / 8
    with pytest.raises(NotEnoughDataError, match="room for a run of one step"):
        drift_of(fit, [Interval(case.stamps[0], case.stamps[20])])
