"""What a search comes to: errors of rough sensors are no missing effect, and a likely fault may be a missing effect."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from calibration.diagnosis.decide.levels import LEVELS
from calibration.diagnosis.decide.verdict import Verdict
from calibration.diagnosis.faults import Fault
from calibration.diagnosis.seek import Sought, seek
from thermal.case.plausibility.anomaly import Anomaly, Certainty
from thermal.data import load_bundled_case
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin


def test_large_errors_of_which_nothing_comes_back_are_chance() -> None:
    ranges = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.2, 0.25))
    settings = TwinSettings(days=10.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=ranges)
    office = pilot_building(3, floor_area=80.0, zones=2, floors=1, name="office")
    found = seek(generate_twin(office, 3, settings)[0], dx=2.0)
    summary = found.verdict.summary
    assert summary is not None and found.left_over is not None
    assert summary.left > max(LEVELS.left_over, LEVELS.left_of_change * summary.change)
    assert found.left_over.fall < 0.03 and not found.left_over.matters
    assert (found.verdict.name, summary.comes_back, found.rounds[0].accepted) == ("no_gap", False, None)


@pytest.mark.parametrize(
    ("certainty", "missing", "left", "told"),
    [
        ("likely", True, (0.3, 0.1), False), ("likely", True, (0.1, 0.3), True), ("likely", False, (0.3,), True),
        ("certain", True, (0.3,), True),
    ],
)  # fmt: skip
def test_a_likely_fault_is_held_against_what_is_missing_without_it(
    monkeypatch: pytest.MonkeyPatch, certainty: Certainty, missing: bool, left: tuple[float, ...], told: bool
) -> None:
    case = load_bundled_case()
    begin, end = case.telemetry.frame.index[[0, -1]]
    seen = Anomaly("exchanged", "warning", certainty, (), begin, end, "exchanged", "exchange them")
    fault = Fault("swapped_sensors", ("F1_N", "F1_S"), "", 0.0, seen, case)
    errors: Iterator[float] = iter(left)

    def answer(models: Any, *_: object) -> Sought:
        rounds: Any = (SimpleNamespace(after_held_out=SimpleNamespace(mae=next(errors))),)
        nothing: Any = None
        structures: Any = object() if missing else None
        return Sought(models, rounds, Verdict("no_gap", (), (), {}), (), nothing, structures, None, None, None)

    monkeypatch.setattr("calibration.diagnosis.seek.mend", lambda *_: (fault,))
    monkeypatch.setattr("calibration.diagnosis.seek._seek", answer)
    found = seek(case)
    assert [f.effect for f in found.faults] == ["swapped_sensors"] * told
    assert [c.effect for c in found.verdict.candidates] == ["swapped_sensors"] * told
    assert found.left == min(left) and next(errors, None) is None
