"""Sun: against pvlib called directly, a noon worked by hand, and every set of irradiances that a station may report."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from pvlib import atmosphere, irradiance, solarposition

from thermal.case.building import Location
from thermal.errors import EffectError
from thermal.inputs.sun import Sun, estimated_sun, incidence_modifier, sun_of

MUNICH = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Europe/Berlin")
NORMAL, DIFFUSE, GLOBAL = (
    f"{name}_irradiance_sensor" for name in ("direct_normal", "diffuse_horizontal", "global_horizontal")
)


def days(start: str = "2023-06-20", n: int = 48, step: str = "1h", zone: str = "Europe/Berlin") -> pd.DatetimeIndex:
    return pd.date_range(pd.Timestamp(start, tz=zone) + pd.Timedelta(step), periods=n, freq=step)


def clear_sky(stamps: pd.DatetimeIndex, step: float) -> pd.DataFrame:
    """A consistent set of irradiances: G = N sin h + D at the middle of the steps, W/m2."""
    middle = stamps - pd.Timedelta(seconds=step / 2)
    place = solarposition.get_solarposition(middle, 48.0, 12.0, 690.0)
    rise = np.sin(np.radians(place["elevation"].to_numpy()))
    normal = np.where(rise > 0.06, 850.0 * np.maximum(rise, 0.0) ** 0.3, 0.0)
    diffuse = 120.0 * np.maximum(rise, 0.0)
    return pd.DataFrame(
        {NORMAL: normal, DIFFUSE: diffuse, GLOBAL: normal * np.maximum(rise, 0) + diffuse}, index=stamps
    )


def test_planes_are_those_of_pvlib() -> None:
    stamps = days(n=96)
    weather = clear_sky(stamps, 3600.0)
    sun = sun_of(MUNICH, stamps, 3600.0, weather)
    place = solarposition.get_solarposition(stamps - pd.Timedelta("30min"), 48.0, 12.0, 690.0)
    for tilt, azimuth in ((90.0, 180.0), (90.0, 247.5), (0.0, 0.0), (30.0, 135.0), (180.0, 0.0)):
        total = irradiance.get_total_irradiance(
            tilt, azimuth, 90.0 - place["elevation"], place["azimuth"], weather[NORMAL].to_numpy(),
            weather[GLOBAL].to_numpy(), weather[DIFFUSE].to_numpy(), albedo=0.2, model="perez",
            dni_extra=irradiance.get_extra_radiation(np.asarray(stamps.day_of_year)),
            airmass=atmosphere.get_relative_airmass(90.0 - place["elevation"].to_numpy()),
        )  # fmt: skip
        beam, diffuse = sun.plane(azimuth, tilt)
        assert beam == pytest.approx(total["poa_direct"].to_numpy(), abs=1e-9)
        up = sun.altitude > 3.0
        assert diffuse[up] == pytest.approx(total["poa_diffuse"].to_numpy()[up], abs=1e-9)


def test_light_of_a_wrong_clock_is_not_gathered_about_a_sun_that_is_down() -> None:
    stamps = days(n=288, step="10min")
    for hours in (-1, 1):
        late = clear_sky(stamps, 600.0)[[GLOBAL]].shift(6 * hours).fillna(0.0)
        sun = sun_of(MUNICH, stamps, 600.0, late)
        assert max(sun.plane(azimuth, 90.0)[1].max() for azimuth in (60.0, 90.0, 270.0, 300.0)) < 500.0


def test_noon_at_the_equinox_by_hand() -> None:
    # 12 deg east at an equinox: the sun culminates 12:00 UTC less 48 min less the equation of time (-7.5 min), 12:20
    # in Berlin; it then stands 90 - 48 = 42 deg over the south
    stamps = pd.DatetimeIndex([pd.Timestamp("2023-03-20 12:24:30", tz="Europe/Berlin")])  # end of a ten-minute step
    weather = pd.DataFrame({NORMAL: [800.0], DIFFUSE: [100.0]}, index=stamps)
    sun = sun_of(MUNICH, stamps, 600.0, weather)
    assert sun.altitude[0] == pytest.approx(42.0, abs=0.2)
    assert sun.azimuth[0] == pytest.approx(180.0, abs=0.6)
    height = np.radians(sun.altitude[0])
    beam, diffuse = sun.plane(180.0, 90.0)
    assert beam[0] == pytest.approx(800.0 * np.cos(height), rel=1e-4)
    assert sun.horizontal[0] == pytest.approx(800.0 * np.sin(height) + 100.0, rel=1e-12)
    # Perez et al. (1990): clearness 5.96, brightness 100 x 1.49 / 1374 = 0.1085, bin 7: F1 = 0.586, F2 = 0.2515; half of
    # an isotropic sky, brighter about the sun by cos 42 deg / cos 48 deg and at the horizon: 100 (0.207 + 0.651 + 0.2515)
    assert diffuse[0] == pytest.approx(110.9 + 0.1 * sun.horizontal[0], rel=2e-3)
    # between 0.974 at 40 deg and 0.934 at 50 deg
    assert sun.through_glass(180.0, 90.0)[0] == pytest.approx(0.966 * beam[0] + 0.86 * diffuse[0], rel=1e-3)
    assert sun.plane(0.0, 90.0)[0][0] == 0.0  # behind a wall to the north


def test_stamps_end_their_steps() -> None:
    # the same hour told as one step, and as the middle one of three steps of 20 minutes
    hour = sun_of(MUNICH, days(n=24), 3600.0, clear_sky(days(n=24), 3600.0))
    fine = days(n=72, step="20min")
    third = sun_of(MUNICH, fine, 1200.0, clear_sky(fine, 1200.0))
    assert hour.altitude == pytest.approx(third.altitude[1::3], abs=1e-12)


def test_clocks_that_change_do_not_move_the_sun() -> None:
    stamps = days("2023-03-25 20:00", n=24)
    weather = clear_sky(stamps, 3600.0)
    local = sun_of(MUNICH, stamps, 3600.0, weather)
    world = sun_of(MUNICH, stamps.tz_convert("UTC"), 3600.0, weather)
    assert local.azimuth == pytest.approx(world.azimuth, abs=1e-12)
    assert np.diff(np.unwrap(local.azimuth, period=360.0)).max() < 25.0  # no jump where the clock jumps


@pytest.mark.parametrize("seen", [(NORMAL, DIFFUSE), (NORMAL, GLOBAL), (DIFFUSE, GLOBAL), (NORMAL, DIFFUSE, GLOBAL)])
def test_two_irradiances_give_the_third(seen: tuple[str, ...]) -> None:
    stamps = days()
    weather = clear_sky(stamps, 3600.0)
    sun = sun_of(MUNICH, stamps, 3600.0, weather[list(seen)])
    assert sun.normal == pytest.approx(weather[NORMAL].to_numpy(), abs=1e-9)
    assert sun.diffuse == pytest.approx(weather[DIFFUSE].to_numpy(), abs=1e-9)
    assert sun.horizontal == pytest.approx(weather[GLOBAL].to_numpy(), abs=1e-9)


def test_the_global_one_alone_is_split_and_adds_up() -> None:
    stamps = days()
    weather = clear_sky(stamps, 3600.0)[[GLOBAL]]
    sun = sun_of(MUNICH, stamps, 3600.0, weather)
    high = sun.altitude > 5.0
    again = sun.normal * np.sin(np.radians(sun.altitude)) + sun.diffuse
    assert again[high] == pytest.approx(weather[GLOBAL].to_numpy()[high], rel=1e-9)
    assert (sun.normal[sun.altitude < 0.0] == 0.0).all()
    clear = sun.altitude > 50.0
    assert (sun.normal[clear] > 500.0).all()  # a high sun on a bright day is mostly beam


@pytest.mark.parametrize("seen", [(), (NORMAL,), (DIFFUSE,)])
def test_what_does_not_tell_beam_and_diffuse_apart_is_refused(seen: tuple[str, ...]) -> None:
    stamps = days()
    with pytest.raises(EffectError, match="expected global_horizontal_irradiance_sensor, or direct_normal"):
        sun_of(MUNICH, stamps, 3600.0, clear_sky(stamps, 3600.0)[list(seen)])


def test_a_low_sun_makes_no_beam_out_of_noise() -> None:
    stamps = days(n=144, step="10min")
    weather = clear_sky(stamps, 600.0)[[DIFFUSE, GLOBAL]]
    weather[GLOBAL] += 5.0  # an offset of the sensor, at night too
    assert sun_of(MUNICH, stamps, 600.0, weather).normal.max() < 1000.0


def test_incidence_modifier_of_known_angles() -> None:
    angle = np.radians([0.0, 60.0, 89.9, 120.0])
    assert incidence_modifier(np.cos(angle)) == pytest.approx([1.0, 0.64 / 0.76, 0.26 / 0.76 * 0.01, 0.0])


def test_a_sun_below_the_horizon_does_not_shine_through_glass() -> None:
    sun = Sun(*(np.array([v]) for v in (180.0, -10.0, 0.0, 0.0, 0.0, 1400.0)))
    assert sun.through_glass(180.0, 90.0)[0] == 0.0


def test_a_day_by_its_range_of_temperature_as_in_fao_56_example_15() -> None:
    # Allen et al. (1998), example 15: Lyon, 45.72 N, July: Ra 40.6 MJ/m2/d, 26.6 and 14.8 degC, Rs 22.3 with 0.16
    lyon = Location(latitude=45.72, longitude=4.95, elevation=200.0, timezone="Europe/Paris")
    stamps = pd.date_range("2023-07-15", periods=145, freq="10min", tz="Etc/GMT-1")[1:]
    outdoor = 293.85 - 5.9 * np.cos(2.0 * np.pi * (np.arange(144) + 0.5) / 144.0)
    sun = estimated_sun(lyon, stamps, 600.0, outdoor)
    total = sun.horizontal.sum() * 600.0 / 1e6
    assert total == pytest.approx(22.3 * 0.175 / 0.16, rel=0.02)
    assert (sun.horizontal[sun.altitude < 0.0] == 0.0).all()
    up = sun.altitude > 5.0
    assert (sun.normal * np.sin(np.radians(sun.altitude)) + sun.diffuse)[up] == pytest.approx(sun.horizontal[up], rel=1e-6)


def test_a_day_without_a_swing_is_dark_and_one_with_a_large_one_no_brighter_than_clear() -> None:
    place, stamps = MUNICH, days("2023-06-20", 25)[1:]
    flat, wide = (estimated_sun(place, stamps, 3600.0, v * np.sin(np.arange(24.0) / 4.0)).horizontal for v in (0.0, 30.0))
    assert wide.max() / flat.max() == pytest.approx(0.75 / 0.25, rel=1e-6)


def test_a_day_that_is_cut_off_is_as_bright_as_the_others() -> None:
    stamps = days("2023-06-20", 73)[1:]
    outdoor = 290.0 + 6.0 * np.sin(2.0 * np.pi * stamps.hour / 24.0)
    whole = estimated_sun(MUNICH, stamps, 3600.0, np.asarray(outdoor)).horizontal
    part = estimated_sun(MUNICH, stamps[9:], 3600.0, np.asarray(outdoor)[9:]).horizontal
    assert part == pytest.approx(whole[9:], rel=1e-6)
