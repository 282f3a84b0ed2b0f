"""The model that a controller predicts with: a building, calibrated or not, reduced to few states."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from calibration.evaluation.settings import ModelSettings, load_parameters, read_settings
from mpc.errors import ControlError
from thermal.case.building import Building
from thermal.effects.effect import Chosen
from thermal.errors import describe
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model

#: Largest number of states of a controller's model: 76 mK from the grid on 123 zones at 0.5 m, at a third of the time.
ORDER = 201


def control_model(
    building: Building,
    parameters: str | Path | Mapping[str, float] | None = None,
    *,
    dx: float | None = None,
    effects: tuple[Chosen, ...] = (),
    order: int | None = ORDER,
) -> ReducedModel:
    """Make the model of a controller.

    Parameters
    ----------
    building : Building
        Floor plans or a zone table.
    parameters : str, Path or mapping of str to float, optional
        A ``calibration.json``, whose settings and effects are taken over; or values by name [parameter units]; starting
        values by default.
    dx : float, optional
        Distance between control volumes of a plan [m]; that of the file, or the plan's.
    effects : tuple of Chosen
        What is added to the baseline, `thermal.effects.chosen`; with a file they are its own.
    order : int, optional
        Largest number of states; None keeps all that the reduction finds.

    Returns
    -------
    ReducedModel
        At these parameters, `ReducedModel.theta`.

    Raises
    ------
    ControlError
        When effects are given beside a file.
    CalibrationError
        When the file cannot be read, or is of another building.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> control_model(load_bundled_case().building, dx=1.0, order=30).order
    30
    """
    return reduced(model_settings(parameters, dx=dx, effects=effects), building, parameters, order)


def model_settings(
    parameters: str | Path | Mapping[str, float] | None = None,
    *,
    dx: float | None = None,
    effects: tuple[Chosen, ...] = (),
) -> ModelSettings:
    """Tell how a model is built: as its file of parameters says, or as given; arguments as those of `control_model`.

    Parameters
    ----------
    parameters : str, Path or mapping of str to float, optional
        A ``calibration.json``, or values by name [parameter units].
    dx : float, optional
        Distance between control volumes of a plan [m].
    effects : tuple of Chosen
        What is added to the baseline.
    """
    if not isinstance(parameters, str | Path):
        return ModelSettings(dx=dx, effects={c.effect.id: c.zones for c in effects})
    if effects:
        raise ControlError(describe("effects", "none beside a file of parameters", f"{len(effects)} of them"))
    return ModelSettings(**read_settings(parameters) | ({} if dx is None else {"dx": dx}))


def reduced(
    settings: ModelSettings,
    building: Building,
    parameters: str | Path | Mapping[str, float] | None = None,
    order: int | None = ORDER,
) -> ReducedModel:
    """Build and reduce a model; arguments as those of `control_model`.

    Parameters
    ----------
    settings : ModelSettings
        How it is built.
    building : Building
        Floor plans or a zone table.
    parameters : str, Path or mapping of str to float, optional
        A file, or values by name [parameter units].
    order : int, optional
        Largest number of states.
    """
    network = settings.network(building)
    if isinstance(parameters, str | Path):
        theta = load_parameters(parameters, network)
    else:
        theta = network.values(parameters or {})
    return reduced_model(SymbolicModel(network), [theta], order=order)
