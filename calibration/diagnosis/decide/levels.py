"""Levels of the verdict, beside those that each case's own nulls give; see `benchmarks/blind_trials.py`."""

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

#: Probability from which an effect belongs to the 90 % set [-].
IN_SET = 0.1
