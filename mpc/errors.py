"""The error family of the package."""

from collections.abc import Collection


class MpcError(Exception):
    """Base of every error that `mpc` raises on purpose: a message, or the parts of one as `describe` takes them."""

    def __str__(self) -> str:
        """Message: the one that was given, or `describe` of its parts."""
        from thermal.errors import describe  # here, since the console command imports this module and starts at once

        return describe(*self.args) if len(self.args) > 1 else super().__str__()

    @classmethod
    def unless(cls, valid: object, where: str, expected: str, found: object, advice: str = "") -> None:
        """Refuse what is not valid, in the words of `thermal.errors.describe`.

        Parameters
        ----------
        valid : bool
            Whether all is well.
        where, expected : str
            What is checked, and what would have been right.
        found : object
            What stood there, in words.
        advice : str
            What to do about it; empty when that is plain.
        """
        if not valid:
            raise cls(where, expected, str(found), advice)

    @classmethod
    def unless_known(cls, value: object, options: Collection[object], where: str, expected: str) -> None:
        """Refuse an option that is not known, and name the nearest one.

        Parameters
        ----------
        value : object
            What was asked for.
        options : collection
            What there is.
        where, expected : str
            What is checked, and what would have been right.
        """
        if value not in options:
            from thermal.errors import nearest

            raise cls(where, expected, repr(value), nearest(value, options))


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


class BoptestError(PlantError):
    """A BOPTEST server or client is used wrongly, or cannot be started."""


class BoptestRequestError(BoptestError):
    """A request that a BOPTEST server cannot take: its status is 400."""


class BoptestTimeoutError(BoptestError):
    """A BOPTEST server does not answer; whether it did what was asked is not known."""


class EnergyPlusError(PlantError):
    """EnergyPlus is missing, has no such building, or a run of it failed."""
