"""A closed loop: a controller on a plant, and its record."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import Actuator
from mpc.loop.plant import Controller, Measurements, Plant
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray


class ClosedLoopRun(NamedTuple):
    """Record of a closed loop.

    Parameters
    ----------
    record : PlantRecord
        For indicators, with the time that the controller took.
    measurements : DataFrame, shape (n_action, n_column)
        What the controller was shown after each action [library's units].
    actions : DataFrame, shape (n_action, n_actuator)
        What it set, by the end of the control step [K] or [Pa].
    """

    record: PlantRecord
    measurements: pd.DataFrame
    actions: pd.DataFrame


@dataclass(frozen=True)
class FixedSetpoints:
    """A controller that holds setpoints, and others from some local hours on.

    Parameters
    ----------
    setpoints : mapping of str to float
        By ``ENTITY/POINT``, or by point for all actuators of that kind [K] or [Pa].
    actuators : tuple of Actuator
        Of the plant.
    by_hour : mapping of float to mapping, optional
        Local hour [h] from which other setpoints hold, until the next of these hours, and past midnight.

    Raises
    ------
    PlantError
        When a setpoint is of none of the actuators, or an hour is not from 0 to 24.

    Examples
    --------
    >>> air = Actuator("AHU/supply_air_temperature_setpoint", "K", 285.0, 300.0)
    >>> fixed = FixedSetpoints({"supply_air_temperature_setpoint": 287.0}, (air,))
    >>> fixed.at_hour(12.0)
    {'AHU/supply_air_temperature_setpoint': 287.0}
    """

    setpoints: Mapping[str, float]
    actuators: tuple[Actuator, ...]
    by_hour: Mapping[float, Mapping[str, float]] | None = None

    def __post_init__(self) -> None:
        names = {a.name for a in self.actuators}
        known = names | {name.rpartition("/")[2] for name in names}
        hours = self.by_hour or {}
        for name in (n for part in (self.setpoints, *hours.values()) for n in part):
            PlantError.unless_known(name, known, "setpoints", "an actuator of the plant")
        for hour in hours:
            PlantError.unless(0.0 <= hour < 24.0, "setpoints: by_hour", "hours from 0 to 24", repr(hour))

    def at_hour(self, hour: float) -> dict[str, float]:
        """Give the setpoints of a local hour.

        Parameters
        ----------
        hour : float
            Local hour with its fraction [h].

        Returns
        -------
        dict of str to float
            By ``ENTITY/POINT`` [K] or [Pa].
        """
        hours = self.by_hour or {}
        begun = [h for h in hours if h <= hour] or list(hours)
        chosen = {**self.setpoints, **(hours[max(begun)] if begun else {})}
        by_kind = {a.name: chosen[kind] for a in self.actuators if (kind := a.name.rpartition("/")[2]) in chosen}
        return by_kind | {a.name: chosen[a.name] for a in self.actuators if a.name in chosen}

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Choose the setpoints of the hour.

        Parameters
        ----------
        measurements : Measurements
            Only their stamp counts.
        forecast : Forecast or None
            Without effect.
        """
        stamp = measurements.stamp
        return self.at_hour(stamp.hour + stamp.minute / 60.0 + stamp.second / 3600.0)


def run_closed_loop(
    plant: Plant,
    controller: Controller,
    *,
    steps: int | None = None,
    seed: int | None = None,
    forecasts: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> ClosedLoopRun:
    """Let a controller run a plant.

    Parameters
    ----------
    plant : Plant
        Reset here.
    controller : Controller
        Asked before each control step.
    steps : int, optional
        Control steps; until the plant is finished by default.
    seed : int, optional
        Of the plant's reset.
    forecasts : bool
        Whether the controller gets forecasts.
    progress : callable, optional
        Called as ``progress(steps_done, steps)``; steps is 0 where it is not known.

    Returns
    -------
    ClosedLoopRun
        Record, measurements and actions.

    Raises
    ------
    PlantError
        When no step could be taken.

    Examples
    --------
    >>> run = run_closed_loop(plant, FixedSetpoints(setpoints, plant.actuators))  # doctest: +SKIP
    """
    seen = plant.reset(seed)
    rows, stamps, chosen, seconds = list[FloatArray](), list[pd.Timestamp](), list[dict[str, float]](), list[float]()
    while not plant.finished and (steps is None or len(rows) < steps):
        forecast = plant.forecast() if forecasts else None
        begin = time.perf_counter()
        actions = dict(controller.step(seen, forecast))
        seconds.append(time.perf_counter() - begin)
        seen = plant.step(actions)
        rows.append(seen.values_array)
        stamps.append(seen.stamp)
        chosen.append(actions)
        if progress is not None:
            progress(len(rows), steps or 0)
    PlantError.unless(rows, "closed loop", "a plant with a control step left", "none")
    index = pd.DatetimeIndex(stamps, name="timestamp")
    record = replace(plant.record(), controller_seconds=np.array(seconds))
    return ClosedLoopRun(
        record, pd.DataFrame(rows, index=index, columns=list(plant.columns)), pd.DataFrame(chosen, index=index)
    )
