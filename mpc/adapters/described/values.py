"""Values of a ``plant.yaml``: numbers with units, hours, series, data sheets, signals and actuators, as a schema."""

import re
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from thermal.case.building import Entry, Number, Positive, Text
from thermal.errors import CaseError
from thermal.units import to_si

_NUMBER = re.compile(r"\s*[-+]?[0-9.]+(?:[eE][-+]?\d+)?\s*")
_WITH_UNIT = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?\d+)?)\s*([A-Za-z°]\S*)\s*")


def kelvin(value: Any) -> Any:
    """Bring text such as ``21 degC`` into kelvin, in tables of hours too; leave all else.

    Parameters
    ----------
    value : object
        As YAML reads it [K], or with a unit.
    """
    if isinstance(value, dict | list | tuple):
        return {k: kelvin(v) for k, v in value.items()} if isinstance(value, dict) else [kelvin(v) for v in value]
    found = _WITH_UNIT.fullmatch(value) if isinstance(value, str) else None
    if found is None:
        return value
    try:
        return float(to_si(np.array([float(found[1])]), found[2], "temperature")[0])
    except (CaseError, ValueError) as error:
        raise ValueError(f"expected a temperature in K, or with its unit such as '21 degC' ({error})") from error


def _signal(value: Any) -> Any:
    """Take a name for a signal without more."""
    return {"signal": value} if isinstance(value, str) else value


def _rising(pairs: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Refuse a data sheet whose outdoor temperatures do not rise."""
    outdoor = [pair[0] for pair in pairs]
    if any(b <= a for a, b in pairwise(outdoor)):
        raise ValueError(f"expected a capacity over rising outdoor temperatures, found {outdoor} K")
    return pairs


def _branch(value: Any) -> str | None:
    """Tell a number, a name and a table of hours apart."""
    if isinstance(value, bool) or (isinstance(value, str) and _NUMBER.fullmatch(value)):  # in quotes by mistake
        return None
    kinds = ((float | int, "<number>"), (str, "<name>"), (dict, "<hours>"))
    return next((tag for kind, tag in kinds if isinstance(value, kind)), None)


class Hours(Entry):
    """Values by the local hour.

    Parameters
    ----------
    weekday : tuple of float
        24 values from midnight on [unit of what they stand for].
    weekend : tuple of float, optional
        On Saturdays and Sundays [the same unit]; as on weekdays by default.
    """

    weekday: Annotated[tuple[Number, ...], Field(min_length=24, max_length=24)]
    weekend: Annotated[tuple[Number, ...], Field(min_length=24, max_length=24)] | None = None


#: A number, the name of a series, or values by the hour.
Value = Annotated[
    Annotated[Number, Tag("<number>")] | Annotated[Text, Tag("<name>")] | Annotated[Hours, Tag("<hours>")],
    Discriminator(
        _branch, custom_error_type="value",
        custom_error_message="Input should be a number, the name of a series, or hours (weekday, weekend)",
    ),
]  # fmt: skip
Kelvin = Annotated[Number, BeforeValidator(kelvin)]

#: Outdoor temperatures, rising, and the most heat at each; on straight lines between them.
DataSheet = Annotated[tuple[tuple[Kelvin, Positive], ...], AfterValidator(_rising)]


class Signal(Entry):
    """A signal of the program that stands for the building, or a series.

    Parameters
    ----------
    signal : str
        Its name there.
    unit : str, optional
        Where the program declares none, or a wrong one.
    """

    signal: Text
    unit: Text | None = None


Named = Annotated[Signal, BeforeValidator(_signal)]


class Input(Signal):
    """An actuator.

    Parameters
    ----------
    signal, unit : str
        As of `Signal`.
    range : tuple of float, optional
        Lowest and highest value [library's unit], or temperatures with their unit; those declared by default.
    kind : {"continuous", "on_off", "modulating"}
        Which values of its range it takes; on-off by default where the program says that it is a Boolean.
    minimum : float, optional
        Smallest value of a modulating actuator that is not off [library's unit].
    release : str, optional
        Input that hands the actuator over while it is 1; ``X_activate`` of ``X_u`` by default where it is there.
    capacity : tuple of tuple of float
        Of a setpoint, a data sheet: outdoor temperatures [K], rising, and the most heat that its machine gives at each,
        or takes where it cools [W].
    """

    range: tuple[Kelvin, Kelvin] | None = None
    kind: Literal["continuous", "on_off", "modulating"] | None = None
    minimum: Number | None = None
    release: Text | None = None
    capacity: DataSheet = ()

    @model_validator(mode="after")
    def _fits(self) -> "Input":
        if (self.kind == "modulating") != (self.minimum is not None):
            raise ValueError("expected a minimum of a modulating actuator, and of no other")
        return self


Acted = Annotated[Input, BeforeValidator(_signal)]
