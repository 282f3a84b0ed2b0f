"""Calibration: recovery of known parameters, what is fixed stays, held-out telemetry stays out, refusals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from calibration import CalibrationError, CalibrationResult, CalibrationSettings, Interval
from calibration import calibrate as calibrate_from_several_starts
from thermal import Building, Case, Inputs, Simulator, Telemetry, ThermalError, ZoneTable, build_network
from thermal.case.building import Airflow, Device, Layer, Location, Surface, ZoneEntry

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=0.0, timezone="Etc/GMT-1")
NOISE = 0.02  # K


def calibrate(case: Case, *intervals: Sequence[Interval], progress: Any = None, **settings: Any) -> CalibrationResult:
    """One start is enough here, but where starts are what is tested."""
    chosen = CalibrationSettings(**{"starts": 1, **settings})
    return calibrate_from_several_starts(case, *intervals, settings=chosen, progress=progress)


def cabin(zones: int = 1) -> Building:
    """A light building that forgets its start within hours: one room, or two with an opening and a fan between them."""
    layers = (Layer(thickness=0.06, conductivity=0.2, density=800.0, heat_capacity=1000.0),
              Layer(thickness=0.06, conductivity=0.04, density=30.0, heat_capacity=1000.0))  # fmt: skip
    names = ("room", "hall")[:zones]
    surfaces = [
        surface
        for i, name in enumerate(names)
        for surface in (
            Surface(name=f"W{i}", kind="wall", zone=name, other="outdoor", area=30.0 - 8 * i, azimuth=180.0, construction="wall"),
            Surface(name=f"G{i}", kind="window", zone=name, other="outdoor", area=4.0 - 2 * i, azimuth=0.0, u_value=1.3,
                    solar_transmittance=0.5),
        )
    ]  # fmt: skip
    if zones == 2:
        surfaces.append(Surface(name="O", kind="opening", zone="room", other="hall", area=0.2))
    entries = tuple(ZoneEntry(name=n, volume=60.0 - 20 * i, floor_area=24.0 - 8 * i) for i, n in enumerate(names))
    heaters = tuple(Device(name=f"heater_{n}", type="electric_heater", zone=n) for n in names)
    fans = (Device(name="fan", type="supply_air_terminal", zone="room"),) if zones == 2 else ()
    flows = (Airflow(source="room", target="hall", device="fan", fraction=0.5),) if zones == 2 else ()
    table = ZoneTable(entries, tuple(surfaces), {"wall": layers})
    return Building("cabin", SITE, 0.0, table, (*heaters, *fans), flows, weather_station="station")


def truth(building: Building, seed: int) -> dict[str, float]:
    """Parameters drawn from half of the prior."""
    rng = np.random.default_rng(seed)
    return {
        p.name: p.inverse(p.transform(p.start) + 0.5 * p.prior_deviation * rng.standard_normal())
        for p in build_network(building).parameters
    }


def telemetry(
    building: Building, parameters: dict[str, float], seed: int = 0, days: int = 12, step: float = 300.0
) -> Case:
    """What sensors would say of the building: our own simulator under random pulses of heat, with noise."""
    rng = np.random.default_rng(seed)
    zones = building.zone_names
    n, per = round(days * 86400.0 / step), round(3 * 3600.0 / step)
    heat = np.repeat(rng.integers(0, 2, (n // per + 1, len(zones))) * 350.0 + 50.0, per, axis=0)[:n]
    hours = np.arange(n) * step / 3600.0
    outdoor = 278.0 + 5.0 * np.sin(2 * np.pi * hours / 24.0) + 2.0 * np.sin(2 * np.pi * hours / 61.0)
    plant = Simulator(building, parameters, step_seconds=step)
    state = plant.reset(np.full(len(zones), 293.0), np.array([278.0]))
    flow = np.full(n, 0.04) if building.airflows else np.zeros(n)
    means, supplied = [], []
    for k in range(n):
        moved = heat[k].copy()
        if building.airflows:  # the fan blows air of 20 degC into the room; half of it goes on to the hall
            moved[0] += flow[k] * 1006.0 * (293.15 - state[0])
            supplied.append(293.15)
        state = plant.step(moved, outdoor[[k]], flow[[k]] * 0.5 if building.airflows else None)
        means.append(state)
    measured = np.array(means) + NOISE * rng.standard_normal((n, len(zones)))
    columns: dict[str, Any] = {"station/outside_air_temperature_sensor": outdoor}
    for i, zone in enumerate(zones):
        columns[f"{zone}/zone_air_temperature_sensor"] = measured[:, i]
        columns[f"heater_{zone}/heating_power_sensor"] = heat[:, i]
    if building.airflows:
        columns["fan/supply_air_flowrate_sensor"] = flow
        columns["fan/discharge_air_temperature_sensor"] = supplied
    index = pd.date_range(
        "2023-01-01", periods=n + 1, freq=pd.Timedelta(step, unit="s"), tz="Etc/GMT-1", name="timestamp"
    )[1:]
    return Case(building, Telemetry.from_frame(pd.DataFrame(columns, index=index)))


@cache
def recovered(seed: int) -> tuple[dict[str, float], CalibrationResult]:
    true = truth(cabin(), seed)
    return true, calibrate(telemetry(cabin(), true, seed))


SEEDS = range(5)


@pytest.mark.parametrize("seed", SEEDS)
def test_known_parameters_are_recovered(seed: int) -> None:
    """Identifiable ones within three standard errors; the held-out error is near the sensor's noise."""
    true, found = recovered(seed)
    assert found.solver.success
    assert found.solver.status == "Solve_Succeeded"
    identifiable = [p for p in found.parameters if p.identifiable]
    assert len(identifiable) >= 3
    for p in identifiable:
        assert p.standard_error is not None
        assert abs(p.value - true[p.name]) < 3.0 * p.standard_error, p.name
    errors = found.calibrated["held_out"].metrics
    floor = NOISE * np.sqrt(2.0 / np.pi)
    assert floor * 0.8 < errors.mae < 1.5 * floor
    assert found.uncalibrated["held_out"].metrics.mae > 5.0 * errors.mae


