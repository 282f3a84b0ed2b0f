"""Missing heat: that which a twin's zone is known to get beside its metered heat, hour by hour, within its band."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.screen import missing as _missing
from calibration.diagnosis.screen.missing import Missing, at_start, missing_heat
from calibration.estimation.heat_balance import heat_balance
from calibration.evaluation.settings import ModelSettings
from thermal import reduced_model
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, TwinTruth, generate_twin

FloatArray = NDArray[np.float64]

#: Heat that a zone gets in office hours and no meter knows of [W], and which zone.
EXTRA, ZONE = 200.0, 1


@cache
def twin(seed: int, noise: float) -> tuple[ModelComparison, TwinTruth]:
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    ranges = TwinRanges(disturbance_deviation=(0.3, 1.0), noise=(noise, noise))
    case, truth = generate_twin(building, seed, TwinSettings(days=15.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=ranges))  # fmt: skip
    return ModelComparison(case, ModelSettings(dx=1.0)), truth


def robbed(fit: Fit) -> tuple[Fit, FloatArray]:
    """A fit whose meter in one zone loses heat in office hours, and that heat [W]."""
    inputs = fit.built.inputs
    begins = inputs.stamps - pd.Timedelta(seconds=inputs.step)
    extra = np.zeros(inputs.heat.shape)
    extra[(begins.hour >= 8) & (begins.hour < 17) & (begins.day_of_week < 5), ZONE] = EXTRA
    known = replace(inputs, heat=inputs.heat - extra)
    return replace(
        fit, built=replace(fit.built, inputs=known), problem=replace(fit.problem, inputs=known)
    ), extra  # fmt: skip


@cache
def estimated(seed: int, noise: float) -> tuple[Missing, FloatArray, FloatArray]:
    """Estimate of the calibrated model, and what it should be, by the hour; which hours are office hours."""
    models, truth = twin(seed, noise)
    fit, extra = robbed(models.fit({}, [{}]))
    found = missing_heat(fit, models.judged)
    begins = fit.built.inputs.stamps - pd.Timedelta(seconds=fit.built.inputs.step)

    def hourly(values: FloatArray) -> FloatArray:
        means = pd.DataFrame(values, index=begins).resample("1h").mean().reindex(found.watts.index)
        return means.to_numpy()

    return found, hourly(extra + truth.disturbance), hourly(extra)[:, ZONE] > 0.99 * EXTRA


def inside(found: Missing, wanted: FloatArray, level: float) -> FloatArray:
    low, high = (edge.to_numpy() for edge in found.band(level))
    return np.asarray(((low < wanted) & (wanted < high)).mean(axis=0))


@pytest.mark.parametrize(("seed", "noise"), [(3, 0.05), (5, 0.05), (5, 0.005)])
def test_heat_that_no_meter_knows_of_is_found(seed: int, noise: float) -> None:
    found, wanted, office = estimated(seed, noise)
    watts = found.watts.to_numpy()
    assert 20 < office.sum() < 60
    contrast = watts[office, ZONE].mean() - watts[~office, ZONE].mean()
    true = wanted[office, ZONE].mean() - wanted[~office, ZONE].mean()
    assert true == pytest.approx(EXTRA, rel=0.05)
    assert contrast == pytest.approx(true, rel=0.05)
    elsewhere = np.delete(watts - wanted, ZONE, axis=1)
    assert np.abs(elsewhere.mean(axis=0)).max() < 0.05 * EXTRA


def test_band_covers_it_at_its_rate() -> None:
    """Pooled over twins with fitted parameters, whose covariance is on the wide side; see the next for noise alone."""
    rates = [inside(*estimated(seed, noise)[:2], 0.9) for seed, noise in ((3, 0.05), (5, 0.05), (5, 0.005))]
    assert np.mean(rates) > 0.9 and np.min(rates) > 0.85
    half = [inside(*estimated(seed, noise)[:2], 0.5) for seed, noise in ((3, 0.05), (5, 0.05), (5, 0.005))]
    assert 0.4 < np.mean(half) < 0.7


def test_at_the_truth_noise_is_all_that_is_unknown() -> None:
    models, truth = twin(5, 0.05)
    fit, _ = robbed(models.fit({}, [{}]))
    theta = np.array([truth.values[p.name] for p in fit.built.network.parameters])
    point = np.array([p.transform(v) for p, v in zip(fit.problem.parameters, theta, strict=True)])
    known = replace(fit, model=reduced_model(fit.built.grid, [theta]), found=replace(fit.found, point=point))
    found = missing_heat(known, models.judged, fixed=True)
    _, wanted, _ = estimated(5, 0.05)
    assert inside(found, wanted, 0.9).mean() == pytest.approx(0.9, abs=0.05)
    wide = missing_heat(known, models.judged)
    assert (wide.deviation.to_numpy() > found.deviation.to_numpy()).all()
    pd.testing.assert_frame_equal(wide.watts, found.watts)


def test_it_is_the_heat_that_the_temperatures_ask_for_and_nearer_the_truth() -> None:
    """The balance takes the mean temperature of a step for that of its end, the smoother does not."""
    models, _ = twin(5, 0.005)
    fit, _ = robbed(models.fit({}, [{}]))
    found, wanted, _ = estimated(5, 0.005)
    asked = heat_balance(fit.model, fit.theta, fit.built.inputs, models.judged)
    np.testing.assert_array_equal(found.watts.index, asked.stamps)
    balance, watts = asked.needed - asked.metered, found.watts.to_numpy()
    np.testing.assert_allclose(watts.mean(axis=0), balance.mean(axis=0), atol=0.02 * EXTRA)
    assert np.sqrt(np.mean((watts - wanted) ** 2)) < 0.5 * np.sqrt(np.mean((balance - wanted) ** 2))


def test_more_is_missing_where_parameters_are_at_their_start() -> None:
    models, _ = twin(5, 0.05)
    fit = models.fit({}, [{}])
    start = at_start(fit)
    np.testing.assert_allclose(start.theta, [p.start for p in fit.built.network.parameters])
    before, after = missing_heat(start, models.judged, fixed=True), missing_heat(fit, models.judged)
    assert before.rms.mean() > 1.5 * after.rms.mean()


def test_hours_without_telemetry_are_not_known() -> None:
    models, _ = twin(5, 0.05)
    fit = models.fit({}, [{}])
    inputs = fit.built.inputs
    zone = inputs.zone.copy()
    at = int(inputs.stamps.searchsorted(models.judged[0].start)) + 100
    zone[at, 2] = np.nan
    holed = replace(fit, built=replace(fit.built, inputs=replace(inputs, zone=zone)))
    found = missing_heat(holed, models.judged)
    gone = found.watts.isna()
    pd.testing.assert_frame_equal(gone, found.deviation.isna())
    assert 1 <= gone.iloc[:, 2].sum() <= 2 and not gone.drop(columns=gone.columns[2]).any(axis=None)


def test_many_zones_are_smoothed_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    found, _, _ = estimated(5, 0.05)
    models, _ = twin(5, 0.05)
    monkeypatch.setattr(_missing, "_MANY_ZONES", 3)
    monkeypatch.setattr(_missing, "_TUNED_MANY", 3 * 86400.0)
    monkeypatch.setattr(_missing, "_ORDER", 20)
    many = missing_heat(robbed(models.fit({}, [{}]))[0], models.judged)
    assert np.nanmean(np.abs(many.watts.to_numpy() - found.watts.to_numpy())) < 0.05 * EXTRA


def test_strengths_at_the_end_of_their_range_have_a_band_too() -> None:
    """A building without leakage: beyond its end of the range the strength would be a negative conductance."""
    models, _ = twin(5, 0.05)
    fit = models.fit({"infiltration": ()}, [{}])
    names = [p.name for p in fit.problem.parameters]
    point = fit.found.point.copy()
    point[[k for k, name in enumerate(names) if name.startswith("infiltration")]] = 0.0
    found = missing_heat(replace(fit, found=replace(fit.found, point=point)), models.judged)
    deviation = found.deviation.to_numpy()
    assert np.isfinite(deviation).any() and np.nanmin(deviation) > 0.0
