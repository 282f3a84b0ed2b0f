"""The error family of the package."""

from __future__ import annotations


class MpcError(Exception):
    """Base of every error that `mpc` raises on purpose."""


class ScenarioError(MpcError):
    """What drives a closed loop is inconsistent, or does not cover the time asked for."""


class WeatherError(ScenarioError):
    """Weather that cannot be read, or lacks what is needed of it."""


class TariffError(ScenarioError):
    """A tariff that cannot be read, or has a part that is not supported."""


class ForecastError(ScenarioError):
    """A forecast that lacks a column or a step."""


class KpiError(MpcError):
    """A record of a closed loop that cannot be measured."""


class PlantError(MpcError):
    """Parts of a plant do not fit each other, or it is used out of order."""


class PlantActionError(PlantError):
    """An action that is missing, unknown, no finite number or outside its range."""


class ReplayError(MpcError):
    """Telemetry lacks what the replay of a sub-system needs."""


class ControlError(MpcError):
    """A control problem whose parts do not fit, or data of a horizon that are incomplete."""


class BoptestError(PlantError):
    """A BOPTEST server or client is used wrongly, or cannot be started."""


class BoptestRequestError(BoptestError):
    """A request that a BOPTEST server cannot take: its status is 400."""


class BoptestAnswerError(BoptestError):
    """A BOPTEST server refuses, or answers what is no answer of its API."""


class BoptestTimeoutError(BoptestError):
    """A BOPTEST server does not answer; whether it did what was asked is not known."""


class FmuError(PlantError):
    """A functional mock-up unit that cannot be run, or fails to."""


class ReportProcessError(MpcError):
    """A report that is made in a process of its own could not be made."""


class EnergyPlusError(PlantError):
    """EnergyPlus is missing, has no such building, or a run of it failed."""


class EnergyPlusTimeoutError(EnergyPlusError):
    """EnergyPlus did not answer in time; its process was ended."""


class EnvironmentSetupError(MpcError):
    """Parts of a learning environment that do not fit each other, or a policy of another one."""


class MissingExtraError(MpcError, ImportError):
    """A package that an extra brings is not installed."""
