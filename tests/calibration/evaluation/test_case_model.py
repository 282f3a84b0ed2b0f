"""A case's model with the parameters, the disturbance and the bands of a file."""

import json
from pathlib import Path
from typing import Any

import pytest

from calibration.errors import CalibrationError
from calibration.evaluation.case_model import read_disturbance

ZONES = ("A", "B")
WHOLE = {"disturbance": {"deviation": 100.0, "time_constant": 3600.0, "sensor_deviation": [0.05, 0.1]}}


def written(folder: Path, **content: Any) -> Path:
    path = folder / "calibration.json"
    path.write_text(json.dumps({**WHOLE, **content}), encoding="utf-8")
    return path


def test_disturbance_and_factors_are_those_of_the_file(tmp_path: Path) -> None:
    found, factors = read_disturbance(written(tmp_path, band_factors={"B": 1.5}), ZONES)
    assert found is not None and found.time_constant == 3600.0
    assert factors == {"B": 1.5}
    assert read_disturbance(written(tmp_path), ZONES)[1] == {}
    assert read_disturbance(written(tmp_path, disturbance=None), ZONES) == (None, {})


@pytest.mark.parametrize(
    "factors", [{"A": -3.0}, {"A": float("inf")}, {"A": float("nan")}, {"C": 1.0}, {"A": "x"}, [1]]
)
def test_factors_that_make_no_band_are_refused_by_their_name(tmp_path: Path, factors: Any) -> None:
    with pytest.raises(CalibrationError, match="band_factors: expected a positive number by zone"):
        read_disturbance(written(tmp_path, band_factors=factors), ZONES)


@pytest.mark.parametrize("entry", [{"deviation": -1.0}, {"nonsense": 1}, [1], "x", {"deviation": [1.0, 2.0, 3.0]}])
def test_a_disturbance_of_another_make_is_refused(tmp_path: Path, entry: Any) -> None:
    if isinstance(entry, dict):
        entry = {**WHOLE["disturbance"], **entry}
    with pytest.raises(CalibrationError, match="disturbance: expected"):
        read_disturbance(written(tmp_path, disturbance=entry), ZONES)
