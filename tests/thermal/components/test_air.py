import numpy as np
import psychrolib
import pytest

from thermal.components.moist_air import dew_point, enthalpy, saturation_humidity, wet_bulb
from thermal.components.operations import FloatOperations

OPS, PRESSURE = FloatOperations(), 101_325.0
psychrolib.SetUnitSystem(psychrolib.SI)


@pytest.mark.parametrize("degrees", np.arange(-20.0, 50.0, 5.0))
def test_saturation_is_that_of_ashrae(degrees):
    expected = psychrolib.GetSatHumRatio(degrees, PRESSURE)
    # below freezing ASHRAE has ice, Magnus undercooled water
    tolerance = 5e-3 if degrees >= 0.0 else 0.25
    assert saturation_humidity(OPS, degrees + 273.15, PRESSURE) == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("degrees", [10.0, 18.0, 26.0, 35.0])
@pytest.mark.parametrize("share", [0.15, 0.4, 0.7, 0.95])
def test_wet_bulb_is_within_a_kelvin_of_ashrae(degrees, share):
    humidity = psychrolib.GetHumRatioFromRelHum(degrees, share, PRESSURE)
    expected = psychrolib.GetTWetBulbFromHumRatio(degrees, humidity, PRESSURE)
    assert wet_bulb(OPS, degrees + 273.15, humidity, PRESSURE) - 273.15 == pytest.approx(expected, abs=1.0)


def test_dew_point_inverts_saturation():
    assert dew_point(OPS, saturation_humidity(OPS, 287.0, PRESSURE), PRESSURE) == pytest.approx(287.0, abs=1e-6)


def test_enthalpy_is_that_of_ashrae():
    assert enthalpy(298.15, 0.01) == pytest.approx(psychrolib.GetMoistAirEnthalpy(25.0, 0.01), rel=1e-9)
