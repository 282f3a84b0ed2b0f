import math

import numpy as np
import psychrolib
import pytest

from thermal.errors import CaseError
from thermal.units import QUANTITIES, air_density, check_unit, from_si, to_si


@pytest.mark.parametrize(
    ("value", "unit", "quantity", "expected"),
    [
        (20.0, "degC", "temperature", 293.15),
        (68.0, "degF", "temperature", 293.15),
        (293.15, "K", "temperature", 293.15),
        (1.0, "kg/s", "air_flow", 1.0),
        (3600.0, "kg/h", "air_flow", 1.0),
        (120.0, "m^3/h", "air_flow", 120.0 / 3600.0 * 1.204152),
        (100.0, "cfm", "air_flow", 100.0 * 0.0283168466 / 60.0 * 1.204152),
        (100.0, "CFM", "air_flow", 100.0 * 0.0283168466 / 60.0 * 1.204152),
        (33.3, "L/s", "air_flow", 0.0333 * 1.204152),
        (1.5, "kW", "power", 1500.0),
        (50.0, "%", "share", 0.5),
        (420.0, "ppm", "concentration", 4.2e-4),
        (3.0, "-", "count", 3.0),
        (3.0, "1", "count", 3.0),
        (36.0, "km/h", "speed", 10.0),
        (90.0, "deg", "angle", 90.0),
        (math.pi, "rad", "angle", 180.0),
        (0.8, "kW/m^2", "irradiance", 800.0),
    ],
)
def test_hand_worked_conversions(value: float, unit: str, quantity: str, expected: float) -> None:
    assert float(to_si(value, unit, quantity)) == pytest.approx(expected, rel=2e-6)


@pytest.mark.parametrize("elevation", [0.0, 201.0, 690.0, 2500.0])
def test_air_density_is_psychrolibs(elevation: float) -> None:
    psychrolib.SetUnitSystem(psychrolib.SI)
    pressure = psychrolib.GetStandardAtmPressure(elevation)
    assert air_density(elevation) == pytest.approx(psychrolib.GetDryAirDensity(20.0, pressure), rel=1e-6)


def test_volume_flow_carries_less_air_on_a_mountain() -> None:
    low, high = (float(to_si(1.0, "m^3/s", "air_flow", elevation=z)) for z in (0.0, 2000.0))
    assert high / low == pytest.approx(0.785, abs=0.002)


@pytest.mark.parametrize("quantity", list(QUANTITIES))
def test_from_si_is_the_inverse(quantity: str) -> None:
    values = np.array([[-3.0, 0.0, np.nan], [20.0, 250.0, 1e4]])
    unit = QUANTITIES[quantity].file_unit
    np.testing.assert_allclose(from_si(to_si(values, unit, quantity), unit, quantity), values, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("unit", ["zork", "", "   ", "m3/h", "degC*", "3*W", "m**m", "__import__('os')"])
def test_unit_that_pint_does_not_know(unit: str) -> None:
    with pytest.raises(CaseError, match=r"units\.heating_power_sensor: expected a unit that pint knows.*kW"):
        check_unit(unit, "power", "building.yaml: units.heating_power_sensor")


@pytest.mark.parametrize(
    ("unit", "quantity", "message"),
    [
        ("kg", "temperature", "a unit of a temperature, found 'kg'"),
        ("C", "temperature", "write degC"),
        ("F", "temperature", "write degF"),
        ("delta_degC", "temperature", "this is a difference"),
        ("m/s", "air_flow", "a mass flow or a volume flow"),
        ("deg", "share", "a share"),
        ("%", "angle", "an angle"),
        ("W", "irradiance", "a power per area"),
    ],
)
def test_unit_of_something_else(unit: str, quantity: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        to_si(1.0, unit, quantity)
