"""The whole way on a house that is known: a safe experiment, a model, and control that beats the rule."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpc.baselines.plants import FullSpeed, OwnControl
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.control.identified.problem import IdentifiedProblem
from mpc.control.solvers.stages import StageSolver
from mpc.errors import ControlError, PlantError
from mpc.identify.excitation import Excitation
from mpc.identify.identify import Identified, identify
from mpc.identify.machines import find_machines
from mpc.identify.model import PlantModel, read_model
from mpc.identify.telemetry import Site, read_telemetry, run_recorded
from mpc.kpi.kpis import Kpis, measure_kpis

DAYS = 4


def site_of(house: Any) -> Site:
    return Site("house", {"house": 192.0}, house.scenario.building.location)


@pytest.fixture(scope="session")
def excited(truth: SimpleNamespace) -> SimpleNamespace:
    house = truth.House(days=DAYS, start="2023-01-10")
    machines = find_machines(house.actuators, house.columns, house.zone_names)
    run, telemetry = run_recorded(house, Excitation(machines, 900.0), site_of(house))
    return SimpleNamespace(house=house, machines=machines, run=run, telemetry=telemetry)


@pytest.fixture(scope="session")
def known(excited: SimpleNamespace) -> Identified:
    return identify(excited.telemetry, excited.machines)


def test_the_experiment_is_safe_and_moves_the_machine(excited: SimpleNamespace, truth: SimpleNamespace) -> None:
    (comfort,) = measure_kpis(excited.run.record, excited.house.scenario).zones
    assert comfort.largest_below < 0.3 and comfort.largest_above < 0.3
    speed = excited.run.actions[truth.heat_pump].dropna()
    assert {0.0, 1.0} < set(speed) and ((speed == 0.0) | (speed >= 0.2)).all() and speed.diff().ne(0).sum() > 20


def test_the_model_has_the_houses_numbers(known: Identified, truth: SimpleNamespace) -> None:
    (found,) = known.model.maps
    assert found.operation == "duty" and found.standing == pytest.approx(truth.standing, rel=1e-3)
    for outdoor in (270.0, 285.0):
        assert found.heat(1.0, 1.0, outdoor, 303.15) == pytest.approx(truth.heat_of(1.0, outdoor), rel=1e-3)
        assert found.efficiency(0.5, outdoor) == pytest.approx(
            truth.heat_of(0.5, outdoor) / truth.power_of(0.5, outdoor), rel=2e-2
        )
    assert known.errors == () and known.notes == ()  # four days: none is held out
    assert known.model.box.shares[1, 0] > 0.5  # most of the heat goes into the floor


def test_a_model_and_its_telemetry_survive_their_files(
    known: Identified, excited: SimpleNamespace, tmp_path: Path
) -> None:
    again = PlantModel.from_dict(known.model.to_dict())
    assert again.to_dict() == known.model.to_dict() and again.maps == known.model.maps
    known.telemetry.to_frame().to_parquet(tmp_path / "t.parquet")
    read = read_telemetry(tmp_path / "t.parquet", known.telemetry.site)
    assert read.step == 900.0
    pd.testing.assert_frame_equal(
        read.frame, known.telemetry.frame, check_freq=False, check_names=False, check_index_type=False
    )
    (tmp_path / "model.json").write_text("{}")
    with pytest.raises(ControlError, match="format 9, found format None"):
        read_model(tmp_path)
    with pytest.raises(ControlError, match="a folder with model.json"):
        read_model(tmp_path / "none")
    with pytest.raises(PlantError, match="3 days of telemetry at least, found 2"):
        identify(run_recorded(excited.house, OwnControl(), site_of(excited.house), 192)[1], excited.machines)


def kpis_of(house: Any, controller: Any) -> tuple[Kpis, np.ndarray]:
    run, _ = run_recorded(house, controller, site_of(house), 48)  # until noon: over the dear morning
    actions = run.actions.to_numpy()[:, 0] if not run.actions.empty else np.zeros(len(run.measurements))
    return measure_kpis(run.record, house.scenario), actions


def test_rules_run_the_machine_as_they_say(truth: SimpleNamespace) -> None:
    house = truth.House(days=1)
    own, none = kpis_of(house, OwnControl())
    rule, speed = kpis_of(house, FullSpeed(find_machines(house.actuators, house.columns, house.zone_names)))
    assert set(speed) == {0.0, 1.0} and not none.any()
    assert rule.cost_tot < 0.7 * own.cost_tot and rule.tdis_tot < 0.1


def test_control_keeps_comfort_at_a_fraction_of_the_cost_with_few_starts(
    known: Identified, truth: SimpleNamespace
) -> None:
    house = truth.House(days=1)
    own, _ = kpis_of(house, OwnControl())
    controller = IdentifiedController(
        known.model, house.actuators, site_of(house).location, IdentifiedSettings(starts=3)
    )
    mine, speed = kpis_of(house, controller)
    assert mine.cost_tot < 0.7 * own.cost_tot and mine.tdis_tot < 0.05
    on = speed > 0.5
    lengths = np.diff(np.flatnonzero(np.diff(np.r_[False, on, False])))[::2]
    assert set(speed) == {0.0, 1.0} and len(lengths) <= 3 and lengths.min() >= 2


def test_the_problem_steps_as_the_network_and_costs_as_the_map(known: Identified, truth: SimpleNamespace) -> None:
    house = truth.House(days=1)
    house.reset()
    model = known.model
    ahead = Ahead.of(model, house.forecast(), site_of(house).location)
    problem = IdentifiedProblem(model)
    state = np.r_[1.0, 2.0, 1.0, -3.0, 100.0]
    ends = np.zeros((96, 1)), np.ones((96, 1))
    data, duty = problem.data(state, ahead, 0.1, 10.0, ends), np.full((96, 1), 0.3)
    followed = problem.stage.follow(data, duty)
    space, (found,) = model.box.space(900.0), model.maps
    heat = 0.3 * found.heat(1.0, 1.0, ahead.outdoor[0], 293.15 + 2.0)
    gain = ahead.gain[0] + 100.0
    u = np.concatenate([[ahead.outdoor[0] - 293.15], ahead.sun[0], [heat], gain])
    np.testing.assert_allclose(followed[1], space.transition @ state[:4] + space.drive @ u, rtol=1e-10)
    assert np.allclose(data.lower[30], 294.15 - 293.15 + 0.1) and data.lower[27, 0] == data.lower[0, 0]
    solved = StageSolver(problem.stage, 96, tolerance=1e-6).solve(data, followed, duty)
    assert str(solved.status) == "converged" and solved.cost < problem.stage.cost_along(data, followed, duty)


def test_what_a_controller_cannot_do_without_is_named(known: Identified, truth: SimpleNamespace) -> None:
    house = truth.House(days=1)
    controller = IdentifiedController(known.model, house.actuators, site_of(house).location)
    with pytest.raises(ControlError, match="forecasts of the plant"):
        controller.step(house.reset(), None)
    with pytest.raises(ControlError, match="heat_pump/compressor_speed among the plant's actuators"):
        IdentifiedController(known.model, (), site_of(house).location)
