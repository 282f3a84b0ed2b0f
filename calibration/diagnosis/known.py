"""Effects that somebody knows to be there, or not to be."""

from collections.abc import Mapping, Sequence

from calibration.errors import CalibrationError
from thermal.effects.catalogue import CATALOGUE, like
from thermal.errors import EffectError


def reasons_of(
    known: Sequence[str], ruled_out: Sequence[str], untestable: Mapping[str, str] | None = None
) -> dict[str, str]:
    """Say of the effects that somebody knows of why they are not sought.

    Parameters
    ----------
    known, ruled_out : sequence of str
        As in `diagnose`.
    untestable : mapping of str to str, optional
        Effects that a case cannot have or tell, with the reason.

    Raises
    ------
    EffectError
        When one is not in the catalogue, or the case cannot have one that is said to be known.
    CalibrationError
        When one is both.
    """
    reasons = {}
    for names, reason in ((known, "known to be there: part of the baseline"), (ruled_out, "ruled out beforehand")):
        for name in names:
            if name not in CATALOGUE:
                raise EffectError(f"effect {name!r}", "one of the catalogue", "another name", like(name))
            CalibrationError.unless(name not in reasons, f"effect {name}", "known or ruled out", "both")
            reasons[name] = reason
    for name in known:
        why = (untestable or {}).get(name, "")
        EffectError.unless(not why, f"known effect {name}", "one that the case can have", why)
    return reasons
