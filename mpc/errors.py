"""The error family of the package."""

from thermal.errors import Described


class MpcError(Described, Exception):
    """Base of every error that `mpc` raises on purpose."""


class ScenarioError(MpcError):
    """What drives a closed loop is inconsistent, or does not cover the time asked for."""


class WeatherError(ScenarioError):
    """Weather that cannot be read, or lacks what is needed of it."""


class PlantError(MpcError):
    """Parts of a plant do not fit each other, or it is used out of order."""


class PlantActionError(PlantError):
    """An action that is missing, unknown, no finite number or outside its range."""


class ControlError(MpcError):
    """A control problem whose parts do not fit, or data of a horizon that are incomplete."""


class VerificationError(MpcError):
    """Metered energy that does not tell what was saved: columns, days or designs that do not fit."""


class BoptestError(PlantError):
    """A BOPTEST server or client is used wrongly, or cannot be started."""


class BoptestRequestError(BoptestError):
    """A request that a BOPTEST server cannot take: its status is 400."""


class BoptestTimeoutError(BoptestError):
    """A BOPTEST server does not answer; whether it did what was asked is not known."""


class EnergyPlusError(PlantError):
    """EnergyPlus is missing, has no such building, or a run of it failed."""


class LiveError(MpcError):
    """Operation of a building is described wrongly, or a part of it cannot do what it is asked for."""


class HistorianError(LiveError):
    """The historian's database or spool cannot be reached, or is full."""
