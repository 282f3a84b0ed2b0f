"""Cold sky, wind on the outside film, and weather that is measured elsewhere."""

from functools import partial
from operator import attrgetter

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, EffectBuilder, described, lacking
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal


def _wind(inputs: InputProvider, zone: str | None) -> FloatArray:
    inside = inputs.usual.mean(axis=1) if zone is None else inputs.usual[:, inputs.zones.index(zone)]
    return np.asarray((inputs.wind - (inputs.normalisation.wind or 0.0)) * (inputs.outdoor - inside))


def _build_sky(builder: EffectBuilder) -> None:
    emitted = builder.parameter("sky_exchange_factor")
    signal = Signal("sky deficit", "W/m^2", attrgetter("sky"), ("sky",))
    for faces in builder.anatomy.outer:
        view = (1.0 + np.cos(np.radians(faces.outlook.tilt))) / 2.0
        if view > 1e-9:
            value = emitted * faces.value / faces.outlook.film
            builder.graph.source(builder.key(), value, faces.node, signal, view * faces.area)


def _build_film(builder: EffectBuilder) -> None:
    slope = builder.parameter("wind_film_slope")
    for faces in builder.anatomy.outer:
        name, of = f"wind on films of {faces.zone or 'walls'}", partial(_wind, zone=faces.zone)
        signal = Signal(name, "K*m/s", of, ("wind", "outdoor", "usual"))
        value = slope * (faces.value / faces.outlook.film) ** 2
        builder.graph.source(builder.key(), value, faces.node, signal, faces.area)


def _swing(inputs: InputProvider) -> FloatArray:
    """Outdoor temperature about its mean over the day around each step [K]."""
    day = max(1, round(86400.0 / inputs.step))
    outdoor = pd.Series(inputs.outdoor)
    return np.asarray(outdoor - outdoor.rolling(day, center=True, min_periods=1).mean())


def _build_station(builder: EffectBuilder) -> None:
    offset, swing = builder.parameter("station_offset"), builder.parameter("station_swing")
    daily = Signal("outdoor temperature about its day's mean", "K", _swing, ("outdoor",))
    for value, _, node, weight in builder.graph.touching(np.array([builder.graph.boundary("outdoor")])):
        builder.graph.source(builder.key(), -offset * value, node, CONSTANT, weight)
        builder.graph.source(builder.key(), -swing * value, node, daily, weight)


_no_faces = lacking("outer", "the building has no surfaces to outdoor")
LONGWAVE_SKY = described("longwave_sky", _build_sky, _no_faces)
WIND_FILM = described("wind_film", _build_film, _no_faces)
WRONG_STATION = described("wrong_station", _build_station, _no_faces)
