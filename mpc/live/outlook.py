"""Forecasts of a site from now on: of the tables that its plant's description names, read anew when they change."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from mpc.adapters.boptest.scenario import DAY, YearClock
from mpc.adapters.described.conditions import SeriesSource, described_forecaster
from mpc.adapters.described.schema import PlantFile
from mpc.adapters.described.series import read_table
from mpc.errors import PlantError
from mpc.scenario.forecast import Forecast, Forecaster


class Outlook:
    """Makes the forecast of any step.

    Whoever forecasts the weather or the prices writes them into one of the ``.csv`` files of `series`; the forecasts of
    the next step have them.

    Parameters
    ----------
    path : Path
        The ``plant.yaml``.
    file : PlantFile
        As read.
    """

    def __init__(self, path: Path, file: PlantFile) -> None:
        self.path, self.file = path, file
        self._made: tuple[float, int, list[int]] = (0.0, -1, [])
        self._forecaster: Forecaster | None = None

    def at(self, begin: float) -> Forecast:
        """Forecast what comes from a time on.

        Parameters
        ----------
        begin : float
            A multiple of the control step, since 1970 in UTC [s].

        Raises
        ------
        PlantError
            When the description has no weather, or a table cannot be read.
        ScenarioError
            When a table does not reach that far.
        """
        step = self.file.control_step
        first, count, state = self._made
        number = round((begin - first) / step)
        if not 0 <= number < count or state != self._state():
            self._make(begin)
            number = 0
        if self._forecaster is None:
            raise PlantError("weather", "that of the plant's description", "none", "name `weather` and `prices`")
        return self._forecaster.table(number)

    def _make(self, begin: float) -> None:
        """Read the tables, for a day or as far as they reach."""
        file, zone = self.file, self.file.location.timezone
        start = pd.Timestamp(begin, unit="s", tz="UTC").tz_convert(zone)
        clock = YearClock(start.year, zone)
        names = [name for name in file.series if name.endswith(".csv")]
        tables = [read_table(self.path.parent / name, name, clock) for name in names]
        ends = [table.seconds[-1] for table in tables]
        whole = int(DAY / file.control_step)
        reach = min([(end - begin) / file.control_step for end in ends], default=2.0 * whole)
        horizon = max(round(file.forecast.hours * 3600.0 / file.control_step), 1)
        count = max(min(int(reach) - horizon, whole), 1)
        self._forecaster = described_forecaster(file, self.path.parent, SeriesSource(tables), start, count)
        self._made = (begin, count, self._state())

    def _state(self) -> list[int]:
        """When each table was last written."""
        places = [self.path.parent / name for name in self.file.series if name.endswith(".csv")]
        return [place.stat().st_mtime_ns if place.is_file() else 0 for place in places]
