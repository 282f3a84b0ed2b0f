"""The calibrated parameters of the baseline: name, unit, start, physical range and where the range comes from."""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, cast

import numpy as np

#: How many values a parameter has: one for the building, one a facade, or one a zone.
Scope = Literal["global", "facade", "zone"]

#: Scale that a parameter is estimated on.
Scale = Literal["log", "logit", "linear"]

#: What stands before the facade in the full name of its parameter, so that a zone called "south" cannot be meant.
FACADE_PREFIX = "facade:"


@dataclass(frozen=True)
class Parameter:
    """A physical parameter θ of the building model.

    Parameters
    ----------
    name : str
        Field term in full; that of a zone is ``name@zone``, that of a facade ``name@facade:south``.
    unit : str
        Unit as pint reads it.
    start : float
        Value before calibration [unit]; the centre of the prior.
    lower, upper : float
        Physical range [unit], ``0 < lower < start < upper``; on the linear scale ``lower <= start <= upper``, where 0
        and negative values are possible.
    source : str
        Where start and range come from.
    scale : {"log", "logit", "linear"}
        What it is estimated on: log for what is positive, logit for a share, linear for the strength of an effect,
        which may be absent or of either sign.
    effect : str or None
        Effect of the catalogue that it belongs to; None for the baseline.
    scope : {"global", "facade", "zone"}
        Whether the value is the building's, or a facade's or a zone's own.
    member : str or None
        The facade or the zone it is of; None for a global one.
    deviation : float or None
        Standard deviation of the prior on the estimation scale [-], where it is not that of the physical range.

    Raises
    ------
    ValueError
        When the range does not hold the start, or scope and member contradict each other.
    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float
    source: str
    scale: Scale = "log"
    effect: str | None = None
    scope: Scope = "global"
    member: str | None = None
    deviation: float | None = None

    def __post_init__(self) -> None:
        if self.scale == "linear":
            expected, ordered = "lower <= start <= upper, not equal", self.lower <= self.start <= self.upper
            ordered = ordered and self.lower < self.upper
        else:
            expected, ordered = "0 < lower < start < upper", 0.0 < self.lower < self.start < self.upper
        if not ordered:
            found = f"{self.lower}, {self.start}, {self.upper}"
            raise ValueError(f"parameter {self.name}: expected {expected}, got {found}")
        if (self.scope == "global") != (self.member is None):
            expected, found = "a member with the scopes facade and zone only", f"scope {self.scope!r}"
            raise ValueError(f"parameter {self.name}: expected {expected}, got {found} with member {self.member!r}")

    @property
    def base(self) -> str:
        """Name that the members of one group share, a key of `PARAMETERS`: calibration may draw them together."""
        return self.name.partition("@")[0]

    @property
    def grouped(self) -> bool:
        """Whether it is one of a group whose members are alike: walls are, strengths of an effect are not.

        What is wrong in one zone says nothing of the next, and may be of the other sign there.
        """
        return self.member is not None and self.scale != "linear"

    @property
    def prior_deviation(self) -> float:
        """Standard deviation of the prior on the estimation scale [-]: the physical range is its 95 % interval.

        Where the range begins at the start, as that of a strength that is absent at first, the prior is the half of a
        normal distribution.
        """
        if self.deviation is not None:
            return self.deviation
        ends = (self.transform(self.lower), self.transform(self.upper))
        if self.scale == "linear":
            centre = self.transform(self.start)
            return max(centre - ends[0], ends[1] - centre) / 2.0
        return float(ends[1] - ends[0]) / 4.0

    def transform(self, value: float) -> float:
        """Map a value to the estimation scale.

        Parameters
        ----------
        value : float
            Value of the parameter [parameter unit].
        """
        if self.scale == "linear":
            return float(value)
        return float(np.log(value / (1.0 - value))) if self.scale == "logit" else float(np.log(value))

    def inverse(self, z: float) -> float:
        """Map a point of the estimation scale back to the value.

        Parameters
        ----------
        z : float
            Point of the estimation scale [-].
        """
        if self.scale == "linear":
            return float(z)
        return float(1.0 / (1.0 + np.exp(-z))) if self.scale == "logit" else float(np.exp(z))

    def slope(self, value: float) -> float:
        """Differentiate the value with respect to the estimation scale.

        Parameters
        ----------
        value : float
            Value of the parameter [parameter unit].
        """
        if self.scale == "linear":
            return 1.0
        return value * (1.0 - value) if self.scale == "logit" else value

    def rescaled(self, factor: float) -> Parameter:
        """Return the parameter with start and range multiplied by ``factor``.

        Parameters
        ----------
        factor : float
            Scale [-], positive.
        """
        return replace(self, start=self.start * factor, lower=self.lower * factor, upper=self.upper * factor)

    def of(self, scope: Literal["facade", "zone"], member: str) -> Parameter:
        """Return the parameter of one facade or one zone, with the same start and range.

        Parameters
        ----------
        scope : {"facade", "zone"}
            Which of the two.
        member : str
            Its name.

        Examples
        --------
        >>> PARAMETERS["window_u_value"].of("facade", "south").name
        'window_u_value@facade:south'
        """
        prefix = FACADE_PREFIX if scope == "facade" else ""
        return replace(self, name=f"{self.base}@{prefix}{member}", scope=scope, member=member)


_ROWS = list(csv.DictReader((Path(__file__).parent / "data" / "parameters.csv").read_text("utf-8").splitlines()))

#: Parameters of the baseline. Wall parameters stand for a wall 1 m thick and are rescaled to the plan's wall thickness.
PARAMETERS: dict[str, Parameter] = {}
for _row in _ROWS:
    _start, _lower, _upper = (float(_row[key]) for key in ("start", "lower", "upper"))
    PARAMETERS[_row["name"]] = Parameter(
        _row["name"], _row["unit"], _start, _lower, _upper, _row["source"], cast(Scale, _row["scale"])
    )

#: Parameters of the envelope: those that may have one value a facade.
ENVELOPE_PARAMETERS = tuple(row["name"] for row in _ROWS if row["per_facade"] == "yes")
