"""SAC on the identified model of a plant that is run whole: trained there, moved to the plant.

The same model, observer, forecasts, prices of comfort and of a start as optimal control. It is trained on the heating
season of the weather file without the two periods of the table, with unmeasured heat drawn as the model has it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
import torch
from foreign_models.periods import DAYS
from foreign_models.plants import PLANTS
from stable_baselines3 import SAC

from calibration.estimation.state_space import REFERENCE
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.controller import IdentifiedSettings
from mpc.control.identified.observer import GreyBoxObserver
from mpc.control.identified.problem import SCALE, IdentifiedProblem
from mpc.errors import ControlError
from mpc.identify.model import PlantModel
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast, Forecaster
from mpc.scenario.rates import HOUR
from mpc.studies.described import PlantStudy
from thermal._types import FloatArray

#: Environment steps of a training, a gradient step for every other one: five minutes of CPU. It was not tuned.
STEPS = 60_000
#: Length of an episode [d].
EPISODE = 7
#: Ends of the hours ahead over which outdoor air, sun and price are averaged and the highest lower edge counts [h].
_HOURS = (1, 2, 4, 8, 16, 24)
#: Training reward of a currency unit: a day's cost is then of order 10, as the networks like it.
_REWARD = 10.0


class _View:
    """What a policy sees: states less edges, runs, hour, and what is ahead."""

    def __init__(self, model: PlantModel, settings: IdentifiedSettings) -> None:
        self.model, self.settings = model, settings
        self.spans = [round(hours * HOUR / model.step) for hours in _HOURS]
        ControlError.unless(
            all(found.operation == "duty" for found in model.maps), "SAC", "machines that are run whole",
            ", ".join(found.operation for found in model.maps),
        )  # fmt: skip

    def __call__(self, state: FloatArray, ahead: Ahead, on: bool, since: int, hour: float) -> FloatArray:
        nodes = self.model.box.capacity.size
        edge = ahead.lower[0] - REFERENCE
        sun = ahead.sun.sum(axis=1) if ahead.sun.size else np.zeros(len(ahead.outdoor))
        price = ahead.prices[:, 0]
        angle = 2.0 * np.pi * hour / 24.0
        seen = [(state[:nodes] - edge.mean()) / 3.0, state[nodes:] / 1e3, [2.0 * on - 1.0, min(since / 8.0, 1.0)],
                [np.sin(angle), np.cos(angle), (price[0] - 0.23) / 0.05]]  # fmt: skip
        begin = 0
        for end in self.spans:
            part = slice(begin, end)
            rise = ahead.lower[part].max() - ahead.lower[0].max()
            seen.append([(ahead.outdoor[part].mean() - 278.0) / 10.0, sun[part].mean() / 300.0,
                         (price[part].mean() - price[0]) / 0.05, rise / 3.0])  # fmt: skip
            begin = end
        return np.concatenate(seen).astype(np.float32)

    def allowed(self, wanted: bool, on: bool, since: int) -> bool:
        """Whether the machine runs: it holds its shortest run and rest."""
        return on if since < round(self.settings.run / self.model.step) else wanted


def _part(ahead: Ahead, k: int, count: int) -> Ahead:
    return Ahead(**{name: value[k : k + count] for name, value in vars(ahead).items()})


class ModelEnvironment(gymnasium.Env[np.ndarray, np.ndarray]):
    """The identified model under the weather of a heating season.

    Parameters
    ----------
    model : PlantModel
        Identified, of one machine that is run whole.
    ahead : Ahead
        Of the whole season, as it came.
    hours : ndarray, shape (n_time,)
        Of the day, at the begins of the steps [h].
    days : ndarray of int
        On which episodes may begin.
    settings : IdentifiedSettings
        Prices of comfort and starts.
    """

    def __init__(
        self, model: PlantModel, ahead: Ahead, hours: FloatArray, days: np.ndarray, settings: IdentifiedSettings
    ) -> None:
        self.model, self.ahead, self.hours, self.days, self.settings = model, ahead, hours, days, settings
        self.view, self.problem = _View(model, settings), IdentifiedProblem(model)
        self._whole, self._day = model.box.disturbed(model.step), round(24.0 * HOUR / model.step)
        size = self.view(np.zeros(self._whole.n), _part(ahead, 0, self._day), False, 0, 0.0).size
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin a week near the band's lower edge."""
        super().reset(seed=seed)
        draw, nz = self.np_random, len(self.model.box.zones)
        self._k = int(draw.choice(self.days)) * self._day
        self._end = self._k + EPISODE * self._day
        air = self.ahead.lower[self._k].mean() - REFERENCE + draw.uniform(0.0, 3.0)
        envelope = 0.5 * (air + self.ahead.outdoor[self._k] - REFERENCE)
        self._state = np.concatenate([np.full(3 * nz, air), np.full(nz, envelope), np.zeros(nz)])
        self._on, self._since = False, 1_000
        return self._seen(), {}

    def _seen(self) -> np.ndarray:
        return self.view(self._state, _part(self.ahead, self._k, self._day), self._on, self._since,
                         float(self.hours[self._k]))  # fmt: skip

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Run the machine for a step or not; a reward is the negative cost."""
        on = self.view.allowed(bool(action[0] > 0.0), self._on, self._since)
        k, nodes, step = self._k, self.model.box.capacity.size, self.model.step
        a = self.ahead
        gain, ends = a.gain[k] + self._state[nodes:], [0.0, 1.0]
        given = [[a.outdoor[k]], a.sun[k], gain, a.prices[k], ends, a.beyond[k].ravel(), a.together[k : k + 1]]
        following, cost = self.problem.stage.step(self._state[:nodes], [float(on)], np.concatenate(given))
        heat = self._state[nodes:] * self._whole.keep
        heat = heat + np.sqrt(self._whole.heat_variance) * self.np_random.normal(size=heat.size)
        self._state = np.concatenate([np.asarray(following).ravel(), heat])
        zone = self._state[: len(self.model.box.zones)] + REFERENCE
        outside = np.maximum(a.lower[k] - zone, 0.0) + np.maximum(zone - a.upper[k], 0.0)
        paid = float(cost) / SCALE + self.settings.comfort_price * float(outside.sum()) * step / HOUR
        paid += self.settings.start_price * float(on and not self._on)
        self._since = 1 if on != self._on else self._since + 1
        self._on, self._k = on, k + 1
        return self._seen(), -_REWARD * paid, False, self._k >= self._end, {}


def train(name: str, path: Path, model: PlantModel, file: Path, seed: int = 0) -> float:
    """Train a policy and write it down.

    Parameters
    ----------
    name : str
        Of the plant.
    path : Path
        Its ``plant.yaml``.
    model : PlantModel
        Identified.
    file : Path
        For the policy.
    seed : int
        Of networks, exploration and weather.

    Returns
    -------
    float
        CPU time that it took [s].
    """
    begin = time.process_time()
    torch.set_num_threads(1)
    season = PlantStudy(path, start="2023-01-09", end="2023-12-24", model=model)
    with season.plant() as plant:
        scenario = plant.forecaster.scenario
    steps = scenario.grid.n_steps
    ahead = Ahead.of(model, Forecaster(scenario, steps).table(0), season.site.location)
    stamps = scenario.grid.stamps - pd.Timedelta(seconds=model.step)
    first = stamps[0].normalize()
    taken = [pd.Timestamp(day, tz=stamps.tz) for day in PLANTS[name].starts.values()]
    days = []
    for day in range(steps * int(model.step) // 86_400 - EPISODE - 1):
        at = first + pd.Timedelta(days=day)
        apart = all(at + pd.Timedelta(days=EPISODE) <= t or at >= t + pd.Timedelta(days=DAYS) for t in taken)
        if apart and (at.month <= 4 or at.month >= 10):
            days.append(day)
    hours = (stamps.hour + stamps.minute / 60.0).to_numpy()
    world = ModelEnvironment(model, ahead, hours, np.array(days), IdentifiedSettings())
    learner = SAC(
        "MlpPolicy", world, learning_rate=5e-4, buffer_size=STEPS, learning_starts=2_000, train_freq=2, gamma=0.99,
        policy_kwargs={"net_arch": [64, 64]}, seed=seed, device="cpu",
    )  # fmt: skip
    learner.learn(STEPS)
    file.parent.mkdir(parents=True, exist_ok=True)
    learner.save(file)
    return time.process_time() - begin


class SacController:
    """A policy on the plant, its states those of the observer of optimal control.

    Parameters
    ----------
    file : Path
        Of `train`.
    model : PlantModel
        Identified.
    study : PlantStudy
        Where the plant stands.
    """

    def __init__(self, file: Path, model: PlantModel, study: PlantStudy) -> None:
        self.policy: Any = SAC.load(file, device="cpu")
        self.model, self._location, self._view = model, study.site.location, _View(model, study.settings)
        self._observer, self._before = GreyBoxObserver(model), None
        self._on, self._since = False, 1_000

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Run the machine or not."""
        if forecast is None:
            raise ControlError("SAC", "forecasts of the plant", "none")
        ahead = Ahead.of(self.model, forecast, self._location)
        if self._before is None:
            self._observer.start(measurements, float(ahead.outdoor[0]))
        else:
            self._observer.update(measurements, *self._before)
        stamp = measurements.stamp
        seen = self._view(self._observer.state, ahead, self._on, self._since, stamp.hour + stamp.minute / 60.0)
        action, _ = self.policy.predict(seen, deterministic=True)
        on = self._view.allowed(bool(action[0] > 0.0), self._on, self._since)
        self._since = 1 if on != self._on else self._since + 1
        self._on, self._before = on, (ahead, np.full(len(self.model.maps), float(on)))
        actuators = [found.machine.actuator for found in self.model.maps]
        return {a.name: a.highest if on else a.lowest for a in actuators}
