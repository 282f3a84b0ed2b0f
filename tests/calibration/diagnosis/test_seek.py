"""What a search comes to: large errors of rough sensors, of which nothing comes back, are no missing effect."""

from calibration.diagnosis.decide.levels import LEVELS
from calibration.diagnosis.seek import seek
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
