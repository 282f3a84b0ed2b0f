"""Heat of unknown cause by time, zone and outdoor temperature: the omnibus test beside the effects of the catalogue."""

import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import Effect, EffectBuilder, strength
from thermal.effects.unknown import BIN, BINS
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import CONSTANT, Signal

#: Heat that is plausible in a bin [W/m2], and per kelvin of outdoor temperature [W/m2/K].
_HEAT, _PER_KELVIN = 20.0, 1.0

_SOURCE = "any cause: loads and losses of offices stay within"

#: Sizes that generic heat may have over its prior's [-]; the likeliest counts (empirical Bayes).
TIGHTNESS = (0.003, 0.01, 0.03, 0.1, 0.3)


def _about_mean(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.outdoor - inputs.outdoor.mean())


_OUTDOOR = Signal("outdoor temperature about its mean", "K", _about_mean, ("outdoor",))


def _build(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        for number, signal in enumerate(BINS):
            builder.heat_air(room, builder.parameter(f"heat_from_{BIN * number:02d}"), signal, room.floor_area)
        builder.heat_air(room, builder.parameter(ZONE_HEAT, zone=room.name), CONSTANT, room.floor_area)
        builder.heat_air(room, builder.parameter("heat_by_outdoor", zone=room.name), _OUTDOOR, room.floor_area)


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
            for first in range(0, 24, BIN)
        ),
        strength(ZONE_HEAT, "W/m^2", _HEAT, _SOURCE, "generic", -_HEAT),
        strength("heat_by_outdoor", "W/m^2/K", _PER_KELVIN, _SOURCE, "generic", -_PER_KELVIN),
    ),
    build=_build,
    zonal=True,
)
