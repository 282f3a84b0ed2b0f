"""Materials and constructions of a trial's building."""

from __future__ import annotations

from typing import Any

import numpy as np

from energyplus_trials.frame import Objects
from energyplus_trials.specification import Fabric

# Conductivity [W/m/K], density [kg/m3], heat capacity [J/kg/K]: usual design values of ISO 10456, rounded.
SOLIDS = {
    "render": (0.87, 1800.0, 1000.0),
    "cladding": (0.16, 700.0, 1600.0),
    "insulation": (0.038, 20.0, 1450.0),
    "brick": (0.60, 1400.0, 1000.0),
    "concrete": (1.80, 2300.0, 1000.0),
    "gypsum": (0.25, 900.0, 1000.0),
    "plaster": (0.51, 1200.0, 1000.0),
    "wood": (0.13, 600.0, 1600.0),
}
FILMS = 0.17  # [m2 K/W], both surface resistances of a wall (ISO 6946)
CAVITY = 0.18  # [m2 K/W], air in a light partition (ISO 6946)
THERMAL_ABSORPTANCE = 0.9
INSIDE_SOLAR_ABSORPTANCE = 0.6
NO_SOLAR_ABSORPTANCE = 0.001  # EnergyPlus wants more than 0

Layers = list[tuple[str, float]]  # of a solid and its thickness [m], or of "" and a resistance [m2 K/W]


def wall_layers(fabric: Fabric) -> Layers:
    """Return the exterior wall, outside first; the insulation is as thick as the U-value asks.

    Parameters
    ----------
    fabric : Fabric
        Of a trial.
    """
    solid: Layers = {
        "mass_inside": [("render", 0.015), ("insulation", 0.0), ("brick", fabric.structure), ("plaster", 0.015)],
        "mass_outside": [("render", 0.015), ("brick", fabric.structure), ("insulation", 0.0), ("gypsum", 0.0125)],
        "light": [("cladding", 0.02), ("insulation", 0.0), ("gypsum", 0.025)],
    }[fabric.wall]
    rest = sum(d / SOLIDS[name][0] for name, d in solid)
    thickness = SOLIDS["insulation"][0] * max(1.0 / fabric.wall_u_value - FILMS - rest, 0.2)
    return [(name, round(thickness, 4) if name == "insulation" else d) for name, d in solid]


def constructions(fabric: Fabric) -> dict[str, Layers]:
    """Return every construction of a null, outside first.

    Parameters
    ----------
    fabric : Fabric
        Of a trial.
    """
    partitions: dict[str, Layers] = {
        "brick": [("plaster", 0.015), ("brick", 0.115), ("plaster", 0.015)],
        "gypsum": [("gypsum", 0.025), ("", CAVITY), ("gypsum", 0.025)],
    }
    # Floors are apart: each zone has its own concrete below and above, which is all its own when mirrored at the back.
    slab: Layers = [("concrete", fabric.slab), ("", 1.0), ("concrete", fabric.slab)]
    return {
        "exterior wall": wall_layers(fabric),
        "partition": partitions[fabric.partition],
        "slab": slab,
        "furniture": [("wood", fabric.furniture_thickness)],
    }


def objects(found: dict[str, Layers], outside_absorptance: float) -> Objects:
    """Return constructions and their materials in EnergyPlus.

    Parameters
    ----------
    found : dict
        Layers by construction.
    outside_absorptance : float
        For sun, of the outermost layer of walls and roofs [-].
    """
    solid: dict[str, dict[str, Any]] = {}
    massless: dict[str, dict[str, Any]] = {}
    made: dict[str, dict[str, Any]] = {}
    for name, layers in found.items():
        names = []
        for number, (kind, size) in enumerate(layers):
            outer = number == 0 and name in ("exterior wall", "roof", "bridge")
            sun = outside_absorptance if outer else INSIDE_SOLAR_ABSORPTANCE
            # named by what it is: a partition's two faces then are of the same materials
            names.append(f"{kind} {1000.0 * size:.1f} mm {sun:.3f}" if kind else f"resistance {size:.4f}")
            surface = {
                "roughness": "MediumRough",
                "thermal_absorptance": THERMAL_ABSORPTANCE,
                "solar_absorptance": sun,
                "visible_absorptance": sun,
            }
            if not kind:
                massless[names[-1]] = surface | {"thermal_resistance": size}
                continue
            conductivity, density, heat = SOLIDS[kind]
            solid[names[-1]] = surface | {
                "thickness": size, "conductivity": conductivity, "density": density, "specific_heat": heat,
            }  # fmt: skip
        fields = ["outside_layer", *(f"layer_{k}" for k in range(2, len(names) + 1))]
        made[name] = dict(zip(fields, names, strict=True))
    return {"Material": solid, "Material:NoMass": massless, "Construction": made}


def pane(u_value: float, transmittance: float) -> dict[str, Any]:
    """Return a pane of a thermal transmittance, with the films that EnergyPlus's simple glazing takes out of it.

    Arasteh, Kohler and Griffith (2009), Modeling windows in EnergyPlus with simple performance indices, LBNL-2804E.

    Parameters
    ----------
    u_value : float
        Air to air [W/m2/K], below 5.85.
    transmittance : float
        For sun at normal incidence [-].
    """
    inside = 1.0 / (0.359073 * np.log(u_value) + 6.949915)
    outside = 1.0 / (0.025342 * u_value + 29.163853)
    resistance = 1.0 / u_value - inside - outside
    thickness = 0.05914 - 0.00714 / resistance if resistance > 1.0 / 7.0 else 0.002
    reflectance = 0.99 - transmittance if transmittance == 0.0 else max(0.95 - transmittance, 0.05)
    optics: dict[str, float] = {}
    for band in ("solar", "visible"):
        optics[f"{band}_transmittance_at_normal_incidence"] = transmittance
        optics[f"front_side_{band}_reflectance_at_normal_incidence"] = reflectance
        optics[f"back_side_{band}_reflectance_at_normal_incidence"] = reflectance
    return {
        "optical_data_type": "SpectralAverage",
        "thickness": float(thickness),
        "conductivity": float(thickness / resistance),
        "front_side_infrared_hemispherical_emissivity": 0.84,
        "back_side_infrared_hemispherical_emissivity": 0.84,
        "infrared_transmittance_at_normal_incidence": 0.0,
        **optics,
    }
