"""What data determine: posterior and shares in closed form, exact null directions, and the words for them."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from calibration import Information, fisher_information
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.estimate import estimate
from calibration.fit.problem import tuning_problem
from calibration.identifiability.information import DETERMINED, information_of, split_jacobian
from mpc.reports.identifiability import (
    _precision_words,
    combination_words,
    information_content,
    information_sentences,
    listed,
)
from thermal import PARAMETERS, Parameter, load_bundled_case, reduced_model

FloatArray = NDArray[np.float64]

WALL, FILM, OUTSIDE = "exterior_wall_conductivity", "interior_film_coefficient", "exterior_convection_coefficient"
MASS, SLAB, SHUFFLE = "slab_heat_capacity", "slab_coupling", "shuffle_probability"


def alike(*names: str) -> list[Parameter]:
    """Parameters whose priors have a deviation of one on the estimation scale."""
    return [
        Parameter(n, "1", 0.5, p.inverse(-2.0), p.inverse(2.0), "", scale="logit")
        if (p := PARAMETERS[n]).scale == "logit"
        else Parameter(n, p.unit, 1.0, np.exp(-2.0), np.exp(2.0), "")
        for n in names
    ]


def informed(names: tuple[str, ...], jacobian: object, **kwargs: object) -> Information:
    return fisher_information(alike(*names), np.array(jacobian, dtype=float), np.eye(len(names)), **kwargs)  # type: ignore[arg-type]


def told_as(found: Information) -> list[str]:
    return [combination_words({p.name: p for p in found.estimated}, c.exponents) for c in found.combinations]


def exponents(found: Information) -> list[dict[str, float]]:
    return [dict(c.exponents) for c in found.combinations]


def test_posterior_is_that_of_a_linear_gaussian_problem() -> None:
    rng = np.random.default_rng(0)
    jacobian, spread = rng.standard_normal((40, 4)), np.array([0.3, 1.0, 2.0, 0.7])
    parameters = alike(WALL, FILM, MASS, SHUFFLE)
    found = fisher_information(parameters, jacobian, np.diag(spread**-2))
    wanted = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian + np.diag(spread**-2))))
    np.testing.assert_allclose([p.posterior_deviation for p in found.parameters], wanted, rtol=1e-12)
    np.testing.assert_allclose([p.prior_deviation for p in found.parameters], spread, rtol=1e-12)
    np.testing.assert_allclose([p.ratio for p in found.parameters], wanted / spread, rtol=1e-12)


def test_a_prior_that_joins_parameters_counts_as_it_is() -> None:
    """As of a group that is drawn towards a common value."""
    rng = np.random.default_rng(1)
    root, jacobian = rng.standard_normal((5, 3)), rng.standard_normal((9, 3))
    found = fisher_information(alike(WALL, FILM, MASS), jacobian, root.T @ root)
    prior, posterior = (np.linalg.inv(m) for m in (root.T @ root, root.T @ root + jacobian.T @ jacobian))
    wanted = np.sqrt(np.diag(posterior) / np.diag(prior))
    np.testing.assert_allclose([p.ratio for p in found.parameters], wanted, rtol=1e-10)
    shares = 1.0 - np.linalg.eigvals(posterior @ np.linalg.inv(prior)).real
    np.testing.assert_allclose([d.share for d in found.directions], np.sort(shares)[::-1], atol=1e-10)


def test_shares_are_what_the_data_explain_along_each_direction() -> None:
    """λ / (1 + λ), best first, along unit vectors."""
    found = informed((WALL, FILM, MASS), np.diag([2.0, 0.0, 0.5]))
    np.testing.assert_allclose([d.share for d in found.directions], [4.0 / 5.0, 0.25 / 1.25, 0.0], atol=1e-12)
    assert [max(d.components, key=lambda n: abs(d.components[n])) for d in found.directions] == [WALL, MASS, FILM]
    for d in found.directions:
        assert sum(v**2 for v in d.components.values()) == pytest.approx(1.0)


def test_precise_data_do_not_spoil_the_priors_of_the_rest() -> None:
    found = informed((WALL, FILM), [[1e6, 1e6]])
    assert told_as(found)[0] == "product exterior wall conductivity × interior film coefficient"
    assert [p.ratio for p in found.parameters] == pytest.approx([np.sqrt(0.5)] * 2, rel=1e-6)
    assert found.combinations[0].ratio == pytest.approx(1.0 / (1e6 * np.sqrt(2.0)), rel=1e-3)


def test_a_covariance_that_is_known_better_counts() -> None:
    wider = np.diag([0.09, 0.81])
    found = informed((WALL, FILM), np.diag([10.0, 10.0]), covariance=wider)
    assert [p.posterior_deviation for p in found.parameters] == pytest.approx([0.3, 0.9])
    assert [p.status for p in found.parameters] == ["determined", "not"]
    assert found.directions[0].share == pytest.approx(100.0 / 101.0)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ([30.0, 30.0], "product exterior wall conductivity × exterior convection coefficient"),
        ([30.0, -30.0], "ratio exterior wall conductivity / exterior convection coefficient"),
        ([-30.0, 30.0], "ratio exterior wall conductivity / exterior convection coefficient"),
        ([30.0, 15.0], "combination exterior wall conductivity × (exterior convection coefficient)^0.5"),
        ([15.0, -30.0], "combination (exterior wall conductivity)^-0.5 × exterior convection coefficient"),
    ],
)
def test_one_row_determines_a_product_of_powers(row: list[float], words: str) -> None:
    """What moves no prediction is perpendicular to the row; what is determined is the row."""
    found = informed((WALL, OUTSIDE), [row])
    assert told_as(found) == [words]
    e = np.array(list(found.combinations[0].exponents.values()))
    null = np.array([row[1], -row[0]])
    assert abs(e @ null) < 1e-9
    assert f"Only the {words} is determined" in " ".join(information_sentences(found))
    assert "determined" not in {p.status for p in found.parameters}


def test_the_precision_of_a_combination_is_its_own() -> None:
    found = informed((WALL, OUTSIDE), [[30.0, 30.0]])
    covariance = np.linalg.inv(np.full((2, 2), 900.0) + np.eye(2))
    assert found.combinations[0].deviation == pytest.approx(np.sqrt(covariance.sum()), rel=1e-9)
    assert "(to 3.3 %)" in " ".join(information_sentences(found))


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(0.7, 1.4), min_size=3, max_size=3),
    st.lists(st.sampled_from([-1.0, 1.0]), min_size=3, max_size=3),
)
def test_combinations_of_three_with_one_null_direction(sizes: list[float], signs: list[float]) -> None:
    """One direction of three is open: two combinations of two, perpendicular to it, tell all that is determined."""
    null = np.array(sizes) * np.array(signs)
    null /= np.linalg.norm(null)
    basis = np.linalg.svd(null[None])[2][1:]
    found = informed((WALL, FILM, MASS), 1e3 * basis)
    rows = np.array([[c.get(n, 0.0) for n in (WALL, FILM, MASS)] for c in exponents(found)])
    assert rows.shape == (2, 3)
    assert ((rows != 0.0).sum(axis=1) == 2).all()
    assert np.linalg.matrix_rank(rows) == 2
    away = np.abs(rows @ null) / np.linalg.norm(rows, axis=1)
    assert (away < 0.11).all()  # exponents within 0.15 of one are told as whole, others to two decimals
    assert all(c.ratio < DETERMINED for c in found.combinations)


def test_ratios_of_five_do_not_make_the_five_known() -> None:
    """Their common scale is open; that five priors pin it to 45 % is not what the data say."""
    names = (WALL, FILM, OUTSIDE, MASS, SLAB)
    found = informed(names, 100.0 * (np.eye(5) - 0.2))
    assert [p.ratio for p in found.parameters] == pytest.approx([np.sqrt(0.2)] * 5, rel=1e-3)
    assert {p.status for p in found.parameters} == {"through_priors"}
    assert len(found.combinations) == 4
    assert all(w.startswith("ratio") for w in told_as(found))


def test_combination_of_three_with_two_null_directions() -> None:
    found = informed((WALL, FILM, MASS), [[50.0, -25.0, 35.0]])
    assert exponents(found) == [{WALL: 1.0, FILM: -0.5, MASS: 0.7}]
    assert told_as(found)[0] == (
        "combination exterior wall conductivity × (interior film coefficient)^-0.5 × (slab heat capacity)^0.7"
    )


def test_combination_of_more_than_are_searched() -> None:
    """Six in one product: no four of them tell it, so the direction itself does, with as many members as it takes."""
    names = (WALL, FILM, OUTSIDE, MASS, SLAB, "furniture_coupling")
    found = informed(names, [[30.0] * 6])
    (only,) = exponents(found)
    assert 5 <= len(only) <= 6
    assert set(only.values()) == {1.0}
    assert found.combinations[0].ratio < DETERMINED


def test_null_directions_move_nothing() -> None:
    rng = np.random.default_rng(5)
    jacobian = rng.standard_normal((2, 4)) * 50.0
    found = informed((WALL, FILM, MASS, SLAB), jacobian)
    for d in found.directions[2:]:
        assert d.share == pytest.approx(0.0, abs=1e-9)
        assert np.abs(jacobian @ np.array(list(d.components.values()))).max() < 1e-6
    for c in found.combinations:
        a = np.array([c.exponents.get(n, 0.0) for n in (WALL, FILM, MASS, SLAB)])
        assert c.ratio < DETERMINED
        assert c.ratio == pytest.approx(
            np.sqrt(a @ np.linalg.inv(jacobian.T @ jacobian + np.eye(4)) @ a / (a @ a)), rel=1e-6
        )


def test_what_stands_beside_does_not_change_the_words() -> None:
    pair = informed((WALL, OUTSIDE), [[30.0, 30.0]])
    rows = [[30.0, 0.0, 30.0, 0.0], [0.0, 40.0, 0.0, 0.0]]
    beside = informed((WALL, FILM, OUTSIDE, SHUFFLE), rows)
    assert told_as(beside) == told_as(pair)
    assert [p.status for p in beside.parameters] == ["partly", "determined", "partly", "not"]
    assert "Shuffle probability is not determined by these data." in information_sentences(beside)
    assert "Determined: interior film coefficient (to 2.5 %)." in information_sentences(beside)


def test_a_parameter_that_its_prior_pins_does_not_hide_the_product() -> None:
    """The prior of the first is narrow enough to make the second known; still only their product is in the data."""
    narrow = np.diag([0.4**-2, 1.0])
    found = fisher_information(alike(WALL, OUTSIDE), np.array([[300.0, 300.0]]), narrow)
    assert [p.status for p in found.parameters] == ["not", "through_priors"]
    assert found.parameters[1].ratio < DETERMINED
    assert exponents(found) == [{WALL: 1.0, OUTSIDE: 1.0}]


def test_a_probability_is_spoken_of_by_its_odds() -> None:
    found = informed((SHUFFLE, SLAB), [[20.0, 20.0]])
    assert told_as(found)[0] == "product odds of the shuffle probability × slab coupling"
    alone = informed((SHUFFLE, SLAB), [[20.0, 0.0]])
    assert "Determined: shuffle probability (its odds to 5 %)." in information_sentences(alone)


def test_sentences_of_all_and_of_nothing() -> None:
    names = (WALL, FILM, MASS)
    everything, nothing = informed(names, 100.0 * np.eye(3)), informed(names, np.zeros((1, 3)))
    assert information_sentences(everything)[0] == "The data determine all of 3 parameters by themselves."
    assert information_sentences(nothing) == (
        "The data determine none of 3 parameters by themselves.",
        "Exterior wall conductivity, interior film coefficient and slab heat capacity are not determined by these data.",
    )
    half = informed(names, np.diag([0.0, 1.5, 0.2]))
    assert (
        "Partly determined (share of the prior's deviation that is left): interior film coefficient (55 %)."
        in information_sentences(half)
    )


def test_densities_enter_as_products() -> None:
    nominal = {"exterior_wall_density": (300.0, "kg/m^3"), "interior_wall_density": (120.0, "kg/m^3")}
    names = ("exterior_wall_heat_capacity", "interior_wall_heat_capacity")
    found = informed(names, [[20.0, 0.0]], nominal=nominal)
    assert information_sentences(found)[-2:] == (
        "Only the product density × heat capacity of the exterior wall is determined: the density stays at its nominal "
        "300 kg/m³.",
        "Density and heat capacity of the interior wall enter only as a product: the density stays at its nominal "
        "120 kg/m³.",
    )
    other = informed(names, [[20.0, 0.0]], nominal={"emissivity": (0.9, "1")})
    assert information_sentences(other)[-1] == "Emissivity enters only as a product and stays at its nominal 0.9."


def test_strong_correlations_are_named() -> None:
    found = informed((WALL, FILM, MASS), np.array([[20.0, 20.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 9.0]]))
    covariance = np.linalg.inv(np.array([[401.0, 400.0, 0.0], [400.0, 410.0, 0.0], [0.0, 0.0, 82.0]]))
    r = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert [(a, b) for a, b, _ in found.correlations] == [(WALL, FILM)]
    assert found.correlations[0][2] == pytest.approx(r)
    assert f"correlation {r:.2f}" in information_sentences(found)[-1]


def test_correlations_of_a_joint_prior_are_not_news() -> None:
    zones = [PARAMETERS[SLAB].of("zone", f"z{i}") for i in range(5)]
    found = fisher_information(zones, np.zeros((1, 5)), np.linalg.inv(np.full((5, 5), 1.0) + 0.05 * np.eye(5)))
    assert found.correlations == ()
    assert information_sentences(found)[-1] == "Slab coupling of 5 zones are not determined by these data."


def test_members_of_a_large_group_are_told_together() -> None:
    sides = [PARAMETERS["window_u_value"].of("facade", s) for s in ("north", "east", "south", "west")]
    precise = fisher_information(sides, np.diag([10.0, 20.0, 40.0, 50.0]), np.eye(4))
    assert (
        information_sentences(precise)[1]
        == "Determined: window U-value of 4 facades (to 2 % at best, to 10 % at worst)."
    )
    partly = fisher_information(sides[:2], np.diag([1.0, 1.2]), np.eye(2))
    assert information_sentences(partly)[1].endswith(
        "window U-value of the north facade (71 %), window U-value of the east facade (64 %)."
    )


def test_many_parameters_take_no_time() -> None:
    rng = np.random.default_rng(3)
    zones = [PARAMETERS[SLAB].of("zone", f"z{i}") for i in range(60)]
    jacobian = np.zeros((30, 60))
    for i in range(30):
        jacobian[i, 2 * i : 2 * i + 2] = 20.0 * rng.uniform(1.0, 2.0)
    found = fisher_information(zones, jacobian, np.diag([p.prior_deviation**-2 for p in zones]))
    assert len(found.combinations) == 30
    assert told_as(found)[0].startswith("product slab coupling of z")


def test_result_is_ready_for_json() -> None:
    found = informed((WALL, OUTSIDE), [[30.0, 30.0]])
    content = json.loads(json.dumps(information_content(found)))
    assert content["parameters"][WALL]["status"] == "partly"
    assert content["combinations"][0]["exponents"] == {WALL: 1.0, OUTSIDE: 1.0}
    assert content["sentences"] == list(information_sentences(found))


def test_words() -> None:
    u_value = PARAMETERS["window_u_value"]
    assert _precision_words(None, 0.041) == "to 4.1 %"
    assert _precision_words(u_value, 0.7) == "to a factor of 2"
    assert combination_words(PARAMETERS, {WALL: 1.0, FILM: -1.0, MASS: -1.0}) == (
        "combination exterior wall conductivity / (interior film coefficient × slab heat capacity)"
    )
    assert [listed(w) for w in (["a"], ["a", "b"], ["a", "b", "c"])] == ["a", "a and b", "a, b and c"]


def test_a_real_case_is_as_flat_as_its_null_directions_say() -> None:
    """Along the directions that are not explained the predictions hardly change, along the first they do."""
    problem = tuning_problem(load_bundled_case(), settings=CalibrationSettings(dx=1.5))
    z = problem.point(problem.start)
    model = reduced_model(problem.grid, [problem.start])
    data, prior = split_jacobian(problem, model, z)
    assert len(prior) == z.size
    found = fisher_information(problem.parameters, data, prior.T @ prior)
    spread = np.array([p.prior_deviation for p in problem.parameters])
    lost = []
    for d in (found.directions[0], found.directions[-1]):
        step = 0.3 * spread * np.array(list(d.components.values()))
        there = problem.weighted(model, z + step)[0][: len(data)]
        lost.append(float(np.sum((there - problem.weighted(model, z)[0][: len(data)]) ** 2)))
    share = found.directions[0].share
    assert lost[0] == pytest.approx(0.09 * share / (1.0 - share), rel=0.3)
    assert lost[1] < 1e-3 * lost[0]
    assert all(a.share >= b.share for a, b in pairwise(found.directions))
    assert "exterior convection coefficient" in information_sentences(found)[-1]  # hardly any outer face is bare


def test_information_of_an_estimate_takes_its_covariance() -> None:
    problem = tuning_problem(load_bundled_case(), settings=CalibrationSettings(dx=1.5))
    found = estimate(problem, problem.point(problem.start))
    found = replace(found, covariance=2.0 * found.covariance)
    known = information_of(found)
    deviations = [p.posterior_deviation for p in known.parameters]
    np.testing.assert_allclose(deviations, np.sqrt(np.diag(found.covariance)), rtol=1e-12)
    assert any("density stays at its nominal" in s for s in information_sentences(known))
