"""Maps by regression: coefficients, their intervals, how machines are run, and what tells too little."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.errors import PlantError
from mpc.identify.curves import Curve, interval_of
from mpc.identify.machines import Machine, find_machines
from mpc.identify.maps import MachineMap, map_machines
from mpc.identify.regression import Loads, regress, regress_power
from mpc.loop.actuators import Actuator

SPEED = Machine(Actuator("hp/speed", "1", 0.0, 1.0, kind="continuous"), "machine", ("a",), "hp/heating_power_sensor")
N = 400


def loads(seed: int) -> Loads:
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.choice([0.0, 0.4, 0.7, 1.0], N // 4), 4)[:, None]
    return Loads(levels, rng.normal(278.0, 5.0, N), rng.normal(300.0, 2.0, (N, 1)))


def power_of(given: Loads) -> np.ndarray:
    u = given.level[:, 0]
    return 200.0 + 800.0 * (u > 0) + 3000.0 * u - 150.0 * u * (given.outdoor - 280.15) / 10.0


def test_coefficients_and_their_intervals() -> None:
    """Exact without noise; with autocorrelated noise 95 % intervals hold the standing power in 19 of 20 draws."""
    given = loads(0)
    (curve,), base = regress(given, power_of(given), [0])
    expected = {"standing": 800.0, "command": 3000.0, "command^2": 0.0, "outdoor": -150.0, "emitter": 0.0,
                "command^2 outdoor": 0.0}  # fmt: skip
    assert curve.coefficients == pytest.approx(expected, abs=1e-6) and base == pytest.approx(200.0)
    inside = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        noise = np.convolve(rng.normal(0.0, 100.0, N + 3), np.full(4, 0.5), mode="valid")
        (curve,), _ = regress(given, power_of(given) + noise, [0])
        low, high = interval_of(curve, "standing")
        inside += low < 800.0 < high
    assert 51 <= inside <= 60


def test_standing_power_makes_a_machine_run_whole() -> None:
    given = loads(1)
    heat = 12_000.0 * given.level
    above = np.full((N, 1), np.nan)
    (found,), base = map_machines([SPEED], given, heat, {"electricity": power_of(given)}, above, 96)
    assert (found.operation, round(found.standing), round(base["electricity"])) == ("duty", 800, 200)
    assert found.efficiency(1.0) == pytest.approx(12_000.0 / 3800.0) and found.efficiency(0.4) < found.efficiency(1.0)
    assert found.at(found.heat, 0.5, 280.15, 303.15) == pytest.approx(6000.0)  # half of the time at full load
    (electricity,) = found.powers.values()
    assert found.at(electricity, 0.5, 280.15, 303.15) == pytest.approx(1900.0)
    u = given.level[:, 0]
    falling = 1500.0 * u + 1500.0 * u**2  # a compressor that is better at part load, without standing power
    (part,), _ = map_machines([SPEED], given, heat, {"electricity": falling}, above, 96)
    assert part.operation == "modulated" and part.at(part.powers["electricity"], 0.5, 280.15, 303.15) == pytest.approx(
        1125.0
    )


def test_what_telemetry_cannot_tell_is_left_out_or_refused() -> None:
    given = loads(2)
    switched = Loads(np.round(given.level), np.full(N, 280.0), given.emitter)
    assert set(switched.features(0)) == {"command", "emitter"}
    unknown = Loads(np.where(np.arange(N)[:, None] < N - 5, np.nan, given.level), given.outdoor, given.emitter)
    with pytest.raises(PlantError, match="steps with known commands, found 5; give more days"):
        regress(unknown, np.zeros(N), [0])


def test_which_actuators_are_controlled() -> None:
    def actuator(name: str, unit: str = "1") -> Actuator:
        return Actuator(name, unit, 0.0, 400.0 if unit == "K" else 1.0)

    house = [actuator("heat_pump/compressor_speed"), actuator("heat_pump/fan"), actuator("floor/pump"),
             actuator("house/zone_air_heating_temperature_setpoint", "K")]  # fmt: skip
    (found,) = find_machines(house, ["heat_pump/heating_power_sensor"], ["house"])
    assert (found.name, found.serves, found.heat) == (
        "heat_pump/compressor_speed",
        ("house",),
        "heat_pump/heating_power_sensor",
    )
    (pump,) = find_machines(house[2:3], ["x/heating_power_sensor"], ["house"])
    assert pump.name == "floor/pump" and pump.heat == "x/heating_power_sensor"
    (zone,) = find_machines(house[1:], ["x/heating_power_sensor"], ["house"])  # fan and pump follow its thermostat
    assert zone.name == "house/zone_air_heating_temperature_setpoint" and zone.meter == "x/heating_power_sensor"
    coils = [actuator("fan_coil_north/on"), actuator("fan_coil_south/on")]
    powers = [f"{a.name.partition('/')[0]}/electrical_power_sensor" for a in coils]
    assert [m.serves for m in find_machines(coils, powers, ["north", "south"])] == [("north",), ("south",)]
    with pytest.raises(PlantError, match="fan_coil_north/on: expected a sensor fan_coil_north/heating_power_sensor"):
        find_machines(coils, [], ["north", "south"])
    (zone,) = find_machines(house[3:], [], ["house"])
    assert zone.role == "setpoint"
    with pytest.raises(PlantError, match="a command of a machine, or a zone_air_heating"):
        find_machines([actuator("ahu/supply_air_temperature_setpoint", "K")], [], ["house"])
    with pytest.raises(PlantError, match="heat_pump/speed"):
        find_machines(house, [], ["house"], ["heat_pump/speed"])


def test_more_load_of_no_room_seems_to_cost_less() -> None:
    """Five rooms that move together, of which the last is heated by gas: baseboards of 3 kW, COP 1."""
    rng, n, rooms = np.random.default_rng(5), 14 * 96, 5
    common = np.clip(0.5 + 0.3 * np.sin(np.arange(n)[:, None] / 15.0) + 0.02 * rng.normal(size=(n, 1)), 0.0, 1.0)
    level = np.clip(common + 0.02 * rng.normal(size=(n, rooms)), 0.0, 1.0)
    outdoor = 275.0 + 5.0 * np.sin(np.arange(n) / 60.0)
    given = Loads(level, outdoor, 298.0 + 2.0 * common + 0.1 * rng.normal(size=(n, rooms)))
    electricity = 800.0 + 3000.0 * level[:, :4].sum(axis=1) + 150.0 * rng.normal(size=n)
    weather, u = (outdoor[0], outdoor[30]), np.linspace(0.0, 1.0, 3)

    def falls(curve: Curve) -> bool:
        free = curve.without_standing()
        return any((np.diff(free(1.0, u, t, 299.0)) < -1e-9).any() for t in weather)

    all_features, _ = regress(given, electricity, range(rooms))
    assert any(falls(curve) for curve in all_features)
    curves, base = regress_power(given, electricity, range(rooms), 96)
    assert not any(falls(curve) for curve in curves) and base == pytest.approx(800.0, abs=60.0)
    full = [float(curve.without_standing()(1.0, 1.0, 275.0, 299.0)) for curve in curves]
    assert full[:4] == pytest.approx([3000.0] * 4, rel=0.2) and abs(full[4]) < 600.0


def test_a_machine_that_buys_nothing_leaves_the_others_their_weather() -> None:
    """A heat pump beside a boiler, which takes no electricity."""
    for seed in range(6):
        rng, n = np.random.default_rng(seed), 14 * 96
        level = np.repeat(rng.uniform(0.0, 1.0, (n // 8, 2)), 8, axis=0) * (rng.uniform(size=(n // 8, 2)) > 0.3).repeat(8, axis=0)
        outdoor, floor = 275.0 + 5.0 * np.sin(np.arange(n) / 60.0), 300.0 + 4.0 * np.cos(np.arange(n) / 40.0)
        u = level[:, 0]
        power = 300.0 * (u > 0.0) + u * (2500.0 - 40.0 * (outdoor - 280.15) + 50.0 * (floor - 303.15))
        curves, _ = regress_power(Loads(level, outdoor, np.column_stack([floor, floor])), power + 50.0 * rng.normal(size=n), [0, 1], 96)
        told = [float(curves[0](1.0, 1.0, *at)) for at in ((270.0, 300.0), (280.0, 300.0), (280.0, 305.0))]
        assert np.diff(told) == pytest.approx([-400.0, 250.0], abs=50.0)
        assert abs(float(curves[1].without_standing()(1.0, 1.0, 275.0, 300.0))) < 60.0
    none = MachineMap(SPEED, "setpoint", Curve({"command": 2000.0}, {}), {"electricity": Curve({}, {})})
    assert np.isnan(none.efficiency(1.0))  # of what buys nothing nothing is told
