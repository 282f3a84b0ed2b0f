"""What an effect could explain of the errors of a model that lacks it, and the price of having chosen where."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from thermal._types import FloatArray

#: Least fall of an error by which an effect matters to predictions, of the root mean square where it is fitted or of
#: the mean where it is held out [K].
MATTERS = 0.03


@dataclass(frozen=True)
class Gain:
    """What an effect could explain.

    Parameters
    ----------
    effect : str
        Its id.
    zones : tuple of str
        Where; empty for the whole building.
    gain : float
        Logarithm of the Bayes factor against the model without it, by tangents [-].
    share : float
        Share of the squared tuning error that it explains [-].
    strengths : mapping of str to float
        Its parameters [parameter units].
    deviations : mapping of str to float
        Standard errors of them, by tangents [parameter units].
    retained : float
        Share of its signature that calibration cannot imitate [-].
    direction : ndarray, shape (n_strength,)
        Its strengths among all those screened, for cosines [parameter units].
    index : ndarray of int
        Positions of its strengths there.
    places : int
        How many zones or pairs of zones it may be in; 0 where it acts on the whole building.
    choice : float
        What was paid for having chosen them; part of the gain [-].
    """

    effect: str
    zones: tuple[str, ...]
    gain: float
    share: float
    strengths: Mapping[str, float]
    deviations: Mapping[str, float]
    retained: float
    direction: FloatArray
    index: NDArray[np.int64]
    places: int = 0
    choice: float = 0.0


def choice_of(count: int, places: int) -> float:
    """Logarithm of the odds against one choice of places before any data [-].

    One place more halves the probability, and all choices of as many are alike; everywhere is as likely as any number.

    Parameters
    ----------
    count, places : int
        Places chosen, and all there are. An effect that is fitted where another was found may be in more than the
        tangents saw a sign of: these are then all.
    """
    places = max(places, count)
    number = gammaln(places + 1) - gammaln(count + 1) - gammaln(places - count + 1)
    return float(np.log(2.0) * (1 if count == places else 1 + count) + number)
