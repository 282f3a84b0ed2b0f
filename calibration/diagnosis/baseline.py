"""The baseline of a diagnosis: as drawn, with films, contents and emitters by the evidence, which no case says."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from calibration.diagnosis.decide.levels import APART
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.fit.fitted_case import is_large
from calibration.fit.ladder import fit_emitter
from calibration.fit.left_out import values_of
from calibration.fit.undrawn import BY_EVIDENCE, UNDRAWN, is_another
from calibration.progress import Progress


def fit_baseline(
    models: ModelComparison, effects: Mapping[str, Sequence[str]], progress: Progress | None = None
) -> tuple[ModelComparison, Fit]:
    """Fit the baseline, with films that follow heat and light contents if likelier, and emitters by left-out days.

    Natural convection needs no parameter, and things that follow the air within minutes one: evidence decides, once it
    is strong. In buildings of more than 40 zones both are left out. Heated floors or radiators are taken if left-out
    tuning days say so.

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
    if not is_large(models.case.building.zone_names) and not models.settings.structure.lumped:
        for name in BY_EVIDENCE:
            structure = UNDRAWN[name].put(models.settings.structure)
            nearer = replace(models, settings=replace(models.settings, structure=structure))
            nearer.drivers = models.drivers
            built = nearer.build(known)
            if not is_another(built.network, found.built.network):
                continue
            if (other := nearer.fit(known, [found.values], built)).evidence > found.evidence + APART:
                models, found = nearer, other
    heated = fit_emitter(found.known, models, known, progress)
    if heated is None:
        return models, found
    settings = replace(models.settings, structure=heated.settings.structure)
    # heated floors beside radiators: how far the shares of rooms differ is what the calibration has found
    models = replace(models, settings=settings, weights=replace(heated.best.problem, effective=None))
    return models, models.fit(known, [values_of(heated.best)])
