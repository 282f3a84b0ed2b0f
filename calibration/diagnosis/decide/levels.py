"""Levels of the verdict, beside those that each case's own nulls give; see `benchmarks/blind_trials.py`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Levels:
    """From where on an answer has another name. ``blind_trials.py worlds`` chooses them anew without each world.

    Parameters
    ----------
    left_over : float
        Root mean square of the tuning errors of the last model above which something is left unexplained [K].
    left_of_change : float
        Its share of that by which zone temperatures change over the horizon, for a model is as wrong as it is driven
        hard [-]: the larger of the two counts.
    left_in_a_zone : float
        What counts in place of ``left_over`` where one zone has most of the squared error [K].
    concentrated : float
        Squared error of a zone over the mean of all from which it has [-].
    explained, explained_of_much : float
        Least share of the squared error that accepted effects must explain for a cause to be named, and where much is
        left over [-].
    generic : float
        Gain of heat of any shape above which a gap is there though no effect of the catalogue explains it [-].
    """

    left_over: float = 0.2
    left_of_change: float = 0.11
    left_in_a_zone: float = 0.1
    concentrated: float = 3.5
    explained: float = 0.4
    explained_of_much: float = 0.6
    generic: float = 16.0


#: Those that hold.
LEVELS = Levels()

#: Difference of gains within which effects of a round cannot be told apart [-].
APART = 3.0

#: Share of an effect's gain from which another is one group with it that looks alike, or that the catalogue says it
#: is confounded with [-]; and the cosine of projected signatures from which they look alike [-]. Without the share,
#: interfloor exchange that gained 48, closed 96 % of a gap and looked like three others of 19 to 31 was left
#: unexplained as a group too large (confirmation seed 8303 of the offices).
RIVAL, ALIKE = 0.6, 0.9

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

#: Probability of people's heat that days which were left out show, as it recurs in each zone [-].
RECURRING = 0.9

#: Probability from which an effect belongs to the 90 % set [-].
IN_SET = 0.1
