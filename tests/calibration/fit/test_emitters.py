"""A calibration finds out what heaters give their heat by where the case does not say it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from calibration.diagnosis.baseline import fit_baseline
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import held_out
from calibration.diagnosis.seek import seek
from calibration.fit.calibrate import calibrate
from calibration.fit.result import CalibrationResult
from mpc.reports.calibration import calibration_verdict
from thermal.case.building import Building, Device, Layer, Location, Surface, ZoneEntry, ZoneTable
from thermal.case.case import Case
from thermal.case.points import HEATING_POWER, OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE
from thermal.case.telemetry import Telemetry
from thermal.effects.gains import daily_course
from thermal.model.matrices import SymbolicModel
from thermal.model.step import IMPLICIT_EULER, Stepper
from thermal.network.build import build_network

SITE = Location(latitude=48.0, longitude=12.0, elevation=0.0, timezone="Etc/GMT-1")
SCREED = Layer(thickness=0.06, conductivity=1.2, density=2000.0, heat_capacity=1000.0)
FOAM = Layer(thickness=0.08, conductivity=0.035, density=30.0, heat_capacity=1450.0)
BRICK = Layer(thickness=0.2, conductivity=0.6, density=1600.0, heat_capacity=900.0)
ZONES = ("below", "above")

#: Heat of people that no meter knows of, by the hour of the day and room [W]: evenings below, nights above.
PEOPLE = np.zeros((24, 2))
PEOPLE[18:23, 0], PEOPLE[[22, 23, *range(7)], 1] = 400.0, 300.0


def house(*emitters: str | None) -> Building:
    """A room over another, with a heater each."""
    faces: list[dict[str, Any]] = [
        {"name": "F", "kind": "floor", "zone": "below", "other": "ground", "construction": "floor", "area": 20.0},
        {"name": "S", "kind": "floor", "zone": "above", "other": "below", "construction": "floor", "area": 20.0},
        {"name": "R", "kind": "ceiling", "zone": "above", "other": "outdoor", "construction": "wall", "area": 20.0},
    ]
    for zone in ZONES:
        faces += [
            {"name": f"W {zone}", "kind": "wall", "zone": zone, "other": "outdoor", "area": 30.0, "azimuth": 180.0,
             "construction": "wall"},
            {"name": f"G {zone}", "kind": "window", "zone": zone, "other": "outdoor", "area": 4.0, "azimuth": 180.0,
             "u_value": 1.3, "solar_transmittance": 0.5},
        ]  # fmt: skip
    table = ZoneTable(
        tuple(ZoneEntry(name=z, volume=50.0, floor_area=20.0) for z in ZONES),
        tuple(Surface(**f) for f in faces), {"floor": (SCREED, FOAM), "wall": (BRICK, FOAM)},
    )  # fmt: skip
    heaters = tuple(
        Device(name=f"H_{z}", type="radiator", zone=z, emitter=cast(Any, e)) for z, e in zip(ZONES, emitters, strict=True)
    )
    return Building("twin", SITE, 0.0, table, devices=heaters)


def twin(*emitters: str | None, days: int = 6, leaks: float = 0.0, people: bool = False) -> Case:
    """Telemetry of a house with these emitters, by half hours, and a case that says nothing of them.

    Each room may leak besides, air of this conductance to outdoor [W/K], and people may live there.
    """
    rng, truth = np.random.default_rng(3), build_network(house(*emitters))
    m = SymbolicModel(truth).matrices(truth.start())
    stamps = pd.date_range("2024-01-01 00:30", periods=48 * days, freq="30min", tz="Etc/GMT-1", name="timestamp")
    hour = np.arange(stamps.size) / 2.0
    outdoor = 2.0 + 4.0 * np.sin(2.0 * np.pi * (hour - 9.0) / 24.0) + np.cumsum(rng.normal(0.0, 0.2, stamps.size))
    heat = 1600.0 * (rng.random((stamps.size // 4 + 1, 2)) < 0.5).repeat(4, axis=0)[: stamps.size]
    stepper, state, zone = Stepper(m, 1800.0, IMPLICIT_EULER), 18.0 * m.uniform[:, None], []
    for k in range(stamps.size):
        outside = np.array([outdoor[k], *(heat[k, ZONES.index(s.name.rpartition(" ")[2])] for s in truth.signals)])
        lost = leaks * (zone[-1] - outdoor[k]) if zone else 0.0
        lost = lost - people * PEOPLE[stamps[k].hour] * rng.uniform(0.8, 1.2)
        state, mean, _, _ = stepper.advance(state, outside[:, None], (heat[k] - lost)[:, None], np.zeros((0, 1)))
        zone.append(mean[:, 0] + rng.normal(0.0, 0.03, 2))
    frame = pd.DataFrame({f"weather_station/{OUTDOOR_TEMPERATURE}": outdoor + 273.15}, index=stamps)
    for i, name in enumerate(ZONES):
        frame[f"{name}/{ZONE_TEMPERATURE}"] = np.array(zone)[:, i] + 273.15
        frame[f"H_{name}/{HEATING_POWER}"] = heat[:, i]
    return Case(house(None, None), Telemetry.from_frame(frame))


def climbed(case: Case) -> CalibrationResult:
    return calibrate(case, settings={"climb": True, "starts": 1})


@pytest.mark.long
def test_a_heated_floor_is_found_and_where_it_is() -> None:
    case = twin("floor", "radiator")
    found = climbed(case)
    errors = {rung.name: rung.left_out_mae for rung in found.rungs}
    assert errors["floor"] < 0.2 * errors["drawn"] and found.settings.structure.emitter == "floor"
    shares = {p.name.partition("@")[2]: p.value for p in found.parameters if p.base == "floor_heat_share"}
    assert shares["below"] > 0.9 > 0.3 > shares["above"]
    assert "as if the floor were heated in below; in the others as if radiators gave it" in calibration_verdict(found)
    # what the file says is as good
    told = calibrate(replace(case, building=house("floor", "radiator")), settings={"starts": 1})
    assert not any(p.base == "floor_heat_share" for p in told.parameters)
    assert told.calibrated["held_out"].metrics.mae < 1.1 * found.calibrated["held_out"].metrics.mae < 0.2


def test_the_baseline_of_a_diagnosis_knows_rooms_with_radiators_from_those_with_heated_floors() -> None:
    models, fit = fit_baseline(ModelComparison(twin("floor", "radiator")), {})
    assert fit.values["floor_heat_share@below"] > 0.9 > 0.3 > fit.values["floor_heat_share@above"]
    assert held_out(models, fit).mae < 0.2


def test_rooms_are_told_apart_though_a_meter_reads_half() -> None:
    case = twin("floor", "radiator")
    frame = case.telemetry.frame.copy()
    frame[f"H_below/{HEATING_POWER}"] *= 0.5
    models, fit = fit_baseline(ModelComparison(Case(case.building, Telemetry.from_frame(frame))), {})
    assert fit.values["floor_heat_share@below"] > 0.9 > 0.3 > fit.values["floor_heat_share@above"]
    assert held_out(models, fit).mae < 0.5


def test_heated_floors_are_found_though_a_lumped_model_makes_up_for_leaks() -> None:
    models, fit = fit_baseline(ModelComparison(twin("floor", "floor", leaks=25.0)), {})
    assert models.settings.structure.emitter == "floor"
    found = models.fit({"infiltration": ()}, [fit.values])
    assert held_out(models, found).mae < 0.2 * held_out(models, fit).mae


@pytest.mark.long
def test_leaks_of_a_house_with_heated_floors_are_found() -> None:
    found = seek(twin("floor", "floor", days=14, leaks=40.0))
    assert found.models.settings.structure.emitter == "floor"
    assert found.verdict.name == "group" and set(found.verdict.candidates[0].group) == {"infiltration", "thermal_bridge"}


def test_peoples_heat_that_recurs_in_each_room_is_found_as_drawn() -> None:
    found = seek(twin(None, None, days=18, people=True))
    assert found.free is None and found.structures is not None
    assert (found.verdict.name, found.verdict.candidates[0].effect) == ("named", "internal_gains")
    assert found.verdict.candidates[0].zones == ZONES and found.verdict.candidates[0].probability > 0.7
    told = found.to_dict()
    assert found.gap == told["gap"]["mae"] > 3.0 * found.left
    first = told["how_far"][0]
    assert (first["effects"], first["held_out_mae_before"]) == (("internal_gains",), found.gap)
    assert first["placebo"]["shuffled"] is None  # other days are the same
    assert [rung.name for rung in found.structures.rungs if rung.chosen] == ["people"]
    # the first harmonics of what was put in
    for i, zone in enumerate(ZONES):
        course, true = daily_course(zone, found.rounds[-1].after.values), PEOPLE[:, i] / 20.0
        harmonics = np.fft.rfft(true)
        harmonics[4:] = 0.0
        smooth = np.fft.irfft(harmonics)
        assert np.corrcoef(course, smooth)[0, 1] > 0.95
        # of the model's heat half warms the surfaces, of the house's all the air
        assert 1.0 < np.ptp(course) / np.ptp(smooth) < 2.0


def test_peoples_heat_is_found_beside_leaks() -> None:
    found = seek(twin(None, None, days=18, people=True, leaks=10.0))
    assert (found.verdict.name, found.verdict.candidates[0].effect) == ("named", "internal_gains")
    assert found.left < 0.4 * found.gap


@pytest.mark.long
def test_people_are_not_sought_where_somebody_knows_of_them() -> None:
    case = twin(None, None, days=18, people=True)
    for said in ({"ruled_out": ("internal_gains",)}, {"known": ("internal_gains",)}):
        found = seek(case, **said)  # type: ignore[arg-type]
        assert found.structures is None or not any("people" in rung.name for rung in found.structures.rungs)


def test_a_house_without_people_has_no_heat_that_recurs() -> None:
    case = twin(None, None, days=18)
    assert seek(case).verdict.name == "no_gap"
    result = climbed(case)
    assert not result.settings.effects and not any(rung.name == "people" for rung in result.rungs)


def test_radiators_are_no_floors() -> None:
    found = climbed(twin("radiator", "radiator"))
    assert found.settings.structure.emitter != "floor"
    assert "floor were heated" not in calibration_verdict(found)
