"""Grey boxes: exact steps, energy, recovery of a network that made the telemetry, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from calibration.errors import CalibrationError
from calibration.estimation.state_space import REFERENCE
from calibration.grey_box import fit
from calibration.grey_box.fit import GreyBoxData, fit_grey_box, follow, predict, run_starts, steady_gain
from calibration.grey_box.judge import judge
from calibration.grey_box.network import GreyBox

STEP = 1800.0


def two_zones() -> GreyBox:
    start = GreyBox.start(
        {"north": 50.0, "south": 80.0},
        ("sun from south",),
        {"floor": ("north", "south"), "heater": ("south",)},
        (True, False),
    )
    rng = np.random.default_rng(1)
    point = start.point + 0.3 * start.scale * rng.standard_normal(start.point.size)
    return replace(start, point=np.maximum(point, start.lowest))


def test_a_step_is_exact() -> None:
    """State at the end and mean over the step, against the matrix exponential of the heat balance with its integral."""
    box = two_zones()
    space, n = box.space(STEP), box.capacity.size
    matrix, push = box._conductance[0], box.input_matrix
    m = push.shape[1]
    big = np.zeros((2 * n + m, 2 * n + m))
    big[:n, :n], big[:n, 2 * n :] = -matrix / box.capacity[:, None], push / box.capacity[:, None]
    big[n : 2 * n, :n] = np.eye(n)  # integral of the states
    exact = expm(big * STEP)
    np.testing.assert_allclose(space.transition, exact[:n, :n], atol=1e-10)
    np.testing.assert_allclose(space.drive, exact[:n, 2 * n :], rtol=1e-8, atol=1e-14)
    np.testing.assert_allclose(space.observation, exact[n : n + 2, :n] / STEP, atol=1e-10)
    np.testing.assert_allclose(space.feedthrough, exact[n : n + 2, 2 * n :] / STEP, rtol=1e-8, atol=1e-14)


def test_energy_is_kept_and_at_rest_it_is_the_heat_loss() -> None:
    box = two_zones()
    assert np.allclose(box.shares.sum(axis=0), 1.0) and np.allclose(box.emitter_weights.sum(axis=0), 1.0)
    assert box.shares[0::2, 1].sum() == 0.0  # the heater serves the south only
    space, n = box.space(STEP), box.capacity.size
    warm = np.zeros(space.drive.shape[1])
    warm[0] = 5.0  # all at the temperature of outdoor air, in kelvins from the reference
    np.testing.assert_allclose(space.transition @ np.full(n, 5.0) + space.drive @ warm, 5.0, rtol=1e-10)
    single = GreyBox.start({"all": 100.0}, (), {"floor": ("all",)}, (True,))
    space = single.space(STEP)
    at_rest = np.linalg.solve(np.eye(4) - space.transition, space.drive @ np.array([0.0, 1000.0, 0.0]))
    assert 1000.0 / at_rest[0] == pytest.approx(single.heat_loss[0], rel=1e-9)  # what goes into the floor leaves by air


def made(box: GreyBox, days: int, seed: int = 0) -> GreyBoxData:
    """Telemetry that the network made, without noise."""
    rng, n = np.random.default_rng(seed), round(days * 86_400.0 / STEP)
    hours = np.arange(n) * STEP / 3600.0
    outdoor = 278.0 + 5.0 * np.sin(2 * np.pi * hours / 24.0) + np.repeat(rng.normal(0, 3, n // 12 + 1), 12)[:n]
    sun = (400.0 * np.maximum(np.sin(np.pi * (hours % 24 - 7) / 10), 0) * (hours % 24 < 17))[:, None]
    heat = np.repeat(rng.choice([0.0, 6000.0], (n // 4 + 1, 2)), 4, axis=0)[:n] * [1.0, 0.3]
    data = GreyBoxData(STEP, np.zeros((n, 2)), outdoor, sun, heat, np.zeros((n, 2)))
    u, space, x = data.pushes(box), box.space(STEP), np.full(8, 0.0)
    zone = np.empty((n, 2))
    for k in range(n):
        zone[k] = space.observation @ x + space.feedthrough @ u[k] + REFERENCE
        x = space.transition @ x + space.drive @ u[k]
    return replace(data, zone=zone)


def test_a_fit_finds_a_network_that_predicts_what_the_true_one_does() -> None:
    true = GreyBox.start({"house": 120.0}, (), {"floor": ("house",)}, (True,))
    rng = np.random.default_rng(3)
    true = replace(true, point=true.point + np.where(true.scale > 1, 0.3, 0.0) * rng.standard_normal(true.point.size))
    n = round(6 * 86_400.0 / STEP)
    hours = np.arange(n) * STEP / 3600.0
    outdoor = 278.0 + 5.0 * np.sin(2 * np.pi * hours / 24.0) + np.repeat(rng.normal(0, 3, n // 12 + 1), 12)[:n]
    heat = np.repeat(rng.choice([0.0, 8000.0], n // 6 + 1), 6)[:n, None]
    data = GreyBoxData(STEP, np.zeros((n, 1)), outdoor, np.empty((n, 0)), heat, np.zeros((n, 1)))
    u, space, x, zone = data.pushes(true), true.space(STEP), np.zeros(4), np.empty((n, 1))
    for k in range(n):
        zone[k] = space.observation @ x + space.feedthrough @ u[k] + REFERENCE
        x = space.transition @ x + space.drive @ u[k]
    data = replace(data, zone=zone + rng.normal(0, 0.01, zone.shape))
    split = 4 * 48
    start = GreyBox.start({"house": 120.0}, (), {"floor": ("house",)}, (True,))
    found = fit_grey_box(start, data.rows(0, split))
    errors = judge(found, data, split)
    assert [e.lead for e in errors] == [3600.0, 21_600.0, 86_400.0]
    assert all(e.grey_box < 0.1 and e.grey_box < 0.3 * min(e.persistence, e.arx) for e in errors)
    assert found.heat_loss[0] == pytest.approx(true.heat_loss[0], rel=0.25)
    again = GreyBox.from_dict(found.to_dict())
    assert np.array_equal(again.point, found.point) and again.zones == ("house",)


def test_the_true_network_predicts_to_the_last_digit_once_its_filter_has_forgotten_the_start() -> None:
    box = two_zones()
    data = made(box, 12)
    gap = replace(data, zone=np.where(np.arange(len(data.zone))[:, None] == 60, np.nan, data.zone))
    followed = follow(box, gap)
    assert np.isnan(followed.innovations[60]).all() and np.isfinite(followed.states).all()
    starts = run_starts(gap, 48)[-4:]
    found = predict(box, gap, followed.states, starts, 48)
    assert np.abs(found - data.zone[starts[:, None] + np.arange(48)]).max() < 0.05
    gain, innovation = steady_gain(box, STEP)
    assert gain.shape == (10, 2) and (np.linalg.eigvalsh(innovation) > 0).all()


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(CalibrationError, match="zones with a floor area"):
        GreyBox.start({"a": 0.0}, (), {"floor": ("a",)}, (True,))
    with pytest.raises(CalibrationError, match="a zone for each source"):
        GreyBox.start({"a": 10.0}, (), {"floor": ("b",)}, (True,))
    box = two_zones()
    data = made(box, 1)
    with pytest.raises(CalibrationError, match="a day to predict"):
        fit_grey_box(box, data)
    with pytest.raises(CalibrationError, match="others of .'outdoor'"):
        replace(data, outdoor=np.full(len(data.zone), np.nan))
    with pytest.raises(CalibrationError, match=f"expected {box.point.size} numbers"):
        GreyBox.from_dict(box.to_dict() | {"point": [1.0]})
    with pytest.raises(CalibrationError, match="buildingmpc identify"):
        GreyBox.from_dict({})


@pytest.mark.parametrize(("errors", "kept"), [((0.3,), 0), ((0.8, 0.2), 1), ((0.8, 0.9), 0)])
def test_a_fit_that_went_astray_is_begun_again(errors: tuple[float, ...], kept: int, monkeypatch: Any) -> None:
    """With heavier air; the better of the two goes on to the noise and the second part."""
    start = GreyBox.start({"a": 100.0, "b": 50.0}, (), {"h": ("a", "b")}, (True,))
    begun = []

    def fitted(box: GreyBox, data: Any, progress: Any, part: int) -> tuple[GreyBox, float]:
        begun.append((box, part))
        return replace(box, point=box.point + 1.0), errors[len(begun) - 1] if part == 0 else 0.0

    monkeypatch.setattr(fit, "_fitted", fitted)
    monkeypatch.setattr(fit, "tune_noise", lambda box, data: box)
    found = fit.fit_grey_box(start, None)
    assert [part for _, part in begun] == [0] * len(errors) + [1]
    if len(errors) > 1:
        np.testing.assert_allclose(begun[1][0].capacity[:2], 3.0 * start.capacity[:2])
        np.testing.assert_allclose(begun[1][0].capacity[2:], start.capacity[2:])
    np.testing.assert_allclose(found.point, begun[kept][0].point + 2.0)
