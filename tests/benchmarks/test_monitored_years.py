"""Years that are monitored: what an open door exchanges, and an oracle's evidence for the change that was made."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

from calibration.monitoring.days import Column, Days
from thermal._types import FloatArray

N_DAY, REFERENCE, START = 60, 40, 50


def days_of(errors: FloatArray) -> Days:
    """Days of a model whose parameter does nothing."""
    dates = pd.date_range("2023-01-02", periods=N_DAY, freq="D", tz="UTC")
    column = Column("window_u_value", "1", None, (), 1.0, 1.0, 0.0, 0.0, False, True, False)
    n = errors.shape[1]
    slopes, zone = np.zeros((N_DAY, n, 1)), np.zeros(n, dtype=np.int64)
    return Days(dates, errors, slopes, (column,), slopes[:6], zone, ("A",))


def test_evidence_of_the_oracle(script: Callable[[str], ModuleType]) -> None:
    """On the first day ``½ gᵀ V⁻¹ g``, V the noise and what is not known of the level; nothing before the change."""
    quiet = 0.5 * np.random.default_rng(1).standard_normal((N_DAY, 4))
    moved = quiet.copy()
    moved[START:] += 1.0
    evidence = script("_monitored_years").evidence_of_oracle(days_of(moved), days_of(quiet), REFERENCE)
    assert evidence[:START] == pytest.approx(0.0)
    assert evidence[START] == pytest.approx(0.5 * 4 / 0.25, rel=0.4)
    assert evidence[START + 5] < evidence[START]  # the level learns


def test_an_open_door_is_in_balance(script: Callable[[str], ModuleType]) -> None:
    """What one zone loses the other has, and none of it goes outdoors."""
    years = script("_monitored_years")
    plant = object.__new__(years._Plant)
    plant.leak, plant.exposed, plant.air, plant.volume = (0.0, 0.0, 0.0), np.zeros(2), 1200.0, np.full(2, 100.0)
    plant.change = years.Change("door_open", ("zone_mixing",), ("A", "B"), 0.2, 0, 1)
    through, between = plant._exchange(np.full(2, -10.0), 3.0, "door_open", [0, 1])
    assert through == pytest.approx(0.0)
    assert between.sum(axis=0) == pytest.approx(0.0)
    assert between[0, 0] == pytest.approx(240.0)
