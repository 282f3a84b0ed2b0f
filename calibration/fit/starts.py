"""Starts of an estimation: where they begin, and the best estimate over them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calibration.errors import CalibrationError
from calibration.fit.estimate import MOST_ZONES, TUNING_ORDER, Estimate, Tuner, estimate, tune
from calibration.fit.least_squares import solve_least_squares
from calibration.fit.problem import Problem
from calibration.progress import Forward, Progress
from thermal._types import FloatArray
from thermal.errors import ModelError
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model

#: What a fit from a start may end in; what is known without it stands then.
FAILURES = (ArithmeticError, np.linalg.LinAlgError, CalibrationError, ModelError)

#: What is said of a start that Ctrl-C ended.
STOPPED = "stopped by Ctrl-C"

#: By how much a further start of a large building must promise a lower cost for a solve of all its states [-]: odds of
#: three to one, where two optima are apart by tens.
_BETTER = 1.0


def draw_starts(problem: Problem, count: int, seed: int) -> list[FloatArray]:
    """Draw points on the estimation scale: the given θ, then draws from the prior at half its spread.

    Parameters
    ----------
    problem : Problem
        With priors.
    count, seed : int
        Number of points, and seed of the draws.
    """
    rng, centre, spread = np.random.default_rng(seed), problem.centre, problem.prior_deviations
    further = [centre + 0.5 * spread * rng.standard_normal(spread.size) for _ in range(count - 1)]
    return [problem.point(problem.start), *further]


def compensated_start(problem: Problem, z: FloatArray, model: SymbolicModel) -> FloatArray:
    """Where the data alone would go: a fit with priors a tenth as strong, from which a compensated optimum is seen.

    Where physics is missing, parameters compensate for it, often as far as a bound (six of eight in the paper); a
    second optimum with the priors may lie on the way back.

    Parameters
    ----------
    problem : Problem
        What to fit.
    z : ndarray, shape (n_free,)
        Start on the estimation scale [-].
    model : SymbolicModel
        Reduced there.
    """
    bold = replace(problem, effective=10.0 * problem.effective_size())
    return solve_least_squares(lambda x: bold.weighted(model, x), z, *problem.bounds, tolerance=1e-1, iterations=15).x


def _explored(best: Estimate, z: FloatArray) -> FloatArray | None:
    """Where a further start leads on a model of few states; None where that is no better than the best so far.

    A solve of a large building takes minutes, and nearly all starts lead to one optimum.
    """
    problem = best.problem
    small = reduced_model(problem.grid, [problem.theta(z)], order=TUNING_ORDER)
    found = solve_least_squares(lambda x: problem.weighted(small, x), z, *problem.bounds, tolerance=1e-1)
    if found.interrupted:
        raise KeyboardInterrupt
    theta = problem.theta(found.x)
    there, _ = problem.weighted(reduced_model(problem.grid, [theta]), found.x)
    return found.x if 0.5 * float(there @ there) < best.solve.cost - _BETTER else None


def solve_starts(
    problem: Problem, first: ReducedModel, starts: int, seed: int, progress: Progress | None, close: bool = False
) -> tuple[Estimate, list[str]]:
    """Best estimate over the starts; a start that fails costs that start only, Ctrl-C those that are left.

    Parameters
    ----------
    problem : Problem
        What to fit.
    first : ReducedModel
        At the problem's start.
    starts, seed : int
        Number of starts, and seed of the draws.
    progress : callable, optional
        Called with stage, done, total.
    close : bool
        Whether the first start is close by.

    Returns
    -------
    tuple
        The best, and what was wrong with the starts that failed.

    Raises
    ------
    CalibrationError
        When every start failed.
    """
    best: Estimate | None = None
    failures = []
    draws = draw_starts(problem, max(1, starts - 1), seed)
    large, whole = len(first.network.zones) > MOST_ZONES, Forward(progress)
    for number in range(starts):
        part = whole.part(1.0 / (starts - number), f"start {number + 1} of {starts}")
        try:
            if number == 1:
                begun = best.problem if best is not None else problem
                small = reduced_model(problem.grid, [first.theta], order=TUNING_ORDER) if large else first
                z = compensated_start(begun, problem.point(problem.start), small)
            else:
                z = draws[max(0, number - 1)]
            tuner: Tuner | None = tune
            if best is not None:  # starts are weighed alike, with the disturbance of the best so far
                known = best.disturbance
                tuner = None if known is None else lambda *_, known=known: known
                explored = _explored(best, z) if large else z
                if explored is None:
                    continue
                z = explored
            found = estimate(problem, z, part, first if number == 0 else None, tuner, close and number == 0)
        except FAILURES as error:
            failures.append(f"start {number + 1}: {error}")
            continue
        except KeyboardInterrupt:
            if best is None:
                raise
            failures.append(f"start {number + 1}: {STOPPED}")
            break
        if best is None or found.better_than(best):
            best = found
        if found.solve.interrupted:
            failures.append(f"start {number + 1}: {STOPPED}")
            break
    if best is None:
        raise CalibrationError(f"every start failed: {'; '.join(failures)}")
    return best, failures