def test_standard_errors_cover_the_truth_over_seeds() -> None:
    """All parameters, also those that only the prior holds: two standard errors cover at least nine in ten."""
    inside = [
        abs(np.log(p.value / true[p.name])) < 2.0 * p.standard_error / p.value
        for true, found in map(recovered, SEEDS)
        for p in found.parameters
        if p.standard_error is not None
    ]
    assert len(inside) == 8 * len(SEEDS)
    assert np.mean(inside) >= 0.9


@pytest.mark.long
def test_errors_shrink_with_more_days() -> None:
    true = truth(cabin(), 1)
    short, long = (calibrate(telemetry(cabin(), true, 1, days)) for days in (6, 24))
    for a, b in zip(short.parameters, long.parameters, strict=True):
        assert b.standard_error is not None
        assert a.standard_error is not None
        assert b.standard_error / b.value < 1.05 * a.standard_error / a.value
    name = "exterior_wall_heat_capacity_multiplier"
    errors = [{p.name: p.standard_error for p in r.parameters}[name] for r in (short, long)]
    assert errors[1] < 0.8 * errors[0]  # type: ignore[operator]


def test_two_zones_with_directed_air_are_recovered() -> None:
    true = truth(cabin(2), 3)
    found = calibrate(telemetry(cabin(2), true, 3))
    assert found.solver.success
    assert found.calibrated["held_out"].metrics.mae < 0.03
    for p in found.parameters:
        if p.identifiable:
            assert p.standard_error is not None
            assert abs(p.value - true[p.name]) < 3.0 * p.standard_error, p.name


@pytest.mark.parametrize("step", [600.0, 1800.0, 3600.0])
def test_steps_of_up_to_an_hour_calibrate(step: float) -> None:
    """N = 36, 12, 6 for six hours; the means over long steps cost some error, not the fit."""
    case = telemetry(cabin(), truth(cabin(), 1), 1, step=step)
    found = calibrate(case)
    assert found.solver.success
    assert found.calibrated["held_out"].steps == round(21600.0 / step)
    assert found.calibrated["held_out"].metrics.mae < 0.15
    assert found.calibrated["held_out"].metrics.mae < 0.5 * found.uncalibrated["held_out"].metrics.mae


def test_second_order_steps_calibrate_too() -> None:
    case = telemetry(cabin(), truth(cabin(), 1), 1)
    found = calibrate(case, scheme="tr_bdf2")
    assert found.solver.success
    assert found.calibrated["held_out"].metrics.mae < 0.04


# Options


@cache
def plain_case() -> Case:
    return telemetry(cabin(), truth(cabin(), 2), 2)


@cache
def plain() -> CalibrationResult:
    return calibrate(plain_case())


def value(result: CalibrationResult, name: str) -> float:
    return {p.name: p.value for p in result.parameters}[name]


def test_fixed_parameters_stay_where_they_are() -> None:
    fixed = {"radiant_coefficient": 4.4, "furniture_coupling": 3.3}
    found = calibrate(plain_case(), fixed=fixed)
    for p in found.parameters:
        if p.name in fixed:
            assert p.value == fixed[p.name]
            assert p.standard_error is None
            assert not p.identifiable
            assert not p.at_bound
        else:
            assert p.standard_error is not None
            assert p.value != p.start
    names = [p.name for p in found.parameters]
    assert found.theta[names.index("radiant_coefficient")] == 4.4


def test_parameters_that_are_known_are_not_moved_much_by_noise() -> None:
    """With the others fixed at the truth, each estimate is within three standard errors of it."""
    true = truth(cabin(), 2)
    for name in ("interior_film_coefficient", "exterior_wall_conductivity_multiplier"):
        found = calibrate(plain_case(), fixed={k: v for k, v in true.items() if k != name})
        (p,) = (p for p in found.parameters if p.name == name)
        assert p.identifiable
        assert p.standard_error is not None
        assert abs(p.value - true[name]) < 3.0 * p.standard_error
        assert p.standard_error < 0.2 * p.value


