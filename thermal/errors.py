"""The error family of the package: every refusal has a name, and says where, what was expected, and what it got."""

import difflib
from collections.abc import Iterable


class Described:
    """What the families of errors share: a message, or the parts of one as `describe` takes them."""

    args: tuple[str, ...]

    def __str__(self) -> str:
        """Message: the one that was given, or `describe` of its parts."""
        return describe(*self.args) if len(self.args) > 1 else super().__str__()

    @classmethod
    def unless(cls, valid: object, where: str, expected: str, found: object, advice: str = "") -> None:
        """Refuse what is not valid, in the words of `describe`.

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
            raise cls(where, expected, str(found), advice)  # type: ignore[call-arg, misc]

    @classmethod
    def unless_known(cls, value: object, options: Iterable[object], where: str, expected: str) -> None:
        """Refuse an option that is not known, and name the nearest one, or all that `expected` does not list.

        Parameters
        ----------
        value : object
            What was asked for.
        options : iterable
            What there is.
        where, expected : str
            What is checked, and what would have been right.
        """
        known = list(options)
        advice = "" if value in known else nearest(value, known)
        told = advice.startswith("valid") and all(str(option) in expected for option in known)
        cls.unless(value in known, where, expected, repr(value), "" if told else advice)


class ThermalError(Described, Exception):
    """Base of every error that `thermal` raises on purpose."""


class CaseError(ThermalError):
    """Something is wrong with a case folder, or with what a case is asked for."""


class ModelError(ThermalError):
    """Something is wrong with a thermal model, or with what it is asked for."""


class EffectError(ModelError):
    """An effect is unknown, or asked for where it cannot be."""


class PlanError(ThermalError):
    """Something is wrong with a drawing or a list of devices, or with what it is asked for."""


class MissingExtraError(ThermalError, ImportError):
    """A package that only an extra of the installation brings."""


class OversizedFileError(PlanError):
    """A file, or what it unpacks to, is larger than any real plan."""


class LostRoomError(PlanError):
    """A room that the cells of a plan are too coarse for."""


class LabelError(ThermalError):
    """Something is wrong with what the labelling page is asked for."""


class SessionHeldError(LabelError):
    """The case is being labelled elsewhere, or somebody else has taken over."""


class ReportError(LabelError):
    """A report that is not there, or could not be made."""


def describe(where: str, expected: str, found: str, advice: str = "") -> str:
    """Write the message of an error: where, what was expected, what was found, what to do.

    Parameters
    ----------
    where
        File and key, row or column, such as ``building.yaml: devices[2].zone``.
    expected
        What would have been right.
    found
        What stood there, in words; a value as its `repr`.
    advice
        What to do about it; empty when that is plain.

    Returns
    -------
    str
        One line.
    """
    return f"{where}: expected {expected}, found {found}" + (f"; {advice}" if advice else "")


def nearest(word: object, options: Iterable[object]) -> str:
    """Name the valid option nearest to a word that is not valid.

    Parameters
    ----------
    word
        What was given.
    options
        What would have been valid.

    Returns
    -------
    str
        ``the nearest valid one is 'x'``, or the valid ones when none is near (at most eight of them).
    """
    names = [str(option) for option in options]
    folded = {name.casefold(): name for name in names}
    match = difflib.get_close_matches(str(word).casefold(), list(folded), n=1, cutoff=0.5)
    if match:
        return f"the nearest valid one is {folded[match[0]]!r}"
    if not names:
        return "there is none to choose from"
    return f"valid: {some_of(names, most=8)}"


def some_of(names: Iterable[str], most: int = 3) -> str:
    """Write some names, and how many more there are.

    Parameters
    ----------
    names
        Names.
    most
        How many are written.

    Returns
    -------
    str
        With commas.

    Examples
    --------
    >>> some_of("abcd", most=2)
    'a, b and 2 more'
    """
    known = list(names)
    return ", ".join(known[:most]) + (f" and {len(known) - most} more" if len(known) > most else "")
