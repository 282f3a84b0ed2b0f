"""Expected odds between models after an experiment, with their parameters free to follow what they saw before."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from calibration.diagnosis.decide.levels import TEMPERATURE
from calibration.evaluation.intervals import Interval, horizon_steps
from calibration.experiment.emulate import Emulated, Emulator
from calibration.experiment.members import Member
from calibration.fit.problem import Problem
from calibration.fit.tuning_runs import tuning_runs
from thermal._types import FloatArray

#: Odds from which one of two models is named: evidence is *strong* from 20 to 1 on (Kass and Raftery 1995,
#: doi:10.1080/01621459.1995.10476572).
ODDS = 20.0

#: Chance of these odds that a design is made for [-]: the power that is usual for trials is 80 to 90 %.
CHANCE = 0.9


def needed(odds: float = ODDS) -> float:
    """Logarithm of the Bayes factor that odds take, as models are wrong in many small ways [-].

    Parameters
    ----------
    odds : float
        Above 1 [-].
    """
    return TEMPERATURE * float(np.log(odds))


def chance_of(expected: float, odds: float = ODDS) -> float:
    """Probability that an experiment reaches odds, from what is expected of its evidence [-].

    Where one of two linear models is right, the logarithm of their Bayes factor is normal, with twice its mean as its
    variance (Box and Hill 1967, doi:10.1080/00401706.1967.10490441, for known variance and equal priors).

    Parameters
    ----------
    expected : float
        Expected logarithm of the Bayes factor [-].
    odds : float
        Above 1 [-].
    """
    if expected <= 0.0:
        return 0.0
    return float(norm.sf((needed(odds) - expected) / np.sqrt(2.0 * expected)))


def expected_log_odds(
    difference: FloatArray, slopes: FloatArray, precision: FloatArray, weight: float, count: float = np.inf
) -> float:
    """Expect the logarithm of the Bayes factor of the true model against another [-].

    ``d = min_z ½ w² |δ + J z|² + ½ zᵀ H z``: what the other's errors exceed the true one's by, once its parameters have
    followed as far as their precision H lets them. With as many independent errors of unknown size it counts as
    ``n/2 log(1 + 2 d/n)``, for the diagnosis learns that size from the same errors.

    Parameters
    ----------
    difference : ndarray, shape (n,)
        The other model's predictions less the true ones [K].
    slopes : ndarray, shape (n, n_parameter)
        Derivatives of the other's predictions, on the estimation scale [K].
    precision : ndarray, shape (n_parameter, n_parameter)
        Inverse covariance of its parameters before the experiment [-].
    weight : float
        Square root of the independent errors in each, over their standard deviation [1/K].
    count : float
        Independent errors of all telemetry [-].

    Examples
    --------
    >>> import numpy as np
    >>> expected_log_odds(np.array([2.0]), np.zeros((1, 1)), np.eye(1), 1.0)
    2.0
    >>> expected_log_odds(np.array([2.0]), np.ones((1, 1)), np.eye(1), 1.0)
    1.0
    """
    weighted, turned = weight * difference, weight * slopes
    z = -np.linalg.solve(turned.T @ turned + precision, turned.T @ weighted)
    rest = weighted + turned @ z
    found = 0.5 * float(rest @ rest) + 0.5 * float(z @ precision @ z)
    return found if np.isinf(count) else 0.5 * count * float(np.log1p(2.0 * found / count))


@dataclass(frozen=True)
class Separation:
    """What an experiment is expected to say of each pair of members.

    Parameters
    ----------
    log_odds : mapping of tuple of str to float
        Expected logarithm of the Bayes factor of the first, were it there, against the second [-].
    swing : mapping of tuple of str to float
        Root mean square of what their predictions differ by before parameters follow [K].
    """

    log_odds: Mapping[tuple[str, str], float]
    swing: Mapping[tuple[str, str], float]

    def least(self, true: str) -> float:
        """Give the expected log odds against the other that is hardest to tell from one, were that there [-].

        Parameters
        ----------
        true : str
            The one.
        """
        return min(v for (a, _), v in self.log_odds.items() if a == true)

    def chance(self, prior: Mapping[str, float], odds: float = ODDS) -> float:
        """Probability that the experiment names the one that is there [-].

        Parameters
        ----------
        prior : mapping of str to float
            Probability of each member [-].
        odds : float
            Above 1 [-].
        """
        true = dict.fromkeys(a for a, _ in self.log_odds)
        whole = sum(prior[e] for e in true)
        return float(sum(prior[e] / whole * chance_of(self.least(e), odds) for e in true))

    def worth(self, prior: Mapping[str, float], enough: float) -> float:
        """Mean of the least log odds, each counted up to what is enough: what a search climbs [-].

        Parameters
        ----------
        prior : mapping of str to float
            Probability of each member [-].
        enough : float
            Log odds that are enough [-].
        """
        true = dict.fromkeys(a for a, _ in self.log_odds)
        whole = sum(prior[e] for e in true)
        return float(sum(prior[e] / whole * min(self.least(e), enough) for e in true))


def separation(
    emulator: Emulator,
    emulated: Mapping[str, Emulated],
    usual: Emulated,
    members: Sequence[Member],
    interval: Interval,
    horizon: str,
) -> Separation:
    """Expect what an experiment says of each pair of members.

    What they differ by on the same days in usual operation is no part of it: the telemetry that they were fitted to has
    told that already.

    Parameters
    ----------
    emulator : Emulator
        Of the days.
    emulated : mapping of str to Emulated
        The experiment were each member true, by effect.
    usual : Emulated
        The days as they were.
    members : sequence of Member
        All of them.
    interval : Interval
        Of the experiment.
    horizon : str
        Of the predictions by which models are compared.
    """
    log_odds, swing = {}, {}
    before = {m.effect: _errors(m, _problem(emulator, m, usual, interval, horizon)) for m in members}
    for true, made in emulated.items():
        at = {m.effect: _problem(emulator, m, made, interval, horizon) for m in members}
        own = next(m for m in members if m.effect == true)
        reference = _errors(own, at[true]) - before[true]
        for other in (m for m in members if m.effect != true):
            problem, fit = at[other.effect], other.fit
            error, slopes = _errors_and_slopes(other, problem)
            differ = error - before[other.effect] - reference
            told = np.isfinite(differ)  # a step that changes too suddenly, in either, tells nothing
            weight = float(np.sqrt(problem.effective_size() / told.sum() / own.fit.found.mean_square))
            count = fit.problem.effective_size() + problem.effective_size()
            jacobian, pair, differ = fit.found.jacobian, (true, other.effect), differ[told]
            precision, turned = jacobian.T @ jacobian, slopes[told] * problem.slopes(fit.theta)
            log_odds[pair] = expected_log_odds(differ, turned, precision, weight, count)
            swing[pair] = float(np.sqrt(np.mean(differ**2)))
    return Separation(log_odds, swing)


def seen_before(members: Sequence[Member], share: float) -> dict[tuple[str, str], float]:
    """Log odds that so much more of usual operation brings, at the rate of the telemetry so far [-].

    Parameters
    ----------
    members : sequence of Member
        Fitted to the telemetry so far.
    share : float
        Length of what is to come over its length [-].
    """
    value = {m.effect: m.fit.evidence for m in members}
    return {(a, b): share * max(0.0, value[a] - value[b]) for a in value for b in value if a != b}


def _errors(member: Member, problem: Problem) -> FloatArray:
    """Errors of all runs, NaN where none is told, so that those of other telemetry of the same steps compare."""
    parts = (problem.errors(member.fit.model, member.fit.theta, runs, slopes=False)[0] for runs in problem.runs)
    return np.concatenate([error.ravel() for error in parts])


def _errors_and_slopes(member: Member, problem: Problem) -> tuple[FloatArray, FloatArray]:
    parts = [problem.errors(member.fit.model, member.fit.theta, runs, slopes=True) for runs in problem.runs]
    slopes = [moved.reshape(error.size, -1) for error, moved in parts if moved is not None]
    return np.concatenate([error.ravel() for error, _ in parts]), np.concatenate(slopes)


def _problem(emulator: Emulator, member: Member, made: Emulated, interval: Interval, horizon: str) -> Problem:
    """Errors of a member's model on emulated telemetry."""
    fit = member.fit
    inputs = emulator.inputs(member, made)
    steps = horizon_steps(horizon, inputs.step)
    runs = tuning_runs(inputs, [interval], steps, fit.settings.spin_up_seconds)
    return Problem(fit.built.grid, inputs, runs, steps, fit.problem.free, fit.theta, fit.settings.stepping)
