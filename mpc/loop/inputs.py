"""What a plant is given: parts that fit each other, boundary temperatures, bias of the zones' sensors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mpc.errors import PlantError
from mpc.loop.building import BuildingModel
from mpc.loop.extras import check_radiant
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.errors import describe


def check_parts(scenario: Scenario, model: BuildingModel, control_steps: int, warm_up_days: int, seed: int) -> None:
    """Refuse parts of a plant that do not fit each other.

    Parameters
    ----------
    scenario : Scenario
        Whose zones and step count.
    model : BuildingModel
        Of the building.
    control_steps, warm_up_days, seed : int
        Of the plant.

    Raises
    ------
    PlantError
        Which part does not fit.
    """
    if model.network.zones != scenario.zones:
        found = f"{len(model.network.zones)} others"
        raise PlantError(describe("building model", f"the scenario's {len(scenario.zones)} zones", found))
    if model.step_seconds != scenario.grid.step:
        found = f"{model.step_seconds:g} s"
        raise PlantError(describe("building model", f"the scenario's step of {scenario.grid.step:g} s", found))
    if model.network.airflows:
        raise PlantError(describe("building", "one without airflows from zone to zone", "some"))
    check_radiant(model.network, scenario)
    if not (isinstance(control_steps, int) and control_steps >= 1 and warm_up_days >= 0 and seed >= 0):
        found = f"{control_steps}, {warm_up_days} and {seed}"
        raise PlantError(describe("plant", "control_steps from 1, warm_up_days and seed from 0 on", found))


def boundary_series(scenario: Scenario, model: BuildingModel, given: Mapping[str, float | FloatArray]) -> FloatArray:
    """Lay out boundary temperatures, shape (n_steps, n_boundary) [K].

    Parameters
    ----------
    scenario : Scenario
        Knows the outdoor temperature.
    model : BuildingModel
        Knows which boundaries there are.
    given : mapping of str to float or ndarray
        Temperatures of the others [K].
    """
    names, n_steps = model.network.boundaries, scenario.grid.n_steps
    columns = [scenario.outdoor]
    for name in names[1:]:
        if name not in given:
            raise PlantError(describe(f"boundary {name!r}", "its temperature", "none", "pass it in `boundaries`"))
        columns.append(np.broadcast_to(np.asarray(given[name], dtype=float), (n_steps,)))
    strange = sorted(set(given) - set(names[1:]))
    if strange:
        raise PlantError(describe("boundaries", f"those of the building, {list(names[1:])}", repr(strange[0])))
    return np.ascontiguousarray(np.column_stack(columns))


def sensor_offset(model: BuildingModel) -> FloatArray:
    """Tell what the zones' sensors say too much, where the effect `sensor_bias` is in the model [K].

    Parameters
    ----------
    model : BuildingModel
        At its parameter values.
    """
    zones = model.network.zones
    offset = np.zeros(len(zones))
    for parameter, value in zip(model.network.parameters, model.theta, strict=True):
        if parameter.base == "sensor_bias" and parameter.member in zones:
            offset[zones.index(parameter.member)] = value
    return offset
