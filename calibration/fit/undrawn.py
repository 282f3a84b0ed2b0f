"""What no drawing tells of a building's structure: films that follow heat or wind, contents that follow the air."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from thermal.network.network import ThermalNetwork
from thermal.network.structure import Structure

#: Share by which a structure with a few parameters more must do better on left-out days [-]: of three measured houses
#: and the Twin Houses one has heat and weather that are moved in time by it.
FEW_MORE = 0.05


@dataclass(frozen=True)
class Undrawn:
    """A part of a structure that no drawing tells.

    Parameters
    ----------
    signal : str
        What must be known for it, as an input of a model.
    put : callable
        Gives a structure that part.
    better : float
        Share by which it must predict left-out days better [-]: films that follow something have no more parameters,
        contents have one.
    """

    signal: str
    put: Callable[[Structure], Structure]
    better: float


#: By the name that the structure then has on the ladder.
UNDRAWN: Mapping[str, Undrawn] = {
    "natural convection": Undrawn("heat", lambda structure: replace(structure, natural_films=True), 0.0),
    "light contents": Undrawn("heat", lambda structure: replace(structure, light_contents=True), FEW_MORE),
    "wind": Undrawn("wind", lambda structure: replace(structure, wind_films=True), 0.0),
}

#: Those that a diagnosis takes by evidence. Wind on outer films is an effect of its catalogue.
BY_EVIDENCE = ("natural convection", "light contents")


def is_another(one: ThermalNetwork, other: ThermalNetwork) -> bool:
    """Whether a part of a structure does anything in a building: what it needs may be nowhere.

    Parameters
    ----------
    one, other : ThermalNetwork
        Of the building with it and without.
    """
    return (len(one.signals), len(one.parameters)) != (len(other.signals), len(other.parameters))
