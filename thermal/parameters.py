"""The calibrated parameters of the baseline: name, unit, start, physical range and where the range comes from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

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

    def __post_init__(self) -> None:
        if self.scale == "linear":
            expected, ordered = "lower <= start <= upper, not equal", self.lower <= self.start <= self.upper
            ordered = ordered and self.lower < self.upper
        else:
            expected, ordered = "0 < lower < start < upper", 0.0 < self.lower < self.start < self.upper
        if not ordered:
            raise ValueError(
                f"parameter {self.name}: expected {expected}, came {self.lower}, {self.start}, {self.upper}"
            )
        if (self.scope == "global") != (self.member is None):
            raise ValueError(
                f"parameter {self.name}: expected a member with the scopes facade and zone only, "
                f"came scope {self.scope!r} with member {self.member!r}"
            )

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


_ISO6946 = "ISO 6946:2017 Annex C (surface resistances)"
_ISO13786 = "ISO 13786:2017 and ISO 52016-1:2017 Table B.14 (areal heat capacity classes)"
_ARCH = "ISO 52016-1:2017 Table 25 (interior convective coefficients 0.7-5 W/m2/K) and radiative 5.13 W/m2/K"

#: Parameters of the baseline. Wall parameters stand for a wall 1 m thick and are rescaled to the plan's wall thickness.
PARAMETERS: dict[str, Parameter] = {
    p.name: p
    for p in (
        Parameter("exterior_convection_coefficient", "W/m^2/K", 20.0, 5.0, 60.0, f"{_ISO6946}: 4 + 4 v at 0.5-14 m/s"),
        Parameter("exterior_wall_conductivity", "W/m/K", 0.55, 0.12, 4.0, "U-values of 0.12-2.5 W/m2/K: ISO 6946:2017"),
        Parameter("exterior_wall_heat_capacity", "J/kg/K", 1000.0, 100.0, 4000.0, _ISO13786),
        Parameter(
            "interior_wall_conductivity",
            "W/m/K",
            2.5,
            0.4,
            20.0,
            "partition resistances of 0.05-2.5 m2K/W: ISO 6946:2017",
        ),
        Parameter("interior_wall_heat_capacity", "J/kg/K", 1000.0, 100.0, 8000.0, _ISO13786),
        Parameter(
            "shuffle_probability",
            "1",
            0.5,
            0.02,
            0.98,
            "probability per 300 s step; above 0.98 the mean factor vanishes",
            scale="logit",
        ),
        Parameter("interior_film_coefficient", "W/m^2/K", 2.5, 1.0, 6.0, _ARCH),
        Parameter("radiant_coefficient", "W/m^2/K", 5.0, 1.5, 8.0, _ARCH),
        Parameter(
            "combined_film_coefficient",
            "W/m^2/K",
            7.7,
            2.5,
            14.0,
            "1 / 0.13 m2K/W: ISO 6946:2017 Table 7; range: the sum of the convective and radiative ones",
        ),
        Parameter("slab_heat_capacity", "J/m^2/K", 1.5e5, 2.0e4, 6.0e5, _ISO13786),
        Parameter(
            "slab_coupling",
            "W/m^2/K",
            10.0,
            0.8,
            60.0,
            "conductivity over thickness: carpeted 0.2 m slab to bare 0.05 m screed",
        ),
        Parameter(
            "furniture_heat_capacity",
            "J/m^2/K",
            1.5e4,
            5.0e2,
            1.0e5,
            "Johra & Heiselberg (2017), doi:10.1016/j.rser.2016.11.145",
        ),
        Parameter(
            "furniture_coupling", "W/m^2/K", 5.0, 0.5, 20.0, "Johra & Heiselberg (2017), doi:10.1016/j.rser.2016.11.145"
        ),
        Parameter("window_u_value", "W/m^2/K", 2.5, 0.6, 6.0, "EN 673: triple to single glazing"),
        Parameter(
            "opening_exchange_velocity",
            "m/s",
            0.08,
            0.01,
            0.3,
            "Allard & Utsumi (1992), Energy and Buildings 18, 133-145",
        ),
        Parameter(
            "exterior_wall_conductivity_multiplier",
            "1",
            1.0,
            0.33,
            3.0,
            "tabulated design conductivities: ISO 10456:2007",
        ),
        Parameter(
            "exterior_wall_heat_capacity_multiplier", "1", 1.0, 0.33, 3.0, "tabulated design values: ISO 10456:2007"
        ),
        Parameter(
            "interior_wall_conductivity_multiplier",
            "1",
            1.0,
            0.33,
            3.0,
            "tabulated design conductivities: ISO 10456:2007",
        ),
        Parameter(
            "interior_wall_heat_capacity_multiplier", "1", 1.0, 0.33, 3.0, "tabulated design values: ISO 10456:2007"
        ),
        Parameter(
            "slab_conductivity_multiplier", "1", 1.0, 0.33, 3.0, "tabulated design conductivities: ISO 10456:2007"
        ),
        Parameter("slab_heat_capacity_multiplier", "1", 1.0, 0.33, 3.0, "tabulated design values: ISO 10456:2007"),
        Parameter(
            "window_conductance_multiplier", "1", 1.0, 0.5, 2.0, "panes without films: EN 673 against in-situ values"
        ),
    )
}

#: Parameters of the envelope: those that may have one value a facade.
ENVELOPE_PARAMETERS = (
    "exterior_convection_coefficient",
    "exterior_wall_conductivity",
    "exterior_wall_heat_capacity",
    "window_u_value",
    "exterior_wall_conductivity_multiplier",
    "exterior_wall_heat_capacity_multiplier",
    "window_conductance_multiplier",
)
