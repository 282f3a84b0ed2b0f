"""Heat that depends on the building's own state, given to EnergyPlus step by step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

STEP = 300.0  # [s]
Column = Callable[[str, str], int]


class Law(Protocol):
    """Heat of one device."""

    device: str

    def watts(self, last: NDArray[np.float64]) -> float:
        """Return the heat into the zone [W] from what was recorded at the end of the last step."""


class Leak:
    """A valve that does not close: heat while air flows.

    Parameters
    ----------
    law : dict
        `device`, `zone` and `watts`.
    column : callable
        Returns the column of an output.
    """

    def __init__(self, law: Mapping[str, Any], column: Column) -> None:
        self.device, self._watts = law["device"], float(law["watts"])
        self._flow = column(law["zone"], "flow")

    def watts(self, last: NDArray[np.float64]) -> float:
        """Return the heat [W] of the next step."""
        return self._watts if last[self._flow] > 1e-6 else 0.0


class PhaseChange:
    """A store of latent heat behind a surface: lumped, enthalpy linear in pieces.

    Below `melting - width / 2` and above `melting + width / 2` [degC] it has its sensible capacity [J/K]; between the
    two also `latent` [J], evenly.

    Parameters
    ----------
    law : dict
        `device`, `zone`, `coupling` [W/K], `capacity` [J/K], `latent` [J], `melting`, `width` [degC] and [K].
    column : callable
        Returns the column of an output.
    """

    def __init__(self, law: Mapping[str, Any], column: Column) -> None:
        self.device, self._coupling = law["device"], float(law["coupling"])
        self._air = column(law["zone"], "temperature")
        low = law["melting"] - law["width"] / 2.0
        high = low + law["width"]
        sensible = float(law["capacity"])
        self._temperatures = np.array([low - 50.0, low, high, high + 50.0])
        self._enthalpies = np.cumsum(
            [0.0, 50.0 * sensible, law["width"] * sensible + float(law["latent"]), 50.0 * sensible]
        )
        self._enthalpy: float | None = None

    def watts(self, last: NDArray[np.float64]) -> float:
        """Return the heat [W] of the next step, and take it from the store."""
        air = float(last[self._air])
        if self._enthalpy is None:
            self._enthalpy = float(np.interp(air, self._temperatures, self._enthalpies))
        store = float(np.interp(self._enthalpy, self._enthalpies, self._temperatures))
        heat = self._coupling * (store - air)
        self._enthalpy -= heat * STEP
        return heat


_LAWS: dict[str, Callable[[Mapping[str, Any], Column], Law]] = {"leak": Leak, "phase_change": PhaseChange}


def make_law(law: Mapping[str, Any], column: Column) -> Law:
    """Return the law that a job describes.

    Parameters
    ----------
    law : dict
        `law`, the kind, and what its kind needs.
    column : callable
        Returns the column of an output.
    """
    return _LAWS[law["law"]](law, column)
