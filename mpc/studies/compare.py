"""Controllers side by side on the same weather, people, prices and noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mpc.errors import ControlError
from mpc.studies.controllers import find_controller
from mpc.studies.run import ControlRun, Progress, run_controller
from mpc.studies.study import Study
from thermal.errors import describe


@dataclass(frozen=True, eq=False)
class Comparison:
    """Runs of several controllers on one study.

    Parameters
    ----------
    study : Study
        What they were run on.
    runs : tuple of ControlRun
        In the order asked for.
    """

    study: Study
    runs: tuple[ControlRun, ...]

    def of(self, controller: str) -> ControlRun | None:
        """Give the run of a controller, where there is one.

        Parameters
        ----------
        controller : str
            Its name.
        """
        return next((run for run in self.runs if run.controller == controller), None)

    @property
    def best_rule(self) -> ControlRun | None:
        """The rule that costs least with its discomfort, where there is one."""
        rules = [run for run in self.runs if not run.entry.predictive]
        return min(rules, key=lambda run: run.objective) if rules else None

    def saving(self, run: ControlRun) -> float | None:
        """Share of the best rule's cost, with discomfort, that a run saves [-]; None without a rule.

        Parameters
        ----------
        run : ControlRun
            One of the runs.
        """
        best = self.best_rule
        return None if best is None or best.objective <= 0.0 else 1.0 - run.objective / best.objective

    def way_to_bound(self, run: ControlRun) -> float | None:
        """Share of the way from the best rule to the perfect bound, cost with discomfort [-].

        Parameters
        ----------
        run : ControlRun
            One of the runs.

        Returns
        -------
        float or None
            None without a rule or a bound, or where the bound is no better than the rule.
        """
        best, bound = self.best_rule, self.of("bound")
        if best is None or bound is None or best.objective <= bound.objective:
            return None
        return (best.objective - run.objective) / (best.objective - bound.objective)


def compare_controllers(study: Study, names: Sequence[str], progress: Progress | None = None) -> Comparison:
    """Run several controllers on a study, one after the other.

    Parameters
    ----------
    study : Study
        What they are run on.
    names : sequence of str
        Such as ``("guideline36", "mpc", "bound")``.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    ControlError
        When a controller is not known, or named twice, or none is.
    """
    known = [find_controller(name).name for name in names]
    if not known or len(set(known)) < len(known):
        raise ControlError(describe("controllers", "some, each once", f"{list(names)}"))
    return Comparison(study, tuple(run_controller(study, name, progress) for name in known))
