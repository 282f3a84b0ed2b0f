"""Baselines of a diagnosis have natural convection and light contents where a building has them, and not else."""

from __future__ import annotations

from pathlib import Path

import pytest

from calibration.diagnosis.baseline import fit_baseline
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import held_out
from calibration.evaluation.settings import ModelSettings
from thermal import load_case
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin
from thermal.units import air_density

SHARED = Path(__file__).parents[3].parent / "shared" / "cases"


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared practice cases beside the repository")
def test_an_office_of_energyplus_has_natural_convection() -> None:
    models = ModelComparison(load_case(SHARED / "practice_none_schedule"), ModelSettings(dx=1.5))
    convective, found = fit_baseline(models, {})
    assert convective.settings.structure.natural_films
    plain = models.fit({}, [{}])
    assert plain.built.network.parameters == found.built.network.parameters  # of which it needs none
    assert found.evidence > plain.evidence + 10.0
    assert held_out(convective, found).mae < 0.9 * held_out(models, plain).mae


def test_films_of_one_coefficient_are_told_from_natural_convection() -> None:
    building = pilot_building(5, floor_area=80.0, zones=2, floors=1, name="office")
    settings = TwinSettings(days=9.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=TwinRanges())
    models, found = fit_baseline(ModelComparison(generate_twin(building, 5, settings)[0], ModelSettings(dx=1.0)), {})
    assert not models.settings.structure.natural_films and not found.built.network.signals


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_light_contents_are_found_by_their_capacity(times: float, monkeypatch: pytest.MonkeyPatch) -> None:
    building = pilot_building(5, floor_area=80.0, zones=2, floors=1, name="office")
    quiet = TwinRanges(noise=(0.01, 0.02), disturbance_deviation=(0.02, 0.05))
    settings = TwinSettings(days=16.0, step_seconds=300.0, dx=1.0, meter="exact", ranges=quiet)
    with monkeypatch.context() as heavy:
        heavy.setattr("thermal.network.build.air_density", lambda elevation: times * air_density(elevation))
        case = generate_twin(building, 5, settings)[0]
    models, found = fit_baseline(ModelComparison(case, ModelSettings(dx=1.0)), {})
    assert models.settings.structure.light_contents is (times > 1.0)
    if times > 1.0:
        assert found.values["air_capacity_multiplier"] == pytest.approx(times, rel=0.05)
        plain = ModelComparison(case, ModelSettings(dx=1.0))
        assert held_out(models, found).mae < 0.5 * held_out(plain, plain.fit({}, [{}])).mae
