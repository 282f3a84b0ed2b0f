"""Measurements are a mapping of points, in the library's units and in those of files."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.loop.plant import Measurements, PointLayout

LAYOUT = PointLayout(("VAV/zone_air_temperature_sensor", "VAV/supply_air_damper_percentage_command"), "Etc/GMT+8")


def test_values_by_name_and_by_unit() -> None:
    seen = Measurements(LAYOUT, 1_700_000_000, np.array([294.15, 0.25]))
    assert seen["VAV/zone_air_temperature_sensor"] == 294.15
    assert dict(seen) == dict(zip(LAYOUT.columns, [294.15, 0.25], strict=True))
    assert seen.in_file_units().round(9).tolist() == [21.0, 25.0]
    assert seen.stamp.isoformat() == "2023-11-14T14:13:20-08:00"


def test_what_is_not_measured_is_refused_by_name() -> None:
    seen = Measurements(LAYOUT, 0, np.zeros(2))
    with pytest.raises(KeyError, match="nearest valid one is 'VAV/zone_air_temperature_sensor'"):
        seen["VAV/zone_air_temperatur_sensor"]


def test_values_are_read_once_when_asked_for() -> None:
    calls = []

    def read() -> np.ndarray:
        calls.append(1)
        return np.array([1.0, 2.0])

    seen = Measurements(LAYOUT, 0, read)
    assert not calls
    assert seen.values_array is seen.values_array and len(calls) == 1
