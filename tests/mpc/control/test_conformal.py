"""The share of violations that is asked for is kept, whatever the misses are, within the stated range."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.identified.conformal import RANGE, RATE, ConformalBackOff, Guarantee, risen
from mpc.errors import ControlError

NONE = np.zeros(2, dtype=bool)


@pytest.mark.parametrize("share", [0.05, 0.2])
@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_share_over_a_season(share: float, drift: float) -> None:
    """Autocorrelated misses whose mean drifts: the share is within a point, and within the theorem's bound."""
    rng, steps = np.random.default_rng(4), 5000
    kept, miss = ConformalBackOff(Guarantee(share), 2), 0.0
    for k in range(steps):
        miss = 0.9 * miss + 0.05 * rng.standard_normal()
        inside = kept.values[0, 0] + miss + drift * np.sin(2 * np.pi * k / steps)
        kept.update(np.array([inside, np.nan]), np.array([True, True]), NONE)
        kept.update(np.array([-5.0, -5.0]), NONE, NONE)  # nobody is in
    assert kept.count == steps and kept.values[1, 0] == 0.0 and kept.values[:, 2].tolist() == [RANGE[1]] * 2
    seen = kept.outside / kept.count
    assert abs(seen - share) < 0.01 and abs(seen - share) <= (RANGE[1] - RANGE[0] + RATE) / (RATE * steps)


def test_zones_and_hours_of_different_errors_have_each_their_own() -> None:
    """A zone that is half a kelvin late in the morning, and right for the rest of the day, is only begun earlier."""
    kept, late = ConformalBackOff(Guarantee(0.05), 2), np.array([0.5, 0.0])
    rng, seen = np.random.default_rng(1), []
    for k in range(150 * 40):
        morning = np.full(2, k % 40 < 4)
        noise = 0.02 * rng.standard_normal(2)
        inside = kept.along(morning[None], ~NONE[None])[0] - late * morning + noise
        kept.update(inside, np.array([True, True]), morning)
        seen.append(inside < 0.0)
    assert np.array(seen).mean() == pytest.approx(0.05, abs=0.01)
    assert kept.values[0, 1] > 0.4 and np.abs(kept.values[[0, 1, 1], [0, 0, 1]]).max() < 0.12


def test_hours_without_people_have_their_own_and_are_not_let_go() -> None:
    """A thermostat that holds 0.05 K under what it is told; by day the band is far, which is no reason for less at night."""
    kept, misses = ConformalBackOff(Guarantee(0.01), 2), []
    for k in range(2000):
        people = np.full(2, 32 <= k % 96 < 72)
        inside = np.where(people, 1.0, kept.along(NONE[None], people[None])[0] - 0.05)
        kept.update(inside, people, NONE)
        misses.append(np.maximum(-inside, 0.0).max())
    assert max(misses[96:]) < 0.02 and kept.outside == 0 and kept.count == 2 * sum(32 <= k % 96 < 72 for k in range(2000))
    for _ in range(3000):
        kept.update(np.ones(2), NONE, NONE)
    assert kept.values[:, 2].tolist() == [0.0, 0.0] and (kept.values[:, 0] < -0.2).all()


def test_what_goes_on_and_off_at_night_is_kept_from_the_edge_by_what_it_dips() -> None:
    """Held in one step and falling in the next by 0.6 K: means are 0.3 K lower, its end is 0.6."""
    kept, ends = ConformalBackOff(Guarantee(0.01), 2), []
    for k in range(400):
        held = kept.along(NONE[None], NONE[None])[0]
        kept.update(held - 0.3 * (k % 2), NONE, NONE)
        ends.append(held - 0.6 * (k % 2))
    assert kept.values[:, 2] == pytest.approx(0.6, abs=0.06) and np.min(ends[100:]) > -0.05


@pytest.mark.parametrize("fall", [0.1, 0.3, 0.6])
def test_a_zone_that_coasts_and_is_held_in_time_needs_no_distance(fall: float) -> None:
    """An ideal thermostat catches it at the edge with its distance: it never ends below."""
    kept, wall = ConformalBackOff(Guarantee(0.01), 1), np.zeros(1, dtype=bool)
    for _ in range(60):
        start = 3.0
        for _ in range(32):
            edge = float(kept.along(wall[None], wall[None])[0, 0])
            end = max(start - fall, edge)
            falls = (start - end) / fall  # share of the step until it is caught
            kept.update(np.array([0.5 * (start + end) * falls + end * (1.0 - falls)]), wall, wall)
            start = end
    assert kept.values[0, 2] < 0.25 * fall + 0.05


def test_a_machine_that_gives_all_it_has_at_night_is_no_reason_to_ask_for_more() -> None:
    kept = ConformalBackOff(Guarantee(0.01), 2)
    for _ in range(100):
        kept.update(np.full(2, -0.4), NONE, NONE, np.array([True, False]))
    assert kept.values[:, 2].tolist() == [0.0, RANGE[1]]


def test_hours_after_a_rise() -> None:
    lower = np.array([288.0] * 4 + [293.0] * 8 + [288.0] * 4)[:, None]
    found = risen(lower, 900.0)[:, 0]
    assert np.flatnonzero(found).tolist() == [4, 5, 6, 7]
    assert risen(lower[6:], 900.0, lower[2:6])[:, 0].tolist() == [True, True] + [False] * 8
    assert not risen(lower[6:], 900.0)[:2].any()  # without what was before nothing has risen


def test_range_holds_and_what_is_no_share_is_refused() -> None:
    kept = ConformalBackOff(Guarantee(0.05, -0.1, 0.2), 2, start=3.0)
    assert (kept.values == 0.2).all()
    for _ in range(500):
        kept.update(np.ones(2), ~NONE, NONE)
    assert kept.values[:, 0].tolist() == [-0.1, -0.1] and kept.values[:, 1].tolist() == [0.2, 0.2]
    for share, low in ((0.0, -0.5), (5.0, -0.5), (0.05, 2.0)):
        with pytest.raises(ControlError, match="a share between 0 and 1"):
            Guarantee(share, low)
