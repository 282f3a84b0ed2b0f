"""Air handlers: economiser, cooling and heating coil, fans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from thermal.errors import ModelError, describe
from thermal.hvac._air import enthalpy
from thermal.hvac._checks import fields_in_range
from thermal.hvac._coil import WaterCoil, water_share
from thermal.hvac._cooling import CoolingCoil
from thermal.hvac._fan import Fan
from thermal.hvac._operations import Operations, Value
from thermal.units import AIR_HEAT_CAPACITY

_LEAST = 1e-9


@dataclass(frozen=True)
class Heater:
    """A coil that heats air by itself: a gas burner or electric resistance.

    Parameters
    ----------
    capacity : float
        Largest heat into the air [W], positive.
    efficiency : float
        Heat over fuel or electric power [-], 0.5 to 1. The default is the Medium Office's gas coil.
    electric : bool
        True for electric resistance.
    """

    capacity: float
    efficiency: float = 0.8
    electric: bool = False

    def __post_init__(self) -> None:
        fields_in_range(
            self,
            {
                "capacity": ("W", 1e-3, 1e8),
                "efficiency": ("-", 0.5, 1.0),
            },
        )


class Mixed(NamedTuple):
    """Air on its way through an air handler, up to its heating coil.

    Parameters
    ----------
    flow : Value
        Supply air [kg/s].
    outdoor_flow : Value
        Outdoor air in, and exhaust air out [kg/s].
    return_temperature, mixed_temperature, cooled_temperature : Value
        Of the return air, behind the mixing box, behind the cooling coil [K].
    return_humidity, supply_humidity : Value
        Of the same air, and of the supply air [kg/kg].
    target : Value
        Temperature wanted in front of the fan [K].
    sensible, latent : Value
        Cooling of the air [W].
    cooling_power, supply_fan_power, exhaust_fan_power : Value
        Electric [W].
    fan_rise : Value
        Rise of the air's temperature in the supply fan [K].
    coil : Value
        Conductance of the heating coil with its valve open [W/K].
    """

    flow: Value
    outdoor_flow: Value
    return_temperature: Value
    mixed_temperature: Value
    cooled_temperature: Value
    return_humidity: Value
    supply_humidity: Value
    target: Value
    sensible: Value
    latent: Value
    cooling_power: Value
    supply_fan_power: Value
    exhaust_fan_power: Value
    fan_rise: Value
    coil: Value


class Warmed(NamedTuple):
    """What a heating coil does: supply air of ``offset + slope * water`` [K].

    Parameters
    ----------
    offset : Value
        Supply temperature but for what the water brings [K].
    slope : Value
        Share of the water's temperature in it [-].
    conductance : Value
        Of the water coil, with its valve as it stands [W/K].
    flow_share : Value
        Water over that of the open valve [-].
    direct : Value
        Heat of a coil that is no water coil [W].
    """

    offset: Value
    slope: Value
    conductance: Value
    flow_share: Value
    direct: Value


@dataclass(frozen=True)
class AirHandler:
    """An air handler: mixing box with economiser, cooling coil, heating coil, supply fan, exhaust fan.

    Parameters
    ----------
    supply_fan : Fan
        Behind the coils.
    exhaust_fan : Fan, optional
        In the exhaust, which carries what comes in from outdoors.
    cooling : CoolingCoil, optional
        None where air is not cooled.
    heating : WaterCoil or Heater, optional
        None where air is not heated.
    minimum_outdoor_share : float
        Least share of outdoor air in the supply air [-], 0 to 1. The default is usual for offices (ASHRAE 62.1-2019).
    minimum_outdoor_flow : float
        Least outdoor air [kg/s], as far as that much is supplied.
    economizer : bool
        Whether outdoor air is used for cooling (dry bulb: when it is colder than the return air).
    high_limit, low_limit : float
        Outdoor temperatures outside of which the economiser stays at its minimum [K]. The high one is the reference
        buildings' 28 degC.
    enthalpy_limit : float, optional
        Enthalpy of the outdoor air above which it stays at its minimum too [J/kg], from 0 degC; none by default, the
        reference buildings have 64,000.

    Notes
    -----
    Supply and return are balanced: what comes in from outdoors goes out through the exhaust.
    """

    supply_fan: Fan
    exhaust_fan: Fan | None = None
    cooling: CoolingCoil | None = None
    heating: WaterCoil | Heater | None = None
    minimum_outdoor_share: float = 0.2
    minimum_outdoor_flow: float = 0.0
    economizer: bool = True
    high_limit: float = 301.15
    low_limit: float = 173.15
    enthalpy_limit: float | None = None

    def __post_init__(self) -> None:
        fields_in_range(
            self,
            {
                "minimum_outdoor_share": ("-", 0.0, 1.0),
                "minimum_outdoor_flow": ("kg/s", 0.0, 1e4),
                "high_limit": ("K", 173.15, 330.0),
                "low_limit": ("K", 173.15, self.high_limit),
            },
        )
        if self.enthalpy_limit is not None:
            fields_in_range(self, {"enthalpy_limit": ("J/kg", 0.0, 2e5)})
        if self.heating is not None and not isinstance(self.heating, WaterCoil | Heater):
            found = type(self.heating).__name__
            raise ModelError(describe("AirHandler.heating", "a WaterCoil, a Heater or None", found))

    def outdoor_share(
        self,
        ops: Operations,
        flow: Value,
        returning: Value,
        outdoor: Value,
        target: Value,
        ventilation: Value = 1.0,
        outdoor_humidity: Value = 0.0,
    ) -> Value:
        """Share of outdoor air in the supply air [-], 0 to 1.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        flow : Value
            Supply air [kg/s].
        returning, outdoor, target : Value
            Temperatures of the return air, outdoors, and wanted in front of the coils [K].
        ventilation : Value
            Share of the minimum of outdoor air that is asked for [-].
        outdoor_humidity : Value
            Of the outdoor air [kg/kg].
        """
        least: Value = self.minimum_outdoor_share
        if self.minimum_outdoor_flow:
            least = ops.minimum(ops.maximum(least, self.minimum_outdoor_flow / (flow + _LEAST)), 1.0)
        least = ventilation * least
        if not self.economizer:
            return least
        colder = ops.maximum(returning - outdoor, 0.01)
        free = ops.clip((returning - target) / colder, 0.0, 1.0)
        useful = ops.step(returning - outdoor) * ops.step(self.high_limit - outdoor)
        if self.low_limit > 173.15:
            useful = useful * ops.step(outdoor - self.low_limit)
        if self.enthalpy_limit is not None:
            held = enthalpy(outdoor, outdoor_humidity)
            useful = useful * ops.step(self.enthalpy_limit - held, 1000.0)
        return least + useful * ops.positive(free - least)

    def mix(
        self,
        ops: Operations,
        flow: Value,
        running: Value,
        returning: Value,
        return_humidity: Value,
        outdoor: Value,
        outdoor_humidity: Value,
        setpoint: Value,
        static_pressure: Value,
        opening: Value,
        ventilation: Value = 1.0,
    ) -> Mixed:
        """Mix return and outdoor air, cool what is too warm, and drive it.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        flow : Value
            Supply air [kg/s].
        running : Value
            1 while the fans run, else 0 [-].
        returning, return_humidity : Value
            Of the return air [K], [kg/kg].
        outdoor, outdoor_humidity : Value
            Of the outdoor air [K], [kg/kg].
        setpoint : Value
            Of the supply air behind the fan [K].
        static_pressure : Value
            Setpoint in the duct [Pa].
        opening : Value
            Water through the open valve of the heating coil over the design flow [-].
        ventilation : Value
            Share of the minimum of outdoor air that is asked for [-].
        """
        rate = AIR_HEAT_CAPACITY * flow + _LEAST
        power = running * self.supply_fan.power(ops, flow, static_pressure)
        rise = self.supply_fan.heat_to_air * power / rate
        target = setpoint - rise
        share = self.outdoor_share(ops, flow, returning, outdoor, target, ventilation, outdoor_humidity)
        mixed = returning + share * (outdoor - returning)
        humidity = return_humidity + share * (outdoor_humidity - return_humidity)
        exhaust = self.exhaust_fan
        exhaust_power = 0.0 if exhaust is None else exhaust.power(ops, share * flow, exhaust.static_pressure) * running
        cooled, supplied, sensible, latent, cooling_power = mixed, humidity, 0.0, 0.0, 0.0
        if self.cooling is not None:
            cooled, supplied, sensible, latent, cooling_power = self.cooling.cool(
                ops, flow, mixed, humidity, target, outdoor
            )
        coil = self.heating.conductance(ops, flow, opening) if isinstance(self.heating, WaterCoil) else 0.0
        return Mixed(
            flow, share * flow, returning, mixed, cooled, return_humidity, supplied, target, sensible, latent,
            cooling_power, power, exhaust_power, rise, coil,
        )  # fmt: skip

    def warm(self, ops: Operations, mixed: Mixed, water: Value, opening: Value) -> Warmed:
        """Heat air that is too cold.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        mixed : Mixed
            Air in front of the heating coil.
        water : Value
            Temperature of the supply water that the valve is set for [K].
        opening : Value
            Water through an open valve over the design flow [-].
        """
        rate = AIR_HEAT_CAPACITY * mixed.flow + _LEAST
        entering = mixed.cooled_temperature
        if self.heating is None:
            return Warmed(entering + mixed.fan_rise, 0.0, 0.0, 0.0, 0.0)
        wanted = rate * ops.positive(mixed.target - entering)
        if isinstance(self.heating, Heater):
            direct = ops.minimum(wanted, self.heating.capacity, 0.1 * self.heating.capacity)
            return Warmed(entering + direct / rate + mixed.fan_rise, 0.0, 0.0, 0.0, direct)
        open_ = mixed.coil
        throttled = ops.capped(wanted / ops.maximum(water - entering, _LEAST), open_, 25.0)
        slope = throttled / rate
        valve = water_share(throttled, open_, self.heating.water_side(ops, opening).curve)
        return Warmed(entering * (1.0 - slope) + mixed.fan_rise, slope, throttled, valve, 0.0)
