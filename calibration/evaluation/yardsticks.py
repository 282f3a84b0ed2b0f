"""Errors of what anyone fits in an hour, beside which the error of a model is judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from calibration.results import Plain

#: What each yardstick is called in words, the simplest first.
YARDSTICKS = {"persistence": "persistence", "arx": "ridge ARX", "rc": "coupled 2R2C"}


@dataclass(frozen=True)
class Yardsticks(Plain):
    """Mean absolute errors of simple models on the runs of an evaluation, each fitted without their targets.

    Parameters
    ----------
    persistence : float
        Of zones that keep the temperature of the start [K].
    arx : float or None
        Of a ridge regression of the change of temperature on temperatures, metered heat and weather [K].
    rc : float or None
        Of a network of two resistances and two capacities a zone, all zones coupled [K].
    reasons : mapping of str to str
        Why a yardstick could not be made, or what it does without, by its name.
    seconds : float
        Wall time [s].
    """

    persistence: float
    arx: float | None = None
    rc: float | None = None
    reasons: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def made(self) -> dict[str, float]:
        """Those that could be made, by name [K]."""
        return {name: error for name, error in self.to_dict().items() if error is not None}

    def useful(self, mae: float) -> bool:
        """Whether an error is below that of all yardsticks that could be made.

        Parameters
        ----------
        mae : float
            Of the model on the same runs [K].

        Examples
        --------
        >>> Yardsticks(0.5, 0.2).useful(0.3), Yardsticks(0.5, 0.2).useful(0.1)
        (False, True)
        """
        return all(mae < error for error in self.made.values())

    def to_dict(self) -> dict[str, float | None]:
        """Errors by name [K]."""
        return {name: getattr(self, name) for name in YARDSTICKS}

    def beside(self, mae: float) -> dict[str, Any]:
        """Entries of a file beside the error of a model.

        Parameters
        ----------
        mae : float
            Of the model on the same runs [K].
        """
        reasons = dict(self.reasons)
        return {"yardsticks": self.to_dict(), "useful": self.useful(mae), "yardstick_remarks": reasons}
