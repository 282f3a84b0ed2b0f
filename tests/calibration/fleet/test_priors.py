"""Population of a fleet: recovered from what noisy buildings say, robust, written, read, and used as a prior."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calibration import CalibrationSettings, calibrate
from calibration.errors import CalibrationError
from calibration.evaluation.population import Population, population_from, read_population
from calibration.fit.problem import tuning_problem
from calibration.fit.told import told_by
from calibration.fleet.job import parameter_rows
from calibration.fleet.priors import Member, learn_population, member
from calibration.results import to_json
from thermal import load_case

NAMES = ("a", "b", "c")
MEAN = np.array([0.5, -0.3, 0.1])
COVARIANCE = np.array([[0.09, 0.03, 0.0], [0.03, 0.04, 0.0], [0.0, 0.0, 0.01]])
RANGES = dict.fromkeys(NAMES, 0.7)


def simulated(count: int, seed: int = 0, rank: int = 3) -> tuple[list[Member], np.ndarray]:
    """Buildings of a known population, and their data's estimates; each tells `rank` directions of its own."""
    rng = np.random.default_rng(seed)
    members, estimates = [], []
    for number in range(count):
        u = rng.multivariate_normal(MEAN, COVARIANCE)
        jacobian = rng.standard_normal((rank, 3)) * np.array([4.0, 4.0, 8.0])
        information = jacobian.T @ jacobian
        pull = information @ u + jacobian.T @ rng.standard_normal(rank)
        members.append(Member(f"office {number}", NAMES, information, pull))
        estimates.append(np.linalg.pinv(information) @ pull)
    return members, np.array(estimates)


@pytest.mark.parametrize("rank", [3, 2])
def test_a_known_population_is_recovered(rank: int) -> None:
    """Within what 600 noisy buildings can say, although no building, or none alone, knows its parameters well."""
    members, estimates = simulated(600, rank=rank)
    found = learn_population(members, RANGES)
    assert found.names == NAMES
    np.testing.assert_allclose(found.mean, MEAN, atol=0.05)
    np.testing.assert_allclose(found.covariance, COVARIANCE, atol=0.02)
    naive = np.cov(estimates.T)  # the buildings' own errors are in it
    assert np.abs(naive - COVARIANCE).max() > 4.0 * np.abs(found.covariance - COVARIANCE).max()


def test_exact_buildings_give_their_own_mean_and_spread() -> None:
    """Of buildings that know their parameters the answer is that of a textbook, with one building of the ranges."""
    points = np.random.default_rng(1).multivariate_normal(MEAN, COVARIANCE, 40)
    exact = 1e10 * np.eye(3)
    found = learn_population([Member(f"{i}", NAMES, exact, exact @ p) for i, p in enumerate(points)], RANGES)
    w = found.weights
    mean = np.average(points, axis=0, weights=w)
    seen = np.einsum("b,bi,bj->ij", w, points - mean, points - mean)
    spread = (0.49 * np.eye(3) + seen) / (1.0 + w.sum())
    np.testing.assert_allclose(found.mean, mean, atol=5e-3)  # the ranges know a little of the mean too
    unknown = np.linalg.inv(w.sum() * np.linalg.inv(spread) + np.eye(3) / 0.49)
    np.testing.assert_allclose(found.covariance, spread + unknown, rtol=0.02, atol=1e-3)


def test_buildings_unlike_the_others_count_less() -> None:
    members, _ = simulated(60, seed=2)
    far = [Member(f"barn {i}", NAMES, m.information, m.pull + m.information @ np.full(3, 5.0)) for i, m in enumerate(members[:4])]
    clean, mixed = learn_population(members, RANGES), learn_population([*members, *far], RANGES)
    assert mixed.weights[-4:].max() < 0.2 < np.median(mixed.weights[:60])
    assert np.abs(mixed.mean - clean.mean).max() < 0.1  # a plain mean would move by 0.3
    np.testing.assert_allclose(np.diag(mixed.covariance), np.diag(clean.covariance), atol=0.1)


