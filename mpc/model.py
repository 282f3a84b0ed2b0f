"""The model that a controller predicts with: a building, calibrated or not, reduced to few states."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from calibration.evaluation.drawn import DrawnModel
from calibration.evaluation.settings import ModelSettings, load_parameters, read_settings
from calibration.fit.result import CalibrationResult
from mpc.errors import ControlError
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.effects.effect import Chosen
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model
from thermal.network.network import ThermalNetwork

#: Parameters of a building: a ``calibration.json`` or what it was written from, a drawn model, or values by name.
BuildingParameters = str | Path | Mapping[str, float] | CalibrationResult | DrawnModel

#: Largest number of states of a controller's model: 76 mK from the grid on 123 zones at 0.5 m, at a third of the time.
ORDER = 201


def control_model(
    building: Building,
    parameters: BuildingParameters | None = None,
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
    parameters : str, Path, CalibrationResult, DrawnModel or mapping of str to float, optional
        A ``calibration.json`` or the result itself, whose settings and effects are taken over; or values by name
        [parameter units]; starting values by default.
    dx : float, optional
        Distance between control volumes of a plan [m]; that of the calibration, or the plan's.
    effects : tuple of Chosen
        What is added to the baseline, `thermal.effects.catalogue.chosen`; with a calibration they are its own.
    order : int, optional
        Largest number of states; None keeps all that the reduction finds.

    Returns
    -------
    ReducedModel
        At these parameters, `ReducedModel.theta`.

    Raises
    ------
    ControlError
        When effects are given beside a calibration.
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
    parameters: BuildingParameters | None = None, *, dx: float | None = None, effects: tuple[Chosen, ...] = ()
) -> ModelSettings:
    """Tell how a model is built: as its file of parameters says, or as given; arguments as those of `control_model`.

    Parameters
    ----------
    parameters : str, Path, CalibrationResult, DrawnModel or mapping of str to float, optional
        A calibration, or values by name [parameter units].
    dx : float, optional
        Distance between control volumes of a plan [m].
    effects : tuple of Chosen
        What is added to the baseline.
    """
    if parameters is None or isinstance(parameters, Mapping):
        return ModelSettings(dx=dx, effects={c.effect.id: c.zones for c in effects})
    ControlError.unless(not effects, "effects", "none beside a file of parameters", f"{len(effects)} of them")
    if isinstance(parameters, CalibrationResult | DrawnModel):
        built = parameters.settings
    else:
        built = ModelSettings(**read_settings(parameters))
    return built if dx is None else replace(built, dx=dx)


def reduced(
    settings: ModelSettings, building: Building, parameters: BuildingParameters | None = None, order: int | None = ORDER
) -> ReducedModel:
    """Build and reduce a model; arguments as those of `control_model`.

    Parameters
    ----------
    settings : ModelSettings
        How it is built.
    building : Building
        Floor plans or a zone table.
    parameters : str, Path, CalibrationResult, DrawnModel or mapping of str to float, optional
        A calibration, or values by name [parameter units].
    order : int, optional
        Largest number of states.
    """
    network = settings.network(building)
    return reduced_model(SymbolicModel(network), [parameter_vector(parameters, network)], order=order)


def parameter_vector(parameters: BuildingParameters | None, network: ThermalNetwork) -> FloatArray:
    """Give the values of a network's parameters, shape (n_parameter,) [parameter units].

    Parameters
    ----------
    parameters : str, Path, CalibrationResult, DrawnModel or mapping of str to float, optional
        A calibration, or values by name [parameter units]; starting values for the rest.
    network : ThermalNetwork
        Whose parameters they are.
    """
    if isinstance(parameters, CalibrationResult):
        return parameters.theta
    if isinstance(parameters, DrawnModel):
        return network.values(parameters.values)
    if isinstance(parameters, str | Path):
        return load_parameters(parameters, network)
    return network.values(parameters or {})
