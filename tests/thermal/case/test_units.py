"""Units of a case that pint does not know, or that belong to another quantity."""

from typing import Any

import pytest

from thermal.case.load import load_case
from thermal.errors import CaseError


def refused(draft: Any, kind: type[CaseError], message: str) -> None:
    with pytest.raises(kind, match=message):
        load_case(draft.write())


def test_unknown_unit(plan_draft: Any) -> None:
    plan_draft.content["units"]["heating_power_sensor"] = "Wat"
    refused(plan_draft, CaseError, r"units\.heating_power_sensor: expected a unit that pint knows, of a power")


def test_unit_of_something_else(plan_draft: Any) -> None:
    plan_draft.content["units"]["zone_air_temperature_sensor"] = "kg"
    refused(plan_draft, CaseError, r"zone_air_temperature_sensor: expected a unit of a temperature")


def test_units_of_points_that_are_not_there_are_checked_too(plan_draft: Any) -> None:
    plan_draft.content["units"]["wind_speed_sensor"] = "kg"
    refused(plan_draft, CaseError, "a unit of a speed")
