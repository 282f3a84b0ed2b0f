"""What machines buy beyond their maps: learned where it is seen, counted with a price that rises, told by a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from calibration.grey_box.network import GreyBox
from mpc.control.identified.beyond import KNOTS, PowerLearner, beyond, weights_of
from mpc.identify.corrections import PowerCorrection
from mpc.identify.curves import Curve
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap, OwnPower, map_machines
from mpc.identify.model import PlantModel
from mpc.identify.regression import Loads
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout

NAME, HEAT, POWER = f"room/{HEATING_SETPOINT}", "hp/heating_power_sensor", "hp/electrical_power_sensor"
MACHINE = Machine(Actuator(NAME, "K", 285.15, 298.15), "setpoint", ("room",), HEAT, POWER)
COMPRESSOR = 0.8  # load that it has alone, at a third of what a resistance takes for the rest


def two_stages(load: np.ndarray) -> np.ndarray:
    return 10_000.0 * (np.minimum(load, COMPRESSOR) / 3.0 + np.maximum(load - COMPRESSOR, 0.0))


def learned(seed: int = 0, count: int = 600) -> MachineMap:
    rng = np.random.default_rng(seed)
    load = np.where(rng.random(count) < 0.2, 0.0, rng.uniform(0.0, 1.4, count))
    loads = Loads(load[:, None], rng.normal(268.0, 4.0, count), np.full((count, 1), 303.15))
    power = 50.0 + two_stages(load)
    above = np.full((count, 1), np.nan)
    (found,), _ = map_machines([MACHINE], loads, 10_000.0 * loads.level, {"electricity": power}, above, 96, [power])
    return found


def test_a_second_stage_is_counted_from_where_it_begins() -> None:
    """Power over load is that of two stages within 3 % of full power, of which a parabola misses three times that."""
    found, outdoor = learned(), np.array([268.0])
    weights = weights_of(found, found.correction(), outdoor, np.array([1.4]))[0]
    load = np.linspace(0.2, 1.4, 25)
    mapped = np.array([found.at(found.powers["electricity"], u, 268.0, 303.15) for u in load])
    told = mapped + beyond(weights, load)
    full = two_stages(np.array([1.4]))[0]
    assert np.abs(told - two_stages(load)).max() < 0.03 * full < 0.5 * np.abs(mapped - two_stages(load)).max()
    assert beyond(weights, 0.0) == pytest.approx(0.0)
    at_knots = np.array([found.at(found.powers["electricity"], u, 268.0, 303.15) for u in KNOTS])
    rising = np.diff(np.diff(at_knots + beyond(weights, KNOTS))) > -0.02 * full
    assert rising.all()


def test_what_is_beyond_an_edge_of_the_data_sheet_is_not_told_by_what_is_before() -> None:
    sheet = ((250.0, 0.5), (260.9, 0.5), (261.0, 1.2), (280.0, 1.5))
    without, given = PowerCorrection(), PowerCorrection((), sheet)
    for correction in (without, given):
        for _ in range(8):
            correction.learn(260.0, 0.4, 0.6)
    warmer = np.array([262.0]), np.array([[0.4]])
    assert abs(given.at(*warmer)[0, 0]) < 0.01 and without.at(*warmer)[0, 0] > 0.4
    assert given.at(np.array([258.0]), np.array([[0.4]]))[0, 0] > 0.4


def test_a_controller_learns_from_the_sensor_of_its_machine() -> None:
    curve = Curve({"command": 3000.0}, {"command": 0.0})
    heat = Curve({"command": 10_000.0}, {"command": 0.0})
    found = MachineMap(MACHINE, "setpoint", heat, {"electricity": curve}, (-0.1, 0.3), (), OwnPower(curve, 50.0))
    box = GreyBox.start({"room": 100.0}, (), {NAME: ("room",)}, (True,))
    model = PlantModel("shop", 900.0, box, (found,))
    learner, layout = PowerLearner(model), PointLayout((HEAT, POWER), "Etc/GMT-1")
    outdoor, most = np.array([258.0, 288.0]), np.full((2, 1), 1.0)
    assert not learner.along(outdoor, most).any()
    for k in range(16):
        for load in (0.2, 0.4, 0.6, 0.8, 1.0):
            seen = Measurements(layout, 1_673_250_000 + 900 * k, [10_000.0 * load, 50.0 + 4500.0 * load])
            learner.learn(seen, np.zeros(1), 258.0, np.zeros(8))
    cold, mild = learner.along(outdoor, most)[:, 0]
    assert beyond(cold, 0.6) == pytest.approx(0.5 * 3000.0 * 0.6, rel=0.05)
    assert abs(beyond(mild, 0.6)) < 1.0
    read = PlantModel.from_dict(replace(model, maps=(learned(),)).to_dict())
    assert read.maps[0].own == learned().own
