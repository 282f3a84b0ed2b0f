"""Errors of predictions that know what a filter knows: heat that is missing now, and how sure they are."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from calibration.results import Plain

#: Probability that a band is made for [-].
LEVEL = 0.9


@dataclass(frozen=True)
class Carried(Plain):
    """Errors on the same runs when each begins from the filter's state and its unmeasured heat is carried on.

    Parameters
    ----------
    mae, median, bias : float
        As in `Metrics` [K].
    by_horizon : mapping of str to float
        MAE at other horizons, each from its own runs [K].
    coverage : float or None
        Share of the measured temperatures inside the 90 % bands of their predictions, over all steps [-]; None where no
        bands were made.
    half_width : float or None
        Half of the band's width at the last step, mean over the measured zones [K].
    """

    mae: float
    median: float
    bias: float
    by_horizon: Mapping[str, float] = field(default_factory=dict)
    coverage: float | None = None
    half_width: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Entry ``carried`` of a file."""
        return {**vars(self), "by_horizon": dict(self.by_horizon)}
