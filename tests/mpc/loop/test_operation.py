"""Schedules follow the comfort bands, ahead of them and within them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mpc.errors import PlantError
from mpc.loop.operation import Operation, scheduled_operation, shared_rows
from mpc.scenario.scenario import Scenario


def test_the_plant_comes_before_the_people(scenario: Callable[..., Scenario]) -> None:
    """Occupied from 6 to 19 on a Monday; an hour and a half ahead is step 54."""
    plan = scheduled_operation(scenario(), 2)
    assert np.flatnonzero(plan.running[:, 0])[[0, -1]].tolist() == [54, 227]
    assert np.flatnonzero(plan.ventilation)[[0, -1]].tolist() == [72, 227]
    np.testing.assert_allclose(plan.heating[[53, 54, 100], 0], [288.65, 294.65, 294.65])
    np.testing.assert_allclose(plan.cooling[[53, 54, 100], 0], [302.65, 296.65, 296.65])
    np.testing.assert_array_equal(plan.set_back[:, 3], plan.running[:, 1] == 0.0)


def test_it_may_run_around_the_clock(scenario: Callable[..., Scenario]) -> None:
    assert scheduled_operation(scenario(), 1, always=True).running.min() == 1.0


def test_setpoints_meet_at_most_in_the_middle_of_the_band(scenario: Callable[..., Scenario]) -> None:
    plan = scheduled_operation(scenario(), 1, margin=5.0)
    np.testing.assert_allclose(plan.heating[100], plan.cooling[100])


@pytest.mark.parametrize("options", [{"lead_hours": 13.0}, {"margin": -0.1}, {"air_handlers": -1}])
def test_numbers_out_of_range_are_refused(scenario: Callable[..., Scenario], options: dict[str, float]) -> None:
    with pytest.raises(PlantError, match="operation"):
        scheduled_operation(scenario(), **options)  # type: ignore[arg-type]


def test_schedules_that_do_not_fit_are_refused() -> None:
    low, day = np.full((4, 2), 294.0), np.zeros((4, 2), dtype=bool)
    fine = Operation(low, low + 2.0, day, np.ones((4, 1)), np.ones(4))
    fine.fits(4, 2, 1)
    with pytest.raises(PlantError, match="4 steps, 2 zones, 2 air handlers"):
        fine.fits(4, 2, 2)
    with pytest.raises(PlantError, match="row 2"):
        Operation(low, np.where(np.arange(4)[:, None] == 2, 290.0, 296.0) + 0.0 * low, day, np.ones((4, 1)), np.ones(4))
    with pytest.raises(PlantError, match="operation: ventilation"):
        Operation(low, low + 2.0, day, np.ones((4, 1)), np.full(4, np.nan))
    with pytest.raises(PlantError, match="night_cycle"):
        Operation(low, low + 2.0, day, np.ones((4, 1)), np.ones(4), -1.0)


def test_equal_rows_are_one_object() -> None:
    rows = shared_rows(np.array([[1.0, 2.0], [1.0, 2.0], [1.0, 3.0]]))
    assert rows[0] is rows[1] and rows[1] is not rows[2]
    assert not rows[0].flags.writeable
