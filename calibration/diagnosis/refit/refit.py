"""An effect fitted together with all that was accepted before, and whether it may be accepted too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.diagnosis.refit.comparison import Bench, Fit, is_strength
from calibration.diagnosis.refit.held_out import HeldOut, growth, held_out
from calibration.diagnosis.screen.gains import Gain, choice_of
from calibration.diagnosis.screen.screen import Screening
from calibration.errors import CalibrationError
from thermal.effects.catalogue import CATALOGUE
from thermal.errors import ModelError

#: Evaluations of a fit from one start.
_EVALUATIONS = 10

#: Least fall of an error by which an effect matters to predictions, of the root mean square where it is fitted or of
#: the mean where it is held out [K].
MATTERS = 0.03

#: Share of that fall which tangents must promise for a fit to be worth its time [-]: of a hundred zones a fit takes
#: half a minute, and their evidence is in the tens for what no prediction shows.
_PROMISING = 0.25

#: By how much the mean of the held-out errors may grow [K], and by how many standard errors of that more [-]: what
#: differs from day to day by chance disproves nothing.
NO_WORSE, CHANCE = 0.005, 1.645

#: Gain of the fit from which an effect is accepted [-]; of 60 null cases one has more, and counts.
ACCEPTED = 6.0


@dataclass(frozen=True)
class Refit:
    """An effect fitted together with all that was accepted before.

    Parameters
    ----------
    screened : Gain
        What its tangents promised.
    fit : Fit
        The model with it.
    gain : float
        Logarithm of its Bayes factor against the model without it [-].
    fall : float
        How far the root mean square of the tuning errors falls with it [K].
    held_out : HeldOut
        Held-out errors with it.
    worse : bool
        Whether held-out errors grow with it by more than chance.
    counts : bool
        Whether it may be accepted: beyond doubt, of some size, and no worse where it was not fitted.
    """

    screened: Gain
    fit: Fit
    gain: float
    fall: float
    held_out: HeldOut
    worse: bool
    counts: bool


@dataclass(frozen=True)
class Work:
    """What a round's fits start from.

    Parameters
    ----------
    bench : Bench
        The case.
    fit : Fit
        The model so far.
    held_out : HeldOut
        Its held-out errors.
    made : Screening
        All effects by tangents.
    """

    bench: Bench
    fit: Fit
    held_out: HeldOut
    made: Screening

    @property
    def accepted(self) -> dict[str, float]:
        """Parameters of the effects that are in the model."""
        parameters = self.fit.built.network.parameters
        return {p.name: self.fit.values[p.name] for p in parameters if p.effect is not None}

    def refit(self, gains: Sequence[Gain], start: Mapping[str, float]) -> Refit | None:
        """Fit with some effects more; None where the fit fails, which costs those effects only.

        Parameters
        ----------
        gains : sequence of Gain
            Of these effects.
        start : mapping of str to float
            Values by name.
        """
        try:
            effects = {**self.fit.effects, **{g.effect: g.zones for g in gains}}
            anew = self.bench.fit(effects, [start], evaluations=_EVALUATIONS)
        except (ArithmeticError, np.linalg.LinAlgError, CalibrationError, ModelError):
            return None
        return self.weighed(gains, anew)

    def weighed(self, gains: Sequence[Gain], anew: Fit) -> Refit:
        """Compare a model with some effects more with the one without them.

        Parameters
        ----------
        gains : sequence of Gain
            Of these effects; the last is what the comparison is told of.
        anew : Fit
            The model with them.
        """
        choice = sum(choice_of(_places(anew, g.effect), g.places) for g in gains if g.places)
        gain = float(anew.evidence - self.fit.evidence - choice)
        fall = float(np.sqrt(self.fit.found.mean_square) - np.sqrt(anew.found.mean_square))
        errors = held_out(self.bench, anew)
        grown, error = growth(self.held_out, errors)
        worse = grown > NO_WORSE + CHANCE * error
        counts = gain > ACCEPTED * len(gains) and not worse and max(fall, -grown) > MATTERS
        counts = counts and all(_beyond_a_step(anew, g.effect) for g in gains)
        return Refit(gains[-1], anew, gain, fall, errors, worse, counts)


def promising(fit: Fit, share: float) -> bool:
    """Whether what tangents promise is worth a fit.

    Parameters
    ----------
    fit : Fit
        The model so far.
    share : float
        Of its squared error that they would explain [-].
    """
    return float(np.sqrt(fit.found.mean_square) * (1.0 - np.sqrt(1.0 - share))) > _PROMISING * MATTERS


def _beyond_a_step(fit: Fit, effect: str) -> bool:
    """Whether what an effect moves in time, if anything, is moved by more than a step of telemetry, and surely so."""
    shifts, step = CATALOGUE[effect].shifts, fit.built.inputs.step / 3600.0
    at = [i for i, p in enumerate(fit.problem.parameters) if p.name in shifts]
    return not at or bool(np.any(np.abs(fit.theta[at]) - CHANCE * fit.deviations[at] > step))


def _places(fit: Fit, effect: str) -> int:
    """Count the zones, or pairs of zones, in which a fitted model has an effect."""
    mine = (p for p in fit.problem.parameters if p.effect == effect and is_strength(p.name, effect))
    return len({p.member for p in mine} - {None})
