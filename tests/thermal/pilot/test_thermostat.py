"""Schedules and terminal units, with numbers worked by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from thermal.errors import ThermalError
from thermal.pilot.thermostat import Terminals, Thermostats, draw_thermostats, size_terminals

WEEK = pd.date_range("2023-10-02", periods=7 * 96, freq="15min", tz="Etc/GMT+8")  # from a Monday


def constant(value: float) -> np.ndarray:
    return np.array([value, value])


@pytest.fixture
def thermostats() -> Thermostats:
    return Thermostats(
        heating=constant(294.0),
        cooling=constant(297.0),
        heating_set_back=constant(290.0),
        cooling_set_back=constant(301.0),
        start=constant(7.0),
        stop=constant(18.0),
        saturday=np.array([True, False]),
    )


@pytest.mark.parametrize(
    ("time", "occupied"),
    [
        ("2023-10-02 06:59:59", [False, False]),
        ("2023-10-02 07:00", [True, True]),
        ("2023-10-06 17:59", [True, True]),
        ("2023-10-06 18:00", [False, False]),
        ("2023-10-07 12:59", [True, False]),
        ("2023-10-07 13:00", [False, False]),
        ("2023-10-08 12:00", [False, False]),
    ],
)
def test_schedule(thermostats: Thermostats, time: str, occupied: list[bool]) -> None:
    index = pd.DatetimeIndex([time], tz="Etc/GMT+8")
    assert thermostats.occupied(index).tolist() == [occupied]
    heating, cooling = thermostats.setpoints(index)
    assert heating.tolist() == [[294.0 if here else 290.0 for here in occupied]]
    assert cooling.tolist() == [[297.0 if here else 301.0 for here in occupied]]


def test_drawn_schedules_differ_between_zones_and_leave_a_dead_band() -> None:
    thermostats = draw_thermostats(0, 123)
    heating, cooling = thermostats.setpoints(WEEK)
    assert (cooling - heating >= 1.49).all()
    assert len(np.unique(thermostats.heating)) > 60
    assert (thermostats.heating - thermostats.heating_set_back >= 1.5).all()
    assert heating.min() >= 289.15
    assert cooling.max() <= 302.15
    share = thermostats.occupied(WEEK)[WEEK.day_of_week == 5].any(axis=0).mean()
    assert 0.05 < share < 0.3
    assert not thermostats.occupied(WEEK)[WEEK.day_of_week == 6].any()
    assert np.array_equal(draw_thermostats(0, 123).start, thermostats.start)
    assert not np.array_equal(draw_thermostats(1, 123).start, thermostats.start)


@pytest.fixture
def terminals() -> Terminals:
    """Of 1006 W/K at full flow and 201.2 W/K at the least."""
    return Terminals(
        design_heat=np.array([15000.0]),
        design_flow=np.array([1.0]),
        minimum_flow=np.array([0.2]),
        coldest=285.15,
        warmest=308.15,
    )


@pytest.mark.parametrize(
    ("demand", "zone", "flow", "heat"),
    [
        (0.0, 293.15, 0.2, 0.0),  # idle: least flow at the zone's temperature
        (1006.0, 293.15, 0.2, 1006.0),  # 5 K above the zone
        (3018.0, 293.15, 0.2, 3018.0),  # 15 K above the zone: warmest air
        (6036.0, 293.15, 0.4, 6036.0),  # more air, as warm
        (99999.0, 293.15, 15000.0 / 15090.0, 15000.0),  # design power
        (99999.0, 298.15, 1.0, 10060.0),  # a warmer zone gets less from the design flow
        (-1609.6, 293.15, 0.2, -1609.6),  # 8 K below the zone: coldest air
        (-3219.2, 293.15, 0.4, -3219.2),
        (-99999.0, 293.15, 1.0, -8048.0),
        (1000.0, 310.15, 1.0, 0.0),  # the warmest air is colder than the zone
        (-1000.0, 280.15, 1.0, 0.0),
    ],
)
def test_supply(terminals: Terminals, demand: float, zone: float, flow: float, heat: float) -> None:
    supplied, brought = terminals.supply(np.array([demand]), np.array([zone]))
    assert brought[0] == pytest.approx(heat, abs=1e-6)
    assert supplied[0] == pytest.approx(flow)
    discharge = zone + brought[0] / (supplied[0] * 1006.0)
    assert 285.15 - 1e-9 <= discharge <= 308.15 + 1e-9 or brought[0] == 0.0


def test_sizes_follow_the_floor_area() -> None:
    areas = np.array([10.0, 50.0, 100.0])
    terminals = size_terminals(0, areas, 50.0, 0.25)
    flux = terminals.design_heat / areas
    assert ((flux >= 42.5) & (flux <= 57.5)).all()
    assert np.allclose(terminals.design_flow * 1006.0 * 14.0, terminals.design_heat)
    assert np.allclose(terminals.minimum_flow, 0.25 * terminals.design_flow)


def test_bad_input_is_refused() -> None:
    with pytest.raises(ThermalError, match="thermostats: expected"):
        draw_thermostats(-1, 3)
    with pytest.raises(ThermalError, match="thermostats: expected"):
        draw_thermostats(0, 0)
    areas = np.array([10.0, 20.0])
    for bad in ((-1, areas, 60.0, 0.2), (0, -areas, 60.0, 0.2), (0, areas, 0.0, 0.2), (0, areas, 60.0, 0.0)):
        with pytest.raises(ThermalError, match="terminals: expected"):
            size_terminals(*bad)
