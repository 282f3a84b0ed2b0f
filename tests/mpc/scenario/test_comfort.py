"""Comfort bands by the local clock."""

from __future__ import annotations

from datetime import date

import pandas as pd
import pytest

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar, StepGrid
from mpc.scenario.occupancy import ComfortBand

ZONE = "America/Los_Angeles"


def test_the_band_narrows_in_occupied_hours() -> None:
    band = ComfortBand((294.0, 297.0), (289.0, 303.0), (6.0, 19.0), (8.0, 12.0), None, Calendar([date(2023, 7, 4)]))
    for day, hours in (
        ("2023-07-03", range(6, 19)),
        ("2023-07-04", ()),
        ("2023-07-08", range(8, 12)),
        ("2023-07-09", ()),
    ):
        grid = StepGrid(pd.Timestamp(day, tz=ZONE), 3600.0, 24)
        lower, upper = band.on(grid)
        assert [k for k in range(24) if lower[k] == 294.0] == list(hours), day
        assert set(zip(lower.tolist(), upper.tolist(), strict=True)) <= {(294.0, 297.0), (289.0, 303.0)}


def test_a_step_that_is_partly_occupied_counts_as_occupied() -> None:
    grid = StepGrid(pd.Timestamp("2023-07-03 05:30", tz=ZONE), 3600.0, 2)
    band = ComfortBand()
    assert band.occupied_share(grid).tolist() == pytest.approx([0.5, 1.0])
    assert band.on(grid)[0].tolist() == [294.15, 294.15]


def test_what_cannot_be_is_refused() -> None:
    for options in ({"occupied": (297.0, 294.0)}, {"unoccupied": (15.0, 30.0)}, {"weekday": (19.0, 6.0)}):
        with pytest.raises(ScenarioError, match=f"comfort: {next(iter(options))}"):
            ComfortBand(**options)
