"""Costs of many plans over a horizon, each followed by a member of a batched plant."""

from dataclasses import replace

import numpy as np

from mpc.batch.plant import BatchedPlant
from mpc.control.controller.site import SitePoints
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem
from mpc.errors import ControlError
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.grid import StepGrid
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.system.system import HvacSystem
from thermal.units import REFERENCE_TEMPERATURE


class HorizonRollouts:
    """Follows plans from an estimated state with the plant's own, unsmoothed equations; no derivatives.

    Parameters
    ----------
    problem : ControlProblem
        Of a regular horizon; its predictor says what is decided.
    model : ReducedBuilding
        The building as the controller believes it to be; its step is the horizon's.
    system : HvacSystem
        The same of the HVAC system, with names of its devices.
    scenario : Scenario
        Of the building, of at least as many steps as the horizon has: what drives it is taken from each horizon's data.
    points : SitePoints
        Names of zones and devices.
    plans : int
        How many are followed at once.

    Raises
    ------
    ControlError
        When the steps of the horizon are not those of the building.
    """

    def __init__(
        self, problem: ControlProblem, model: ReducedBuilding, system: HvacSystem, scenario: Scenario,
        points: SitePoints, plans: int,
    ) -> None:  # fmt: skip
        horizon, self.problem = problem.predictor.horizon, problem
        regular = bool(np.allclose(horizon.steps, model.step_seconds))
        ControlError.unless(regular, "sampled plans", f"steps of {model.step_seconds:g} s", "others")
        channels, hvac = problem.predictor.channels, problem.predictor.hvac
        place = points.setpoints(channels, np.arange(len(channels), dtype=float), hvac)
        self._channel_of = [int(k) for k in place.values()]
        plant = SimulatedPlant(
            _of_steps(scenario, len(horizon), model.step_seconds), system, model, warm_up_days=0,
            limits={c.quantity: (c.lower, c.upper) for c in channels},
            boundaries=dict.fromkeys(model.network.boundaries[1:], REFERENCE_TEMPERATURE),
        )  # fmt: skip
        self._water = [key for key in system.states if key.endswith("supply_water_temperature")]
        self.batch = BatchedPlant(plant, plans, actions=tuple(place))

    def __call__(self, data: HorizonData, shares: FloatArray) -> FloatArray:
        """Follow plans; give the terms of their costs, shape (n, n_term) as `CostTerms` [currency].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        shares : ndarray, shape (n, D)
            Decisions in shares of their ranges [-].
        """
        problem, batch, horizon = self.problem, self.batch, self.problem.predictor.horizon
        ControlError.unless(data.heat_value == 0.0, "sampled plans", "a heat value of 0", f"{data.heat_value:g}")
        batch.start(data.state, self._rows(data), dict.fromkeys(self._water, data.water))
        plans = np.stack([problem.plan(row) for row in shares], axis=-1)  # (n_block, n_channel, n)
        for block in horizon.block_of.tolist():
            batch.step(plans[block, self._channel_of])
        history = batch.history
        assert history is not None  # noqa: S101 - batches record by default
        zone = np.moveaxis(history[0], -1, 0).astype(float) + REFERENCE_TEMPERATURE
        electric, fuel = history[1].astype(float).transpose(1, 2, 0)
        changes = shares @ problem.differences.T - problem.standing(data)
        prices = problem.energy_prices(data)
        return np.column_stack([
            electric @ prices[0],
            fuel @ prices[1],
            [problem.demand_charge(data, row) for row in electric],
            problem.penalty(data, zone[:, 1:]).value.sum(axis=(1, 2)),
            problem.move_weight * (changes**2).sum(axis=1),
            np.zeros(len(shares)),
        ])  # fmt: skip

    def _rows(self, data: HorizonData) -> dict[str, FloatArray]:
        """Give what drives the members, as `mpc.batch.inputs.plant_rows` names it."""
        outside = data.boundary.copy()
        outside[:, : len(self.batch.plants[0].model.network.boundaries)] -= REFERENCE_TEMPERATURE
        running = data.running if data.running.size else np.ones((len(outside), 1))
        return {
            "heating": data.heating_setpoint - REFERENCE_TEMPERATURE,
            "cooling": data.cooling_setpoint - REFERENCE_TEMPERATURE,
            "running": data.running, "some_idle": (running.min(axis=1, keepdims=True) < 1.0) * 1.0,
            "ventilation": data.ventilation[:, :1],
            "outdoor": data.outdoor_temperature[:, None], "outside": outside,
            "gains": data.gains + self.problem.predictor.fading[:, None] * data.disturbance,
        }  # fmt: skip


def _of_steps(scenario: Scenario, count: int, step: float) -> Scenario:
    """Take as many rows of a scenario as a horizon has steps; they only stand for those of its data."""
    rows = {
        name: getattr(scenario, name)[:count]
        for name in ("occupancy", "expected_occupancy", "lower", "upper", "electricity_price", "gas_price",
                     "electricity_carbon", "gas_carbon")
    }  # fmt: skip
    weather = replace(scenario.weather, frame=scenario.weather.frame.iloc[:count])
    return replace(scenario, grid=StepGrid(scenario.grid.start, step, count), weather=weather, demand=(), **rows)
