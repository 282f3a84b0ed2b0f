"""What a case's own null shows: gains of every effect where nothing is missing but heat at random and sensor noise.

The errors of the fitted baseline are drawn anew many times, of nothing but the unmeasured heat and the sensor noise
that the case itself shows (their sizes and their correlation in time maximise the likelihood of a filter's
innovations), and every effect is screened on each draw as it is on the telemetry: with the fitted parameters free to
follow, in the zones where it would explain most. So the level that a name has to beat is the case's own and needs no
other building (parametric bootstrap: Davison and Hinkley 1997, Bootstrap Methods and their Application, ch. 4). All
draws are linear algebra on the sensitivities that the screen has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.diagnosis.refit.comparison import Fit
from calibration.diagnosis.screen.gains import MATTERS
from calibration.diagnosis.screen.generic import TIGHTNESS
from calibration.diagnosis.screen.missing import tuned_disturbance
from calibration.diagnosis.screen.programme import Explained, Grown
from calibration.diagnosis.screen.screen import Screening
from calibration.fit.precision import drawn_errors
from calibration.results import Plain
from thermal._types import FloatArray
from thermal.effects.catalogue import CATALOGUE

#: Draws of the errors: a level of 3 % is told to within 1.7 %.
DRAWS = 100

#: Rate at which a case without any missing effect may be given a name [-].
FALSE_ALARM = 0.03

#: Longest course of heat at random [s]: what stays for days is no chance. Tuned on four days, a steady lack looks like
#: heat that keeps for weeks (720 h in development seed 4 of the houses), and would hide the ground and what is steady.
_LONGEST = 43200.0


@dataclass(frozen=True)
class OwnNulls(Plain):
    """Gains that a case shows where nothing is missing.

    Parameters
    ----------
    largest : ndarray, shape (n_draw,)
        Of all effects of a draw, in order [-].
    gains : mapping of str to ndarray, shape (n_draw,)
        By effect [-].
    generic : ndarray, shape (n_draw,)
        Of heat of any shape [-].
    """

    largest: FloatArray
    gains: dict[str, FloatArray]
    generic: FloatArray

    @property
    def level(self) -> float:
        """Gain that the largest of a null exceeds at the rate `FALSE_ALARM` [-]."""
        return float(np.quantile(self.largest, 1.0 - FALSE_ALARM))

    @property
    def generic_level(self) -> float:
        """Gain of heat of any shape that a null exceeds at the rate `FALSE_ALARM` [-]."""
        return float(np.quantile(self.generic, 1.0 - FALSE_ALARM))

    def usual(self, effect: str) -> float:
        """Gain of an effect that a null exceeds at the rate `FALSE_ALARM`, 0 at least [-].

        Parameters
        ----------
        effect : str
            Its id; 0 for one that was not screened.
        """
        known = self.gains.get(effect)
        return 0.0 if known is None else max(0.0, float(np.quantile(known, 1.0 - FALSE_ALARM)))

    def p_value(self, gain: float) -> float:
        """Probability that the largest gain of a null is as large [-].

        The share of draws where it is; beyond all of these an exponential tail with the mean excess over the median.

        Parameters
        ----------
        gain : float
            Largest gain of the case [-].
        """
        above = int(np.count_nonzero(self.largest >= gain))
        if above:
            return (1 + above) / (1 + self.largest.size)
        middle = float(np.median(self.largest))
        excess = self.largest[self.largest > middle] - middle
        beyond = (gain - self.largest.max()) / max(float(excess.mean()) if excess.size else 0.0, 1e-9)
        return float(np.exp(-beyond) / (1 + self.largest.size))


def own_nulls(made: Screening, fit: Fit, candidates: Sequence[str]) -> OwnNulls:
    """Gains of every effect on draws of a case's own errors.

    Parameters
    ----------
    made : Screening
        Of the baseline; its sensitivities are let go.
    fit : Fit
        Beside which the unmeasured heat is tuned: with the best effect, where there is one. A steady heat that the
        baseline lacks would count as heat at random that lasts for days, and hide itself.
    candidates : sequence of str
        Effects that are screened.
    """
    tuned = tuned_disturbance(fit)
    chance = replace(tuned, time_constant=min(tuned.time_constant, _LONGEST))
    errors = drawn_errors(fit.problem, fit.model, fit.theta, chance, DRAWS)
    scores, rms = made.scores_of(errors), np.sqrt(np.mean(errors**2, axis=1))
    made.jacobian = None

    def counted(gain: FloatArray, share: FloatArray) -> FloatArray:
        """Gain of what matters to a prediction: errors of a few millikelvin may be explained without being accepted."""
        return np.where(rms * (1.0 - np.sqrt(1.0 - share)) > MATTERS, gain, np.minimum(gain, 0.0))

    gains = {e: counted(*_gains_of(made, e, scores)) for e in candidates if made.strengths_of(e).size}
    sizes = [(f, t) for f in made.generic_families() for t in TIGHTNESS]
    heat = [made.programme.solve(f, scores, tightness=t) for f, t in sizes]
    generic = np.max([counted(found.gain, found.share) for found in heat], axis=0)
    largest = np.max(list(gains.values()), axis=0) if gains else np.zeros(len(scores))
    return OwnNulls(np.sort(largest), gains, np.sort(generic))


def _gains_of(made: Screening, effect: str, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gain and share of one effect in every draw: over the building or zones, as `Screening.of` has it [-]."""
    if not CATALOGUE[effect].takes_zones:
        whole = made.programme.solve(made.strengths_of(effect), scores)
        return whole.gain, whole.share
    members, everywhere = made.members_of(effect)
    found: list[Explained | Grown] = [made.programme.solve(index, scores) for index in everywhere.values()]
    if members:
        found.append(made.programme.grow(list(members.values()), scores, len(members) + made.elsewhere))
    gains, shares = np.array([f.gain for f in found]), np.array([f.share for f in found])
    best, draws = np.argmax(gains, axis=0), np.arange(len(scores))
    return gains[best, draws], shares[best, draws]
