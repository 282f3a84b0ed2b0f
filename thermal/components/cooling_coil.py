"""Cooling coil and what cools it: sensible and latent load, chiller or direct expansion, coefficient of performance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from thermal.components.component import Component, Port, Range
from thermal.components.curves import (
    CHILLER_CAPACITY,
    CHILLER_INPUT,
    CHILLER_PART_LOAD,
    DX_CAPACITY,
    DX_INPUT,
    DX_PART_LOAD,
    Biquadratic,
    Polynomial,
    celsius,
)
from thermal.components.moist_air import EVAPORATION_HEAT, dew_point, saturation_humidity, wet_bulb
from thermal.components.operations import Operations, Value
from thermal.errors import ModelError
from thermal.units import AIR_HEAT_CAPACITY

_LEAST = 1e-9  # J/kg


class Cooled(NamedTuple):
    """Air behind a cooling coil, and what it took.

    Parameters
    ----------
    temperature : Value
        Of the air that leaves [K].
    humidity : Value
        Of that air [kg/kg].
    sensible, latent : Value
        Heat taken from the air [W], not negative.
    power : Value
        Electric power of compressor and auxiliaries [W].
    """

    temperature: Value
    humidity: Value
    sensible: Value
    latent: Value
    power: Value


@dataclass(frozen=True)
class CoolingCoil(Component):
    """A cooling coil with its chiller or condensing unit.

    Parameters
    ----------
    capacity : float
        Rated total cooling [W], positive, at 19.4 degC wet bulb and 35 degC outdoors.
    cop : float
        Rated coefficient of performance [-], 1 to 10. The default is the Medium Office's.
    bypass : float
        Share of the air that passes without touching the coil [-], 0 to 0.5. The default is that of four to six rows
        (ASHRAE Handbook, HVAC Systems and Equipment 2016, ch. 23).
    coldest : float
        Lowest temperature of the coil's surface [K]. The default is that of chilled water at 6.7 degC.
    lockout : float
        Outdoor temperature below which the compressor stays off [K]; none by default.
    chilled_water : float, optional
        Temperature of chilled water [K], which the curves then take as x; None for direct expansion, where x is the
        wet bulb of the air that enters.
    auxiliaries : float
        Electric power of chilled-water pumps and tower per cooling [-], 0 to 0.3.
    capacity_curve, input_curve : Biquadratic
        Capacity and energy input over the rated ones, of x and the outdoor temperature [degC].
    part_load : Polynomial
        Energy input over that at full load, by part-load ratio. Below the lowest ratio of its range the compressor
        cycles; a curve that begins at 0 must be 0 there.
    pressure : float
        Of the air [Pa], 50,000 to 110,000.

    Notes
    -----
    Sensible heat: ``C (T_in - T_out)``, as far as ``C (1 - bypass) (T_in - coldest)`` and the capacity go. Latent heat
    by the apparatus dew point ``T_adp = (T_out - bypass T_in) / (1 - bypass)``: the air that touches the coil leaves
    saturated at T_adp or as dry as it came. Power ``Q_available / COP * EIR(x, T_outdoor) * f(part load)``, never below
    Carnot's between the coil and outdoors.
    """

    ports = (Port("air", "air", "kg/s"), Port("power", "electricity", "W"))

    capacity: Annotated[float, Range("W", 1e-3, 1e8)]
    cop: Annotated[float, Range("-", 1.0, 10.0)] = 3.23372
    bypass: Annotated[float, Range("-", 0.0, 0.5)] = 0.1
    coldest: Annotated[float, Range("K", 268.15, 293.15)] = 279.85
    lockout: Annotated[float, Range("K", 0.0, 300.0)] = 0.0
    chilled_water: Annotated[float, Range("K", 268.15, 293.15)] | None = None
    auxiliaries: Annotated[float, Range("-", 0.0, 0.3)] = 0.0
    capacity_curve: Biquadratic = DX_CAPACITY
    input_curve: Biquadratic = DX_INPUT
    part_load: Polynomial = DX_PART_LOAD
    pressure: Annotated[float, Range("Pa", 5e4, 1.1e5)] = 101_325.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.part_load.lowest <= 0.0 and self.part_load.coefficients[0] != 0.0:
            expected = "0 at no load, or a range that begins above 0"
            raise ModelError("CoolingCoil.part_load", expected, f"{self.part_load.coefficients[0]:g} at no load")

    @classmethod
    def chilled(
        cls, capacity: float, cop: float = 3.0, *, chilled_water: float = 279.82, auxiliaries: float = 0.05
    ) -> CoolingCoil:
        """Make a coil of an air-cooled reciprocating chiller, whose COP goes with outdoor temperature and part load.

        Parameters
        ----------
        capacity : float
            Cooling at 6.67 degC of chilled water and 29.4 degC outdoors [W], positive.
        cop : float
            Coefficient of performance there [-], 1 to 10; the default is near ASHRAE 90.1-2016's least (table 6.8.1-3,
            2.985).
        chilled_water : float
            Temperature of the chilled water [K]; the default is the rated one.
        auxiliaries : float
            Electric power of condenser fans and chilled-water pump per cooling [-]; the default has the 0.035 of
            EnergyPlus' template for the fans, and a pump.

        Returns
        -------
        CoolingCoil
            With the curves `CHILLER_CAPACITY`, `CHILLER_INPUT` and `CHILLER_PART_LOAD`; the coil's surface is no colder
            than the water.

        Examples
        --------
        >>> CoolingCoil.chilled(50_000.0).part_load.lowest
        0.25
        """
        return cls(
            capacity, cop, coldest=chilled_water, chilled_water=chilled_water, auxiliaries=auxiliaries,
            capacity_curve=CHILLER_CAPACITY, input_curve=CHILLER_INPUT, part_load=CHILLER_PART_LOAD,
        )  # fmt: skip

    def cool(
        self, ops: Operations, flow: Value, temperature: Value, humidity: Value, target: Value, outdoor: Value
    ) -> Cooled:
        """Cool air towards a temperature.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        flow : Value
            Air through the coil [kg/s].
        temperature, humidity : Value
            Of the air that enters [K], [kg/kg].
        target : Value
            Temperature wanted behind the coil [K].
        outdoor : Value
            Outdoor temperature [K].
        """
        allowed = ops.step(outdoor - self.lockout) if self.lockout else 1.0
        most = (1.0 - self.bypass) * ops.positive(temperature - self.coldest)
        drop = allowed * ops.clip(temperature - target, 0.0, most)
        if ops.surely_below(drop, 0.0):
            return Cooled(temperature, humidity, 0.0, 0.0, 0.0)
        # mist does not condense on a coil that is no colder than its air
        vapour = ops.minimum(humidity, saturation_humidity(ops, temperature, self.pressure), 1e-3)
        loss = self._loss(ops, temperature, vapour, drop)
        water = self.chilled_water
        x = celsius(wet_bulb(ops, temperature, humidity, self.pressure) if water is None else water)
        available = self.capacity * self.capacity_curve(ops, x, celsius(outdoor))
        if not ops.surely_below(flow * (AIR_HEAT_CAPACITY * drop + EVAPORATION_HEAT * loss), available):
            drop = ops.minimum(drop, self._deepest(ops, temperature, vapour, most, available / flow))
            loss = self._loss(ops, temperature, vapour, drop)
        sensible, latent = AIR_HEAT_CAPACITY * flow * drop, EVAPORATION_HEAT * flow * loss
        total = sensible + latent
        ratio, least = total / available, self.part_load.lowest
        power = available / self.cop * self.input_curve(ops, x, celsius(outdoor)) * self.part_load(ops, ratio)
        if least > 0.0:
            power = power * ops.minimum(ratio / least, 1.0)
        surface = temperature - drop / (1.0 - self.bypass)
        carnot = total * ops.positive(outdoor - surface) / surface
        power = ops.maximum(power, carnot, 0.01 * self.capacity) + self.auxiliaries * total
        return Cooled(temperature - drop, humidity - loss, sensible, latent, power)

    def _loss(self, ops: Operations, temperature: Value, humidity: Value, drop: Value) -> Value:
        """Fall of the humidity ratio [kg/kg] that goes with a fall of the temperature [K]."""
        dew = saturation_humidity(ops, temperature - drop / (1.0 - self.bypass), self.pressure)
        return (1.0 - self.bypass) * ops.positive(humidity - dew, 1e-3)

    def _deepest(self, ops: Operations, temperature: Value, humidity: Value, most: Value, heat: Value) -> Value:
        """Fall of the air's temperature [K] that the capacity per air, `heat` [J/kg], allows, up to `most` [K].

        Heat over fall is a straight line down to the dew point and nearly one below it: three chords of that part, each
        from the end of the one before, find where it reaches the capacity within some hundredths. What is wanted has no
        part in it, so that wanting more never brings less.
        """
        dew = (1.0 - self.bypass) * ops.positive(temperature - dew_point(ops, humidity, self.pressure))
        dry = ops.minimum(dew, most)
        spare = ops.positive(heat - AIR_HEAT_CAPACITY * dry, 1000.0)
        deepest = most
        for _ in range(3):
            latent = EVAPORATION_HEAT * self._loss(ops, temperature, humidity, deepest)
            wet = ops.positive(deepest - dry)
            chord = wet / (AIR_HEAT_CAPACITY * wet + latent + _LEAST)
            deepest = ops.minimum(deepest, dry + spare * chord)
        return ops.minimum(deepest, heat / AIR_HEAT_CAPACITY)
