"""Heat of unknown cause: found where it is planted, certified on days that nothing was chosen on, handed on."""

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from calibration.diagnosis import correction
from calibration.diagnosis.correction import Correction, correct
from calibration.diagnosis.diagnosis import Diagnosis, diagnose
from calibration.diagnosis.posterior import read_posterior
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import HeldOut, held_out
from calibration.diagnosis.screen.kinds_of_heat import Kind
from calibration.evaluation.case_model import case_model
from calibration.evaluation.settings import ModelSettings
from mpc.reports.diagnosis import diagnosis_summary, write_diagnosis
from mpc.reports.diagnosis_words import diagnosis_verdict
from thermal import Case, Telemetry
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.unknown import SUN, UNKNOWN
from thermal.model.case_replay import free_runs, spin_up
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin

#: Heat in two zones [W/m2 per 10 m/s K]: a draught.
DRAUGHT = -4.0


@cache
def twin() -> Case:
    """Three weeks of an office of four zones, quiet but for its thermostats."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.005, 0.01))
    settings = TwinSettings(days=21.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet)
    return generate_twin(building, 3, settings)[0]


@cache
def draughty() -> Case:
    """The same with what wind and cold take from two zones."""
    return _planted("heat_by_wind", twin().building.zone_names[:2], ("heat_by_wind",), DRAUGHT)


@cache
def sunny() -> Case:
    """The same with sun on its facades."""
    return _planted(SUN, twin().building.zone_names, [f"{SUN}_{k}" for k in range(4)], 6.0)


def _planted(effect: str, zones: Sequence[str], parameters: Sequence[str], size: float) -> Case:
    """The same with heat of unknown cause, by the model's own answer to it."""
    case = twin()
    built = ModelComparison(case, ModelSettings(dx=1.0)).build({effect: zones})
    first, found = np.array([4]), []
    for strength in (0.0, size):
        theta = built.theta(dict.fromkeys((f"{p}@{z}" for z in zones for p in parameters), strength))
        matrices = built.grid.matrices(theta, False)
        states, _ = spin_up(matrices, built.inputs, 0, first)
        found.append(free_runs(matrices, built.inputs, first, len(built.inputs) - 5, states)[0][0])
    frame = case.telemetry.frame.copy()
    for number, zone in enumerate(case.building.zone_names):
        (device,) = case.building.devices_of(zone)
        for point in ("zone_air_temperature_sensor", "discharge_air_temperature_sensor"):  # metered heat stays
            frame.iloc[5:, frame.columns.get_loc(f"{device.name}/{point}")] += (found[1] - found[0])[:, number]
    return Case(case.building, Telemetry.from_frame(frame))


@cache
def prepared(case: Case) -> tuple[ModelComparison, Fit, HeldOut]:
    models = ModelComparison(case, ModelSettings(dx=1.0))
    fit = models.fit({}, [{}])
    return models, fit, held_out(models, fit)


@cache
def corrected() -> Correction:
    models, fit, before = prepared(draughty())
    found = correct(models, fit, before, prepared(twin())[2])
    assert found is not None
    return found


def test_planted_heat_is_found_with_its_driver_and_its_zones() -> None:
    found, zones = corrected(), draughty().building.zone_names[:2]
    first = found.drivers[0]
    assert first.effect == "heat_by_wind" and set(zones) <= set(first.zones)
    assert first.share > 0.5 and first.p_value < 0.05
    models = prepared(draughty())[0]
    wind = models.drivers.wind * (models.drivers.usual.mean(axis=1) - models.drivers.outdoor) / 10.0
    for zone in zones:
        true = abs(DRAUGHT) * models.anatomy.rooms[zone].floor_area * np.sqrt(np.mean(wind**2))
        assert first.watts[zone] == pytest.approx(true, rel=0.5)  # some of it the calibration has made up for
        assert first.interval[zone][0] < first.watts[zone] < first.interval[zone][1] and first.mean[zone] < 0.0


def test_the_error_falls_on_days_that_nothing_was_fitted_to() -> None:
    found, floor = corrected(), prepared(twin())[2]
    assert found.after.mae < found.before.mae - 0.7 * (found.before.mae - floor.mae)
    assert found.share_closed is not None and found.interval is not None
    assert found.share_closed > 0.7 and found.interval[0] <= found.share_closed <= found.interval[1]


def test_nothing_is_certified_where_nothing_is_missing() -> None:
    models, fit, before = prepared(twin())
    found = correct(models, fit, before, before)
    assert found is None or found.before.mae - found.after.mae < 0.01


def test_sun_on_planes_that_no_zone_has_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    models, fit, before = prepared(sunny())
    facades = dict.fromkeys(sunny().building.zone_names, np.array([1.0, 1.0, 1.0, 1.0, 0.0]))
    monkeypatch.setattr(correction, "candidates", lambda *_: [Kind(SUN, facades)])  # as under another's flat
    found = correct(models, fit, before, prepared(twin())[2])
    assert found is not None and found.after.mae < before.mae
    (only,) = found.drivers
    assert only.effect == SUN and set(only.zones) == set(facades)
    assert all(low < only.watts[z] < high for z, (low, high) in only.interval.items())
    assert {f"{SUN}_4@{zone}": 0.0 for zone in facades}.items() <= found.fit.values.items()


@pytest.mark.long
def test_a_diagnosis_without_the_right_effect_hands_it_on(tmp_path: Path) -> None:
    every = [e for e in CATALOGUE if e != "solar_gain"]
    found = diagnose(draughty(), dx=1.0, ruled_out=every)
    assert found.verdict.name == "unexplained" and found.correction is not None
    assert any(r.chosen and r.name == "corrected" for r in found.rungs)
    assert found.predicts == pytest.approx(found.correction.after.mae, rel=1e-6)
    text = diagnosis_verdict(found)
    assert "Heat of unknown cause" in text and "wind in" in text and "calibration.json holds it" in text
    _whole(found, tmp_path)


def _whole(found: Diagnosis, out: Path) -> None:
    """What is written holds it, and a model can be made of that."""
    assert found.correction is not None
    page = write_diagnosis(found, draughty(), out / "d").read_text(encoding="utf-8")
    assert "<h2>Heat of unknown cause</h2>" in page
    told = diagnosis_summary(found)["correction"]
    first = told["drivers"][0]
    assert first["effect"] == "heat_by_wind" and first["answers_to"] == "wind"
    assert set(told["watts_rms"]) == set(told["zones"]) and told["false_discovery"] == 0.1
    content = json.loads((out / "d" / "calibration.json").read_text(encoding="utf-8"))
    assert {e["effect"] for e in content["effects"]} == {d.effect for d in found.correction.drivers}
    assert set(content["settings"]["effects"]) <= set(UNKNOWN)
    (only,) = read_posterior(out / "d" / "posterior.json").draw(draughty().building, 1)
    assert set(only.settings.effects) == {d.effect for d in found.correction.drivers}
    model = case_model(draughty(), out / "d" / "calibration.json")
    assert dict(zip([p.name for p in model.grid.network.parameters], model.theta, strict=True)) == pytest.approx(
        found.taken.values
    )
