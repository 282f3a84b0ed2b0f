"""Temperatures that the zones should keep to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar, StepGrid, local_hours
from thermal._types import FloatArray
from thermal.errors import describe


@dataclass(frozen=True)
class ComfortBand:
    """A band in occupied hours and a wider one outside of them, by the local clock.

    Parameters
    ----------
    occupied, unoccupied : tuple of float
        Lower and upper temperature [K]. Defaults are those of BOPTEST's multi-zone office, 21 to 24 and 15 to 30 degC
        (Blum et al. 2021, doi:10.1080/19401493.2021.1986574).
    weekday, saturday, sunday : tuple of float or None
        Start and end of the occupied hours, local [h], multiples of 5 minutes; None is a day without. A holiday is
        like a Sunday. Defaults are weekdays from 6 to 19.
    calendar : Calendar
        Which days are holidays; default none.

    Raises
    ------
    ScenarioError
        When a band is empty or hours are out of order.
    """

    occupied: tuple[float, float] = (294.15, 297.15)
    unoccupied: tuple[float, float] = (288.15, 303.15)
    weekday: tuple[float, float] | None = (6.0, 19.0)
    saturday: tuple[float, float] | None = None
    sunday: tuple[float, float] | None = None
    calendar: Calendar = field(default_factory=Calendar)

    def __post_init__(self) -> None:
        for name in ("occupied", "unoccupied"):
            lower, upper = getattr(self, name)
            if not 223.15 <= lower < upper <= 373.15:
                found = f"{lower:g} to {upper:g}"
                raise ScenarioError(describe(f"comfort: {name}", "a lower and an upper temperature in K", found))
        for name in ("weekday", "saturday", "sunday"):
            hours = getattr(self, name)
            if hours is not None and not 0.0 <= hours[0] < hours[1] <= 24.0:
                raise ScenarioError(describe(f"comfort: {name}", "rising hours from 0 to 24", repr(hours)))

    def occupied_share(self, grid: StepGrid) -> FloatArray:
        """Share of each step that lies in occupied hours, shape (n_steps,) [-].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        of_kind = np.array([hours or (0.0, 0.0) for hours in (self.weekday, self.saturday, self.sunday)])
        hour, (first, last) = local_hours(grid.middles), of_kind[self.calendar.kinds_on(grid.middles)].T
        inside = ((hour >= first) & (hour < last)).astype(float)
        return grid.mean(inside)

    def on(self, grid: StepGrid) -> tuple[FloatArray, FloatArray]:
        """Lower and upper edge over each step, shape (n_steps,) each [K].

        A step that is partly occupied has the occupied band.

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        occupied = self.occupied_share(grid) > 0.0
        lower, upper = (np.where(occupied, self.occupied[side], self.unoccupied[side]).astype(float) for side in (0, 1))
        return lower, upper
