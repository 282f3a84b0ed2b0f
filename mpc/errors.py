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


class EnvironmentSetupError(MpcError):
    """Parts of a learning environment that do not fit each other, or a policy of another one."""


class MissingExtraError(MpcError, ImportError):
    """A package that an extra brings is not installed."""
