"""Heat of any shape: what an omnibus test looks for where no effect of the catalogue fits."""

from __future__ import annotations

from functools import partial

import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, Effect, EffectBuilder, strength
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal

#: Hours of a bin of the day.
_BIN = 3

#: Heat that is plausible in a bin [W/m2], and per kelvin of outdoor temperature [W/m2/K].
_HEAT, _PER_KELVIN = 20.0, 1.0

_SOURCE = "any cause: loads and losses of offices stay within"


def _hours(drivers: InputProvider, first: int) -> FloatArray:
    hour = np.asarray(drivers.stamps.hour)
    return ((hour >= first) & (hour < first + _BIN)).astype(float)


def _outdoor(drivers: InputProvider) -> FloatArray:
    return np.asarray(drivers.outdoor - drivers.outdoor.mean())


def _build(builder: EffectBuilder) -> None:
    outdoor = Signal("outdoor temperature about its mean", "K", _outdoor, ("outdoor",))
    for room in builder.rooms:
        for first in range(0, 24, _BIN):
            signal = Signal(f"{first} to {first + _BIN} h", "1", partial(_hours, first=first))
            builder.heat_air(room, builder.parameter(f"heat_from_{first:02d}"), signal, room.floor_area)
        builder.heat_air(room, builder.parameter(ZONE_HEAT, zone=room.name), CONSTANT, room.floor_area)
        builder.heat_air(room, builder.parameter("heat_by_outdoor", zone=room.name), outdoor, room.floor_area)


#: Constant heat of a zone [W/m2], by which the smallest detectable watts are told.
ZONE_HEAT = "heat_of_zone"

#: Heat at every time of day, and in each zone constantly and with outdoor temperature.
GENERIC = Effect(
    id="generic",
    title="heat of unknown cause",
    equation="A (Σ_b p_b 1[t in b] + p_z + p_T,z (T_out - mean))",
    source="generic regressors of an omnibus test",
    acts_on="air of each zone",
    confounders=(),
    separated_by="",
    parameters=(
        *(
            strength(f"heat_from_{first:02d}", "W/m^2", _HEAT, _SOURCE, "generic", -_HEAT)
            for first in range(0, 24, _BIN)
        ),
        strength(ZONE_HEAT, "W/m^2", _HEAT, _SOURCE, "generic", -_HEAT),
        strength("heat_by_outdoor", "W/m^2/K", _PER_KELVIN, _SOURCE, "generic", -_PER_KELVIN),
    ),
    build=_build,
    zonal=True,
)
