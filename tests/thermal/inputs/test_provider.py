"""InputProvider: what a case's telemetry says, in the building's time, and what it does not say."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from thermal import Case, Telemetry
from thermal.errors import EffectError
from thermal.inputs.live import LiveInputs
from thermal.inputs.normalisation import WIND, Normalisation, fit_normalisation, usual_temperatures
from thermal.inputs.provider import INFRARED, INPUTS, IRRADIANCE, InputProvider, telemetry_inputs
from thermal.inputs.signals import Signal, signal_values

CaseOf = Callable[[str], Case]


def changed(case: Case, **columns: object) -> Case:
    """The case with columns of its telemetry changed or, where None, taken away."""
    frame = case.telemetry.frame.copy()
    for name, values in columns.items():
        if values is None:
            frame = frame.drop(columns=name)
        else:
            frame[name] = values
    return replace(case, telemetry=Telemetry.from_frame(frame), judged=None)


def test_sky_is_colder_than_air(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    drivers = telemetry_inputs(case)
    frame = case.telemetry.frame
    expected = (
        frame[f"weather_station/{INFRARED}"]
        - 5.670374419e-8 * frame["weather_station/outside_air_temperature_sensor"] ** 4
    )
    assert drivers.sky == pytest.approx(expected.to_numpy(), rel=1e-12)
    assert drivers.sky.mean() < 0.0


def test_largest_heat_is_that_of_the_normalisation(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    drivers, (first, *others) = telemetry_inputs(case), case.building.zone_names
    largest = drivers.largest_heat
    assert largest.shape == (len(case.stamps), len(case.building.zone_names))
    assert (largest == largest[0]).all() and largest[0, 0] == drivers.normalisation.heat[first]
    drivers.normalisation = replace(drivers.normalisation, heat={first: 7.0})
    again = InputProvider(case.building, case.stamps, case.step, drivers.series, drivers.normalisation)
    assert again.largest_heat[0].tolist() == [7.0, *(0.0 for _ in others)]


def test_gaps_are_bridged(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    values = case.telemetry.frame[f"weather_station/{WIND}"].copy()
    values.iloc[10:13] = np.nan
    gap = telemetry_inputs(changed(case, **{f"weather_station/{WIND}": values})).wind
    assert gap[9:14] == pytest.approx(np.linspace(values.iloc[9], values.iloc[13], 5))


def test_presence_follows_the_clock_of_the_building(lively_case: CaseOf) -> None:
    # Friday 24 March to Monday 27 March 2023; clocks go forward on the Sunday
    drivers = telemetry_inputs(lively_case("plan"))
    middle = drivers.stamps - pd.Timedelta(minutes=5)
    weekend = middle.day_of_week >= 5
    assert (drivers.occupancy[weekend] == 0.0).all()
    friday = ~weekend & (middle.day == 24)
    hours = np.asarray(middle.hour + middle.minute / 60.0)
    assert (drivers.occupancy[friday & (hours > 8.6) & (hours < 17.4)] == 1.0).all()
    assert (drivers.occupancy[friday & ((hours < 7.4) | (hours > 18.6))] == 0.0).all()
    # half are there at eight and at eighteen, so that a working day has ten hours
    assert drivers.occupancy[friday].sum() / 6.0 == pytest.approx(10.0, abs=1e-9)
    # where nobody counts, people may be at home as well
    assert (drivers.awake[(hours > 8.6) & (hours < 22.4)] == 1.0).all()
    assert (drivers.awake[(hours < 5.4) | (hours > 23.6)] == 0.0).all()


def test_counted_people_go_before_office_hours(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    n = len(case.stamps)
    people = {"A/occupancy_count_sensor": np.arange(n) % 4.0, "B/occupancy_count_sensor": np.full(n, 1.0)}
    drivers = telemetry_inputs(changed(case, **people))
    assert drivers.occupancy == pytest.approx((np.arange(n) % 4.0 + 1.0) / 4.0)
    assert drivers.awake is drivers.occupancy


def test_usual_temperature_knows_the_hour_and_not_the_stamp(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    drivers, zone = telemetry_inputs(case), case.zone_temperatures()
    slots = zone.groupby([zone.index.day_of_week < 5, zone.index.hour])
    assert drivers.usual == pytest.approx(slots.transform("mean").to_numpy())
    blank = changed(case, **{"A/zone_air_temperature_sensor": np.nan})
    assert np.isfinite(telemetry_inputs(blank).usual).all()


def test_supply_air_is_flow_and_heat_above_the_zone(lively_case: CaseOf) -> None:
    case = lively_case("table")
    inputs = telemetry_inputs(case)
    flow, heat = inputs.supply_flow, inputs.supply_heat
    metered = case.zone_heat().to_numpy()
    assert heat[:, 0] == pytest.approx(metered[:, 0])
    assert (flow[:, 1] == 0.0).all() and (heat[:, 1] == 0.0).all()  # an electric heater has no air
    assert telemetry_inputs(case).heat == pytest.approx(metered)
    assert telemetry_inputs(case).airflow == pytest.approx(0.5 * flow[:, [0]])


@pytest.mark.parametrize(
    ("point", "use"),
    [(WIND, lambda d: d.wind), (INFRARED, lambda d: d.sky)],
)
def test_what_is_not_measured_is_said_by_name(
    lively_case: CaseOf, point: str, use: Callable[[InputProvider], object]
) -> None:
    drivers = telemetry_inputs(changed(lively_case("plan"), **{f"weather_station/{point}": None}))
    assert not drivers.measured(point)
    with pytest.raises(EffectError, match=f"expected {point}"):
        use(drivers)


def test_a_sun_that_nobody_measures_is_estimated_over_days_and_refused_within_one(lively_case: CaseOf) -> None:
    drivers = telemetry_inputs(changed(lively_case("plan"), **{f"weather_station/{IRRADIANCE}": None}))
    assert not drivers.measured(IRRADIANCE)
    days = pd.date_range("2023-06-20 01:00", periods=72, freq="h", tz="Europe/Berlin")
    swing = 290.0 + 6.0 * np.sin(2.0 * np.pi * (days.hour - 9.0) / 24.0)
    series, none = {"outdoor": np.asarray(swing)}, Normalisation()
    long = InputProvider(drivers.building, days, 3600.0, series, none)
    assert long.gives("sun") and long.estimates(IRRADIANCE) and long.sun.horizontal.max() > 300.0
    short = InputProvider(drivers.building, days[:24], 3600.0, {"outdoor": series["outdoor"][:24]}, none)
    assert not short.gives("sun")
    with pytest.raises(EffectError, match=f"expected {IRRADIANCE}"):
        _ = short.sun


def test_beam_follows_from_global_and_diffuse(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    swapped = changed(
        case,
        **{f"weather_station/{IRRADIANCE}": None, "weather_station/global_horizontal_irradiance_sensor": 300.0},
    )
    assert telemetry_inputs(swapped).measured(IRRADIANCE)
    assert telemetry_inputs(swapped).sun.normal.max() > 0.0


def test_signals_are_columns(lively_case: CaseOf) -> None:
    drivers = telemetry_inputs(lively_case("plan"))
    signals = [Signal("one", "1", lambda d: np.ones(len(d.stamps))), Signal("wind", "m/s", lambda d: d.wind)]
    assert signal_values(signals, drivers) == pytest.approx(
        np.column_stack([np.ones(len(drivers.stamps)), drivers.wind])
    )
    assert signal_values([], drivers).shape == (len(drivers.stamps), 0)


def test_values_by_name_unit_and_time(lively_case: CaseOf) -> None:
    inputs = telemetry_inputs(lively_case("plan"))
    some = inputs.stamps[[3, 7]]
    assert inputs.values("wind", "m/s", some).tolist() == inputs.wind[[3, 7]].tolist()
    assert inputs.values("heat").shape == (len(inputs.stamps), len(inputs.zones))
    assert np.array_equal(inputs.values("sun", "W/m^2"), inputs.sun.horizontal)
    assert inputs.lacks(("outdoor", "radiant_gains", "usual")) == ("radiant_gains",)
    assert "wind" in repr(inputs) and "radiant_gains" not in repr(inputs)
    for ask, message in (
        (lambda: inputs.values("wind", "km/h"), "input wind: expected unit m/s, found 'km/h'"),
        (lambda: inputs.values("winds"), "nearest valid one is 'wind'"),
        (lambda: inputs.values("wind", at=some + pd.Timedelta(days=99)), "stamps of the telemetry"),
    ):
        with pytest.raises(EffectError, match=message):
            ask()


def test_constants_are_of_the_intervals_they_are_fitted_on(lively_case: CaseOf) -> None:
    case = lively_case("table")
    n = len(case.stamps)
    people = np.where(np.arange(n) < n // 2, 3.0, 12.0)
    case = changed(case, **{"A/occupancy_count_sensor": people})
    early = fit_normalisation(case, [(case.stamps[0], case.stamps[n // 2 - 1])])
    assert (early.people, fit_normalisation(case).people) == (3.0, 12.0)
    assert telemetry_inputs(case, early).occupancy.max() == 4.0
    frame = case.telemetry.frame
    assert early.wind == pytest.approx(frame[f"weather_station/{WIND}"].iloc[: n // 2].mean())
    assert early.peak_flow["A"] >= early.flow["A"] > 0.0 and set(early.usual) == set(case.building.zone_names)
    assert Normalisation.from_dict(json.loads(json.dumps(early.to_dict()))) == early
    assert f"{len(early.usual)} zones" in repr(early)


def test_hours_that_were_not_fitted_are_those_of_other_days() -> None:
    # Friday the 24th from 6 to 12: a Saturday's eight o'clock is that of the Friday, eight in the evening the mean
    index = pd.date_range("2023-03-24 06:00", "2023-03-24 11:50", freq="10min", tz="Etc/GMT+6")
    zone = pd.DataFrame({"A": np.asarray(index.hour, dtype=float), "B": np.nan}, index=index)
    usual = usual_temperatures(zone)
    assert (usual["A"][24 + 8], usual["A"][8], usual["A"][20]) == (8.0, 8.0, 8.5)
    assert usual["B"][24 + 8] == 8.5


def test_a_live_feed_gives_what_the_telemetry_gives_row_by_row(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    whole = telemetry_inputs(case)
    now = LiveInputs(case.building, case.step, whole.normalisation)
    for k in (5, 60):
        now.put(whole.stamps[k : k + 1], {name: values[k : k + 1] for name, values in whole.series.items()})
        for name in INPUTS:
            if name.endswith("_rate"):
                assert not now.gives(name)  # takes several stamps
            elif now.gives(name):
                np.testing.assert_allclose(now.values(name), whole.values(name)[[k]], rtol=1e-12)
        assert now.gives("heat") and now.gives("sky") and now.gives("through_windows")
