"""Constructions of the bundled case and their thermal transmittances."""

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Material:
    """A layer.

    Parameters
    ----------
    thickness : float
        [m]
    conductivity : float
        [W/m/K]
    density : float
        [kg/m3]
    heat_capacity : float
        [J/kg/K]
    """

    thickness: float
    conductivity: float
    density: float
    heat_capacity: float


# Values: usual design values of ISO 10456, rounded.
MATERIALS = MappingProxyType(
    {
        "render": Material(0.02, 0.87, 1800.0, 1000.0),
        "insulation": Material(0.04, 0.038, 20.0, 1450.0),
        "brick": Material(0.175, 0.60, 1400.0, 1000.0),
        "plaster": Material(0.015, 0.51, 1200.0, 1000.0),
        "partition_brick": Material(0.115, 0.50, 1200.0, 1000.0),
        "screed": Material(0.05, 1.40, 2000.0, 1000.0),
        "concrete": Material(0.15, 1.80, 2300.0, 1000.0),
    }
)
# Layers from the outside (or the back of a slab) inwards.
CONSTRUCTIONS = MappingProxyType(
    {
        "exterior_wall": ("render", "insulation", "brick", "plaster"),
        "interior_wall": ("plaster", "partition_brick", "plaster"),
        "floor_slab": ("concrete", "screed"),
        "ceiling_slab": ("concrete",),
    }
)
GLAZING_U_VALUE = 2.7  # [W/m2/K], air to air, winter films of EnergyPlus's simple glazing system
GLAZING_SHGC = 0.40  # [-], solar heat gain coefficient at normal incidence
EXTERIOR_CONVECTION = 20.0  # [W/m2/K], constant; with about 4.6 of radiation the 25 of ISO 6946
THERMAL_ABSORPTANCE = 0.9  # [-], outside it acts towards surroundings at air temperature only
INTERIOR_SOLAR_ABSORPTANCE = 0.6  # [-]
EXTERIOR_SOLAR_ABSORPTANCE = 0.001  # [-], EnergyPlus wants more than 0: opaque walls take no sun
# Surface resistances of ISO 6946 [m2 K/W], only to state U-values; EnergyPlus computes its own films.
RESISTANCE_INSIDE = 0.13
RESISTANCE_OUTSIDE = 0.04


def resistance(construction: str) -> float:
    """Return the resistance of a construction without surface films [m2 K/W].

    Parameters
    ----------
    construction : str
        Key of `CONSTRUCTIONS`.
    """
    layers = (MATERIALS[name] for name in CONSTRUCTIONS[construction])
    return sum(layer.thickness / layer.conductivity for layer in layers)


def u_values() -> dict[str, float]:
    """Return air-to-air transmittances [W/m2/K] of what separates two airs, with the films of ISO 6946."""
    exterior = resistance("exterior_wall") + RESISTANCE_INSIDE + RESISTANCE_OUTSIDE
    interior = resistance("interior_wall") + 2.0 * RESISTANCE_INSIDE
    return {"exterior_wall": 1.0 / exterior, "interior_wall": 1.0 / interior, "glazing": GLAZING_U_VALUE}
