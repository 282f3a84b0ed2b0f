"""Equipment of a zone that nobody meters: heat that is always on, beside a valve that leaks, and heat that is switched."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.diagnosis.decide.verdict import group_of
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import held_out
from calibration.diagnosis.refit.repeat import agreement
from calibration.diagnosis.refit.search import Round, search
from calibration.diagnosis.screen.screen import Screening
from calibration.evaluation.settings import ModelSettings
from thermal import Case, Telemetry
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin
from thermal.units import AIR_HEAT_CAPACITY

FloatArray = NDArray[np.float64]

SOUGHT = ("internal_gains", "valve_leak", "flow_gain", "capacity_limit")


@cache
def twin() -> Case:
    """Three weeks of an office of four zones whose thermostats hold it whatever heats it."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.005, 0.01))
    return generate_twin(building, 3, TwinSettings(days=22.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet))[
        0
    ]


def heated(watts: FloatArray | float) -> tuple[ModelComparison, Fit, str]:
    """The twin with heat in its second zone that its terminal need not give; the zone."""
    case = twin()
    zone = case.building.zone_names[1]
    frame, (device,) = case.telemetry.frame.copy(), case.building.devices_of(zone)
    rate, discharge = (
        f"{device.name}/{point}_sensor" for point in ("supply_air_flowrate", "discharge_air_temperature")
    )
    # the same heat by thrice the flow, so that no discharge temperature is impossible
    air = case.zone_temperatures()[zone]
    frame[discharge] = air + (frame[discharge] - air) / 3.0
    frame[rate] *= 3.0
    frame[discharge] -= watts / (AIR_HEAT_CAPACITY * frame[rate])
    models = ModelComparison(Case(case.building, Telemetry.from_frame(frame)), ModelSettings(dx=1.0))
    return models, models.fit({}, [{}]), zone


def searched(watts: FloatArray | float) -> tuple[Round, ModelComparison, str]:
    models, fit, zone = heated(watts)
    return search(models, fit, held_out(models, fit), SOUGHT)[0], models, zone


def test_heat_that_is_always_on_is_told_with_the_valve_that_would_do_the_same() -> None:
    first, _, zone = searched(400.0)
    assert first.accepted is not None and first.accepted.screened.zones == (zone,)
    # where air always flows they are one
    assert {"internal_gains", "valve_leak"} <= {*group_of(first, first.accepted.screened.effect)}
    gains = next(r for r in first.refits if r.screened.effect == "internal_gains")
    assert gains.zones == (zone,)
    area = first.before.built.network.anatomy.rooms[zone].floor_area
    assert gains.fit.values[f"equipment_gain@{zone}"] * area == pytest.approx(400.0, rel=0.2)
    # no data tell anything of what is never seen on, and its two halves do not disagree of it
    own = {name for name in gains.fit.values if name.endswith(f"@{zone}")}
    assert own - gains.fit.told == {f"switched_heat@{zone}"}
    assert agreement(gains.fit)["internal_gains"].agrees


def test_heat_that_is_switched_is_seen_and_sized() -> None:
    rng, steps = np.random.default_rng(4), len(twin().telemetry.frame)
    on = np.zeros(steps)
    for begin in rng.integers(0, steps - 20, 32):
        on[begin : begin + int(rng.integers(5, 18))] = 1.0
    first, models, zone = searched(1200.0 * on)
    accepted = first.accepted
    assert accepted is not None and (accepted.screened.effect, accepted.screened.zones) == ("internal_gains", (zone,))
    seen = models.drivers.switched
    assert (seen[:, 1] * on).sum() > 0.85 * max(on.sum(), seen[:, 1].sum()) and not np.delete(seen, 1, axis=1).any()
    # half of it is radiated, which the heat that is planted is not
    assert 1200.0 < accepted.fit.values[f"switched_heat@{zone}"] < 3000.0
    assert accepted.held_out.mae < 0.6 * first.held_out.mae


def test_heat_that_is_on_in_one_half_only_is_no_disagreement() -> None:
    rng, steps = np.random.default_rng(6), len(twin().telemetry.frame)
    on = np.zeros(steps)
    for begin in rng.integers(300, steps // 4, 10):
        on[begin : begin + int(rng.integers(5, 18))] = 1.0
    models, _, zone = heated(1500.0 * on)
    models.drivers.switched = np.zeros_like(models.drivers.switched)
    models.drivers.switched[:, 1] = on
    fit = models.fit({"internal_gains": [zone]}, [{}])
    assert fit.values[f"switched_heat@{zone}"] > 1000.0
    told = agreement(fit)["internal_gains"]
    first, second = (half[f"switched_heat@{zone}"] for half in told.estimates)
    assert first > 5.0 * second and told.agrees


def test_without_any_there_is_none_and_all_zones_have_no_equipment() -> None:
    models, fit, _ = heated(0.0)
    made = Screening(models, fit, SOUGHT)
    assert not models.drivers.switched.any()
    members, everywhere = made.members_of("internal_gains")
    assert list(members) == list(models.case.building.zone_names) and list(everywhere) == [()]
    for way in made.ways("internal_gains"):
        assert len(way.zones) < 4 and way.gain < 6.0
