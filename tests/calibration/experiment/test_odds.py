"""Expected odds against what draws of noise give."""

import numpy as np
import pytest

from calibration.experiment.odds import Separation, chance_of, expected_log_odds, needed


def test_expected_log_odds_are_the_mean_of_realised_ones() -> None:
    rng = np.random.default_rng(5)
    slopes, difference = rng.normal(size=(30, 4)), 0.5 * rng.normal(size=30)
    root = rng.normal(size=(4, 4))
    precision, deviation = root @ root.T + np.eye(4), 0.7
    # two linear models with the same unknown parameters: errors have this covariance under both
    covariance = deviation**2 * np.eye(30) + slopes @ np.linalg.solve(precision, slopes.T)
    expected = expected_log_odds(difference, slopes, precision, 1.0 / deviation)
    drawn = rng.multivariate_normal(np.zeros(30), covariance, size=20000)
    inverse = np.linalg.inv(covariance)
    squared = [np.einsum("ni,ij,nj->n", y, inverse, y) for y in (drawn, drawn - difference)]
    realised = 0.5 * (squared[1] - squared[0])
    assert realised.mean() == pytest.approx(expected, rel=0.03)
    assert realised.var() == pytest.approx(2.0 * expected, rel=0.05)
    share = float(np.mean(realised > needed(2.0)))
    assert chance_of(expected, 2.0) == pytest.approx(share, abs=0.02)


def test_a_difference_that_parameters_can_follow_says_nothing() -> None:
    slopes = np.array([[1.0], [2.0], [-1.0]])
    loose, stiff = 1e-9 * np.eye(1), 1e9 * np.eye(1)
    assert expected_log_odds(slopes[:, 0], slopes, loose, 10.0) < 1e-6
    assert expected_log_odds(slopes[:, 0], slopes, stiff, 1.0) == pytest.approx(3.0, rel=1e-6)


def test_errors_of_unknown_size_say_less() -> None:
    one, none, eye = np.array([4.0]), np.zeros((1, 1)), np.eye(1)
    known, unknown = (expected_log_odds(one, none, eye, 1.0, n) for n in (np.inf, 20.0))
    assert known == pytest.approx(8.0) and unknown == pytest.approx(10.0 * np.log(1.8))


def test_the_chance_is_that_of_the_member_that_is_there() -> None:
    found = Separation({("a", "b"): 40.0, ("b", "a"): 0.0}, {})
    assert found.chance({"a": 0.9, "b": 0.1}) == pytest.approx(0.9, abs=1e-3)
    assert found.worth({"a": 0.5, "b": 0.5}, 12.0) == pytest.approx(6.0)
    assert chance_of(needed()) == pytest.approx(0.5) and chance_of(0.0) == 0.0
