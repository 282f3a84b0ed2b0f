"""Masses, losses, contents and shares by room against wrong instruments: twins of either kind, what a search is told."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from calibration.diagnosis.refit import challenge as module
from calibration.diagnosis.refit.challenge import challenge
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.screen.gains import choice_of
from calibration.evaluation.settings import ModelSettings
from calibration.fit.ladder import MASSES
from thermal._types import FloatArray
from thermal.case.building import FloorPlans, GeometryQuality
from thermal.case.case import Case
from thermal.case.plan import zone_floor_areas
from thermal.case.telemetry import Telemetry
from thermal.inputs.normalisation import fit_normalisation
from thermal.inputs.provider import telemetry_inputs
from thermal.network.structure import Structure
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin
from thermal.pilot.weather import draw_disturbance
from thermal.units import air_density


def office(*by_zone: str, quality: GeometryQuality = "approximate") -> Case:
    """A twin under pseudo-random setpoints, some of whose parameters are each zone's own."""
    drawn = pilot_building(4, floor_area=150.0, zones=5, floors=1, name="office")
    building = replace(drawn, geometry_quality=quality)
    quiet = TwinRanges(disturbance_deviation=(0.01, 0.02), noise=(0.005, 0.01))
    settings = TwinSettings(
        days=12.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet, excitation="prbs",
        scopes=dict.fromkeys(by_zone, "zone"),
    )  # fmt: skip
    return generate_twin(building, 4, settings)[0]


def full_of_light_things(monkeypatch: pytest.MonkeyPatch) -> Case:
    """A twin in which three times as much as the air follows it at once."""
    building = pilot_building(5, floor_area=80.0, zones=2, floors=1, name="office")
    quiet = TwinRanges(noise=(0.01, 0.02), disturbance_deviation=(0.02, 0.05))
    settings = TwinSettings(days=14.0, step_seconds=300.0, dx=1.0, meter="exact", ranges=quiet)
    with monkeypatch.context() as heavy:
        heavy.setattr("thermal.network.build.air_density", lambda elevation: 3.0 * air_density(elevation))
        return generate_twin(building, 5, settings)[0]


def crowded(monkeypatch: pytest.MonkeyPatch, shares: Sequence[float]) -> Case:
    """A twin with people that no meter knows of, more of them in some rooms than in others."""
    building = pilot_building(5, floor_area=120.0, zones=len(shares), floors=1, name="office")
    quiet = TwinRanges(noise=(0.01, 0.02), disturbance_deviation=(0.01, 0.02))
    settings = TwinSettings(days=14.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet)
    empty = generate_twin(building, 5, settings)[0]
    assert isinstance(empty.building.geometry, FloorPlans)
    areas = zone_floor_areas(empty.building.geometry)
    density = 10.0 * np.array([share * areas[zone] for share, zone in zip(shares, building.zone_names, strict=True)])
    presence = telemetry_inputs(empty, fit_normalisation(empty)).occupancy

    def heat(seed: int, count: int, *of: Any) -> FloatArray:
        drawn = draw_disturbance(seed, count, *of)
        drawn[count - presence.size :] += presence[:, None] * density
        return drawn

    with monkeypatch.context() as busy:
        busy.setattr("thermal.pilot.twin.draw_disturbance", heat)
        return generate_twin(building, 5, settings)[0]


def wrong_meters(case: Case) -> Case:
    frame = case.telemetry.frame.copy()
    for share, device in zip((0.65, 1.4), case.building.devices, strict=False):
        frame[f"{device.name}/supply_air_flowrate_sensor"] *= share
    return Case(case.building, Telemetry.from_frame(frame))


def accepted(models: ModelComparison) -> list[Any]:
    """Rounds that accepted a gain of every meter."""
    before, zones = models.fit({}, [{}]), models.case.building.zone_names
    after = models.fit({"flow_gain": zones}, [before.values])
    gain = after.evidence - before.evidence - choice_of(len(zones), len(zones))
    return [SimpleNamespace(before=before, after=after, accepted=named("flow_gain", gain))]


def named(effect: str, gain: float) -> SimpleNamespace:
    return SimpleNamespace(screened=SimpleNamespace(effect=effect), gain=gain)


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[tuple[ModelComparison, Fit]]:
    """What another search is told to start from; a search is not what is looked at here."""
    found: list[tuple[ModelComparison, Fit]] = []

    def search(models: ModelComparison, baseline: Fit, *_: Any) -> tuple[SimpleNamespace, ...]:
        found.append((models, baseline))
        return (SimpleNamespace(after=baseline),)

    monkeypatch.setattr(module, "search", search)
    monkeypatch.setattr(module, "judge", lambda *_: SimpleNamespace(name="named"))
    return found


def test_masses_by_zone_take_the_name_from_meters(told: list[tuple[ModelComparison, Fit]]) -> None:
    models = ModelComparison(office(*MASSES), ModelSettings(dx=1.0))
    rounds = accepted(models)
    again, found = challenge(models, rounds, ["flow_gain"])
    ((zoned, baseline),) = told
    assert found == (SimpleNamespace(after=baseline),)
    assert again is zoned and set(zoned.settings.scopes) == set(MASSES)
    assert (zoned.tuned, zoned.judged) == (models.tuned, models.judged)
    assert not baseline.effects and baseline.evidence > rounds[0].after.evidence - 12.0


@pytest.mark.parametrize("quality", ["approximate", "surveyed"])
def test_losses_by_zone_take_it_where_the_drawing_is_no_survey(
    told: list[tuple[ModelComparison, Fit]], quality: GeometryQuality
) -> None:
    models = ModelComparison(office("window_u_value", quality=quality), ModelSettings(dx=1.0))
    again, _ = challenge(models, accepted(models), ["flow_gain"])
    assert len(told) == 1
    assert ("window_u_value" in again.settings.scopes) is (quality == "approximate")


