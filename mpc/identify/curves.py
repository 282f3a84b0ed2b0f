"""Curves of machines: what one gives or takes by load, outdoor air and the emitter's temperature."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

#: Outdoor air and emitter that coefficients are told at [K], and changes that slopes are for [K]: 7 degC is where heat
#: pumps are rated (EN 14511).
OUTDOOR, EMITTER, PER = 280.15, 303.15, 10.0

#: Half width of intervals in standard errors: 95 % of a normal distribution.
_WIDE = 1.96


@dataclass(frozen=True)
class Curve:
    """What a machine gives or takes over its features: ``Σ c_i φ_i``.

    ``standing`` is 1 at any load above 0, ``command`` the load u from 0 to 1, ``command^2`` its square, ``outdoor`` and
    ``emitter`` u times the difference from 7 and 30 degC over 10 K.

    Parameters
    ----------
    coefficients, deviations : mapping of str to float
        By feature, and their standard errors, robust against autocorrelation [W].
    """

    coefficients: Mapping[str, float]
    deviations: Mapping[str, float]

    def __call__(self, on: Any, u: Any, outdoor: Any, emitter: Any) -> Any:
        """Evaluate, with numbers, arrays or symbols [W].

        Parameters
        ----------
        on, u : number, array or symbol
            Whether it runs, and its load [-].
        outdoor, emitter : number, array or symbol
            Temperatures [K].
        """
        features = features_of(on, u, outdoor, emitter)
        return sum((c * features[name] for name, c in self.coefficients.items()), 0.0 * u)

    def without_standing(self) -> Self:
        """Leave the standing part out, as it is where a machine never runs at part load."""
        return replace(self, coefficients={k: v for k, v in self.coefficients.items() if k != "standing"})


def features_of(on: Any, u: Any, outdoor: Any, emitter: Any) -> dict[str, Any]:
    """Features of a load, see `Curve`.

    Parameters
    ----------
    on, u : number, array or symbol
        Whether it runs, and its load [-].
    outdoor, emitter : number, array or symbol
        Temperatures [K].
    """
    return {
        "standing": on,
        "command": u,
        "command^2": u * u,
        "outdoor": u * (outdoor - OUTDOOR) / PER,
        "emitter": u * (emitter - EMITTER) / PER,
        "command^2 outdoor": u * u * (outdoor - OUTDOOR) / PER,
    }


def interval_of(curve: Curve, feature: str) -> tuple[float, float]:
    """Give the ends of the 95 % interval of a coefficient [W].

    Parameters
    ----------
    curve : Curve
        Of a machine.
    feature : str
        Of the curve.
    """
    value, wide = curve.coefficients[feature], _WIDE * curve.deviations[feature]
    return value - wide, value + wide
