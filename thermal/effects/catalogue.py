"""The catalogue of effects: what a building may have and the baseline does not, each a term of the model."""

from collections.abc import Iterable, Mapping, Sequence

from thermal.effects import air, envelope, gains, metering
from thermal.effects.effect import Chosen, Effect
from thermal.effects.unknown import UNKNOWN
from thermal.errors import EffectError, nearest
from thermal.parameters import PARAMETERS

#: Effects by id, in the order in which they join a network: what others look at comes first, sensors come last.
CATALOGUE: dict[str, Effect] = {
    e.id: e
    for e in (
        envelope.ROOF_EXCHANGE, gains.SOLAR_GAIN, gains.BLINDS, gains.SOLAR_OPAQUE, envelope.LONGWAVE_SKY,
        envelope.WIND_FILM, air.INFILTRATION, air.THERMAL_BRIDGE, air.WINDOW_OPENING, air.VENTILATION,
        gains.INTERNAL_GAINS, gains.LATENT_LOAD, envelope.INTERFLOOR_EXCHANGE, envelope.GROUND_EXCHANGE,
        envelope.NEIGHBOUR, envelope.HIDDEN_MASS, air.ZONE_MIXING, envelope.WRONG_STATION, metering.CLOCK_SHIFT,
        metering.FLOW_GAIN, metering.DUCT_LOSS, metering.CAPACITY_LIMIT, metering.VALVE_LEAK, metering.SENSOR_BIAS,
        metering.SENSOR_LAG,
    )
}  # fmt: skip


def register_effect(effect: Effect) -> None:
    """Add an effect of one's own to the catalogue: commands, calibration, diagnosis and reports know it from then on.

    Parameters
    ----------
    effect : Effect
        After those of the catalogue in the order in which they join a network.

    Raises
    ------
    EffectError
        When its id or the name of a parameter is taken, or it modifies an effect that is not there.
    """
    taken = {p.name for e in (*CATALOGUE.values(), *UNKNOWN.values()) for p in e.parameters} | set(PARAMETERS)
    names = [p.name for p in effect.parameters]
    clashes = [effect.id] if is_effect(effect.id) else [name for name in names if name in taken]
    if clashes:
        raise EffectError(f"effect {effect.id}", "a name of its own", repr(clashes[0]), "call it otherwise")
    if absent := [r for r in effect.requires if r not in CATALOGUE]:
        raise EffectError(f"effect {effect.id}: requires", "effects of the catalogue", repr(absent[0]))
    if not names or effect.parameters[0].start != 0.0 or any(p.effect != effect.id for p in effect.parameters):
        expected = "a strength that starts at 0 first, all with this effect's id"
        raise EffectError(f"effect {effect.id}: parameters", expected, f"{names}")
    CATALOGUE[effect.id] = effect


def is_effect(name: str) -> bool:
    """Whether there is an effect of this id, of the catalogue or of unknown cause.

    Parameters
    ----------
    name : str
        Id.
    """
    return name in CATALOGUE or name in UNKNOWN


def effect_of(name: str) -> Effect:
    """Give the effect of this id, of the catalogue or of unknown cause.

    Parameters
    ----------
    name : str
        Id.

    Raises
    ------
    EffectError
        When there is none.

    Examples
    --------
    >>> effect_of("solar_gain").zonal, effect_of("heat_by_wind").title
    (False, 'heat of unknown cause with wind')
    """
    if not is_effect(name):
        raise EffectError(f"effect {name!r}: not in the catalogue; {like(name)}")
    return CATALOGUE[name] if name in CATALOGUE else UNKNOWN[name]


def like(word: str) -> str:
    """Name the effects that a word that is none may have meant: by what they are, else by how they are spelled.

    Parameters
    ----------
    word : str
        What was given.

    Examples
    --------
    >>> like("wind")
    'it may be wind_film (wind on the outside of walls and windows) or infiltration (outdoor air that leaks in)'
    >>> like("meter"), like("solar_gian")
    ('it may be flow_gain (a heat meter that reads wrong)', "the nearest valid one is 'solar_gain'")
    """
    asked = word.replace("_", " ").casefold().split()
    spelled = nearest(word, CATALOGUE)
    if len(asked) > 1 and "nearest" in spelled:
        return spelled
    meant = [e.id for e in CATALOGUE.values() if e.is_meant_by(asked)]
    if not meant and "nearest" not in spelled:
        meant = [e.id for e in CATALOGUE.values() if e.is_meant_by(asked, begun=True)]
    if not meant:
        return spelled
    *most, last = (f"{e} ({CATALOGUE[e].title})" for e in meant)
    return f"it may be {', '.join(most)} or {last}" if most else f"it may be {last}"


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
        EffectError.unless(not isinstance(where, str), f"effect {name}", "a sequence of zones", repr(where))
    for name in zones:
        lacking = [r for r in effect_of(name).requires if r not in zones]
        if lacking:
            raise EffectError(f"effect {name}: modifies {', '.join(lacking)}; add that too")
    known = (*CATALOGUE.values(), *UNKNOWN.values())
    return tuple(Chosen(e, tuple(zones[e.id])) for e in known if e.id in zones)
