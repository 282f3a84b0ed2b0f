"""What an experiment does: setpoints of zones, held, changed to and fro, or let go, for some hours."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from thermal._types import BoolArray, FloatArray

#: Point types of a schedule.
HEATING, COOLING = "zone_air_heating_temperature_setpoint", "zone_air_cooling_temperature_setpoint"
SUPPLY_AIR, STATIC_PRESSURE = "supply_air_temperature_setpoint", "supply_air_static_pressure_setpoint"

#: Unit of each point.
UNITS = {HEATING: "K", COOLING: "K", SUPPLY_AIR: "K", STATIC_PRESSURE: "Pa"}

#: Distance between heating and cooling setpoint of a zone that is held at a temperature [K]: terminals must not heat
#: and cool in turns.
BAND = 0.5


@dataclass(frozen=True)
class Move:
    """Setpoints of some zones, or of air handlers, for some hours.

    Parameters
    ----------
    title : str
        In plain words.
    zones : tuple of str
        Zones, or air handlers, whose setpoints are set.
    pairs : tuple of tuple of float
        Heating and cooling setpoint, one pair after another [K]; of an air handler the setpoint twice [K] or [Pa].
    every : float
        How long each pair holds [h].
    spans : tuple of tuple of float
        First and last hour of each part, counted from the beginning of the experiment [h]; the turns go on within.
    point : str
        Point of air handlers that it sets; the setpoints of zones by default.
    """

    title: str
    zones: tuple[str, ...]
    pairs: tuple[tuple[float, float], ...]
    every: float
    spans: tuple[tuple[float, float], ...]
    point: str = ""

    @property
    def hours(self) -> float:
        """How long it lasts in all [h]."""
        return sum(b - a for a, b in self.spans)

    def pair_at(self, hours: FloatArray) -> tuple[BoolArray, FloatArray]:
        """Whether it acts, and the pair that holds, at each of some times.

        Parameters
        ----------
        hours : ndarray, shape (n_time,)
            From the beginning of the experiment [h].

        Returns
        -------
        tuple
            Shape (n_time,), and (n_time, 2) [K].
        """
        acts, pair = np.zeros(hours.size, dtype=bool), np.zeros((hours.size, 2))
        for first, last in self.spans:
            inside = (hours >= first) & (hours < last)
            turn = ((hours[inside] - first) // self.every).astype(int) % len(self.pairs)
            pair[inside] = np.array(self.pairs)[turn]
            acts |= inside
        return acts, pair

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``moves`` in ``experiment.json``."""
        return {
            "title": self.title, "zones": list(self.zones), "pairs": [list(p) for p in self.pairs],
            "every_hours": self.every, "spans_hours": [list(s) for s in self.spans], "point": self.point or "setpoints",
        }  # fmt: skip


@dataclass(frozen=True)
class Schedule:
    """An experiment's setpoints over time.

    Parameters
    ----------
    start : Timestamp
        When it begins.
    hours : float
        How long it lasts [h].
    moves : tuple of Move
        What is done; where two set the same, the later counts.
    """

    start: pd.Timestamp
    hours: float
    moves: tuple[Move, ...] = ()

    @property
    def end(self) -> pd.Timestamp:
        """When it is over."""
        return self.start + pd.Timedelta(hours=self.hours)

    def setpoints(self, stamps: pd.DatetimeIndex, step: float, names: Sequence[str], point: str = "") -> FloatArray:
        """Give setpoints of steps, NaN where they are as usual: shape (n_time, n_name, 2) [K] or [Pa].

        Parameters
        ----------
        stamps : DatetimeIndex, length n_time
            Ends of the steps.
        step : float
            Their length [s].
        names : sequence of str
            Zones, or air handlers.
        point : str
            Of air handlers; the setpoints of zones by default.
        """
        hours = (stamps - self.start) / pd.Timedelta(hours=1) - step / 7200.0
        found = np.full((len(stamps), len(names), 2), np.nan)
        for move in (m for m in self.moves if m.point == point):
            acts, pair = move.pair_at(np.asarray(hours, dtype=float))
            acts &= (hours >= 0.0) & (hours < self.hours)
            for i in (i for i, name in enumerate(names) if name in move.zones):
                found[acts, i] = pair[acts]
        return found

    def rows(self, step: float) -> pd.DataFrame:
        """Tabulate what is to be set when.

        Parameters
        ----------
        step : float
            Time between looks at it [s].

        Returns
        -------
        DataFrame
            Columns ``time``, ``point``, ``value`` and ``unit``, in order of time; a value holds until the next of its
            point, and NaN gives the point back to the building's own automation.
        """
        count = round(self.hours * 3600.0 / step)
        ends = pd.DatetimeIndex([self.start + pd.Timedelta(seconds=step * (k + 1)) for k in range(count)])
        rows: list[tuple[pd.Timestamp, str, float, str]] = []
        for kind in dict.fromkeys(m.point for m in self.moves):
            points = (kind,) if kind else (HEATING, COOLING)
            names = list(dict.fromkeys(z for m in self.moves if m.point == kind for z in m.zones))
            values = self.setpoints(ends, step, names, kind)
            for i, name in enumerate(names):
                for k, point in enumerate(points):
                    course = np.append(values[:, i, k], np.nan)
                    before = np.append(np.nan, course[:-1])
                    changed = ~((course == before) | (np.isnan(course) & np.isnan(before)))
                    rows += [
                        (
                            self.start + pd.Timedelta(seconds=step * int(j)),
                            f"{name}/{point}",
                            float(course[j]),
                            UNITS[point],
                        )
                        for j in np.flatnonzero(changed)
                    ]
        frame = pd.DataFrame(rows, columns=["time", "point", "value", "unit"])
        return frame.sort_values(["time", "point"], ignore_index=True)
