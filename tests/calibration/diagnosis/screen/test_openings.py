"""Openings of windows: found in heat that is lost at a stroke, and nowhere else; the path against all paths."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.diagnosis.screen.openings import opened_when
from calibration.diagnosis.screen.two_states import most_likely_paths, noise_of
from calibration.estimation.heat_balance import heat_balance, step_balance
from calibration.evaluation.intervals import Interval
from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model, replay_inputs

FloatArray = NDArray[np.float64]

STEP, DAY, DAYS = 300.0, 288, 14
PRESENCE = np.tile((np.arange(DAY) >= 96) & (np.arange(DAY) < 216), DAYS).astype(float)


def opened(rng: np.random.Generator, first: int = 100, last: int = 190) -> FloatArray:
    """Once a day, for half an hour to two hours."""
    state = np.zeros(DAYS * DAY)
    for day in range(DAYS):
        begin = day * DAY + int(rng.integers(first, last))
        state[begin : begin + int(rng.integers(6, 24))] = 1.0
    return state


def lost(state: FloatArray, unit: FloatArray, rng: np.random.Generator, area: float = 1.0) -> FloatArray:
    """Heat through the window, noise of a day and of a step [W]."""
    slow = 300.0 * np.sin(2.0 * np.pi * np.arange(state.size) / DAY)
    return state * area * unit + slow + 200.0 * rng.standard_normal(state.size)


UNIT = 1200.0 + 400.0 * np.sin(2.0 * np.pi * (np.arange(DAYS * DAY) - 100) / DAY)


def found_in(*heat: FloatArray) -> FloatArray:
    """Openings of zones whose windows let out alike, shape (n_time, n_zone)."""
    return opened_when(np.column_stack(heat), np.tile(UNIT[:, None], len(heat)), PRESENCE, STEP)


@pytest.mark.parametrize("area", [0.5, 1.0, 3.0])
def test_openings_are_found(area: float) -> None:
    rng = np.random.default_rng(3)
    state = opened(rng)
    heat = lost(state, UNIT, rng, area)
    heat[500:520] = np.nan
    found = found_in(heat)[:, 0]
    assert (found * state).sum() > 0.85 * state.sum()
    assert (found * state).sum() > 0.85 * found.sum()


@pytest.mark.parametrize("area", [0.7, 2.0])
def test_windows_that_stand_open_for_half_a_day_are_found_as_well(area: float) -> None:
    rng, state = np.random.default_rng(6), np.zeros(DAYS * DAY)
    for begin in np.arange(DAYS) * DAY + rng.integers(100, 130, DAYS):
        state[begin : begin + int(rng.integers(9, 72))] = 1.0
    found = found_in(lost(state, UNIT, rng, area))[:, 0]
    assert (found * state).sum() > 0.9 * state.sum()
    assert (found * state).sum() > 0.9 * found.sum()


def test_a_window_whose_heat_departs_from_its_law_is_told_from_a_small_loss_of_every_evening() -> None:
    rng = np.random.default_rng(4)
    state = opened(rng)
    spell = np.repeat(rng.uniform(0.6, 1.4, state.size // 12), 12)
    evening = np.tile((np.arange(DAY) >= 195) & (np.arange(DAY) < 213), DAYS)
    heat = 4.0 * spell * state * UNIT + 150.0 * evening + 50.0 * rng.standard_normal(state.size)
    found = found_in(heat)[:, 0]
    assert (found * state).sum() > 0.95 * state.sum()
    assert (found * state).sum() > 0.95 * found.sum()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_noise_is_that_of_heat_that_no_window_loses(sign: float) -> None:
    """However long windows stand open, in the cold and where it is warmer outdoor."""
    rng = np.random.default_rng(9)
    unit, quiet = sign * UNIT, 70.0 * rng.standard_normal(UNIT.size)
    assert noise_of(quiet, unit) == pytest.approx(70.0, rel=0.05)
    state = (rng.uniform(size=unit.size) < 0.2).astype(float)
    assert noise_of(quiet + 2.0 * state * unit, unit) == pytest.approx(70.0, rel=0.05)
    assert noise_of(np.zeros(3), unit[:3]) > 0.0


def test_noise_a_slow_loss_and_a_steady_one_are_no_openings() -> None:
    rng = np.random.default_rng(5)
    states = (np.zeros(DAYS * DAY), np.ones(DAYS * DAY))
    assert not found_in(*(lost(state, UNIT, rng) for state in states), np.full(DAYS * DAY, np.nan)).any()


def test_what_comes_at_night_and_what_warms_is_not_opened_by_people() -> None:
    rng = np.random.default_rng(6)
    at_night = opened(rng, 0, 60)
    assert not found_in(lost(at_night, UNIT, rng)).any()
    by_day = opened(rng)
    assert not found_in(-by_day * UNIT + 100.0 * rng.standard_normal(by_day.size)).any()


def test_the_path_is_the_most_likely_of_all() -> None:
    rng = np.random.default_rng(8)
    odds, opens, shuts = rng.normal(0.0, 2.0, 9), rng.uniform(0.05, 0.3, 9), 0.25

    def value(path: tuple[int, ...]) -> float:
        total, before = 0.0, 0
        for k, now in enumerate(path):
            chance = opens[k] if before == 0 else shuts
            total += np.log(chance if now != before else 1.0 - chance) + odds[k] * now
            before = now
        return total

    best = max(product((0, 1), repeat=9), key=value)
    paths, gains = most_likely_paths(np.column_stack([odds, np.full(9, -5.0)]), opens, shuts)
    assert tuple(paths[:, 0].astype(int)) == best
    assert gains == pytest.approx([value(best) - value((0,) * 9), 0.0])
    assert not paths[:, 1].any()


def test_the_balance_of_steps_is_that_of_hours() -> None:
    case = load_bundled_case()
    network = build_network(case.building, dx=2.0)
    theta = np.array([p.start for p in network.parameters])
    inputs, model = replay_inputs(case, network), reduced_model(SymbolicModel(network), [theta])
    rows, metered, needed = step_balance(model, theta, inputs)
    hours = heat_balance(model, theta, inputs, [Interval(inputs.stamps[0], inputs.stamps[-1])])
    per = round(3600.0 / inputs.step)
    begins = inputs.stamps[rows] - (inputs.stamps[1] - inputs.stamps[0])
    k = next(i for i in range(len(rows)) if begins[i] == hours.stamps[3])
    assert metered[k : k + per].mean(axis=0) == pytest.approx(hours.metered[3], nan_ok=True)
    assert needed[k : k + per].mean(axis=0) == pytest.approx(hours.needed[3], abs=1.0, nan_ok=True)
