"""Constructions of an office, from outside to inside, as EnergyPlus' objects.

EnergyPlus' conduction transfer functions lose or make heat in heavy layers at steps of five minutes: insulation has no
mass, and no wall or slab is heavier than `plant.heat_made` bears.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ideal_air_trials.specification import Fabric

Objects = dict[str, dict[str, dict[str, Any]]]
Layer = tuple[str, float, float, float, float]  # name, [m], [W/m/K], [kg/m3], [J/kg/K]

INSULATION = "insulation"  # a layer without mass that takes what is left of the wall's resistance
_BRICK, _CONCRETE = (0.9, 1800.0, 840.0), (1.6, 2300.0, 900.0)
_BLOCK, _BOARD = (0.8, 1500.0, 900.0), (0.2, 800.0, 1000.0)
#: Layers of exterior walls on both sides of their insulation.
WALLS: dict[str, tuple[Layer, Layer]] = {
    "brick_veneer": (("brick", 0.08, *_BRICK), ("gypsum", 0.025, *_BOARD)),
    "light": (("panel", 0.012, 0.4, 1500.0, 900.0), ("gypsum", 0.025, *_BOARD)),
    "concrete_outside": (("concrete", 0.09, *_CONCRETE), ("gypsum", 0.0125, *_BOARD)),
    "block_inside": (("render", 0.01, 0.9, 1800.0, 900.0), ("block", 0.08, *_BLOCK)),
}
PARTY_BLOCK: Layer = ("party block", 0.09, *_BLOCK)
_BOARDS = 0.025  # [m] of gypsum board on either side of studs
_PLASTER = 0.012  # [m] on either side of blocks
SLAB_CAPACITY = 900.0  # [J/kg/K], concrete
_LEAST_INSULATION = 0.4  # [m2K/W]

NO_SUN = 0.0001  # [-], absorptance of outer layers that an effect adds
_OPAQUE = 0.6  # [-], absorptance of faces that no sun reaches
EMISSIVITY = 0.9  # [-], of all opaque faces
DARK = (0.0005, 0.999)  # [-], transmittance and reflectance of a pane that lets no sun through
PANE = 0.006  # [m]


def material(layer: Layer, absorptance: float = _OPAQUE) -> Objects:
    """Return a layer with mass.

    Parameters
    ----------
    layer : tuple
        Name, thickness, conductivity, density and heat capacity.
    absorptance : float
        Of the sun [-].
    """
    name, thickness, conductivity, density, capacity = layer
    fields = {
        "roughness": "MediumRough", "thickness": round(thickness, 5), "conductivity": round(conductivity, 5),
        "density": round(density, 2), "specific_heat": capacity, "thermal_absorptance": EMISSIVITY,
        "solar_absorptance": absorptance, "visible_absorptance": absorptance,
    }  # fmt: skip
    return {"Material": {name: fields}}


def resistance(name: str, value: float, absorptance: float = _OPAQUE, roughness: str = "Rough") -> Objects:
    """Return a layer without mass.

    Parameters
    ----------
    name : str
        Of it.
    value : float
        [m2K/W]
    absorptance : float
        Of the sun [-].
    roughness : str
        EnergyPlus' word.
    """
    fields = {
        "roughness": roughness, "thermal_resistance": round(value, 4), "thermal_absorptance": EMISSIVITY,
        "solar_absorptance": absorptance, "visible_absorptance": absorptance,
    }  # fmt: skip
    return {"Material:NoMass": {name: fields}}


def construction(name: str, layers: Sequence[str]) -> Objects:
    """Return a construction.

    Parameters
    ----------
    name : str
        Of it.
    layers : sequence of str
        From outside to inside.
    """
    keys = ("outside_layer", *(f"layer_{k}" for k in range(2, len(layers) + 1)))
    return {"Construction": {name: dict(zip(keys, layers, strict=True))}}


def merge(objects: Objects, *parts: Objects) -> Objects:
    """Add objects to others, which are changed and returned.

    Parameters
    ----------
    objects : dict
        By class and name.
    *parts : dict
        To add.
    """
    for part in parts:
        for kind, named in part.items():
            objects.setdefault(kind, {}).update(named)
    return objects


def slab_half(fabric: Fabric) -> float:
    """Return the resistance of half a slab's concrete [m2K/W].

    Parameters
    ----------
    fabric : Fabric
        Of an office.
    """
    return fabric.slab_thickness / 2.0 / fabric.slab_conductivity


def slab(name: str, fabric: Fabric, thickness: float) -> Layer:
    """Return a layer of the slab's concrete.

    Parameters
    ----------
    name : str
        Of it.
    fabric : Fabric
        Of an office.
    thickness : float
        [m]
    """
    return name, thickness, fabric.slab_conductivity, fabric.slab_density, SLAB_CAPACITY


def opaque(fabric: Fabric) -> Objects:
    """Return walls, partitions and the halves of slabs that zones have below and above them.

    Parameters
    ----------
    fabric : Fabric
        Of an office.
    """
    outer, inner = WALLS[fabric.wall]
    left = fabric.wall_resistance - outer[1] / outer[2] - inner[1] / inner[2]
    if fabric.partition == "stud":
        face: Layer = ("partition face", _BOARDS, *_BOARD)
        core: Layer = ("partition core", fabric.partition_thickness - 2.0 * _BOARDS, 0.06, 30.0, 1000.0)
    else:
        face = ("partition face", _PLASTER, 0.5, 1300.0, 1000.0)
        core = ("partition core", fabric.partition_thickness - 2.0 * _PLASTER, 0.5, 1200.0, 900.0)
    return merge(
        {},
        material(outer, absorptance=0.0),
        resistance(INSULATION, max(left, _LEAST_INSULATION)),
        material(inner),
        construction("exterior wall", (outer[0], INSULATION, inner[0])),
        material(face),
        material(core),
        construction("partition", (face[0], core[0], face[0])),
        material(slab("half slab", fabric, fabric.slab_thickness / 2.0)),
        resistance("carpet", fabric.carpet_resistance),
        resistance("tile", fabric.tile_resistance, roughness="MediumRough"),
        construction("floor", ("half slab", "carpet")),
        construction("ceiling", ("half slab", "tile")),
    )


def window(fabric: Fabric, transmittance: float, reflectance: float) -> Objects:
    """Return windows of two panes.

    Parameters
    ----------
    fabric : Fabric
        Of an office.
    transmittance, reflectance : float
        Of one pane for the sun [-].
    """
    panes = {
        name: {
            "optical_data_type": "SpectralAverage", "thickness": PANE, "conductivity": 1.0,
            "solar_transmittance_at_normal_incidence": round(transmittance, 5),
            "front_side_solar_reflectance_at_normal_incidence": round(reflectance, 5),
            "back_side_solar_reflectance_at_normal_incidence": round(reflectance, 5),
            "visible_transmittance_at_normal_incidence": 0.8,
            "front_side_visible_reflectance_at_normal_incidence": 0.08,
            "back_side_visible_reflectance_at_normal_incidence": 0.08,
            "infrared_transmittance_at_normal_incidence": 0.0,
            "front_side_infrared_hemispherical_emissivity": emissivity,
            "back_side_infrared_hemispherical_emissivity": 0.84,
        }
        for name, emissivity in (("outer pane", 0.84), ("inner pane", round(fabric.emissivity, 3)))
    }  # fmt: skip
    gap = {"gap": {"gas_type": "Air", "thickness": round(fabric.gap, 4)}}
    found: Objects = {"WindowMaterial:Glazing": panes, "WindowMaterial:Gas": gap}
    return merge(found, construction("window", ("outer pane", "gap", "inner pane")))
