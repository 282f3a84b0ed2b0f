"""Open windows: sought beyond the calibrated model, and again where another effect won that takes heat at like times."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import Refit, Work, held_out, look_again
from calibration.diagnosis.refit.search import search
from calibration.diagnosis.screen.gains import Gain
from calibration.diagnosis.screen.screen import screen
from calibration.diagnosis.screen.seen import WINDOWS
from calibration.evaluation.settings import ModelSettings
from thermal import Case, Telemetry
from thermal.inputs.provider import telemetry_inputs
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin
from thermal.units import AIR_HEAT_CAPACITY

FloatArray = NDArray[np.float64]

#: Window [m2], and the step of the telemetry [s].
AREA, STEP = 1.5, 900.0


@cache
def twin() -> Case:
    """Two weeks of an office of four zones whose thermostats hold it whatever a window lets out."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.005, 0.01))
    return generate_twin(building, 3, TwinSettings(days=15.0, step_seconds=STEP, dx=1.0, meter="exact", ranges=quiet))[
        0
    ]


@cache
def planted() -> tuple[Case, str, FloatArray]:
    """The twin with a window of its first zone opened once a working day; the zone, and when."""
    case, drivers, rng = twin(), telemetry_inputs(twin()), np.random.default_rng(2)
    zone = case.building.zone_names[0]
    there = np.flatnonzero(np.diff((drivers.occupancy > 0.5).astype(int)) == 1) + 1
    opened = np.zeros(len(drivers.stamps))
    for begin in there:
        first = begin + int(rng.integers(0, 20))
        opened[first : first + int(rng.integers(2, 8))] = 1.0
    unit = -AIR_HEAT_CAPACITY * 1.2 * drivers.through_windows[:, 0]  # 1.2 kg of air a cubic metre
    frame, (device,) = case.telemetry.frame.copy(), case.building.devices_of(zone)
    rate, discharge = (
        f"{device.name}/{point}_sensor" for point in ("supply_air_flowrate", "discharge_air_temperature")
    )
    assert (frame[rate] > 0.0).all()
    # the same heat by thrice the flow, so that no discharge temperature is impossible
    air = case.zone_temperatures()[zone]
    frame[discharge] = air + (frame[discharge] - air) / 3.0
    frame[rate] *= 3.0
    frame[discharge] += AREA * opened * unit / (AIR_HEAT_CAPACITY * frame[rate])
    return Case(case.building, Telemetry.from_frame(frame)), zone, opened


@cache
def at_work() -> tuple[ModelComparison, Fit, Work, tuple[Gain, ...]]:
    models = ModelComparison(planted()[0], ModelSettings(dx=1.0))
    models.drivers.openings = np.zeros_like(models.drivers.openings)  # nothing was seen at the start
    fit = models.fit({}, [{}])
    made, gains, _ = screen(models, fit, [WINDOWS, "capacity_limit", "flow_gain"])
    return models, fit, Work(models, fit, held_out(models, fit), made), tuple(gains)


def refit(effect: str) -> Refit:
    _, _, work, gains = at_work()
    gain = next(g for g in gains if g.effect == effect)
    found = work.refit([Gain(**{**vars(gain), "zones": (planted()[1],)})], {})
    assert found is not None
    return found


def test_windows_are_seen_beyond_the_calibrated_model_and_stay_seen_by_who_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    models, fit, work, _ = at_work()
    kept: dict[str, Any] = {}

    def stage(name: str, of: Callable[[], Any]) -> object:
        return kept[name] if name in kept else kept.setdefault(name, of())

    monkeypatch.setattr("calibration.diagnosis.refit.search.stage", stage)
    for _ in range(2):  # begun, and gone on with after all rounds
        models.drivers.openings = np.eye(*models.drivers.openings.shape)  # whatever was seen before
        found = search(models, fit, work.held_out, [WINDOWS])[0].accepted
        _, zone, opened = planted()
        seen = models.drivers.openings
        assert found is not None and found.screened.zones == (zone,)
        assert (seen[:, 0] * opened).sum() > 0.8 * max(opened.sum(), seen[:, 0].sum()) and not seen[:, 1:].any()


def test_windows_are_found_behind_the_effect_that_won() -> None:
    models, _, work, gains = at_work()
    models.drivers.openings = np.zeros_like(models.drivers.openings)
    won = refit("capacity_limit")
    first, *others = look_again(work, gains, [won], won)
    assert first.screened.effect == WINDOWS
    assert others == [won]
    assert first.gain > won.gain
    _, zone, opened = planted()
    assert first.screened.zones == (zone,)
    seen = models.drivers.openings
    assert (seen[:, 0] * opened).sum() > 0.8 * max(opened.sum(), seen[:, 0].sum())
    assert not seen[:, 1:].any()
    assert first.fit.values[f"opened_window_area@{zone}"] == pytest.approx(AREA, rel=0.15)


def test_the_old_openings_stay_where_the_new_ones_gain_less() -> None:
    models, _, work, gains = at_work()
    won, before = refit("capacity_limit"), np.eye(*models.drivers.openings.shape)
    models.drivers.openings = before
    better = Refit(**{**vars(refit(WINDOWS)), "gain": 1e6})
    assert look_again(work, gains, [better, won], won) == [better, won]
    assert models.drivers.openings is before


def test_nobody_looks_where_windows_are_no_rival() -> None:
    models, _, work, gains = at_work()
    before, won = models.drivers.openings, refit("flow_gain")
    assert look_again(work, gains, [won], won) == [won]
    assert look_again(work, gains, [won], None) == [won]
    assert look_again(work, [g for g in gains if g.effect != WINDOWS], [won], refit("capacity_limit")) == [won]
    assert models.drivers.openings is before