@pytest.mark.long
def test_equal_seeds_give_equal_results_and_more_starts_no_worse_ones() -> None:
    first, again = (calibrate(plain_case(), starts=2, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.theta, again.theta)
    assert first.solver.starts == 2
    assert first.solver.success
    assert first.calibrated["tuning"].metrics.mae < 1.05 * plain().calibrated["tuning"].metrics.mae
    assert first.calibrated["held_out"].metrics.mae < 1.1 * plain().calibrated["held_out"].metrics.mae


@pytest.mark.long
def test_zone_scopes_are_estimated_zone_by_zone() -> None:
    case = telemetry(cabin(2), truth(cabin(2), 3), 3)
    found = calibrate(case, scopes={"furniture_heat_capacity": "zone"})
    names = [p.name for p in found.parameters]
    assert {"furniture_heat_capacity@room", "furniture_heat_capacity@hall"} <= set(names)
    assert found.solver.success


def test_progress_is_told() -> None:
    told: list[tuple[str, int, int]] = []
    calibrate(plain_case(), progress=lambda *message: told.append(message))
    assert told
    assert all(0 <= done <= total for _, done, total in told)


# Held-out telemetry


@pytest.mark.parametrize("rows", [2000, 400])
def test_held_out_targets_do_not_reach_the_estimate(monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    """Held out first, tuned after it: sensors of the held-out interval may serve the spin-up, never a residual."""
    import calibration.fit.problem as module

    case = plain_case()
    stamps = case.stamps
    held_out, tune = Interval(stamps[0], stamps[1439]), Interval(stamps[1440], stamps[1440 + rows])
    read = module.replay_inputs

    def spoilt(*arguments: Any) -> Inputs:
        inputs = read(*arguments)
        zone = inputs.zone.copy()
        zone[:1440] += 3.0  # what residuals and errors are taken from; `held` and `bridged` serve spin-up and starts
        return replace(inputs, zone=zone)

    wanted = calibrate(case, [tune], [held_out])
    monkeypatch.setattr(module, "replay_inputs", spoilt)
    found = calibrate(case, [tune], [held_out])
    np.testing.assert_array_equal(found.theta, wanted.theta)
    assert found.calibrated["held_out"].metrics.bias == pytest.approx(wanted.calibrated["held_out"].metrics.bias - 3.0)


def test_several_intervals_are_tuned_on_and_reported_in_order() -> None:
    case = plain_case()
    stamps = case.stamps
    parts = [Interval(stamps[i], stamps[j]) for i, j in ((2000, 2400), (600, 1200))]
    held_out = [Interval(stamps[i], stamps[j]) for i, j in ((2500, 2900), (1300, 1900))]
    found = calibrate(case, parts, held_out)
    assert found.tuning == tuple(reversed(parts))
    assert found.held_out == tuple(reversed(held_out))
    assert [p.interval for p in found.calibrated["held_out"].predictions] == list(reversed(held_out))
    assert found.calibrated["held_out"].metrics.mae < 0.03


# Refusals


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scheme": "euler"}, "implicit_euler"),
        ({"starts": 0}, "starts"),
        ({"horizon": "7min"}, "horizon"),
        ({"fixed": {"interior_film": 2.0}}, "interior_film"),
        ({"fixed": {"interior_film_coefficient": -2.0}}, "interior_film_coefficient"),
        ({"scopes": {"interior_film": "zone"}}, "interior_film"),
    ],
)
def test_options_that_cannot_be_are_refused_by_name(options: dict[str, Any], message: str) -> None:
    with pytest.raises((CalibrationError, ThermalError), match=message):
        calibrate(plain_case(), **options)


def test_all_parameters_fixed_leaves_nothing_to_calibrate() -> None:
    """Either refused by name, or the fixed values come back with a status that says so; never a crash of the solver."""
    true = truth(cabin(), 2)
    try:
        found = calibrate(plain_case(), fixed=true)
    except CalibrationError as error:
        assert "fixed" in str(error)
    else:
        assert {p.name: p.value for p in found.parameters} == true


def test_too_little_telemetry_is_refused() -> None:
    case = plain_case()
    short = Case(case.building, Telemetry.from_frame(case.telemetry.frame.iloc[:200]))
    with pytest.raises(CalibrationError, match="spin-up"):
        calibrate(short)


def test_tuning_without_a_usable_run_is_refused() -> None:
    frame = plain_case().telemetry.frame.copy()
    frame.iloc[:2304:40, frame.columns.get_loc("heater_room/heating_power_sensor")] = np.nan
    for start in range(0, 2304, 40):
        frame.iloc[start : start + 8, frame.columns.get_loc("heater_room/heating_power_sensor")] = np.nan
    case = Case(cabin(), Telemetry.from_frame(frame))
    with pytest.raises(CalibrationError, match=r"tuning|runs"):
        calibrate(case)
