import psychrolib
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.cooling_coil import CoolingCoil
from thermal.components.curves import DX_CAPACITY, Polynomial
from thermal.components.moist_air import wet_bulb
from thermal.components.operations import FloatOperations
from thermal.errors import ModelError

OPS = FloatOperations()
psychrolib.SetUnitSystem(psychrolib.SI)
POINTS = {
    "flow": st.floats(0.01, 5.0), "temperature": st.floats(275.0, 315.0), "share": st.floats(0.05, 0.98),
    "target": st.floats(278.0, 300.0), "outdoor": st.floats(255.0, 320.0),
}  # fmt: skip


def humidity_of(temperature, share):
    return psychrolib.GetHumRatioFromRelHum(temperature - 273.15, share, 101_325.0)


def test_a_dry_coil_by_hand():
    cooled = CoolingCoil(50_000.0).cool(OPS, 1.0, 298.15, 0.002, 288.15, 308.15)
    assert cooled.temperature == pytest.approx(288.15)
    assert cooled.sensible == pytest.approx(10_060.0)
    assert cooled.latent == 0.0


def test_the_apparatus_dew_point_by_hand():
    coil = CoolingCoil(50_000.0, bypass=0.1)
    cooled = coil.cool(OPS, 1.0, 300.15, 0.012, 287.15, 308.15)
    surface = (287.15 - 0.1 * 300.15) / 0.9
    saturated = psychrolib.GetSatHumRatio(surface - 273.15, 101_325.0)
    assert cooled.humidity == pytest.approx(0.1 * 0.012 + 0.9 * saturated, rel=2e-3)
    assert cooled.latent == pytest.approx(2.454e6 * (0.012 - cooled.humidity), rel=1e-9)


@given(**POINTS)
def test_the_second_law(flow, temperature, share, target, outdoor):
    coil = CoolingCoil(30_000.0)
    humidity = humidity_of(temperature, share)
    cooled = coil.cool(OPS, flow, temperature, humidity, target, outdoor)
    # no air colder than the coil can be, nor than was wanted
    assert cooled.temperature >= min(temperature, max(target, coil.coldest)) - 1e-9
    assert cooled.temperature <= temperature
    assert 0.0 <= cooled.humidity <= humidity * (1.0 + 1e-12)
    assert cooled.sensible >= 0.0 and cooled.latent >= 0.0
    total = cooled.sensible + cooled.latent
    surface = temperature - (temperature - cooled.temperature) / 0.9
    if total > 1.0:
        carnot = surface / max(outdoor - surface, 1e-9)
        assert total / cooled.power <= carnot * (1.0 + 1e-9)
    # what leaves carries what was not taken out, by ASHRAE's enthalpies within the difference of heat capacities
    before = psychrolib.GetMoistAirEnthalpy(temperature - 273.15, humidity)
    after = psychrolib.GetMoistAirEnthalpy(cooled.temperature - 273.15, cooled.humidity)
    assert total == pytest.approx(flow * (before - after), rel=0.08, abs=5.0 * flow)


@given(**POINTS)
def test_capacity_bounds_the_load(flow, temperature, share, target, outdoor):
    coil = CoolingCoil(5000.0)
    cooled = coil.cool(OPS, flow, temperature, humidity_of(temperature, share), target, outdoor)
    x = wet_bulb(OPS, temperature, humidity_of(temperature, share), 101_325.0) - 273.15
    available = 5000.0 * DX_CAPACITY(OPS, x, outdoor - 273.15)
    assert cooled.sensible + cooled.latent <= 1.04 * available
    assert cooled.power <= 5000.0


@given(**POINTS, capacity=st.floats(500.0, 20_000.0))
def test_wanting_colder_air_never_brings_warmer(flow, temperature, share, target, outdoor, capacity):
    coil, humidity = CoolingCoil(capacity), humidity_of(temperature, share)
    first, colder = (coil.cool(OPS, flow, temperature, humidity, t, outdoor) for t in (target, target - 1.0))
    assert colder.temperature <= first.temperature + 1e-9
    assert colder.power >= first.power - 1e-6


