"""Holidays of an input file beside those of pandas."""

from __future__ import annotations

from datetime import date

import pytest
from pandas.tseries.holiday import USColumbusDay, USLaborDay, USMartinLutherKingJr, USMemorialDay, USThanksgivingDay

from mpc.adapters.energyplus.input import InputFile, holidays
from mpc.errors import EnergyPlusError

YEARS = range(2020, 2030)


def days(start: str, **fields: object) -> InputFile:
    written = {"start_date": start, "special_day_type": "Holiday", "duration": 1, **fields}
    return InputFile({"RunPeriodControl:SpecialDays": {"day": written}}, "office")


@pytest.mark.parametrize(
    ("text", "known"),
    [
        ("3rd Monday in January", USMartinLutherKingJr),
        ("Last Monday in May", USMemorialDay),
        ("1st Monday in September", USLaborDay),
        ("2nd Monday in October", USColumbusDay),
        ("4th Thursday in November", USThanksgivingDay),
    ],
)
def test_counted_days_are_those_of_pandas(text, known):
    assert holidays(days(text), YEARS) == {d.date() for d in known.dates("2020-01-01", "2029-12-31")}


def test_fixed_days_and_their_length():
    assert holidays(days("July 4"), [2023]) == holidays(days("7/4"), [2023]) == {date(2023, 7, 4)}
    assert holidays(days("December 31", duration=2), [2023]) == {date(2023, 12, 31), date(2024, 1, 1)}
    assert holidays(days("July 4", special_day_type="SummerDesignDay"), [2023]) == frozenset()
    assert holidays(InputFile({}, "office"), [2023]) == frozenset()


@pytest.mark.parametrize("text", ["5th Monday in February", "Juli 4th", "13/1", "February 30"])
def test_a_date_that_is_none_is_named(text):
    with pytest.raises(EnergyPlusError, match="1st Monday in September"):
        holidays(days(text), [2023])


@pytest.mark.energyplus
def test_nobody_expects_comfort_on_a_holiday(office):
    """The fourth of July 2023, a Tuesday, has the band of a Sunday; the day after does not."""
    from mpc.adapters.energyplus.make import energyplus_scenario

    scenario = energyplus_scenario(office, "2023-07-04", 2, step_seconds=3600.0)
    width = (scenario.upper - scenario.lower)[:, 0].reshape(2, 24)
    assert len(set(width[0])) == 1 and width[0, 0] > width[1].min()
