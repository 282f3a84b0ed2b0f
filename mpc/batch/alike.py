"""Which plants can be stepped together, and which of their buildings are the same."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mpc.errors import PlantError
from mpc.loop.building import BuildingModel
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from thermal._types import IntArray


def different_models(models: Sequence[ReducedBuilding]) -> tuple[list[ReducedBuilding], IntArray]:
    """Find which reduced buildings differ.

    Parameters
    ----------
    models : sequence of ReducedBuilding
        One a plant.

    Returns
    -------
    tuple
        Those that differ, and which of them each is.
    """
    found, place = list[ReducedBuilding](), list[int]()
    for model in models:
        mine = model.step_matrices()
        same = [k for k, other in enumerate(found) if other is model or (driven_by(other) == driven_by(model) and
                all(np.array_equal(a, b) for a, b in zip(mine, other.step_matrices(), strict=True)))]  # fmt: skip
        place.append(same[0] if same else len(found))
        found += [] if same else [model]
    return found, np.array(place, dtype=np.intp)


def driven_by(*models: BuildingModel) -> tuple[str, ...]:
    """Name what drives buildings from outside, each boundary and signal that one of them has once; in their order.

    Parameters
    ----------
    *models : BuildingModel
        Whose effects may differ.
    """
    boundaries = dict.fromkeys(f"boundary {name}" for model in models for name in model.network.boundaries)
    signals = dict.fromkeys(f"signal {signal.name}" for model in models for signal in model.network.signals)
    return (*boundaries, *signals)


def checked_plants(plants: Any) -> tuple[SimulatedPlant, ...]:
    """Refuse plants that cannot be stepped together.

    Parameters
    ----------
    plants : SimulatedPlant or sequence of SimulatedPlant
        The plants, or what is none.

    Raises
    ------
    PlantError
        Which plant does not fit, and why.
    """
    every = (plants,) if isinstance(plants, SimulatedPlant) else tuple(plants)
    PlantError.unless(bool(every), "batch", "a plant or more", "none")
    first = every[0]
    for k, plant in enumerate(every):
        where, kind = f"batch: plant {k}", type(getattr(plant, "model", plant)).__name__
        PlantError.unless(isinstance(getattr(plant, "model", None), ReducedBuilding), where,
                          "one on a reduced building", kind, "take kind='reduced'")  # fmt: skip
        for what in ("columns", "actuators", "control_steps", "zone_names"):
            same = getattr(plant, what) == getattr(first, what)
            PlantError.unless(same, where, f"the same {what.replace('_', ' ')} as plant 0", "others")
        same = same_system(plant.system, first.system) and plant.scenario.grid.step == first.scenario.grid.step
        PlantError.unless(same, where, "the HVAC system and step of plant 0", "others")
        noise = [None if p.sensors.noise is None else p.sensors.noise.noise for p in (plant, first)]
        PlantError.unless(noise[0] == noise[1], where, "the noise of plant 0", "another")
    return every


def same_system(one: Any, other: Any) -> bool:
    """Tell whether two components, systems or parameters are the same in all that they are made of.

    Parameters
    ----------
    one, other : object
        Any.
    """
    if one is other:
        return True
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and np.array_equal(one, other)
    names = getattr(one, "__dataclass_fields__", None)
    if names is not None:
        return type(one) is type(other) and all(same_system(getattr(one, k), getattr(other, k)) for k in names)
    if isinstance(one, dict):
        return isinstance(other, dict) and list(one) == list(other) and all(same_system(one[k], other[k]) for k in one)
    return bool(one == other)