def test_a_coil_at_its_capacity_takes_it_all():
    coil = CoolingCoil(5000.0)
    for temperature, share, flow in ((303.0, 0.5, 0.5), (299.0, 0.9, 0.4), (308.0, 0.2, 0.6)):
        humidity = humidity_of(temperature, share)
        cooled = coil.cool(OPS, flow, temperature, humidity, 281.0, 308.0)
        x = wet_bulb(OPS, temperature, humidity, 101_325.0) - 273.15
        assert cooled.sensible + cooled.latent == pytest.approx(5000.0 * DX_CAPACITY(OPS, x, 34.85), rel=0.02)


@given(outdoor=st.floats(284.0, 318.0))
def test_warmer_weather_takes_more_power(outdoor):
    coil = CoolingCoil(50_000.0)
    powers = [coil.cool(OPS, 1.0, 299.0, 0.010, 287.0, t).power for t in (outdoor, outdoor + 2.0)]
    assert powers[1] > powers[0]


def test_chilled_water_lockout_and_pumps():
    coil = CoolingCoil(50_000.0, chilled_water=280.15, auxiliaries=0.05, lockout=285.15)
    assert coil.cool(OPS, 1.0, 299.0, 0.008, 287.0, 280.0).sensible == 0.0
    running = coil.cool(OPS, 1.0, 299.0, 0.004, 287.0, 300.0)
    plain = CoolingCoil(50_000.0, chilled_water=280.15).cool(OPS, 1.0, 299.0, 0.004, 287.0, 300.0)
    assert running.power == pytest.approx(plain.power + 0.05 * plain.sensible)


def test_a_compressor_cycles_below_its_least_part_load():
    curve = Polynomial((0.2, 0.8), 0.25, 1.0, "test")
    coil = CoolingCoil(40_000.0, part_load=curve)
    full = [coil.cool(OPS, 1.0, 289.0 + d, 0.003, 289.0, 308.0) for d in (2.0, 1.0, 0.0)]
    assert full[0].power == pytest.approx(2.0 * full[1].power, rel=0.05)  # wet bulbs differ a little
    assert full[2].power == 0.0
    with pytest.raises(ModelError, match="expected 0 at no load, or a range that begins above 0, found 0.2"):
        CoolingCoil(40_000.0, part_load=Polynomial((0.2, 0.8), 0.0, 1.0, "test"))


def test_a_chiller_by_hand():
    """At 6.67 degC of water and 29.4 degC outdoors the curves are 1 by their rating; half the load costs 0.600."""
    coil = CoolingCoil.chilled(40_000.0, auxiliaries=0.0)
    half = coil.cool(OPS, 20_000.0 / (1006.0 * 8.0), 296.0, 0.001, 288.0, 302.55)
    assert half.sensible == pytest.approx(20_000.0) and half.latent == 0.0
    by_part_load = 0.088065 + 1.137742 * 0.5 - 0.225806 * 0.25
    assert half.power == pytest.approx(40_000.0 / 3.0 * by_part_load, rel=0.01)


@pytest.mark.parametrize("load", [0.3, 0.6, 0.95])
def test_the_cop_of_a_chiller_goes_with_weather_and_part_load(load):
    coil = CoolingCoil.chilled(40_000.0)

    def cop(share, outdoor):
        cooled = coil.cool(OPS, share * 40_000.0 / (1006.0 * 8.0), 296.0, 0.001, 288.0, outdoor)
        return (cooled.sensible + cooled.latent) / cooled.power

    assert cop(load, 298.15) > 1.05 * cop(load, 303.15) > 1.05 * cop(load, 308.15)
    assert cop(0.3, 303.15) < 0.95 * cop(0.9, 303.15)  # a compressor that is throttled wastes some
    assert cop(0.1, 303.15) == pytest.approx(cop(0.2, 303.15))  # one that cycles does not


def test_parameters_out_of_range_are_refused():
    with pytest.raises(ModelError, match=r"CoolingCoil.cop: expected 1 to 10 -, found 12.0"):
        CoolingCoil(1000.0, cop=12.0)
    with pytest.raises(ModelError, match=r"CoolingCoil.chilled_water: .* found 7.0"):
        CoolingCoil(1000.0, chilled_water=7.0)
