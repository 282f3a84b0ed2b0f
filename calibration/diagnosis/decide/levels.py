"""Levels of the verdict: what null cases and trials of known causes say of gains; see `benchmarks/blind_trials.py`."""

import json
from importlib.resources import files
from typing import Any

import numpy as np

#: Gain of generic heat above which a gap is there though no effect of the catalogue explains it [-].
GENERIC_GAP = 8.0

#: Root mean square of the tuning errors of the last model above which something is left unexplained [K], and its share
#: of that by which zone temperatures change over the horizon, for a model is as wrong as it is driven hard [-]: the
#: larger counts. Where one zone has over so many times its share of the squared error, the smaller one does [K, -].
LEFT_OVER, LEFT_OF_CHANGE, LEFT_IN_A_ZONE, CONCENTRATED = 0.2, 0.11, 0.1, 3.5

#: Least share of the squared error that accepted effects must explain for a cause to be named, and where much is left
#: over [-].
EXPLAINED, EXPLAINED_OF_MUCH = 0.4, 0.6

#: Difference of gains within which effects of a round cannot be told apart [-].
APART = 3.0

#: Share of an effect's gain from which what the catalogue says it is confounded with is one group with it [-].
RIVAL = 0.6

#: Cosine of projected signatures from which effects are one group [-].
ALIKE = 0.9

#: Largest group that a verdict may name.
LARGEST_GROUP = 4

#: Temperature by which gains are divided before they become probabilities [-]: likelihoods of a model that is wrong in
#: many small ways are too sure of themselves.
TEMPERATURE = 2.0

#: Most evidence of an effect that matters to no prediction, and of one that makes those worse which it was not fitted
#: to [-].
SMALL, DOUBTFUL = 4.0, 1.0

#: Most probability of an effect whose signals explain as much on other days, or that does not repeat [-].
VOID = 0.5

#: Probability from which an effect belongs to the 90 % set [-].
IN_SET = 0.1

_NULLS: dict[str, Any] = json.loads(
    (files("calibration.diagnosis.decide") / "null_levels.json").read_text(encoding="utf-8")
)

#: Largest gains of the first round in development cases without any missing effect, in order [-]: made by
#: ``benchmarks/blind_trials.py levels``.
NULL_GAINS: tuple[float, ...] = tuple(_NULLS["largest"])


def usual(effect: str) -> float:
    """Largest gain that an effect reaches in cases without any missing effect, 0 at least [-].

    Parameters
    ----------
    effect : str
        Its id; 0 for one that no null case could tell.
    """
    return float(max(0.0, *_NULLS["gains"].get(effect, (0.0,))))


def p_value(gain: float) -> float:
    """Probability that a case without any missing effect shows so large a gain [-].

    The share of null cases that do, and beyond all of these an exponential tail with their mean excess over the median.

    Parameters
    ----------
    gain : float
        Largest gain of the first round [-].
    """
    nulls = np.array(NULL_GAINS)
    above = int(np.count_nonzero(nulls >= gain))
    if above:
        return (1 + above) / (1 + nulls.size)
    excess = nulls[nulls > np.median(nulls)] - np.median(nulls)
    return float(np.exp(-(gain - nulls.max()) / excess.mean()) / (1 + nulls.size))
