"""Constructions of a house as the case folder has them: layers from the room outwards."""

from __future__ import annotations

from typing import Any

from house_trials.faces import Face
from house_trials.specification import Fabric

# Conductivity [W/m/K], density [kg/m3], heat capacity [J/kg/K]: design values, ISO 10456.
MATERIALS = {
    "plaster": (0.57, 1300.0, 1000.0),
    "gypsum board": (0.25, 900.0, 1000.0),
    "brick": (0.68, 1600.0, 920.0),
    "aerated block": (0.14, 500.0, 1000.0),
    "wool": (0.040, 40.0, 1030.0),
    "stud and wool": (0.050, 90.0, 1200.0),
    "foam": (0.035, 30.0, 1450.0),
    "sheathing": (0.13, 600.0, 1700.0),
    "render": (0.80, 1800.0, 1000.0),
    "screed": (1.40, 2000.0, 1000.0),
    "concrete": (2.00, 2400.0, 1000.0),
    "parquet": (0.16, 700.0, 1700.0),
    "chipboard": (0.14, 650.0, 1700.0),
    "timber": (0.13, 500.0, 1600.0),
}
FILMS = 0.17  # [m2 K/W], both surface resistances of a wall (ISO 6946)
BOUNDARY_FILM = 1.0 / 0.13  # [W/m2/K], towards attic and cellar (ISO 6946)

Layers = tuple[tuple[str, float], ...]  # material and thickness [m]

#: Layer of the lowest floor, from the room, that heating pipes lie at the foot of.
HEATED_LAYER = "screed"


def constructions(fabric: Fabric) -> dict[str, Layers]:
    """Return every construction of a house, from the room outwards.

    Parameters
    ----------
    fabric : Fabric
        Of a trial.
    """
    d = fabric.insulation
    wall: dict[str, Layers] = {
        "brick": (("plaster", 0.015), ("brick", 0.30), ("foam", d), ("render", 0.01)),
        "cavity": (("plaster", 0.012), ("aerated block", 0.10), ("wool", d), ("brick", 0.10)),
        "block": (("plaster", 0.012), ("aerated block", 0.24), ("foam", d), ("render", 0.015)),
        "timber": (("gypsum board", 0.025), ("stud and wool", max(d, 0.06)), ("sheathing", 0.022)),
    }
    partition: dict[str, Layers] = {
        "brick": (("plaster", 0.012), ("brick", 0.115), ("plaster", 0.012)),
        "stud": (("gypsum board", 0.0125), ("stud and wool", 0.06), ("gypsum board", 0.0125)),
    }
    slab: dict[str, Layers] = {  # from the room below
        "concrete": (("plaster", 0.01), ("concrete", 0.16), ("foam", 0.03), ("screed", 0.05), ("parquet", 0.012)),
        "joists": (("gypsum board", 0.0125), ("stud and wool", 0.14), ("chipboard", 0.022)),
    }
    under: Layers = (("foam", fabric.floor_insulation), ("concrete", 0.15))
    roof: Layers = (("gypsum board", 0.0125), ("stud and wool", fabric.roof_insulation), ("sheathing", 0.022))
    found = {
        "exterior wall": wall[fabric.wall],
        "partition": partition[fabric.partition],
        "slab": slab[fabric.slab],
        "lowest floor": (("parquet", 0.012), ("screed", 0.055), *under),
        "roof": roof,
        "furniture": (("timber", 0.03),),
    }
    return {name: tuple((m, thickness) for m, thickness in layers if thickness > 0.0) for name, layers in found.items()}


def construction_of(face: Face) -> str:
    """Return the construction of a surface; a slab's layers go upwards.

    Parameters
    ----------
    face : Face
        Of a house.
    """
    if face.kind == "wall":
        return "exterior wall" if face.other == "outdoor" else "partition"
    if face.other in ("ground", "cellar"):
        return "lowest floor"
    return "roof" if face.other in ("outdoor", "attic") else "slab"


def u_value(layers: Layers) -> float:
    """Return the thermal transmittance of layers between two films [W/m2/K].

    Parameters
    ----------
    layers : tuple of (str, float)
        Materials and thicknesses [m].
    """
    return 1.0 / (FILMS + sum(d / MATERIALS[name][0] for name, d in layers))


def table_layers(layers: Layers) -> list[dict[str, float]]:
    """Return layers as a case folder has them.

    Parameters
    ----------
    layers : tuple of (str, float)
        From the surface's zone to what is behind it.
    """
    names = ("conductivity", "density", "heat_capacity")
    return [{"thickness": d} | dict(zip(names, MATERIALS[m], strict=True)) for m, d in layers]


def pane(u: float, transmittance: float) -> dict[str, Any]:
    """Return a pane of a rated thermal transmittance: its resistance is that of the window less its films (EN 673).

    Parameters
    ----------
    u : float
        Air to air [W/m2/K], at films of 7.7 and 25 W/m2/K.
    transmittance : float
        For sun at normal incidence [-].
    """
    resistance, thickness = 1.0 / u - 1.0 / 7.7 - 1.0 / 25.0, 0.02
    optics = {
        f"{band}_{what}": value
        for band in ("solar", "visible")
        for what, value in (("transmittance_at_normal_incidence", transmittance),)
    }
    for side in ("front", "back"):
        for band in ("solar", "visible"):
            reflected = max((0.94 if transmittance else 0.99) - transmittance, 0.05)
            optics[f"{side}_side_{band}_reflectance_at_normal_incidence"] = reflected
        optics[f"{side}_side_infrared_hemispherical_emissivity"] = 0.84
    return optics | {
        "optical_data_type": "SpectralAverage", "thickness": thickness, "conductivity": thickness / resistance,
        "infrared_transmittance_at_normal_incidence": 0.0,
    }  # fmt: skip
