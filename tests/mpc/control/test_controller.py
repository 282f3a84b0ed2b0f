"""The controller in closed loop with its own model, and every fault it must live through."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from calibration import DisturbanceModel, KalmanFilter
from calibration.estimation.state_space import state_space
from mpc.control.controller.controller import MpcController
from mpc.control.controller.observer import Observer
from mpc.control.controller.site import ControllerSettings, SitePoints, Source
from mpc.control.problem.horizon import HorizonData
from mpc.control.solvers.sequential import SequentialSolver
from mpc.errors import ControlError
from mpc.scenario.forecast import Forecast
from mpc.scenario.tariff import DemandCharge
from thermal.model.step import IMPLICIT_EULER

START = pd.Timestamp("2023-01-16 06:00", tz="Etc/GMT+8")
STEP = pd.Timedelta(minutes=5)


class Twin:
    """The model as a plant: what the controller measures, with a constant heat that nobody told it of."""

    def __init__(self, modes, n_zone: int, hidden: float = 0.0) -> None:
        self.modes, self.hidden, self.n = modes, hidden, n_zone
        self.x = modes.uniform * -1.0
        self.flow, self.warm, self.zone = np.full(n_zone, 0.05), np.full(n_zone, 293.0), np.full(n_zone, 292.15)

    def measure(self, points: SitePoints) -> dict[str, float]:
        seen = {"weather_station/outside_air_temperature_sensor": 276.0, "BOILER/supply_water_temperature_sensor": 330.0,
                "AHU/electrical_power_sensor": 2000.0}  # fmt: skip
        for k, name in enumerate(points.terminals):
            seen[f"{name}/zone_air_temperature_sensor"] = self.zone[k]
            seen[f"{name}/supply_air_flowrate_sensor"] = self.flow[k]
            seen[f"{name}/discharge_air_temperature_sensor"] = self.warm[k]
        return seen

    def step(self, action) -> None:
        """Heat by a crude thermostat, which the model need not know: heat is metered."""
        step, begin = self.modes.propagator(300.0, IMPLICIT_EULER), self.modes.output @ self.x + 293.15
        heat = np.clip(400.0 * (294.65 - begin), -500.0, 800.0)
        drive = self.modes.boundary @ [276.0 - 293.15] + self.modes.heating @ (heat + 30.0 + self.hidden)
        new = step.end * self.x + step.end_gain * drive
        mean = self.modes.output @ (step.mean * self.x + step.mean_gain * drive) + 293.15
        self.x, self.zone, self.warm = new, mean, mean + heat / (1006.0 * self.flow)


@pytest.fixture
def controller(make_problem, modes, points) -> MpcController:
    problem = make_problem()
    kalman = KalmanFilter(state_space(modes, 300.0), DisturbanceModel(100.0, 6 * 3600.0, 0.05))
    return MpcController(SequentialSolver(problem), Observer(kalman, modes), points)


def ahead(make_forecast, k: int) -> Forecast:
    return make_forecast(START + k * STEP)


def test_a_closed_loop_without_offset(controller, modes, points, make_forecast) -> None:
    """Heat that the model does not know of is found, and predicted on."""
    twin = Twin(modes, len(points.zones), hidden=120.0)
    for k in range(10):
        action = controller.step(twin.measure(points), ahead(make_forecast, k))
        assert action.source is Source.OPTIMAL and np.isfinite(list(action.values())).all()
        assert set(action) == {"AHU/supply_air_temperature_setpoint", "BOILER/supply_water_temperature_setpoint"}
        assert action.stamp == START + k * STEP
        if k == 0:  # walls and slabs are taken to be at rest: here they are
            twin.x = controller.observer.modal_state.copy()
        twin.step(action)
    for _ in range(60):
        controller.observer.update(
            twin.zone, points.read(twin.measure(points), controller._system).heat + 30.0, np.array([276.0])
        )
        twin.step(None)
    np.testing.assert_allclose(controller.observer.disturbance, 120.0, rtol=0.1)


def test_telemetry_tells_what_the_structure_remembers(controller, modes, points) -> None:
    """From a week of it the state is that of the plant, which a start at rest is far from."""
    twin, rows = Twin(modes, len(points.zones)), []
    for _ in range(2000):
        twin.step(None)
        rows.append(twin.measure(points))
    index = pd.date_range(end=START, periods=len(rows), freq=STEP)
    past = pd.DataFrame(rows, index=index).assign(**{f"{zone}/internal_gain": 30.0 for zone in points.zones})
    controller.observer.start(twin.zone, np.array([276.0]))
    at_rest = np.abs(controller.observer.modal_state - twin.x).max()
    past.iloc[100:110, 3] = np.nan
    lacked = controller.start_up(past)
    assert lacked.shape == (2000, len(points.zones)) and list(lacked) == list(points.zones)
    assert np.abs(controller.observer.modal_state - twin.x).max() < 0.15 * at_rest
    np.testing.assert_allclose(controller.observer.disturbance, 0.0, atol=5.0)
    controller.start_up(past.drop(columns=[c for c in past if c.endswith("internal_gain")]))
    np.testing.assert_allclose(controller.observer.disturbance, 30.0, atol=5.0)  # what nobody expected is found
    flows = [column for column in past if column.endswith("flowrate_sensor")]
    lost = past.copy()
    lost.loc[index[1500:1540], flows] = np.nan  # heat that is not on record is not heat that the model lacks
    apart = np.abs(controller.start_up(lost) - lacked).to_numpy()
    assert flows and np.abs(lacked.to_numpy()[1490:]).max() < 5.0 and apart[1490:].max() < 5.0
    with pytest.raises(ControlError, match="a time zone"):
        controller.start_up(past.tz_localize(None))
    with pytest.raises(ControlError, match="a zone that reports"):
        controller.start_up(past.filter(regex="outside|power"))
    with pytest.raises(ControlError, match="an outdoor temperature"):
        controller.start_up(past.drop(columns="weather_station/outside_air_temperature_sensor"))


def test_saved_and_restored_it_goes_on_bit_for_bit(controller, modes, points, make_forecast) -> None:
    twin = Twin(modes, len(points.zones))
    for k in range(3):
        controller.step(twin.measure(points), ahead(make_forecast, k))
        twin.step(None)
    saved = controller.save_state()
    first = controller.step(twin.measure(points), ahead(make_forecast, 3))
    controller.step(twin.measure(points), ahead(make_forecast, 4))
    controller.restore_state(saved)
    again = controller.step(twin.measure(points), ahead(make_forecast, 3))
    assert dict(first) == dict(again)
    controller.restore_state({key: value for key, value in saved.items() if key != "possible"})  # of an older version


def test_faults_have_names_and_setpoints_stay_finite(controller, modes, points, make_forecast) -> None:
    twin = Twin(modes, len(points.zones))
    seen = twin.measure(points)
    controller.step(seen, ahead(make_forecast, 0))
    lost = seen | {f"{points.terminals[0]}/zone_air_temperature_sensor": np.nan}
    del lost[f"{points.terminals[1]}/supply_air_flowrate_sensor"], lost["BOILER/supply_water_temperature_sensor"]
    action = controller.step(lost, ahead(make_forecast, 1))
    words = " ".join(action.reasons)
    assert action.source is Source.OPTIMAL and f"zone temperature of {points.zones[0]!r} is missing" in words
    assert f"{points.terminals[1]!r} is missing" in words and "supply water temperature" in words
    late = controller.step(seen, None, START + 2 * STEP)
    assert late.source is Source.OPTIMAL and "forecast is late" in late.reasons[0]
    gap = ahead(make_forecast, 3).table.copy()
    gap.loc[gap.index[2:], "gas_price"] = np.nan
    holed = controller.step(seen, Forecast(gap))
    assert holed.source is Source.OPTIMAL and any("lacks 'gas_price'" in r for r in holed.reasons)
    empty = controller.step({}, ahead(make_forecast, 4))
    assert np.isfinite(list(empty.values())).all()


def test_solvers_that_fail_fall_back(controller, modes, points, make_forecast, monkeypatch) -> None:
    seen = Twin(modes, len(points.zones)).measure(points)

    def broken(*_: object) -> None:
        raise RuntimeError("singular")

    working = controller.solver.solve
    monkeypatch.setattr(controller.solver, "solve", broken)
    rules = controller.step(seen, ahead(make_forecast, 0))
    assert rules.source is Source.RULES and "solver broke: RuntimeError: singular" in rules.reasons
    monkeypatch.setattr(controller.solver, "solve", working)
    good = controller.step(seen, ahead(make_forecast, 1))
    assert good.solution is not None
    monkeypatch.setattr(controller.solver, "solve", broken)
    kept = controller.step(seen, ahead(make_forecast, 2))
    assert kept.source is Source.PREVIOUS and "the previous plan is followed" in kept.reasons
    wanted = controller.problem.predictor.horizon.shifted(good.solution.plan, 300.0)[0]
    np.testing.assert_allclose(list(kept.values()), wanted)
    out_of_time = controller.step(seen, ahead(make_forecast, 300))  # beyond the plan
    assert out_of_time.source is Source.RULES


@pytest.mark.parametrize("price", [-3.0, np.nan, np.inf])
def test_a_price_of_discomfort_that_is_none_is_refused(price: float) -> None:
    with pytest.raises(ControlError, match="comfort price: expected a number from 0 on, found"):
        ControllerSettings(comfort_price=price)


def test_comfort_that_cannot_be_had_is_explained(controller, modes, points, make_forecast) -> None:
    twin = Twin(modes, len(points.zones))
    twin.zone = np.full(len(points.zones), 283.15)
    action = controller.step(twin.measure(points), ahead(make_forecast, 0))
    assert any("below 21.0 degC at 2023-01-16 07:" in reason for reason in action.reasons)


def test_peaks_of_the_month_are_counted(make_problem, modes, points, make_forecast) -> None:
    kalman = KalmanFilter(state_space(modes, 300.0), DisturbanceModel(100.0, 6 * 3600.0, 0.05))
    settings = ControllerSettings(demand=(DemandCharge([10.0]),))
    controller = MpcController(SequentialSolver(make_problem()), Observer(kalman, modes), points, settings)
    twin = Twin(modes, len(points.zones))
    for k, power in enumerate((1e3, 2e3, 3e3, 6e3, 9e3)):  # the first is of the window before
        controller.step(twin.measure(points) | {"AHU/electrical_power_sensor": power}, ahead(make_forecast, k))
    assert controller.save_state()["peaks"] == pytest.approx({"2023-01 flat": (2e3 + 3e3 + 6e3) / 3.0})


def test_horizon_data_are_plain_parameters(controller, make_data, monkeypatch, modes, points, make_forecast) -> None:
    """Nothing is built when a horizon's data change: no function of CasADi is made."""
    import casadi

    seen = Twin(modes, len(points.zones)).measure(points)
    controller.step(seen, ahead(make_forecast, 0))
    built: list[str] = []
    real = casadi.Function.__init__
    monkeypatch.setattr(casadi.Function, "__init__", lambda self, *a: (built.append("one"), real(self, *a))[1])
    controller.step(seen, ahead(make_forecast, 1))
    assert not built
    assert isinstance(make_data(controller.problem), HorizonData)


@pytest.mark.parametrize("odd", [pd.NaT, pd.Timestamp("2023-01-16 06:00"), pd.Timestamp("1500-01-01", tz="UTC")])
def test_a_time_that_cannot_be_is_said_and_not_used(controller, modes, points, make_forecast, odd) -> None:
    action = controller.step(Twin(modes, len(points.zones)).measure(points), ahead(make_forecast, 0), odd)
    assert action.stamp == START and action.source is Source.OPTIMAL
    assert any("not one of time stamps of the years 1900 to 2199 in a time zone" in r for r in action.reasons)
