"""Sun through glass, blinds, and sun on opaque walls."""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import Effect, Joining, hat, shape, strength
from thermal.inputs.drivers import IRRADIANCE, Drivers, Signal
from thermal.network.topology import Anatomy

_ASHRAE = "ASHRAE Fundamentals 2017, ch. 15 (fenestration)"

#: Solar transmittance that a window is taken for where another's is known [-]: double glazing (EN 410).
_USUAL_TRANSMITTANCE = 0.6

#: Irradiance on a facade at which blinds may be drawn [W/m2]: knots of the interpolation in between.
_DRAWN_AT = (100.0, 200.0, 300.0, 400.0)

SHGC = strength("solar_heat_gain_coefficient", "1", 0.8, f"{_ASHRAE}, table 10: single glazing 0.8", "solar_gain")
TO_MASS = shape(
    "solar_share_to_floor", "1", 0.5, 0.1, 0.9, "EnergyPlus: all beams on the floor; ISO 52016-1: none", "solar_gain",
    "logit",
)  # fmt: skip


def _through(drivers: Drivers, azimuth: float, tilt: float) -> FloatArray:
    return drivers.sun.through_glass(azimuth, tilt)


def _through_when_bright(drivers: Drivers, azimuth: float, tilt: float, threshold: float) -> FloatArray:
    beam, diffuse = drivers.sun.plane(azimuth, tilt)
    return np.where(beam + diffuse > threshold, drivers.sun.through_glass(azimuth, tilt), 0.0)


def _on_plane(drivers: Drivers, azimuth: float, tilt: float) -> FloatArray:
    return np.asarray(sum(drivers.sun.plane(azimuth, tilt)))


def _panes(join: Joining, value: ca.SX, signal_of: partial[FloatArray], name: str) -> None:
    """Bring sun through every pane: a share to the floor or furniture, the rest to the other surfaces."""
    share = join.graph.own(TO_MASS)
    to_mass, to_surfaces = value * share, value * (1.0 - share)
    for pane in join.anatomy.panes:
        room = join.anatomy.rooms[pane.zone]
        signal = Signal(
            f"{name} at {pane.azimuth:g} deg, tilt {pane.tilt:g}", "W/m^2",
            partial(signal_of, azimuth=pane.azimuth, tilt=pane.tilt),
        )  # fmt: skip
        known = 1.0 if pane.transmittance is None else pane.transmittance / _USUAL_TRANSMITTANCE
        mass = room.floor[0] if room.floor else room.furniture
        if mass < 0:
            join.heat_surfaces(room, value, signal, known * pane.area)
            continue
        join.graph.source(name, to_mass, mass, signal, known * pane.area)
        join.heat_surfaces(room, to_surfaces, signal, known * pane.area)


def _build_gain(join: Joining) -> None:
    _panes(join, join.graph.own(SHGC), partial(_through), "sun through glass")


def _build_blinds(join: Joining) -> None:
    drawn, threshold = join.parameter("blind_shading"), join.parameter("blind_irradiance")
    for number, knot in enumerate(_DRAWN_AT):
        value = -join.graph.own(SHGC) * drawn * hat(threshold, _DRAWN_AT, number)
        _panes(join, value, partial(_through_when_bright, threshold=knot), f"sun through glass over {knot:g} W/m2")


def _build_opaque(join: Joining) -> None:
    absorptance = join.parameter("solar_absorptance")
    for faces in join.anatomy.outer:
        look = faces.outlook
        if look.glass or look.tilt > 90.0:
            continue
        signal = Signal(
            f"sun at {look.azimuth:g} deg, tilt {look.tilt:g}", "W/m^2",
            partial(_on_plane, azimuth=look.azimuth, tilt=look.tilt),
        )  # fmt: skip
        join.graph.source(join.key(), absorptance * faces.value / look.film, faces.node, signal, faces.area)


def _no_panes(anatomy: Anatomy) -> str | None:
    return None if anatomy.panes else "the building has no windows to outdoor"


def _no_walls(anatomy: Anatomy) -> str | None:
    opaque = any(not f.outlook.glass and f.outlook.tilt <= 90.0 for f in anatomy.outer)
    return None if opaque else "the building has no opaque walls to outdoor"


SOLAR_GAIN = Effect(
    id="solar_gain",
    title="sun through the windows",
    equation="Σ_panes g A (IAM I_b + 0.86 I_d)",
    source=f"{_ASHRAE}; incidence angle modifier of ASHRAE 93; isotropic sky of Liu and Jordan (1963)",
    acts_on="floor slab or furniture, and the zone's surfaces",
    confounders=("internal_gains", "solar_opaque", "blinds"),
    separated_by="sunny and overcast days; the morning of east and the afternoon of west zones",
    parameters=(SHGC, TO_MASS),
    build=_build_gain,
    needs=(IRRADIANCE,),
    applies=_no_panes,
)

BLINDS = Effect(
    id="blinds",
    title="blinds drawn when the sun is strong",
    equation="-β Σ_panes g A (IAM I_b + 0.86 I_d) 1[I > I_0]",
    source="O'Brien, Kapsis and Athienitis (2013), doi:10.1016/j.buildenv.2012.11.006",
    acts_on="floor slab or furniture, and the zone's surfaces, as the sun through the windows",
    confounders=("solar_gain",),
    separated_by="bright and half-bright days",
    parameters=(
        strength("blind_shading", "1", 0.8, "shading of interior and exterior blinds: ISO 52022-1", "blinds"),
        shape("blind_irradiance", "W/m^2", 200.0, 100.0, 400.0, "O'Brien et al. (2013), table 2", "blinds"),
    ),
    build=_build_blinds,
    needs=(IRRADIANCE,),
    requires=("solar_gain",),
    applies=_no_panes,
)

SOLAR_OPAQUE = Effect(
    id="solar_opaque",
    title="sun on the opaque walls",
    equation="α A I κ / h_o at the node behind the outer face",
    source="ISO 52016-1:2017, 6.5.6 (absorption at external surfaces)",
    acts_on="exterior walls",
    confounders=("solar_gain", "longwave_sky"),
    separated_by="the lag of two to eight hours; zones with walls and no windows",
    parameters=(
        strength("solar_absorptance", "1", 0.9, "light to dark finishes: ISO 52016-1 table A.15", "solar_opaque"),
    ),
    build=_build_opaque,
    needs=(IRRADIANCE,),
    applies=_no_walls,
)
