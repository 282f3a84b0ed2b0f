"""The share of violations that is asked for is kept, whatever the misses are, within the stated range."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.identified.conformal import RANGE, RATE, ConformalBackOff, Guarantee
from mpc.errors import ControlError


@pytest.mark.parametrize("share", [0.05, 0.2])
@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_share_over_a_season(share: float, drift: float) -> None:
    """Autocorrelated misses whose mean drifts: the share is within a point, and within the theorem's bound."""
    rng, steps = np.random.default_rng(4), 5000
    kept, miss = ConformalBackOff(Guarantee(share)), 0.0
    for k in range(steps):
        miss = 0.9 * miss + 0.05 * rng.standard_normal()
        inside = kept.value + miss + drift * np.sin(2 * np.pi * k / steps)
        kept.update(np.array([inside, np.nan]), np.array([True, True]))
        kept.update(np.array([-5.0, -5.0]), np.array([False, False]))  # nobody is in
    assert kept.count == steps
    seen = kept.outside / kept.count
    assert abs(seen - share) < 0.01 and abs(seen - share) <= (RANGE[1] - RANGE[0] + RATE) / (RATE * steps)


def test_range_holds_and_what_is_no_share_is_refused() -> None:
    kept = ConformalBackOff(Guarantee(0.05, -0.1, 0.2), start=3.0)
    assert kept.value == 0.2
    for _ in range(500):
        kept.update(np.array([1.0]), np.array([True]))
    assert kept.value == -0.1
    for share, low in ((0.0, -0.5), (5.0, -0.5), (0.05, 2.0)):
        with pytest.raises(ControlError, match="a share between 0 and 1"):
            Guarantee(share, low)
