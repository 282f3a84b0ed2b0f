"""The baseline of a diagnosis: as drawn, with what heaters give their heat by where the case does not say it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.evaluation.settings import ModelSettings
from calibration.fit.ladder import fit_emitter
from calibration.fit.left_out import values_of
from calibration.progress import Progress
from thermal.network.structure import Structure


def drawn_settings(dx: float | None) -> ModelSettings:
    """Give the model settings of a building as drawn, whose inside films follow the heat of their zone.

    Parameters
    ----------
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    """
    return ModelSettings(dx=dx, structure=Structure(natural_films=True))


def fit_baseline(
    models: ModelComparison, effects: Mapping[str, Sequence[str]], progress: Progress | None = None
) -> tuple[ModelComparison, Fit]:
    """Fit the baseline, with heated floors or radiators if left-out tuning days say so.

    Parameters
    ----------
    models : ModelComparison
        The case and its days.
    effects : mapping of str to sequence of str
        What is known to be there.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    tuple
        The case with the structure that was chosen, and its fit.
    """
    known = {name: tuple(zones) for name, zones in effects.items()}
    found = models.fit(known, [{}])
    heated = fit_emitter(found.known, models, known, progress)
    if heated is None:
        return models, found
    settings = replace(models.settings, structure=heated.settings.structure)
    # heated floors beside radiators: how far the shares of rooms differ is what the calibration has found
    models = replace(models, settings=settings, weights=replace(heated.best.problem, effective=None))
    return models, models.fit(known, [values_of(heated.best)])