def film_and_wall(seed: int) -> Member:
    """What the measured resistance of a wall says of it and of its film, of a twentieth, where its fit has ended."""
    rng = np.random.default_rng(seed)
    film, wall = rng.normal([-0.5, 0.5], 0.2)
    measured = np.log(0.05 * np.exp(film) + np.exp(wall)) + rng.normal(0.0, 0.01)
    point = np.zeros(2)
    for _ in range(20):
        parts = np.array([0.05, 1.0]) * np.exp(point)
        slope = parts / parts.sum() / 0.01
        off = (measured - np.log(parts.sum())) / 0.01
        point = np.linalg.solve(np.outer(slope, slope) + np.eye(2) / 0.49, slope * (off + slope @ point))
    return Member(f"office {seed}", ("film", "wall"), np.outer(slope, slope), slope * (off + slope @ point))


def test_many_that_know_nothing_are_not_sure_of_it_together() -> None:
    """A slope that differs a little from one estimate to the next would tell of films far outside of their range."""
    members, ranges = [film_and_wall(seed) for seed in range(800)], {"film": 0.7, "wall": 0.7}
    few, many = learn_population(members[:50], ranges), learn_population(members, ranges)
    assert many.mean == pytest.approx([0.0, 0.5], abs=0.1) and few.mean == pytest.approx(many.mean, abs=0.1)
    assert np.sqrt(np.diag(many.covariance)) == pytest.approx([0.7, 0.2], abs=0.05)
    together = np.linalg.pinv(sum(m.information for m in members)) @ sum(m.pull for m in members)
    assert abs(together[0]) > 1.4  # what all of them say as one: two ranges away


def test_a_fleet_that_says_nothing_leaves_the_ranges() -> None:
    silent = [Member(f"{i}", NAMES, np.zeros((3, 3)), np.zeros(3)) for i in range(3)]
    found = learn_population(silent, RANGES)
    np.testing.assert_allclose(found.covariance, 0.49 * np.eye(3))
    assert not found.mean.any() and found.weights.tolist() == [1.0, 1.0, 1.0]


def test_what_few_buildings_have_is_learned_from_these() -> None:
    """A parameter that one building in forty has is as well known as that building tells it."""
    members, _ = simulated(80, seed=3)
    points = (0.4, 0.5)
    rare = [Member(f"pool {x}", ("pool",), np.array([[1e4]]), np.array([1e4 * x])) for x in points]
    found = learn_population([*members, *rare], RANGES | {"pool": 0.7})
    at = found.names.index("pool")
    assert found.mean[at] == pytest.approx(np.mean(points), abs=0.15) and found.covariance[at, at] < 0.35


def test_members_of_a_group_say_what_they_have_in_common() -> None:
    """Of facades whose values are exact, their mean is known as far as they spread."""
    rows = [{"base": "wall", "information": [1e9 * (i == j) for j in range(4)], "pull": 1e9 * x, "own_deviation": 0.2}
            for i, x in enumerate((0.1, 0.3, 0.2, 0.4))]  # fmt: skip
    found = member("office", rows)
    assert found is not None and found.names == ("wall",)
    np.testing.assert_allclose(found.information, [[4 / 0.2**2]], rtol=1e-5)
    np.testing.assert_allclose(found.pull / found.information[0], [0.25], rtol=1e-5)
    assert member("office", [{"base": "wall", "information": None}]) is None


@pytest.fixture(scope="module")
def office(cases: Path) -> Any:
    return load_case(cases / "office 0")


