"""Intervals of savings hold the known saving at the stated rate, whatever the days remember."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from mpc.errors import VerificationError
from mpc.verification import before_after as periods
from mpc.verification import switchback as alternation
from mpc.verification.before_after import before_after
from mpc.verification.inference import lag_one, mean_estimate, sum_error
from mpc.verification.switchback import switchback

MakeDays = Callable[..., pd.DataFrame]


@pytest.mark.parametrize(("rho", "n"), [(0.0, 40), (0.6, 120)])
def test_the_error_of_a_mean_is_that_of_its_scatter(rho: float, n: int) -> None:
    rng, inside, errors, means = np.random.default_rng(1), 0, [], []
    for _ in range(400):
        x = rng.normal(size=n)
        for k in range(1, n):
            x[k] = rho * x[k - 1] + np.sqrt(1.0 - rho**2) * x[k]
        found = mean_estimate(x)
        low, high = found.interval(0.9)
        inside += low <= 0.0 <= high
        errors.append(found.error**2)
        means.append(found.value)
    exact = (1.0 + rho) / (1.0 - rho) / n  # variance of the mean of an AR(1) process, leading term
    assert np.mean(errors) == pytest.approx(exact, rel=0.2) and np.var(means) == pytest.approx(exact, rel=0.2)
    assert 0.86 <= inside / 400 <= 0.94  # three standard deviations about 0.9


def test_error_of_white_days_and_their_correlation() -> None:
    rng = np.random.default_rng(0)
    parts = rng.normal(size=20_000)
    assert sum_error(parts)[0] == pytest.approx(np.sqrt(20_000.0), rel=0.1)
    assert lag_one(parts) == pytest.approx(0.0, abs=0.03)
    walk = np.convolve(parts, 0.7 ** np.arange(60))[: len(parts)]
    assert lag_one(walk) == pytest.approx(0.7, abs=0.03)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out what intervals do not need: fits to held-out parts and permutations."""
    for module in (alternation, periods):
        judge = module.judge_baseline
        monkeypatch.setattr(module, "judge_baseline", lambda *a, judge=judge: judge(*a, hold_out=False))
    monkeypatch.setattr(alternation, "_SHUFFLES", 9)


# Of 60 repeats at 90 %, 54 are expected, with a standard deviation of 2.3.
@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("kind", "carry"), [("alternate", 0.0), ("pairs", 0.0), ("random", 0.04)])
def test_intervals_of_alternate_days_hold_the_saving(make_days: MakeDays, kind: str, carry: float) -> None:
    truth, inside, told = 35e3 * (0.1 + carry), 0, set()
    for seed in range(60):
        found = switchback(make_days(seed, kind, carry=carry))
        low, high = found.saving.interval(0.9)
        inside += low <= truth <= high
        told.add(found.carried is not None)
    assert 48 <= inside, inside
    assert told == {kind != "alternate"}


@pytest.mark.usefixtures("quick")
def test_intervals_against_a_baseline_hold_the_saving(make_days: MakeDays) -> None:
    truth, inside = 35e3 * 86400.0 * 0.1 * 60, 0
    for seed in range(40):
        days = make_days(seed, np.repeat([0.0, 1.0], [120, 60]), n=180)
        low, high = before_after(days[:120], days[120:]).saving.interval(0.9)
        inside += low <= truth <= high
    assert 31 <= inside <= 40, inside  # 36 expected, standard deviation 1.9


def test_exact_days_are_told_exactly(make_days: MakeDays) -> None:
    index = pd.date_range("2026-01-05", periods=60, tz="UTC")
    outdoor = 273.15 + 12.0 * np.sin(np.arange(60.0)) + 8.0
    acts = np.arange(60) // 2 % 2 * 1.0
    power = 5000.0 + 800.0 * np.maximum(np.percentile(outdoor, 50.0) - outdoor, 0.0) - 700.0 * acts
    days = pd.DataFrame({"power": power, "outdoor": outdoor, "weekend": 0.0, "acts": acts}, index=index)
    found = switchback(days)
    assert found.saving.value == pytest.approx(700.0, abs=60.0)
    assert found.model.form in ("heating", "heating and cooling")
    one = days.assign(power=power + 700.0 * acts)
    saved = before_after(one[:40], one[40:].assign(power=one["power"][40:] - 500.0))
    assert saved.saving.value == pytest.approx(500.0 * 86400.0 * 20, rel=0.05)
    assert saved.share.value == pytest.approx(500.0 / one["power"][40:].mean(), rel=0.05)


def test_permutations_find_no_saving_where_there_is_none(make_days: MakeDays) -> None:
    p = [switchback(make_days(seed, "random", saving=0.0)).p_value for seed in range(8)]
    assert min(p) > 0.01 and np.median(p) > 0.15
    assert switchback(make_days(1, "random", saving=0.2)).p_value < 0.02


def test_too_few_days_are_refused(make_days: MakeDays) -> None:
    with pytest.raises(VerificationError, match="7 whole days of each control"):
        switchback(make_days(0, "pairs", n=12))
    days = make_days(0, "pairs")
    with pytest.raises(VerificationError, match="at least 14 days"):
        before_after(days[:10], days[10:])
    with pytest.raises(VerificationError, match="change-point"):
        before_after(days[:20], days[20:], "changepoint")
