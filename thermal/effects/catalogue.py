"""The catalogue of effects: what a building may have and the baseline does not, each a term of the model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from thermal.effects.air import INFILTRATION, THERMAL_BRIDGE, WINDOW_OPENING, ZONE_MIXING
from thermal.effects.effect import Chosen, Effect
from thermal.effects.metering import CAPACITY_LIMIT, DUCT_LOSS, FLOW_GAIN, SENSOR_BIAS, SENSOR_LAG, VALVE_LEAK
from thermal.effects.next_door import GROUND_EXCHANGE, HIDDEN_MASS, INTERFLOOR_EXCHANGE, NEIGHBOUR, ROOF_EXCHANGE
from thermal.effects.outside import LONGWAVE_SKY, WIND_FILM, WRONG_STATION
from thermal.effects.people import CLOCK_SHIFT, INTERNAL_GAINS, LATENT_LOAD
from thermal.effects.sun import BLINDS, SOLAR_GAIN, SOLAR_OPAQUE
from thermal.errors import EffectError, nearest

#: Effects by id, in the order in which they join a network: what others look at comes first, sensors come last.
CATALOGUE: dict[str, Effect] = {
    e.id: e
    for e in (
        ROOF_EXCHANGE, SOLAR_GAIN, BLINDS, SOLAR_OPAQUE, LONGWAVE_SKY, WIND_FILM, INFILTRATION, THERMAL_BRIDGE,
        WINDOW_OPENING, INTERNAL_GAINS, LATENT_LOAD, INTERFLOOR_EXCHANGE, GROUND_EXCHANGE, NEIGHBOUR, HIDDEN_MASS,
        ZONE_MIXING, WRONG_STATION, CLOCK_SHIFT, FLOW_GAIN, DUCT_LOSS, CAPACITY_LIMIT, VALVE_LEAK, SENSOR_BIAS,
        SENSOR_LAG,
    )
}  # fmt: skip


def chosen(effects: Iterable[str] | Mapping[str, Sequence[str]]) -> tuple[Chosen, ...]:
    """Effects to extend a network by, in the order of the catalogue.

    Parameters
    ----------
    effects : iterable of str, or mapping of str to sequence of str
        Ids; a mapping has the zones of each, none for the whole building.

    Raises
    ------
    EffectError
        When an id is not in the catalogue, or an effect lacks one that it modifies.

    Examples
    --------
    >>> [c.effect.id for c in chosen(["blinds", "solar_gain"])]
    ['solar_gain', 'blinds']
    """
    zones = dict(effects) if isinstance(effects, Mapping) else {name: () for name in effects}
    for name, where in zones.items():
        if isinstance(where, str):
            raise EffectError(f"effect {name}: expected a sequence of zones, came {where!r}")
    for name in zones:
        if name not in CATALOGUE:
            raise EffectError(f"effect {name!r}: not in the catalogue; {nearest(name, CATALOGUE)}")
        lacking = [r for r in CATALOGUE[name].requires if r not in zones]
        if lacking:
            raise EffectError(f"effect {name}: modifies {', '.join(lacking)}; add that too")
    return tuple(Chosen(e, tuple(zones[e.id])) for e in CATALOGUE.values() if e.id in zones)
