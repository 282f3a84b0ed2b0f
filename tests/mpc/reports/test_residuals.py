"""What a page says of what the model leaves: sentences that fit the numbers, and a reason where a part is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration import CalibrationResult, CalibrationSettings, DisturbanceModel, calibrate
from calibration.estimation.heat_balance import HeatBalance
from calibration.estimation.whiteness import Whiteness, ZoneWhiteness
from mpc.reports.residuals import (
    MOST_FILTERED,
    _heat_sentence,
    _leftover_sentence,
    _whiteness_sentence,
    diagnostics_content,
)
from thermal import Case, Inputs, SymbolicModel, load_bundled_case, replay_inputs


def white(*zones: tuple[float, float]) -> Whiteness:
    """Zones with an autocorrelation at one step and a probability."""
    found = {f"z{i}": ZoneWhiteness(500, lag, (5.0,), (p,), 0.01 * (i + 1), p) for i, (lag, p) in enumerate(zones)}
    return Whiteness(found, (6,), (6,), 300.0)


def balance(metered: float, needed: float, hours: int = 100) -> HeatBalance:
    stamps = pd.date_range("2023-01-01", periods=hours, freq="h", tz="UTC")
    return HeatBalance(stamps, ("a",), np.full((hours, 1), metered), np.full((hours, 1), needed))


@pytest.fixture(scope="module")
def case() -> Case:
    return load_bundled_case()


@pytest.fixture(scope="module")
def result(case: Case) -> CalibrationResult:
    return calibrate(case, settings=CalibrationSettings(dx=1.0, starts=1))


@pytest.fixture(scope="module")
def model(case: Case, result: CalibrationResult) -> tuple[SymbolicModel, Inputs]:
    network = result.settings.network(case.building)
    return SymbolicModel(network), replay_inputs(case, network)


def test_what_is_left_in_words() -> None:
    common = DisturbanceModel(110.0, 7200.0, 0.03)
    text = _leftover_sentence(common, 1.2)
    assert "about 110 W a zone, remembered for 2 h, and sensor noise of 0.03 K" in text
    assert "1.2 times what these make, which is close" in text and "missing" not in text
    assert _leftover_sentence(common, 1.6).endswith("1.6 times what these make: physics is missing.")
    assert _leftover_sentence(common, 1.0).endswith("no larger than these make.")
    by_zone = DisturbanceModel(np.array([50.0, 100.0, 900.0]), 3.5 * 86400.0, 0.1)
    assert "about 100 W a zone, remembered for 3.5 d" in _leftover_sentence(by_zone, 1.0)
    assert "that drifts" in _leftover_sentence(DisturbanceModel(10.0, np.inf, 0.1), 1.0)
    assert "were not tuned" in _leftover_sentence(None, 1.0)


def test_whiteness_in_words() -> None:
    assert "are white" in _whiteness_sentence(white((0.01, 0.5), (-0.02, 0.9)))
    little = _whiteness_sentence(white((0.03, 1e-4), (-0.05, 0.9), (0.04, 0.9)))
    assert little.startswith("1 of 3 zones fail") and "±0.04 only" in little
    assert "keep its sign" in _whiteness_sentence(white((0.3, 1e-9), (0.2, 1e-9)))
    assert "turn its sign" in _whiteness_sentence(white((-0.3, 1e-9), (-0.2, 1e-9)))
    assert "with either sign" in _whiteness_sentence(white((-0.3, 1e-9), (0.3, 1e-9)))


def test_heat_in_words() -> None:
    warm = balance(100.0, 120.0)
    text = _heat_sentence(warm, warm.of_building())
    assert "needs 20.2 % more heat" in text and "not within" in text
    good = balance(100.0, 95.0)
    assert "5.1 % less heat" in _heat_sentence(good, good.of_building())
    assert ": within" in _heat_sentence(good, good.of_building())
    short = balance(100.0, 95.0, hours=10)
    assert short.of_building() is None and "no ratio" in _heat_sentence(short, None)


def test_every_part_has_its_numbers(result: CalibrationResult, model: tuple[SymbolicModel, Inputs]) -> None:
    content = diagnostics_content(result, *model)
    found, heat = content["innovations"], content["heat"]
    assert {row[0] for row in found["rows"]} == set(result.zones)
    distances = [float(row[-1]) for row in found["rows"]]
    assert distances == sorted(distances, reverse=True)
    alone = result.calibrated["held_out"].by_horizon
    assert [(row[0], row[1]) for row in found["horizons"]] == [(h, f"{mae:.3f}") for h, mae in alone.items()]
    assert all(float(corrected) < float(model) for _, model, corrected in found["horizons"])
    assert len(found["pictures"]) == 2 and len(heat["pictures"]) == 1
    assert heat["rows"][0][0] == "whole building" and len(heat["rows"]) == 1 + len(result.zones)
    building, parts = (np.array([float(row[2]) for row in rows]) for rows in (heat["rows"][:1], heat["rows"][1:]))
    assert building[0] == pytest.approx(parts.sum(), abs=3.0)


def test_what_is_left_out_says_why(result: CalibrationResult, model: tuple[SymbolicModel, Inputs]) -> None:
    untuned = diagnostics_content(replace(result, disturbance=None), *model)
    assert "not tuned" in untuned["innovations"]["reason"] and "rows" in untuned["heat"]
    zones = tuple(f"z{i}" for i in range(MOST_FILTERED + 1))
    large = diagnostics_content(replace(result, zones=zones), *model)
    assert f"with {MOST_FILTERED + 1} zones" in large["innovations"]["reason"] and "rows" in large["heat"]
    first = result.tuning[0].start
    short = replace(result, held_out=(replace(result.held_out[0], start=first, end=first + pd.Timedelta("2h")),))
    content = diagnostics_content(short, *model)
    assert "expected room" in content["innovations"]["reason"] and "expected room" in content["heat"]["reason"]
