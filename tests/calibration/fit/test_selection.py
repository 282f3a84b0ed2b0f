"""Choice of a structure: likelihood ratio and evidence in closed form, the bootstrap over days, and the verdicts."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2, multivariate_normal

from calibration import CalibrationError, Interval, select_structure
from calibration.evaluation.settings import CalibrationSettings, ModelSettings
from calibration.fit import selection as module
from calibration.fit.selection import Candidate, _day_bootstrap, _likelihood_ratio, _nested, compare_candidates
from calibration.identifiability.information import InformationSearch
from mpc.reports.identifiability import selection_verdict
from thermal import Structure, load_bundled_case

FloatArray = NDArray[np.float64]

BARE, FULL = Structure(furniture=False, slab_nodes=0), Structure()


def runs(days: int, error: float, noise: float = 0.0, seed: int = 0) -> pd.Series[float]:
    """Hourly errors; the noise is that of a day."""
    rng = np.random.default_rng(seed)
    stamps = pd.date_range("2023-03-01T01:00", periods=24 * days, freq="h", tz="Etc/GMT+5")
    found: pd.Series[float] = pd.Series(error + np.repeat(noise * rng.standard_normal(days), 24), index=stamps)
    return found


def candidate(name: str, errors: pd.Series[float], **given: Any) -> Candidate:
    values: dict[str, Any] = {
        "settings": ModelSettings(), "parameters": 10, "tuning_error": 0.3, "information": np.zeros(10),
        "prior_cost": 0.0, "success": True, "effective_size": 60.0, "residuals": 3000,
    }  # fmt: skip
    return Candidate(name=name, errors=errors, held_out_mae=float(errors.mean()), **{**values, **given})


def test_clearly_less_error_on_days_held_out_decides() -> None:
    small = candidate("bare", runs(12, 0.35, 0.02, 1), prior_cost=-100.0)
    large = candidate("with interior mass", runs(12, 0.25, 0.02, 2))
    found = compare_candidates([small, large])
    assert found.preferred == "with interior mass"
    (difference,) = found.differences
    assert (difference.first, difference.second, difference.days) == ("bare", "with interior mass", 12)
    assert 0.07 < difference.lower < difference.mae < difference.upper < 0.13
    assert selection_verdict(found).startswith(
        "The structure with interior mass is preferred. Against bare speak the days held out, by 0.1"
    )
    assert selection_verdict(found).endswith("(12 days held out, 60 effective observations tuned on.)")


def test_nested_structures_fall_back_on_the_likelihood_ratio() -> None:
    small = candidate(
        "bare", runs(10, 0.30, 0.1, 1), settings=ModelSettings(structure=BARE), parameters=9, tuning_error=0.35
    )
    large = candidate("full", runs(10, 0.29, 0.1, 2), parameters=13, tuning_error=0.28)
    found = compare_candidates([small, large])
    assert found.preferred == "full"
    (ratio,) = found.ratios
    assert ratio.statistic == pytest.approx(60.0 * np.log(0.35**2 / 0.28**2))
    assert (ratio.small, ratio.large, ratio.degrees) == ("bare", "full", 4)
    assert ratio.p_value == pytest.approx(chi2.sf(ratio.statistic, 4))
    assert selection_verdict(found) == (
        "The structure full is preferred. Against bare speak the tuning data, by a likelihood ratio of 26.8 for the 4 "
        f"more parameters of full (p = {ratio.p_value:.2g}). (10 days held out, 60 effective observations tuned on.)"
    )


def test_what_neither_tells_is_said() -> None:
    small = candidate("bare", runs(10, 0.30, 0.1, 1), settings=ModelSettings(structure=BARE), parameters=9)
    large = candidate("full", runs(10, 0.29, 0.1, 2), parameters=13, tuning_error=0.299, prior_cost=8.0)
    found = compare_candidates([small, large])
    assert found.preferred is None
    assert selection_verdict(found).startswith(
        "Cannot tell bare and full apart, by 10 days held out or by the tuning data: the simplest of them, bare, is enough."
    )


def test_a_larger_structure_with_a_larger_error_is_not_preferred() -> None:
    small = candidate("bare", runs(10, 0.3, 0.1, 1), settings=ModelSettings(structure=BARE), parameters=9)
    large = candidate("full", runs(10, 0.3, 0.1, 2), parameters=13, tuning_error=0.31)
    ratio = _likelihood_ratio(small, large, 60.0)
    assert ratio.statistic < 0.0
    assert ratio.p_value == 1.0
    assert compare_candidates([small, large]).preferred is None


def test_others_fall_back_on_the_evidence() -> None:
    one = candidate("one node", runs(10, 0.3, 0.1, 1), settings=ModelSettings(structure=Structure(wall_nodes=1)))
    two = candidate(
        "three nodes",
        runs(10, 0.31, 0.1, 2),
        settings=ModelSettings(structure=Structure(wall_nodes=3)),
        prior_cost=-7.0,
    )
    found = compare_candidates([one, two])
    assert found.ratios == ()
    assert found.preferred == "three nodes"
    assert (
        "Against one node speak the tuning data, by a log evidence 3.5 below that of three nodes."
        in selection_verdict(found)
    )
    assert compare_candidates([one, candidate("b", runs(10, 0.31, 0.1, 2), prior_cost=-4.0)]).preferred is None


def test_few_days_tell_nothing() -> None:
    found = compare_candidates([candidate("a", runs(3, 0.2)), candidate("b", runs(3, 0.9))])
    assert np.isnan(found.differences[0].lower)
    assert (
        "Cannot tell a and b apart, by 3 days held out, which is too few, or by the tuning data"
        in selection_verdict(found)
    )


def test_a_difference_too_small_to_matter_does_not_decide() -> None:
    same = runs(10, 0.3, 0.1, 1)
    found = compare_candidates([candidate("a", same), candidate("b", same + 0.005)])
    assert found.differences[0].lower > 0.0
    assert not found.differences[0].told
    assert found.preferred is None


def test_three_candidates_of_which_one_is_out() -> None:
    parts = [runs(10, 0.30, 0.1, 1), runs(10, 0.29, 0.1, 2), runs(10, 0.9, 0.1, 3)]
    found = compare_candidates([candidate(n, e) for n, e in zip("abc", parts, strict=True)])
    assert [d.told for d in found.differences if d.first == "c"] == [True]
    assert found.preferred is None
    assert selection_verdict(found).startswith("Cannot tell a and b apart")
    assert "Against c speak the days held out" in selection_verdict(found)


def test_two_that_are_alike_leave_the_third_out() -> None:
    """Two of three are told apart from the third by the tuning data, though not from each other."""
    errors = [runs(3, e) for e in (0.3, 0.2, 0.2)]
    parts = [candidate(n, e, prior_cost=v) for n, e, v in zip("abc", errors, (35.2, 12.0, 12.2), strict=True)]
    found = compare_candidates(parts)
    assert selection_verdict(found).startswith("Cannot tell b and c apart")
    assert "Against a speak the tuning data, by a log evidence 11.6 below that of b." in selection_verdict(found)


def test_nested_means_with_something_left_out() -> None:
    def of(parameters: int, **given: Any) -> Candidate:
        return candidate("x", runs(5, 0.1), settings=ModelSettings(**given), parameters=parameters)

    full = of(13)
    assert _nested(of(9, structure=BARE), full)
    assert _nested(of(11, structure=Structure(furniture=False)), full)
    assert _nested(of(12), full)  # some parameters fixed
    assert not _nested(full, of(9, structure=BARE))
    assert not _nested(of(11, structure=Structure(radiant=False)), full)
    assert not _nested(of(9, structure=Structure(furniture=False, wall_nodes=3)), full)
    assert not _nested(of(9, dx=1.0), full)
    zoned = of(17, scopes={"slab_coupling": "zone"})
    assert _nested(full, zoned)
    assert not _nested(of(14, scopes={"window_u_value": "facade"}), zoned)


def test_evidence_of_a_linear_problem_is_exact() -> None:
    """Of y = A z + e with prior z ~ N(c, S) and e ~ N(0, σ²): the density of y, at its own maximum."""
    rng = np.random.default_rng(4)
    n, sigma = 12, 0.4
    a, centre, spread = rng.standard_normal((n, 3)), rng.standard_normal(3), np.array([0.5, 1.0, 2.0])
    y = a @ (centre + spread * rng.standard_normal(3)) + sigma * rng.standard_normal(n)
    exact = multivariate_normal(a @ centre, sigma**2 * np.eye(n) + a @ np.diag(spread**2) @ a.T).logpdf(y)
    data, prior = a / sigma, np.diag(1.0 / spread**2)
    z = np.linalg.solve(data.T @ data + prior, data.T @ y / sigma + prior @ centre)
    residual, away = (a @ z - y) / sigma, (z - centre) / spread
    values = InformationSearch(data.T @ data / n, prior).values
    one = candidate("a", runs(5, 0.1), tuning_error=sigma, information=values, prior_cost=float(away @ away))
    # it takes σ to be the root mean square of the residuals: their sum of squares is n
    found = one.log_evidence(n) - 0.5 * n * np.log(2.0 * np.pi) + 0.5 * (n - residual @ residual)
    assert found == pytest.approx(exact, rel=1e-9)


def test_the_least_number_of_observations_counts_for_all() -> None:
    small = candidate(
        "bare", runs(10, 0.3, 0.1, 1), settings=ModelSettings(structure=BARE), parameters=9, tuning_error=0.31
    )
    large = candidate("full", runs(10, 0.3, 0.1, 2), parameters=13, effective_size=20.0)
    found = compare_candidates([small, large])
    assert found.effective_size == 20.0
    assert found.ratios[0].statistic == pytest.approx(20.0 * np.log(0.31**2 / 0.3**2))


def test_bootstrap_covers_the_mean_of_independent_and_of_correlated_days() -> None:
    """90 % intervals over simulated sets of 14 days; days that go together by 0.3 cost some coverage."""
    rng = np.random.default_rng(5)
    counts = np.full(14, 24.0)
    for correlation, least in ((0.0, 0.85), (0.3, 0.75)):
        inside, trials = 0, 150
        for k in range(trials):
            noise = rng.standard_normal(64)
            for i in range(1, 64):
                noise[i] = correlation * noise[i - 1] + np.sqrt(1.0 - correlation**2) * noise[i]
            lower, upper = _day_bootstrap(24.0 * noise[50:], counts, seed=k)
            inside += lower < 0.0 < upper
        assert least < inside / trials < 0.98


def test_bootstrap_is_seeded_and_weighs_days_by_their_runs() -> None:
    rng = np.random.default_rng(6)
    means, counts = rng.standard_normal(9), np.array([24.0] * 8 + [1e-9])
    one, other = (_day_bootstrap(means * counts, counts, seed) for seed in (0, 1))
    assert one == _day_bootstrap(means * counts, counts, 0)
    assert one != other
    assert all(np.isnan(_day_bootstrap(means[:4], counts[:4])))


def fake_calibrate(case: Any, tune: Any, hold_out: Any, settings: CalibrationSettings) -> SimpleNamespace:
    """The start of the model instead of a fit."""
    chosen = settings.model
    network = chosen.network(case.building)
    judged = runs(8, 0.3 if chosen.structure == BARE else 0.2, 0.01, 1)
    prediction = SimpleNamespace(
        error=judged.to_numpy()[:, None], start=pd.DatetimeIndex(judged.index) - pd.Timedelta(hours=6)
    )
    held_out = SimpleNamespace(
        steps=72, step_seconds=300.0, predictions=(prediction,), metrics=SimpleNamespace(mae=float(judged.mean()))
    )
    return SimpleNamespace(
        theta=network.start(), settings=chosen, tuning=(), horizon="6h", calibrated={"held_out": held_out},
        solver=SimpleNamespace(success=True, status="Solve_Succeeded"), disturbance=None, excess=1.0,
    )  # fmt: skip


def test_each_structure_is_calibrated_and_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "calibrate", fake_calibrate)
    told: list[Any] = []
    structures = {"bare": BARE, "full": {"structure": FULL}}
    with ThreadPoolExecutor(2) as pool:
        found = select_structure(
            load_bundled_case(), structures, settings={"dx": 1.5}, executor=pool, progress=lambda *a: told.append(a)
        )
    assert told == [("select", 1, 2), ("select", 2, 2)]
    assert found.preferred == "full"
    bare, full = found.candidates
    assert (bare.name, bare.parameters, full.parameters) == ("bare", 9, 13)
    assert bare.effective_size == full.effective_size == found.effective_size
    assert bare.residuals == full.residuals
    assert found.ratios[0].degrees == 4
    content = json.loads(json.dumps(found.to_dict()))
    assert content["candidates"]["bare"]["settings"]["structure"]["furniture"] is False
    assert content["preferred"] == "full"


def test_what_cannot_be_compared_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    case = load_bundled_case()
    with pytest.raises(CalibrationError, match="expected at least two to choose from, found \\['bare'\\]"):
        select_structure(case, {"bare": BARE})
    with pytest.raises(CalibrationError, match="calibrate takes no 'scope'; the nearest valid one is 'scopes'"):
        select_structure(case, {"bare": BARE, "zoned": {"scope": {}}})
    with pytest.raises(CalibrationError, match="'hold_out' is the same for all"):
        select_structure(case, {"a": BARE, "b": {"hold_out": []}})

    def longer(*args: Any, settings: CalibrationSettings) -> SimpleNamespace:
        found = fake_calibrate(*args, settings=settings)
        if settings.horizon != "6h":
            found.calibrated["held_out"].predictions[0].start += pd.Timedelta(hours=1)
        return found

    monkeypatch.setattr(module, "calibrate", longer)
    with pytest.raises(CalibrationError, match="'a' and 'b' are not judged on the same runs"):
        select_structure(case, {"a": BARE, "b": {"horizon": "360min"}}, settings={"dx": 1.5})


@pytest.mark.long
def test_a_real_case_with_and_without_interior_mass() -> None:
    case = load_bundled_case()
    tune, hold_out = ([Interval(case.stamps[288 * a], case.stamps[288 * b])] for a, b in ((0, 2), (3, 4)))
    structures = {"bare": BARE, "full": FULL}
    found = select_structure(case, structures, tune, hold_out, {"dx": 1.5, "starts": 1})
    assert [c.success for c in found.candidates] == [True, True]
    (ratio,) = found.ratios
    assert (ratio.small, ratio.large, ratio.degrees) == ("bare", "full", 4)
    assert 0.0 < found.effective_size <= 5.0  # five zones on the day that two days leave after their spin-up
    assert found.candidates[0].tuning_error > found.candidates[1].tuning_error
    assert selection_verdict(found).startswith("Cannot tell bare and full apart, by 1 day held out, which is too few,")
