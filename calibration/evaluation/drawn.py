"""A model with its parameters, as one of those that are possible."""

from collections.abc import Mapping
from dataclasses import dataclass

from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.settings import ModelSettings


@dataclass(frozen=True)
class DrawnModel:
    """A model out of those that are possible, as `calibration.diagnosis.posterior.Posterior` draws them.

    Parameters
    ----------
    settings : ModelSettings
        How it is built, with its effects.
    values : mapping of str to float
        Parameters by name [parameter units].
    disturbance : DisturbanceModel or None
        Heat that it leaves unexplained.
    """

    settings: ModelSettings
    values: Mapping[str, float]
    disturbance: DisturbanceModel | None
