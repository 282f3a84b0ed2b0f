"""Cooling towers: how cold the condenser's water is, and what the fan takes for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from scipy.optimize import brentq

from thermal.components.component import Component, Port, Range
from thermal.components.moist_air import WATER_HEAT_CAPACITY, enthalpy, saturated_temperature, saturation_humidity
from thermal.components.operations import FloatOperations, Operations, Value
from thermal.units import AIR_HEAT_CAPACITY

_LITTLE = 10.0  # J/kg: with less the air's heat capacity is that where nothing is taken up
_PASSES = 3  # the air's heat capacity moves by less than 0.1 % in the last
_MOST = 1.5e5  # J/kg that the air takes up: beyond it a tower boils
_FREE = 0.1  # air and UA of free convection over those with the fan: EnergyPlus' defaults


class TowerStep(NamedTuple):
    """What a tower did in a step.

    Parameters
    ----------
    water_temperature : Value
        Of the water that leaves it for the condenser [K].
    power : Value
        Of the fan [W].
    duty : Value
        Share of the step that the fan ran [-].
    """

    water_temperature: Value
    power: Value
    duty: Value


@dataclass(frozen=True)
class CoolingTower(Component):
    """An open tower whose fan is on or off.

    Parameters
    ----------
    conductance : float
        UA at the design flows [W/K], positive.
    air_flow, water_flow : float
        Design flows [kg/s], positive.
    fan_power : float
        Of the fan [W].
    setpoint : float
        Temperature that the water is held at, as far as it goes [K]; the default is that of EnergyPlus' reference
        Large Office, 21.1 degC.
    pressure : float
        Of the air [Pa].

    Notes
    -----
    Merkel's model with moist air as a gas of equivalent heat capacity (ASHRAE's HVAC1 toolkit; as EnergyPlus'
    CoolingTower:SingleSpeed): ``c_e = (h_s(T_wb,out) - h_s(T_wb,in)) / (T_wb,out - T_wb,in)`` with ``h_s(T_wb,out) =
    h_s(T_wb,in) + Q / m_air``; ``UA_e = UA c_e / c_p``, counter flow, and ``Q = eps C_min (T_water,in - T_wb,in)``.
    Without fan a tenth of air and UA is left. The fan runs the share of time that holds the setpoint.
    """

    ports = (Port("power", "electricity", "W"),)

    conductance: Annotated[float, Range("W/K", 1.0, 1e8)]
    air_flow: Annotated[float, Range("kg/s", 1e-3, 1e5)]
    water_flow: Annotated[float, Range("kg/s", 1e-3, 1e5)]
    fan_power: Annotated[float, Range("W", 0.0, 1e7)]
    setpoint: Annotated[float, Range("K", 278.15, 318.15)] = 294.25
    pressure: Annotated[float, Range("Pa", 5e4, 1.1e5)] = 101_325.0

    @classmethod
    def sized(cls, rejected: float) -> CoolingTower:
        """Size a tower: 35 to 29.4 degC of water at a wet bulb of 25.6 degC (CTI's and EnergyPlus' conditions).

        Parameters
        ----------
        rejected : float
            Heat [W].
        """
        # EnergyPlus' rules: fan power is 0.0105 of the capacity, and moves the air against 190 Pa at half efficiency
        power = 0.0105 * rejected
        air, water = 1.2 * 0.5 * power / 190.0, rejected / (5.6 * WATER_HEAT_CAPACITY)
        design = dict(air_flow=air, water_flow=water, fan_power=power)
        ops, wet = FloatOperations(), 298.75
        found = brentq(
            lambda c: cls(c, **design)._leaving(ops, rejected, wet, 1.0) - 302.55, 0.05 * rejected, 5.0 * rejected
        )
        return cls(float(found), **design)

    def _transfer(self, ops: Operations, rejected: Value, wet_bulb: Value, share: float) -> Value:
        """Heat per difference between water and wet bulb that enter, with a share of air and UA [W/K]."""
        water, air = WATER_HEAT_CAPACITY * self.water_flow, share * self.air_flow
        start = enthalpy(wet_bulb, saturation_humidity(ops, wet_bulb, self.pressure))
        taken = ops.clip(rejected / air, _LITTLE, _MOST, 1e3)
        heat_capacity = taken / (saturated_temperature(ops, start + taken, self.pressure) - wet_bulb)
        least, most = ops.ordered(air * heat_capacity, water)
        ratio = 0.999 * least / most
        decay = ops.exp(-share * self.conductance * heat_capacity / (AIR_HEAT_CAPACITY * least) * (1.0 - ratio))
        return (1.0 - decay) / (1.0 - ratio * decay) * least

    def _leaving(self, ops: Operations, rejected: Value, wet_bulb: Value, share: float) -> Value:
        """Water that leaves with a share of air and UA [K]."""
        water = WATER_HEAT_CAPACITY * self.water_flow
        return wet_bulb + rejected / self._transfer(ops, rejected, wet_bulb, share) - rejected / water

    def cool(self, ops: Operations, rejected: Value, wet_bulb: Value) -> TowerStep:
        """Cool the condenser's water.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        rejected : Value
            Heat [W], not negative.
        wet_bulb : Value
            Wet bulb outdoors [K].
        """
        free, forced = (self._leaving(ops, rejected, wet_bulb, share) for share in (_FREE, 1.0))
        water = ops.minimum(free, ops.maximum(self.setpoint, forced))
        # with water that comes as warm as it does at the setpoint, what fan and free convection would reject
        lift = ops.positive(self.setpoint + rejected / (WATER_HEAT_CAPACITY * self.water_flow) - wet_bulb)
        still, blown = (self._rejected(ops, lift, wet_bulb, share) for share in (_FREE, 1.0))
        duty = ops.clip((rejected - still) / (blown - still + 1e-3 * self.conductance), 0.0, 1.0)
        return TowerStep(water, duty * self.fan_power, duty)

    def _rejected(self, ops: Operations, lift: Value, wet_bulb: Value, share: float) -> Value:
        """Heat that water of a temperature above the wet bulb [K] gives off, by three passes [W]."""
        found = share * self.conductance * lift
        for _ in range(_PASSES):
            found = self._transfer(ops, found, wet_bulb, share) * lift
        return found
