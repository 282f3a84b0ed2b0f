"""Cold sky, and wind on the outside film."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from thermal.effects._effect import Effect, Joining, strength
from thermal.network import Anatomy
from thermal.signals import INFRARED, WIND, Drivers, Signal

FloatArray = NDArray[np.float64]


def _sky(drivers: Drivers) -> FloatArray:
    return drivers.sky


def _wind(drivers: Drivers, zone: str | None) -> FloatArray:
    inside = drivers.usual.mean(axis=1) if zone is None else drivers.usual[:, drivers.zones.index(zone)]
    return np.asarray((drivers.wind - drivers.wind.mean()) * (drivers.outdoor - inside))


def _build_sky(join: Joining) -> None:
    emitted = join.parameter("sky_exchange_factor")
    signal = Signal("sky deficit", "W/m^2", _sky)
    for faces in join.anatomy.outer:
        view = (1.0 + np.cos(np.radians(faces.outlook.tilt))) / 2.0
        if view > 1e-9:
            value = emitted * faces.value / faces.outlook.film
            join.graph.source(join.key(), value, faces.node, signal, view * faces.area)


def _build_film(join: Joining) -> None:
    slope = join.parameter("wind_film_slope")
    for faces in join.anatomy.outer:
        signal = Signal(f"wind on films of {faces.zone or 'walls'}", "K*m/s", partial(_wind, zone=faces.zone))
        value = slope * (faces.value / faces.outlook.film) ** 2
        join.graph.source(join.key(), value, faces.node, signal, faces.area)


def _no_faces(anatomy: Anatomy) -> str | None:
    return None if anatomy.outer else "the building has no surfaces to outdoor"


LONGWAVE_SKY = Effect(
    id="longwave_sky",
    title="heat radiated to the cold sky",
    equation="ε F A (L_sky - σ T_out⁴) κ / h_o",
    source="ISO 52016-1:2017, 6.5.13 (extra thermal radiation to the sky); sky from the measured infrared irradiance",
    acts_on="exterior walls and, through windows, the zones",
    confounders=("wind_film", "thermal_bridge", "infiltration"),
    separated_by="clear and cloudy nights at equal outdoor temperature",
    parameters=(strength("sky_exchange_factor", "1", 0.95, "emissivity 0.2 (low-e) to 0.95", "longwave_sky"),),
    build=_build_sky,
    needs=(INFRARED,),
    applies=_no_faces,
)

WIND_FILM = Effect(
    id="wind_film",
    title="wind on the outside of walls and windows",
    equation="h_1 (v - v̄) A (κ / h_o)² (T_out - T)",
    source="ISO 6946:2017 Annex C: 4 + 4 v",
    acts_on="exterior walls and, through windows, the zones",
    confounders=("infiltration",),
    separated_by="windy and calm nights; lag through the wall",
    parameters=(strength("wind_film_slope", "W*s/m^3/K", 6.0, "2 to 6 (McAdams 1954; ISO 6946)", "wind_film"),),
    build=_build_film,
    needs=(WIND,),
    applies=_no_faces,
)
