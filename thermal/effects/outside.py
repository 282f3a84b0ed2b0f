"""Cold sky, wind on the outside film, and weather that is measured elsewhere."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, Effect, Joining, strength
from thermal.inputs.drivers import INFRARED, WIND, Drivers, Signal
from thermal.network.topology import Anatomy


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


def _swing(drivers: Drivers) -> FloatArray:
    """Outdoor temperature about its mean over the day around each step [K]."""
    day = max(1, round(86400.0 / drivers.case.step))
    outdoor = pd.Series(drivers.outdoor)
    return np.asarray(outdoor - outdoor.rolling(day, center=True, min_periods=1).mean())


def _build_station(join: Joining) -> None:
    offset, swing = join.parameter("station_offset"), join.parameter("station_swing")
    daily = Signal("outdoor temperature about its day's mean", "K", _swing)
    for value, _, node, weight in join.graph.touching(np.array([join.graph.boundary("outdoor")])):
        join.graph.source(join.key(), -offset * value, node, CONSTANT, weight)
        join.graph.source(join.key(), -swing * value, node, daily, weight)


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

WRONG_STATION = Effect(
    id="wrong_station",
    title="weather that is measured elsewhere",
    equation="-κ A (b_o + s_o (T_out - daily mean))",
    source="Oke (1982), doi:10.1002/qj.49710845502 (town and country differ by night); WMO-No. 8 (siting, shelter)",
    acts_on="whatever touches the outdoor air",
    confounders=("longwave_sky", "ground_exchange", "thermal_bridge", "solar_opaque"),
    separated_by="a second thermometer in the shade of the building",
    parameters=(
        strength("station_offset", "K", 4.0, "plus or minus 4 K: Oke (1982)", "wrong_station", -4.0),
        strength("station_swing", "1", 0.5, "swings of sheltered and sunlit sites", "wrong_station", -0.5),
    ),
    build=_build_station,
    applies=_no_faces,
)
