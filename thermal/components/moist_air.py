"""Moist air and water: constants, saturation, wet bulb, in closed forms that differentiate."""

from thermal.components.operations import Operations, Value

WATER_HEAT_CAPACITY = 4186.0  # J/kg/K, liquid at 50 degC within 0.2 % (IAPWS-95)
WATER_DENSITY = 983.0  # kg/m3 at 60 degC (IAPWS-95)
SUPPLY_AIR_DENSITY = 1.2  # kg/m3: rated flows and pressures of fans are of standard air (ASHRAE Fundamentals 2017)
EVAPORATION_HEAT = 2.454e6  # J/kg at 20 degC (ASHRAE Fundamentals 2017, ch. 1)
LEAST_AIR = 1e-6  # kg/s: less air is none, and the dampers of an air handler that is off are shut
USUAL_HUMIDITY = 0.006  # kg/kg: dew point 6.5 degC, so that coils stay nearly dry where no humidity is given
_FREEZING = 273.15  # K
_LEAST_SATURATED = -9e3  # J/kg: saturated air at -12 degC, colder than any coil or wet bulb that matters
_MOLAR_RATIO = 0.621945  # water to dry air (ASHRAE Fundamentals 2017, ch. 1)


def _saturation_pressure(ops: Operations, temperature: Value) -> Value:
    """Vapour pressure of saturated air [Pa] at a temperature [K].

    Magnus' form, Alduchov and Eskridge (1996), J. Appl. Meteor. 35, 601-609, eq. 21: within 0.4 % from -40 to 50 degC.
    """
    degrees = temperature - _FREEZING
    return 610.94 * ops.exp(17.625 * degrees / (degrees + 243.04))


def saturation_humidity(ops: Operations, temperature: Value, pressure: float) -> Value:
    """Humidity ratio of saturated air [kg/kg] at a temperature [K] and a pressure [Pa]."""
    vapour = _saturation_pressure(ops, temperature)
    return _MOLAR_RATIO * vapour / (pressure - vapour)


def dew_point(ops: Operations, humidity: Value, pressure: float) -> Value:
    """Dew point [K] of air of a humidity ratio [kg/kg] and pressure [Pa], the inverse of `saturation_humidity`."""
    vapour = pressure * humidity / (_MOLAR_RATIO + humidity)
    exponent = ops.log(vapour / 610.94 + 1e-9)
    return _FREEZING + 243.04 * exponent / (17.625 - exponent)


def enthalpy(temperature: Value, humidity: Value) -> Value:
    """Enthalpy of moist air [J/kg] above 0 degC, at a temperature [K] and humidity ratio [kg/kg].

    ASHRAE Fundamentals 2017, ch. 1, eq. 30.
    """
    degrees = temperature - _FREEZING
    return 1006.0 * degrees + humidity * (2.501e6 + 1860.0 * degrees)


def saturated_temperature(ops: Operations, saturated: Value, pressure: float) -> Value:
    """Temperature [K] at which air of a pressure [Pa] has an enthalpy [J/kg] when it is saturated.

    Newton's rule from a fit that is within 2 K from 0 to 40 degC, four times: within 1e-6 K from -10 to 45 degC.
    """
    saturated = ops.maximum(saturated, _LEAST_SATURATED, 1e3)
    temperature = _FREEZING + 20.7 * (ops.log(saturated + 17e3) - 10.184)
    for _ in range(4):
        vapour, degrees = _saturation_pressure(ops, temperature), temperature - _FREEZING
        humidity = _MOLAR_RATIO * vapour / (pressure - vapour)
        steepness = humidity * pressure / (pressure - vapour) * 17.625 * 243.04 / (degrees + 243.04) ** 2
        slope = 1006.0 + 1860.0 * humidity + (2.501e6 + 1860.0 * degrees) * steepness
        temperature = temperature - (enthalpy(temperature, humidity) - saturated) / slope
    return temperature


def wet_bulb(ops: Operations, temperature: Value, humidity: Value, pressure: float) -> Value:
    """Wet-bulb temperature [K] of air at a temperature [K], humidity ratio [kg/kg] and pressure [Pa].

    Stull (2011), doi:10.1175/JAMC-D-11-0143.1: within 1 K, mostly 0.3 K, at 5 to 99 % and -20 to 50 degC at sea level.
    """
    vapour = pressure * humidity / (_MOLAR_RATIO + humidity)
    share = 100.0 * vapour / _saturation_pressure(ops, temperature)
    percent = ops.clip(share, 5.0, 99.0)
    degrees = temperature - _FREEZING
    root = ops.sqrt(percent)
    return (
        _FREEZING
        + degrees * ops.arctan(0.151977 * ops.sqrt(percent + 8.313659))
        + ops.arctan(degrees + percent)
        - ops.arctan(percent - 1.676331)
        + 0.00391838 * percent * root * ops.arctan(0.023101 * percent)
        - 4.686035
    )