def test_a_population_is_a_prior(office: Any) -> None:
    """What the data say is the same under either prior, and a narrow population is where the estimate ends."""
    settings = {"horizon": "1h", "starts": 1}
    result = calibrate(office, settings=settings)
    told = result.told
    assert told is not None
    free = [p.name for p in result.parameters if p.standard_error is not None]
    assert list(told.names) == free
    rows = {r["name"]: r for r in parameter_rows(result)}
    assert rows[free[0]]["information"] == told.information[0].tolist()
    values = [p.value / p.start for p in result.parameters if p.name in free]
    logs = [i for i, p in enumerate(result.information.estimated) if p.scale == "log"]
    np.testing.assert_allclose(told.point[logs], np.log(values)[logs], atol=1e-9)

    names, count = tuple(told.names), len(told.names)
    shift = 0.2 * told.prior_deviation
    narrow = Population(names, shift, 1e-8 * np.eye(count), ("x", "y"), np.ones(2))
    there = calibrate(office, settings=settings | {"population": narrow})
    assert there.told is not None
    np.testing.assert_allclose(there.told.point, shift, atol=1e-3)
    wide = Population(names, np.zeros(count), np.diag(told.prior_deviation**2), ("x", "y"), np.ones(2))
    same = calibrate(office, settings=settings | {"population": wide})
    np.testing.assert_allclose(same.theta, result.theta, rtol=1e-9)


def test_only_what_it_knows_is_replaced(office: Any) -> None:
    plain = tuning_problem(office)
    one = plain.parameters[2]
    known = Population((one.name,), np.array([0.3]), np.array([[0.04]]), ("x", "y"), np.ones(2))
    changed = tuning_problem(office, settings=CalibrationSettings(population=known))
    moved = changed.centre - plain.centre
    assert moved[2] == pytest.approx(0.3) and np.count_nonzero(moved) == 1
    before, after = plain.prior_covariance(), changed.prior_covariance()
    assert after[2, 2] == pytest.approx(0.04) and changed.prior_deviations[2] == pytest.approx(0.2)
    rest = np.arange(len(before)) != 2
    np.testing.assert_array_equal(after[np.ix_(rest, rest)], before[np.ix_(rest, rest)])


def test_what_the_data_say_is_apart_from_the_prior(office: Any) -> None:
    """At an optimum inside of its bounds pull is ``I u + Λ u``, whose gradients cancel: (J'J + Λ) u."""
    from calibration.fit.fitted_case import fit_case

    best = fit_case(office, (), (), CalibrationSettings(horizon="1h", starts=1)).best
    told, problem = told_by(best), best.problem
    precision = np.linalg.inv(problem.prior_covariance())
    gradient = told.information @ told.point - told.pull + precision @ told.point
    scale = np.sqrt(np.diag(told.information + precision))
    lower, upper = problem.bounds
    inside = (best.point > lower + 1e-3) & (best.point < upper - 1e-3)
    assert inside.sum() >= 10
    assert np.abs(gradient / scale)[inside].max() < 0.2  # of a standard error, where rounds end


def test_files(tmp_path: Path) -> None:
    found = learn_population(simulated(20)[0], RANGES)
    (tmp_path / "p.json").write_text(to_json(found.to_dict()), encoding="utf-8")
    read = read_population(tmp_path / "p.json")
    assert (read.names, read.members) == (found.names, found.members)
    np.testing.assert_allclose(read.covariance, found.covariance, rtol=1e-12)
    for content, message in (
        ("{", "expected JSON"),
        ("{}", "expected a population as"),
        (json.dumps({**found.to_dict(), "mean": [0.0]}), "positive definite covariance of 3 names"),
        (json.dumps({**found.to_dict(), "mean": None, "names": 3}), "expected names, mean"),
    ):
        (tmp_path / "bad.json").write_text(content, encoding="utf-8")
        with pytest.raises(CalibrationError, match=message):
            read_population(tmp_path / "bad.json")
    with pytest.raises(CalibrationError, match="cannot read"):
        read_population(tmp_path / "nowhere.json")
    with pytest.raises(CalibrationError, match="at least two calibrated buildings"):
        learn_population(simulated(1)[0], RANGES)
    with pytest.raises(CalibrationError, match="expected a population"):
        population_from([])
