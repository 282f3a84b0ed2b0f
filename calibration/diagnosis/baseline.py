"""The baseline of a diagnosis: as drawn, with what heaters give their heat by where the case does not say it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.fit.ladder import ADVANCE, fit_emitter
from calibration.fit.left_out import Known, left_out, values_of
from calibration.progress import Progress


@dataclass(frozen=True)
class Doubted:
    """A baseline with heated floors or radiators that predicts worse than a lumped model does.

    The drawing is wrong altogether, or something is missing that a lumped model makes up for: what is found about it
    tells.

    Parameters
    ----------
    models : ModelComparison
        The case with this structure.
    fit : Fit
        Its fit.
    lumped : float
        Error of the lumped model on left-out days [K].
    """

    models: ModelComparison
    fit: Fit
    lumped: float

    def stands(self, found: Fit) -> bool:
        """Whether the structure with what was found about it predicts left-out days about as well as a lumped model.

        Parameters
        ----------
        found : Fit
            With effects.
        """
        known = Known(found.weighed, found.model, found.point)
        left = left_out(known, self.models.tuned, self.models.calibration.spin_up_seconds)
        return self.lumped >= (1.0 - ADVANCE) * left.mae


@dataclass(frozen=True)
class Baseline:
    """A case without any effect that is to be found.

    Parameters
    ----------
    models : ModelComparison
        The case with the structure that was chosen.
    fit : Fit
        Its fit.
    doubted : Doubted or None
        What was not chosen though it predicts better than what was.
    """

    models: ModelComparison
    fit: Fit
    doubted: Doubted | None = None


def fit_baseline(
    models: ModelComparison, effects: Mapping[str, Sequence[str]], progress: Progress | None = None
) -> Baseline:
    """Fit the baseline, with heated floors or radiators if left-out tuning days say so.

    Parameters
    ----------
    models : ModelComparison
        The case and its days.
    effects : mapping of str to sequence of str
        What is known to be there.
    progress : callable, optional
        Called with stage, done, total.
    """
    known = {name: tuple(zones) for name, zones in effects.items()}
    found = models.fit(known, [{}])
    heated = fit_emitter(Known(found.weighed, found.model, found.point), models, known, progress)
    if heated is None:
        return Baseline(models, found)
    settings = replace(models.settings, structure=heated.fit.settings.structure)
    # heated floors beside radiators: how far the shares of rooms differ is what the calibration has found
    other = replace(models, settings=settings, weights=replace(heated.fit.best.problem, effective=None))
    fit = other.fit(known, [values_of(heated.fit.best)])
    return Baseline(models, found, Doubted(other, fit, heated.lumped)) if heated.wrong else Baseline(other, fit)