def test_light_contents_take_it_from_sensors_that_lag(
    told: list[tuple[ModelComparison, Fit]], monkeypatch: pytest.MonkeyPatch
) -> None:
    models = ModelComparison(full_of_light_things(monkeypatch), ModelSettings(dx=1.0))
    before = models.fit({}, [{}])
    after = models.fit({"sensor_lag": ()}, [before.values])
    gain = after.evidence - before.evidence
    lag: Any = SimpleNamespace(before=before, after=after, accepted=named("sensor_lag", gain))
    assert gain > 3.0
    again, _ = challenge(models, [lag], ["sensor_lag"])
    ((_, baseline),) = told
    assert again.settings.structure.light_contents and not again.settings.scopes
    assert not baseline.effects and baseline.evidence > after.evidence
    assert baseline.values["air_capacity_multiplier"] == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize("shares", [(1.5, 0.4, 1.3, 0.6, 1.2), (1.0, 1.0, 1.0, 1.0, 1.0)])
def test_shares_of_rooms_take_it_from_their_meters(
    told: list[tuple[ModelComparison, Fit]], monkeypatch: pytest.MonkeyPatch, shares: Sequence[float]
) -> None:
    models = ModelComparison(crowded(monkeypatch, shares), ModelSettings(dx=1.0))
    zones, before = models.case.building.zone_names, models.fit({}, [{}])
    people = models.fit({"internal_gains": ()}, [before.values])
    after = models.fit({"internal_gains": (), "flow_gain": zones}, [people.values])
    first, second = people.evidence - before.evidence, after.evidence - people.evidence - choice_of(5, 5)
    rounds: list[Any] = [
        SimpleNamespace(before=before, after=people, accepted=named("internal_gains", first)),
        SimpleNamespace(before=people, after=after, accepted=named("flow_gain", second)),
    ]
    apart = models.built_as(replace(models.settings, structure=Structure(uneven=("internal_gains",))))
    unlike = apart.fit({"internal_gains": ()}, [people.values])
    assert first > 6.0
    if len(set(shares)) == 1:  # shares that need not be have their price
        assert unlike.evidence < people.evidence
        return
    challenge(models, rounds, ["internal_gains", "flow_gain"])
    (searched, baseline), *_ = told  # what is the likeliest; the search that stands in here finds nothing
    assert searched.settings == apart.settings and not baseline.effects
    assert unlike.evidence > after.evidence
    found = np.array([unlike.values[f"internal_gain_room_share@{zone}"] for zone in zones])
    np.testing.assert_allclose(found / found.mean(), np.array(shares) / np.mean(shares), atol=0.15)


def test_a_search_that_stops_short_of_what_was_found_is_not_taken(
    told: list[tuple[ModelComparison, Fit]], monkeypatch: pytest.MonkeyPatch
) -> None:
    models = ModelComparison(office(*MASSES), ModelSettings(dx=1.0))
    rounds = accepted(models)
    short = SimpleNamespace(after=SimpleNamespace(evidence=rounds[0].after.evidence - 100.0))
    monkeypatch.setattr(module, "search", lambda *_: (short,))
    assert challenge(models, rounds, ["flow_gain"]) == (models, tuple(rounds))


def test_meters_that_are_wrong_keep_it(told: list[tuple[ModelComparison, Fit]]) -> None:
    models = ModelComparison(wrong_meters(office()), ModelSettings(dx=1.0))
    rounds = accepted(models)
    assert rounds[0].after.evidence > rounds[0].before.evidence + 12.0
    assert challenge(models, rounds, ["flow_gain"]) == (models, tuple(rounds))
    assert told == []


def test_where_nothing_is_missing_or_masses_are_what_is_nothing_is_challenged(
    told: list[tuple[ModelComparison, Fit]], monkeypatch: pytest.MonkeyPatch
) -> None:
    models = ModelComparison(office(*MASSES), ModelSettings(dx=1.0))
    rounds = accepted(models)
    masses = SimpleNamespace(**vars(rounds[0]) | {"after": SimpleNamespace(effects={"hidden_mass": ()})})
    assert challenge(models, [masses], [])[1] == (masses,)
    monkeypatch.setattr(module, "judge", lambda *_: SimpleNamespace(name="no_gap"))
    assert challenge(models, rounds, [])[1] == tuple(rounds)
    assert told == []


def test_masses_are_weighed_alone_and_beside_each_part_of_what_was_found() -> None:
    chain = [({}, 100.0), ({"ground_exchange": ()}, 120.0), ({"ground_exchange": (), "flow_gain": ("a",)}, 135.0)]
    fits = [SimpleNamespace(effects=effects, evidence=evidence) for effects, evidence in chain]
    rounds: list[Any] = [
        SimpleNamespace(before=fits[0], after=fits[1], accepted=named("ground_exchange", 20.0)),
        SimpleNamespace(before=fits[1], after=fits[2], accepted=named("flow_gain", 12.0)),  # its zone costs 3
        SimpleNamespace(before=fits[2], after=fits[2], accepted=None),
    ]
    alone, beside = module._rivals(rounds, {})
    assert alone == ({}, 135.0 - 6.0 - 3.0)
    assert beside == ({"ground_exchange": ()}, 135.0 - 6.0 - 3.0)
    assert list(module._rivals(rounds[:1], {})) == [({}, 120.0 - 6.0), ({"ground_exchange": ()}, 120.0 + 6.0)]
    nothing: Any = SimpleNamespace(before=fits[0], after=fits[0], accepted=None)
    assert list(module._rivals([nothing], {})) == [({}, 100.0 + 6.0)]
