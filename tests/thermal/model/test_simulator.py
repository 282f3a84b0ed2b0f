"""The stepping simulator: starts, steps, repeatability, the random shuffle against its mean, refusals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import Building, FloorPlan, FloorPlans, Simulator, SymbolicModel, ZoneTable, load_bundled_case
from thermal.case.building import Airflow, Layer, Location, Surface, ZoneEntry
from thermal.errors import ModelError, ThermalError
from thermal.model.case_replay import free_runs, replay_inputs
from thermal.model.simulator import Shuffle
from thermal.model.step import TR_BDF2
from thermal.units import AIR_HEAT_CAPACITY

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")


def plan_building(*floors: tuple[str, ...]) -> Building:
    rows = floors or (("########", "#AAA+BB#", "#AAA+BB#", "#AAA+BB#", "########"),)
    plans = tuple(FloorPlan(f"F{i}", 3.0, np.array([list(row) for row in f])) for i, f in enumerate(rows))
    return Building("plan", SITE, 0.0, FloorPlans(1.0, plans, {"A": {"south": 2.0}} if not floors else {}))


def table_building() -> Building:
    layers = (Layer(thickness=0.2, conductivity=0.5, density=1200.0, heat_capacity=1000.0),)
    surfaces = (
        Surface(name="W", kind="wall", zone="room", other="outdoor", area=12.0, azimuth=180.0, construction="wall"),
        Surface(name="I", kind="wall", zone="room", other="hall", area=8.0, construction="wall"),
        Surface(name="C", kind="ceiling", zone="hall", other="attic", area=10.0, construction="wall"),
    )
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0), ZoneEntry(name="hall", volume=26.0, floor_area=10.0))
    flows = (Airflow(source="room", target="hall", device="fan", fraction=0.5),)
    return Building("table", SITE, 0.0, ZoneTable(zones, surfaces, {"wall": layers}), airflows=flows)


def drive(plant: Simulator, steps: int, seed: int = 3) -> FloatArray:
    """Step with heat and weather that move; zone means over the steps."""
    rng = np.random.default_rng(seed)
    n_zone, n_boundary = len(plant.zone_names), len(plant.network.boundaries)
    return np.array(
        [plant.step(2000.0 * rng.random(n_zone), 275.0 + 5.0 * rng.random(n_boundary)) for _ in range(steps)]
    )


# Starts and steps


@pytest.mark.parametrize("building", [plan_building, table_building])
def test_reset_holds_the_zones_and_returns_them(building: Callable[[], Building]) -> None:
    plant = Simulator(building())
    wanted = np.array([294.0, 291.5])
    boundary = np.full(len(plant.network.boundaries), 275.0)
    np.testing.assert_allclose(plant.reset(wanted, boundary), wanted, atol=1e-8)
    np.testing.assert_allclose(plant.zone_temperatures, wanted, atol=1e-8)
    assert plant.states.shape == (plant.network.n_node,)
    assert (plant.states > 274.9).all()
    assert (plant.states < 300.0).all()


def test_reset_is_close_to_the_steady_state_it_is_called() -> None:
    """The heat that holds the zones in the steady state leaves them, and all that is behind them, where reset put them."""
    plant = Simulator(plan_building())
    wanted, outdoor = np.array([294.0, 291.5]), np.array([270.0])
    plant.reset(wanted, outdoor)
    m = plant.matrices
    stiffness = m.flow[:, : m.n].toarray()
    gain = m.observation @ np.linalg.solve(stiffness, np.hstack([m.heating.toarray(), -m.flow[:, m.n :].toarray()]))
    heat = np.linalg.solve(gain[:, :2], wanted - gain[:, 2] * 270.0)
    before = plant.states
    for _ in range(288):
        plant.step(heat, outdoor)
    assert np.abs(plant.states - before).max() < 0.05
    np.testing.assert_allclose(plant.zone_temperatures, wanted, atol=0.02)


def test_building_at_one_temperature_stays_there_by_default() -> None:
    plant = Simulator(plan_building())
    plant.reset(np.array([293.0, 293.0]))
    for _ in range(10):
        mean = plant.step(np.zeros(2), np.array([293.0]))
    np.testing.assert_allclose(mean, 293.0, atol=1e-9)


def test_step_returns_the_mean_over_the_step() -> None:
    plant = Simulator(plan_building())
    before = plant.reset(np.array([294.0, 291.5]), np.array([275.0]))
    mean = plant.step(np.array([1500.0, 0.0]), np.array([275.0]))
    np.testing.assert_allclose(mean, 0.5 * (before + plant.zone_temperatures), rtol=1e-12)


def test_airflow_is_zero_by_default_and_counts_when_given() -> None:
    plants = [Simulator(table_building()) for _ in range(3)]
    for plant in plants:
        plant.reset(np.array([298.0, 290.0]), np.array([280.0, 280.0]))
    heat, boundary = np.zeros(2), np.array([280.0, 280.0])
    without = plants[0].step(heat, boundary)
    np.testing.assert_array_equal(plants[1].step(heat, boundary, np.zeros(1)), without)
    moved = plants[2].step(heat, boundary, np.array([0.05]))
    assert moved[1] > without[1] + 0.1
    # what it warms the hall with
    state = plants[2].network.observation @ plants[2].states
    assert state[1] - plants[0].zone_temperatures[1] < AIR_HEAT_CAPACITY * 0.05 * 8.0 * 300.0 / (26.0 * 1.1 * 1006.0)


def test_states_are_a_copy() -> None:
    plant = Simulator(plan_building())
    plant.reset(np.array([294.0, 291.5]))
    plant.states[:] = 0.0
    assert (plant.states > 200.0).all()


@pytest.mark.parametrize("shuffle", ["mean", "random"])
@pytest.mark.parametrize("dx", [1.0, 2.0, 0.5])
def test_energy_of_a_step_is_balanced_with_and_without_the_random_shuffle(shuffle: Any, dx: float) -> None:
    """Stored heat = heat of the zones + exchange with outdoor at the end of the step, before air changes places."""
    plant = Simulator(plan_building(), dx=dx, shuffle=Shuffle(shuffle, 0.7))
    plant.reset(np.array([294.0, 291.0]), np.array([275.0]))
    m, capacity = plant.matrices, plant.matrices.capacity.diagonal()
    exchange = -m.flow[:, m.n :].toarray()[:, 0]
    rng = np.random.default_rng(1)
    outer = exchange > 0
    assert (capacity[outer & (plant.network.kind == "air")] >= 0).all()
    for _ in range(5):
        heat, outdoor = 2000.0 * rng.random(2), 270.0 + 5 * rng.random()
        before = plant.states
        plant.step(heat, np.array([outdoor]))
        after = plant.states
        # air is not among what outdoor touches except past windows; use the whole balance by K on the unshuffled air
        unshuffled = np.linalg.solve(
            (m.capacity + 300.0 * m.flow[:, : m.n]).toarray(),
            m.capacity @ before + 300.0 * (m.heating @ heat + exchange * outdoor),
        )
        lost = float(exchange @ (unshuffled - outdoor))
        through = 300.0 * (float(np.abs(heat).sum()) + float(np.abs(exchange * (unshuffled - outdoor)).sum()))
        stored = float(capacity @ (after - before))
        assert abs(stored - 300.0 * (heat.sum() - lost)) < 1e-9 * through
        moved = np.abs(after - unshuffled) > 1e-9
        assert moved.any() == (shuffle == "random")
        assert set(plant.network.kind[moved]) <= {"air"}
        np.testing.assert_allclose(
            plant.network.observation @ after, plant.network.observation @ unshuffled, rtol=0, atol=1e-9
        )


# Repeatability


def test_equal_seeds_are_equal_bit_for_bit_and_others_are_not() -> None:
    def run(seed: int) -> FloatArray:
        plant = Simulator(plan_building(), shuffle=Shuffle("random", seed=seed))
        plant.reset(np.array([294.0, 291.5]), np.array([275.0]))
        return drive(plant, 12)

    np.testing.assert_array_equal(run(5), run(5))
    assert (run(5) != run(6)).any()


@pytest.mark.parametrize("shuffle", ["mean", "random"])
@pytest.mark.parametrize("step", [300.0, 100.0, 1000.0])
def test_restored_state_continues_bit_for_bit(shuffle: Any, step: float) -> None:
    plant = Simulator(plan_building(), shuffle=shuffle, step_seconds=step)
    plant.reset(np.array([294.0, 291.5]), np.array([275.0]))
    drive(plant, 4)
    saved = plant.save_state()
    first, states = drive(plant, 9), plant.states
    plant.restore_state(saved)
    np.testing.assert_array_equal(drive(plant, 9), first)
    np.testing.assert_array_equal(plant.states, states)
    other = Simulator(plan_building(), shuffle=Shuffle(shuffle, seed=99), step_seconds=step)
    other.restore_state(saved)
    np.testing.assert_array_equal(drive(other, 9), first)


def test_saved_state_is_not_changed_by_what_follows() -> None:
    plant = Simulator(plan_building(), shuffle="random")
    plant.reset(np.array([294.0, 291.5]), np.array([275.0]))
    saved = plant.save_state()
    first = drive(plant, 3)
    drive(plant, 20)
    plant.restore_state(saved)
    np.testing.assert_array_equal(drive(plant, 3), first)


def test_reset_begins_the_time_between_shuffles_anew() -> None:
    """With steps of 100 s a shuffle comes every third; two steps before a reset do not count after it."""
    plant = Simulator(plan_building(), shuffle="random", step_seconds=100.0)
    for earlier in (0, 2):
        plant.reset(np.array([294.0, 291.5]), np.array([275.0]))
        drive(plant, earlier)
        plant.reset(np.array([294.0, 291.5]), np.array([275.0]))
        shuffled = []
        for _ in range(3):
            before = plant.save_state()["shuffle"]
            plant.step(np.zeros(2), np.array([275.0]))
            shuffled.append(plant.save_state()["shuffle"] != before)
        assert shuffled == [False, False, True]


def test_state_of_another_building_is_refused() -> None:
    plant, other = Simulator(plan_building()), Simulator(table_building())
    other.reset(np.array([294.0, 291.5]))
    with pytest.raises(ThermalError):
        plant.restore_state(other.save_state())


# The random shuffle and its mean


def test_mean_of_random_runs_is_the_run_with_the_mean_shuffle() -> None:
    """Rise of the zone means in six hours from uniform heat, over 24 seeds: within 3 standard errors and 2.5 %."""
    room = ("##########", *(["#AAAA+BBB#"] * 4), "##########")
    heat, outdoor, start = np.array([1500.0, 0.0]), np.array([270.0]), np.array([290.0, 290.0])

    def ended(seed: int) -> FloatArray:
        plant = Simulator(plan_building(room), shuffle=Shuffle("random", 0.4, seed=seed))
        plant.reset(start, outdoor)
        return np.array([plant.step(heat, outdoor) for _ in range(72)])[-1]

    # the mean shuffle takes its probability from θ
    plant = Simulator(plan_building(room), {"shuffle_probability": 0.4})
    plant.reset(start, outdoor)
    mean = np.array([plant.step(heat, outdoor) for _ in range(72)])[-1]
    runs = np.array([ended(s) for s in range(24)])
    error = runs.std(axis=0, ddof=1) / np.sqrt(len(runs))
    rise = np.abs(mean - start).max()
    assert rise > 3.0
    assert (np.abs(runs.mean(axis=0) - mean) < 3.0 * error + 0.025 * rise).all()


def test_random_shuffle_takes_the_calibrated_probability() -> None:
    """Parameters of a calibration hold the probability; a plant that shuffles at random can be given all of them."""
    names = [p.name for p in Simulator(plan_building()).network.parameters]
    assert "shuffle_probability" in names
    calibrated = {"shuffle_probability": 0.9, "interior_film_coefficient": 3.0}
    plant = Simulator(plan_building(), calibrated, shuffle="random")
    assert plant.probability == 0.9


@pytest.mark.parametrize("probability", [-0.1, 1.1, np.nan])
def test_probabilities_outside_of_0_to_1_are_refused(probability: float) -> None:
    with pytest.raises(ThermalError, match="probability"):
        Simulator(plan_building(), shuffle=Shuffle("random", probability))


def test_zone_table_has_nothing_to_shuffle() -> None:
    runs = []
    for shuffle in ("mean", "random"):
        plant = Simulator(table_building(), shuffle=shuffle)  # type: ignore[arg-type]
        plant.reset(np.array([294.0, 291.5]), np.array([275.0, 280.0]))
        runs.append(drive(plant, 5))
    np.testing.assert_array_equal(*runs)


# Telemetry


@pytest.mark.parametrize("scheme", ["implicit_euler", "tr_bdf2"])
def test_steps_are_the_free_run_of_the_telemetry(scheme: str) -> None:
    case, start = load_bundled_case(), 500
    plant = Simulator(case.building, {"slab_coupling": 20.0}, dx=1.5, scheme=scheme)
    model = SymbolicModel(plant.network)
    inputs = replay_inputs(case, plant.network)
    matrices = model.matrices(plant.network.values({"slab_coupling": 20.0}))
    np.testing.assert_allclose(plant.reset(inputs.zone[start], inputs.boundary[start]), inputs.zone[start], atol=1e-8)
    states = plant.states[:, None]
    options = {"scheme": TR_BDF2} if scheme == "tr_bdf2" else {}
    wanted = free_runs(matrices, inputs, np.array([start]), 36, states, **options)[0][0]
    found = [plant.step(inputs.heat[start + k], inputs.boundary[start + k]) for k in range(1, 37)]
    np.testing.assert_allclose(np.array(found), wanted, rtol=0, atol=1e-9)


# Fields


@pytest.mark.parametrize("dx", [1.0, 0.5])
def test_field_is_the_floor_on_its_grid(dx: float) -> None:
    lower = ("........", "########", "#AAA+BB#", "#AAA+BB#", "########", "........")
    upper = ("........", "#####...", "#CCC#...", "#CCC#...", "#####...", "........")
    plant = Simulator(plan_building(lower, upper), dx=dx)
    plant.reset(np.array([290.0, 292.0, 298.0]), np.array([280.0]))
    split = round(1.0 / dx)
    for number, rows in enumerate((lower, upper)):
        tokens = np.repeat(np.repeat(np.array([list(r) for r in rows]), split, axis=0), split, axis=1)
        field = plant.field(number)
        # one origin for all floors: the field is as large as the plan, outside included
        assert field.shape == tokens.shape
        np.testing.assert_array_equal(np.isnan(field), tokens == ".")
    assert np.nanmax(plant.field(1)) > np.nanmax(plant.field(0))
    np.testing.assert_allclose(plant.field(0)[2 * split : 4 * split, split : 4 * split].mean(), 290.0, atol=1e-8)


def test_field_of_a_zone_table_or_of_another_floor_is_refused() -> None:
    for plant, floor in ((Simulator(table_building()), 0), (Simulator(plan_building()), 1)):
        plant.reset(np.array([290.0, 292.0]))
        with pytest.raises(ModelError, match="floor"):
            plant.field(floor)


# Refusals


def started() -> Simulator:
    plant = Simulator(table_building())
    plant.reset(np.array([294.0, 291.5]))
    return plant


BAD_STEPS: dict[str, tuple[tuple[Any, ...], str]] = {
    "heat of one zone": ((np.zeros(1), np.full(2, 280.0)), r"zone_heat: expected shape \(2,\), got \(1,\)"),
    "heat as a column": ((np.zeros((2, 1)), np.full(2, 280.0)), "zone_heat"),
    "heat missing": ((np.array([0.0, np.nan]), np.full(2, 280.0)), r"zone_heat\[1\].*nan"),
    "boundary of one": ((np.zeros(2), np.full(1, 280.0)), "boundary_temperatures: expected shape"),
    "boundary in degC": ((np.zeros(2), np.array([280.0, 7.0])), r"boundary_temperatures\[1\]: expected kelvin.*7.0"),
    "boundary infinite": ((np.zeros(2), np.array([280.0, np.inf])), "boundary_temperatures"),
    "airflow of none": ((np.zeros(2), np.full(2, 280.0), np.zeros(0)), "airflow: expected shape"),
    "airflow missing": ((np.zeros(2), np.full(2, 280.0), np.array([np.nan])), "airflow"),
    "airflow backwards": ((np.zeros(2), np.full(2, 280.0), np.array([-0.1])), "airflow"),
}


@pytest.mark.parametrize("name", BAD_STEPS)
def test_bad_inputs_of_a_step_are_refused_and_change_nothing(name: str) -> None:
    arguments, message = BAD_STEPS[name]
    plant = started()
    before = plant.states
    with pytest.raises(ModelError, match=message):
        plant.step(*arguments)
    np.testing.assert_array_equal(plant.states, before)


def test_bad_starts_are_refused() -> None:
    plant = Simulator(table_building())
    with pytest.raises(ModelError, match=r"zone_temperatures\[0\]: expected kelvin"):
        plant.reset(np.array([21.0, 22.0]))
    with pytest.raises(ModelError, match="zone_temperatures: expected shape"):
        plant.reset(np.array([294.0]))
    with pytest.raises(ModelError, match="boundary_temperatures"):
        plant.reset(np.array([294.0, 291.0]), np.array([5.0, 8.0]))


def test_step_before_reset_says_what_to_do() -> None:
    plant = Simulator(table_building())
    for call in (
        lambda: plant.step(np.zeros(2), np.full(2, 280.0)),
        lambda: plant.states,
        lambda: plant.zone_temperatures,
    ):
        with pytest.raises(ModelError, match=r"reset\(\)"):
            call()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scheme": "explicit_euler"}, r"implicit_euler.*'explicit_euler'"),
        ({"shuffle": "none"}, "'mean' or 'random'.*'none'"),
        ({"step_seconds": 0.0}, "step_seconds"),
        ({"step_seconds": np.nan}, "step_seconds"),
        ({"parameters": {"interior_film": 2.0}}, "interior_film"),
        ({"parameters": {"interior_film_coefficient": -2.0}}, "interior_film_coefficient"),
        ({"dx": 0.3}, "cell size"),
    ],
)
def test_unknown_options_are_refused_by_name(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Simulator(plan_building(), **options)
