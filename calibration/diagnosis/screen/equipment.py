"""Heat of single zones that nobody meters, as a form of the heat of people, light and equipment."""

from collections.abc import Collection, Sequence

from calibration.diagnosis.screen.generic import ZONE_HEAT
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.effect import Chosen
from thermal.effects.gains import EQUIPMENT, INTERNAL_GAINS, SCHEDULED, SWITCHED
from thermal.inputs.provider import InputProvider
from thermal.parameters import Parameter

#: Effect that equipment belongs to.
EQUIPPED = INTERNAL_GAINS.id


def always_on(parameters: Sequence[Parameter], lacking: Collection[str]) -> dict[Parameter, int]:
    """Strengths of what is always on, with the positions of heat of unknown cause that has their sensitivities.

    Half of the one is radiated, and all of the other is in the air: a fit tells the difference.

    Parameters
    ----------
    parameters : sequence of Parameter
        Of a model with heat of unknown cause.
    lacking : collection of str
        Effects that are sought.

    Returns
    -------
    dict
        By zone; empty in a building of one, where it is a base load.
    """
    kind = next(p for p in CATALOGUE[EQUIPPED].parameters if p.name == EQUIPMENT)
    at = {p.member: i for i, p in enumerate(parameters) if p.base == ZONE_HEAT and p.member is not None}
    return {kind.of("zone", zone): i for zone, i in at.items()} if EQUIPPED in lacking and len(at) > 1 else {}


def at_times(drivers: InputProvider, lacking: Collection[str], here: Collection[str]) -> list[Chosen]:
    """Heat of single zones in the hours of people, and heat that is seen to be switched, in the zones where it is.

    Parameters
    ----------
    drivers : InputProvider
        Of the case.
    lacking : collection of str
        Effects that are sought.
    here : collection of str
        Zones to which a search is confined; empty where it is not.
    """
    if EQUIPPED not in lacking or len(drivers.zones) < 2:
        return []
    where = [zone for zone in drivers.zones if not here or zone in here]
    seen = [zone for zone, course in zip(drivers.zones, drivers.switched.T, strict=True) if course.any()]
    both = (SCHEDULED, tuple(where)), (SWITCHED, tuple(zone for zone in where if zone in seen))
    return [Chosen(effect, zones) for effect, zones in both if zones]
