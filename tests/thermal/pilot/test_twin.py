"""Twins against what is true of them: heat, noise, replay, parameters."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from thermal import (
    PARAMETERS,
    Case,
    ModelError,
    SymbolicModel,
    build_network,
    free_runs,
    load_bundled_case,
    load_case,
    replay_inputs,
    save_case,
    spin_up,
)
from thermal.case.building import Building, Location, ZoneTable
from thermal.case.plan import zone_floor_areas
from thermal.errors import ThermalError
from thermal.model.step import Stepper
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, TwinTruth, _draw_conditions, _draw_values
from thermal.pilot.twin import generate_twin as generate

QUIET = TwinRanges(disturbance_deviation=(0.0, 0.0), noise=(0.0, 0.0))
LOUD = TwinRanges(disturbance_deviation=(2.0, 2.0), disturbance_time=(7200.0, 7200.0), noise=(0.05, 0.05))
SHORT: dict[str, Any] = {"days": 2.0, "spin_up_days": 0.5, "dx": 1.0}
Twin = tuple[Case, TwinTruth]


@pytest.fixture(scope="module")
def building() -> Building:
    return load_bundled_case().building


@pytest.fixture(scope="module")
def quiet(building: Building) -> Twin:
    return generate(building, 1, TwinSettings(ranges=QUIET, meter="exact", **SHORT))


@pytest.fixture(scope="module")
def sensed(building: Building) -> Twin:
    return generate(building, 1, TwinSettings(ranges=LOUD, **SHORT))


@pytest.fixture(scope="module")
def metered(building: Building) -> Twin:
    return generate(building, 1, TwinSettings(ranges=LOUD, meter="exact", **SHORT))


def flow(case: Case) -> np.ndarray:
    return case.telemetry.frame.filter(regex="/supply_air_flowrate_sensor$").to_numpy()


def noise_of(twin: Twin) -> np.ndarray:
    return twin[0].zone_temperatures().to_numpy() - twin[1].zone_temperatures


def test_a_user_gets_a_whole_case(sensed: Twin) -> None:
    case, truth = sensed
    assert case.telemetry.frame.shape == (2 * 288, 7 + 5 * 5)
    assert str(case.stamps[0]) == "2023-01-09 00:05:00-05:00"
    for signals in (case.zone_temperatures(), case.zone_heat(), case.boundary_temperatures()):
        assert signals.notna().all().all()
    assert sum(case.quality.count(kind) for kind in ("gap", "impossible", "flat", "spike")) == 0
    assert {p.name for p in truth.parameters} == set(truth.values)


def test_without_disturbance_and_noise_the_true_model_replays_it(quiet: Twin) -> None:
    case, truth = quiet
    network = build_network(case.building, dx=1.0)
    matrices, inputs = SymbolicModel(network).matrices(truth.theta), replay_inputs(case, network)
    means, _ = free_runs(matrices, inputs, np.array([0]), len(inputs) - 1, truth.states[:, None])
    assert np.abs(means[0][:72] - inputs.zone[1:73]).max() < 1e-9
    assert np.abs(means[0] - inputs.zone[1:]).max() < 1e-8


def test_after_a_long_hold_it_replays_without_the_true_states(building: Building) -> None:
    """Light walls and slabs forget their start within four days of zones held at their temperatures."""
    fixed = {"exterior_wall_heat_capacity": 200.0, "interior_wall_heat_capacity": 200.0, "slab_heat_capacity": 3e4}
    case, truth = generate(
        building, 2, TwinSettings(days=5.0, spin_up_days=1.0, dx=1.5, ranges=QUIET, meter="exact", fixed=fixed)
    )
    network = build_network(case.building, dx=1.5)
    matrices, inputs = SymbolicModel(network).matrices(truth.theta), replay_inputs(case, network)
    starts = np.array([4 * 288 + 12 * hour for hour in (2, 4, 13, 15)])

    def error(held: np.ndarray) -> float:
        states, _ = spin_up(matrices, replace(inputs, held=held), 0, starts)
        means, _ = free_runs(matrices, inputs, starts, 72, states)
        return float(np.abs(means[:, -1] - inputs.zone[starts + 72]).max())

    stepper, states = Stepper(matrices, 300.0), [truth.states[:, None]]
    for k in range(1, len(inputs)):
        states.append(stepper.advance(states[-1], inputs.boundary[k][:, None], truth.heat[k][:, None])[0])
    assert error(np.array([(network.observation @ state)[:, 0] for state in states])) < 1e-4
    assert error(inputs.held) < 0.02  # telemetry holds means over a step: the hold is half a step late


def test_energy_is_balanced(sensed: Twin) -> None:
    """What is stored more after two days is the heat of the terminals and the unmeasured heat, less what went out."""
    case, truth = sensed
    model = SymbolicModel(build_network(case.building, dx=1.0)).matrices(truth.theta)
    stepper, outdoor = Stepper(model, 300.0), case.boundary_temperatures().to_numpy()
    states, lost = truth.states[:, None], 0.0
    for k in range(1, len(outdoor)):
        heat = (truth.heat[k] + truth.disturbance[k])[:, None]
        states, mean, _, _ = stepper.advance(states, outdoor[k][:, None], heat)
        assert np.allclose(mean[:, 0], truth.zone_temperatures[k], atol=1e-9, rtol=0.0)
        lost += 300.0 * float(np.sum(model.flow @ np.concatenate([states[:, 0], outdoor[k]])))
    stored = float(np.sum(model.capacity @ (states[:, 0] - truth.states)))
    given = 300.0 * float((truth.heat[1:] + truth.disturbance[1:]).sum())
    assert stored == pytest.approx(given - lost, abs=1e-9 * max(abs(given), abs(lost)))
    assert abs(truth.disturbance).sum() > 0.01 * abs(truth.heat).sum()


def innovations(case: Case, truth: TwinTruth, dx: float) -> np.ndarray:
    """One-step errors of the Kalman filter that knows all that is true, each over its own deviation.

    States are the volumes, the unmeasured heat, and the zones at the start of the step: telemetry holds means over it.
    """
    network = build_network(case.building, dx=dx)
    m, inputs = SymbolicModel(network).matrices(truth.theta), replay_inputs(case, network)
    n, k, step = m.n, len(network.zones), inputs.step
    inverse = np.linalg.inv((m.capacity + step * m.flow[:, :n]).toarray())
    forced = step * inverse @ m.heating.toarray()
    keep = np.exp(-step / truth.disturbance_time)
    areas = np.array(list(zone_floor_areas(case.building.geometry).values()))  # type: ignore[arg-type]
    advance, observe = np.zeros((n + 2 * k, n + 2 * k)), np.zeros((k, n + 2 * k))
    advance[:n, :n], advance[:n, n : n + k] = inverse @ m.capacity.toarray(), keep * forced
    advance[n : n + k, n : n + k] = keep * np.eye(k)
    advance[n + k :, :n] = network.observation.toarray()
    observe[:, :n], observe[:, n + k :] = 0.5 * network.observation.toarray(), 0.5 * np.eye(k)
    drive = np.vstack([forced, np.eye(k), np.zeros((k, k))]) * (truth.disturbance_deviation * areas)
    process = (1.0 - keep**2) * drive @ drive.T
    mean = np.concatenate([truth.states, truth.disturbance[0], np.zeros(k)])
    spread, found = np.zeros_like(advance), []
    for row in range(1, len(inputs)):
        mean = advance @ mean
        mean[:n] += forced @ inputs.heat[row] - step * inverse @ (m.flow[:, n:] @ inputs.boundary[row])
        spread = advance @ spread @ advance.T + process
        miss, covariance = inputs.zone[row] - observe @ mean, observe @ spread @ observe.T + truth.noise**2 * np.eye(k)
        gain = np.linalg.solve(covariance, observe @ spread).T
        mean, spread = mean + gain @ miss, spread - gain @ observe @ spread
        found.append(np.linalg.solve(np.linalg.cholesky(covariance), miss))
    return np.array(found)


def test_a_filter_that_knows_the_truth_finds_nothing_else() -> None:
    """Heat, its process, its timing within the step, and the noise are what the truth says: innovations are white."""
    office = pilot_building(1, floor_area=80.0, zones=2, floors=1, name="office")
    twin = generate(office, 1, TwinSettings(days=6.0, spin_up_days=0.5, dx=2.0, ranges=LOUD, meter="exact"))
    white = innovations(*twin, dx=2.0)
    assert np.mean(white**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / white.size))
    for lag in (1, 2, 12):
        assert abs(np.mean(white[lag:] * white[:-lag])) < 4.0 / np.sqrt(white.size)
    assert stats.kstest(white.ravel(), "norm").pvalue > 1e-3
    blind = replace(twin[1], disturbance_deviation=0.0, disturbance=0.0 * twin[1].disturbance)
    assert np.mean(innovations(twin[0], blind, dx=2.0) ** 2) > 2.0


def test_an_exact_meter_sees_the_terminals_heat_and_nothing_else(metered: Twin) -> None:
    case, truth = metered
    assert np.allclose(case.zone_heat().to_numpy(), truth.heat, atol=1e-7)
    assert abs(truth.disturbance).max() > 100.0


def test_sensors_of_their_own_make_the_metered_heat_noisy(sensed: Twin) -> None:
    case, truth = sensed
    kelvin = (case.zone_heat().to_numpy() - truth.heat) / (1006.0 * flow(case))
    assert kelvin.std() == pytest.approx(np.sqrt(2.0) * truth.noise, rel=0.05)
    assert abs(kelvin.mean()) < 4.0 * kelvin.std() / np.sqrt(kelvin.size)
    assert np.corrcoef(kelvin.ravel(), noise_of(sensed).ravel())[0, 1] == pytest.approx(-np.sqrt(0.5), abs=0.05)


def test_the_meter_changes_nothing_but_the_discharge_sensor(sensed: Twin, metered: Twin) -> None:
    frames = [twin[0].telemetry.frame for twin in (sensed, metered)]
    differ = [column for column in frames[0] if not frames[0][column].equals(frames[1][column])]
    assert {column.partition("/")[2] for column in differ} == {"discharge_air_temperature_sensor"}
    assert np.array_equal(sensed[1].states, metered[1].states)


def test_noise_is_white_and_of_its_deviation(sensed: Twin) -> None:
    noise = noise_of(sensed)
    assert noise.std() == pytest.approx(0.05, rel=0.05)
    for other in (np.roll(noise, 1, axis=0), sensed[1].disturbance):
        assert abs(np.corrcoef(noise.ravel(), other.ravel())[0, 1]) < 0.07


def test_the_disturbance_is_as_large_as_said(building: Building) -> None:
    areas = np.array(list(zone_floor_areas(building.geometry).values()))  # type: ignore[arg-type]
    per_area = [
        generate(building, seed, TwinSettings(ranges=LOUD, days=1.0, spin_up_days=1.0, dx=1.5))[1] for seed in range(8)
    ]
    values = np.stack([truth.disturbance[::72] / areas for truth in per_area])  # 6 h: three correlation times
    assert values.std() == pytest.approx(2.0, rel=0.15)


def test_sensors_may_have_a_resolution(building: Building) -> None:
    case, truth = generate(building, 1, TwinSettings(ranges=LOUD, resolution=0.1, **SHORT))
    degrees = case.zone_temperatures().to_numpy() - 273.15
    assert np.allclose(degrees, np.round(degrees, 1), atol=1e-9)
    assert noise_of((case, truth)).std() == pytest.approx(np.sqrt(0.05**2 + 0.1**2 / 12.0), rel=0.05)


def test_same_seed_same_twin(building: Building, sensed: Twin) -> None:
    again, other = (generate(building, seed, TwinSettings(ranges=LOUD, **SHORT)) for seed in (1, 2))
    assert again[0].telemetry.frame.equals(sensed[0].telemetry.frame)
    for name in ("theta", "heat", "disturbance", "states", "zone_temperatures"):
        assert np.array_equal(getattr(again[1], name), getattr(sensed[1], name))
        assert not np.array_equal(getattr(other[1], name), getattr(sensed[1], name))


def test_excitation_changes_setpoints_only(building: Building, sensed: Twin) -> None:
    case, truth = generate(building, 1, TwinSettings(ranges=LOUD, excitation="prbs", **SHORT))
    assert np.array_equal(truth.theta, sensed[1].theta)
    assert np.array_equal(truth.disturbance, sensed[1].disturbance)
    assert case.weather().equals(sensed[0].weather())
    heating = case.telemetry.frame.filter(regex="heating_setpoint$").to_numpy()
    assert all(np.unique(column).size == 2 for column in heating.T)


def test_it_is_saved_and_loaded(sensed: Twin, tmp_path: Path) -> None:
    case, truth = sensed
    loaded = load_case(save_case(case, tmp_path / "twin"))
    assert loaded.building.zone_names == case.building.zone_names
    assert list(loaded.telemetry.frame) == list(case.telemetry.frame)
    assert np.allclose(loaded.telemetry.frame, case.telemetry.frame, atol=1e-9, rtol=0.0)
    assert np.allclose(loaded.zone_heat(), case.zone_heat(), atol=1e-6)
    network = build_network(loaded.building, dx=1.0)
    told = json.loads(json.dumps(truth.to_dict()))
    assert network.values({k: v["value"] for k, v in told["parameters"].items()}) == pytest.approx(truth.theta)
    assert (told["noise"], told["disturbance_deviation"], told["disturbance_time"]) == (0.05, 2.0, 7200.0)


def test_parameters_follow_their_priors_within_their_ranges() -> None:
    drawn = np.array([list(_draw_values(seed, tuple(PARAMETERS.values())).values()) for seed in range(800)])
    for p, values in zip(PARAMETERS.values(), drawn.T, strict=True):
        assert p.lower <= values.min() < values.max() <= p.upper
        z = (np.array([p.transform(value) for value in values]) - p.transform(p.start)) / p.prior_deviation
        low, high = ((p.transform(bound) - p.transform(p.start)) / p.prior_deviation for bound in (p.lower, p.upper))
        assert stats.kstest(z, stats.truncnorm(low, high).cdf).pvalue > 1e-3, p.name


def test_conditions_are_spread_over_their_ranges() -> None:
    ranges = TwinRanges()
    drawn = np.array([_draw_conditions(seed, ranges) for seed in range(800)])
    for (low, high), values in zip(vars(ranges).values(), drawn.T, strict=True):
        assert stats.kstest(np.log(values / low) / np.log(high / low), "uniform").pvalue > 1e-3
    assert np.abs(np.corrcoef(drawn.T) - np.eye(3)).max() < 0.15


def test_fixed_and_zone_parameters(building: Building, sensed: Twin) -> None:
    _, fixed = generate(building, 1, TwinSettings(fixed={"radiant_coefficient": 4.0}, **SHORT))
    assert fixed.values == {**sensed[1].values, "radiant_coefficient": 4.0}
    _, zonal = generate(building, 1, TwinSettings(scopes={"slab_coupling": "zone"}, **SHORT))
    couplings = [value for name, value in zonal.values.items() if name.startswith("slab_coupling@")]
    assert len(set(couplings)) == 5


def test_a_twin_of_a_generated_office() -> None:
    office = pilot_building(3, floor_area=300.0, zones=6, floors=1, name="office")
    case, truth = generate(office, 3, TwinSettings(days=1.0, spin_up_days=0.5, dx=1.0, step_seconds=600.0))
    assert case.building.name == "office_twin_3"
    assert truth.heat.shape == (144, 6)
    assert case.step == 600.0


@pytest.mark.parametrize(
    ("arguments", "error", "named"),
    [
        ({"excitation": "steps"}, ThermalError, "excitation: .*schedule, prbs"),
        ({"meter": "sensor"}, ThermalError, "nearest valid one is 'sensors'"),
        ({"seed": -1}, ThermalError, "seed"),
        ({"days": 0.0, "spin_up_days": 0.0}, ThermalError, "at least two steps"),
        ({"resolution": -1.0}, ThermalError, "resolution"),
        ({"fixed": {"radiant_coeficient": 4.0}}, ModelError, "radiant_coefficient"),
    ],
)
def test_bad_arguments_are_refused(
    building: Building, arguments: dict[str, Any], error: type[Exception], named: str
) -> None:
    with pytest.raises(error, match=named):
        seed = arguments.get("seed", 0)
        generate(building, seed, TwinSettings(**{**SHORT, **{k: v for k, v in arguments.items() if k != "seed"}}))


def test_a_zone_table_is_refused() -> None:
    table = Building("hut", Location(latitude=0.0, longitude=0.0, elevation=0.0, timezone="UTC"), 0.0, ZoneTable(()))
    with pytest.raises(ThermalError, match="'hut': expected floor plans"):
        generate(table)


@pytest.mark.parametrize(
    "ranges",
    [
        {"noise": (0.1, 0.02)},
        {"noise": (0.0, 0.1)},
        {"disturbance_time": (0.0, 0.0)},
        {"disturbance_deviation": (-1.0, 1.0)},
        {"disturbance_deviation": (1.0, np.inf)},
        {"disturbance_deviation": (np.nan, 1.0)},
    ],
)
def test_bad_ranges_are_refused(ranges: dict[str, tuple[float, float]]) -> None:
    with pytest.raises(ThermalError, match=next(iter(ranges))):
        TwinRanges(**ranges)
