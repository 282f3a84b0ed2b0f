"""Signals that drive the sources of a network."""

from datetime import timedelta

import numpy as np
import pytest

from thermal.data import load_bundled_case
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import DAILY, daily_waves, signal_values


def test_waves_repeat_from_day_to_day_and_are_independent() -> None:
    inputs = telemetry_inputs(load_bundled_case())
    waves = DAILY
    assert len({wave.name for wave in waves}) == 6
    values = signal_values(waves, inputs)
    a_day = int(86400.0 / inputs.step)
    assert values[a_day : 2 * a_day] == pytest.approx(values[:a_day], abs=1e-9)
    gram = values[:a_day].T @ values[:a_day] / a_day
    assert gram == pytest.approx(0.5 * np.eye(6), abs=1e-9)
    # the sine of a day is at its top at six in the morning by the building's clock
    top = inputs.stamps[int(np.argmax(values[:a_day, 0]))] - timedelta(seconds=inputs.step / 2.0)
    assert abs(top.hour + top.minute / 60.0 - 6.0) <= inputs.step / 3600.0
    # by name, they are functions of the hour
    for wave, column in zip(DAILY, values.T, strict=True):
        assert column == pytest.approx(daily_waves()[wave.name](inputs.clock), abs=1e-12)
