"""Air handlers: economiser, cooling and heating coil, fans."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from thermal.components.checks import in_range
from thermal.components.component import Actuator, Component, Conditions, Given, Port, Range, Run
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.energy_balance import EnergyBalance
from thermal.components.fan import Fan
from thermal.components.heater import Heater
from thermal.components.moist_air import EVAPORATION_HEAT, enthalpy
from thermal.components.operations import Operations, Value
from thermal.components.streams import AirCommand, AirDrawn, Duct, HotWater, SupplyAir, SupplyWater, WaterDrawn
from thermal.components.water_coil import WaterCoil, water_share
from thermal.errors import ModelError
from thermal.units import AIR_HEAT_CAPACITY

_LEAST = 1e-9


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


class AirHandlerStep(NamedTuple):
    """What an air handler did in a step; powers are means over it.

    Parameters
    ----------
    mixed : Mixed
        Its air, up to the heating coil.
    warmed : Warmed
        Its heating coil, valve set.
    electric_power, fuel_power : Value
        Taken up [W].
    water : Value
        Supply water at the end of the step [K]; 0 where no coil takes any.
    """

    mixed: Mixed
    warmed: Warmed
    electric_power: Value
    fuel_power: Value
    water: Value

    @property
    def supply_temperature(self) -> Value:
        """Supply air [K]."""
        return self.warmed.offset + self.warmed.slope * self.water


@dataclass(frozen=True)
class AirHandler(Component):
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

    label, device = "air handler", "ahu"
    ports = (
        Port("supply_air", "air", "kg/s", supplies=True),
        Port("hot_water", "water", "kg/s"),
        Port("electric_power", "electricity", "W"),
        Port("fuel_power", "fuel", "W"),
    )
    actuators = (
        Actuator("supply_air_temperature_setpoint", "K", 273.15, 333.15, (285.0, 300.0)),  # as in the paper's simulator
        Actuator("supply_air_static_pressure_setpoint", "Pa", 1.0, 2500.0, (25.0, 1000.0), "design_pressure"),
        Actuator("fan_running", "-", 0.0, 1.0, default=1.0),
        Actuator("ventilation", "-", 0.0, 1.0, default=1.0),
    )
    sensors = (
        "supply_air_temperature_setpoint", "supply_air_temperature_sensor", "mixed_air_temperature_sensor",
        "return_air_temperature_sensor", "outside_air_temperature_sensor", "supply_fan_power_sensor",
        "electrical_power_sensor", "gas_power_sensor", "supply_air_static_pressure_setpoint",
        "supply_air_static_pressure_sensor",
    )  # fmt: skip

    supply_fan: Fan
    exhaust_fan: Fan | None = None
    cooling: CoolingCoil | None = None
    heating: WaterCoil | Heater | None = None
    minimum_outdoor_share: Annotated[float, Range("-", 0.0, 1.0)] = 0.2
    minimum_outdoor_flow: Annotated[float, Range("kg/s", 0.0, 1e4)] = 0.0
    economizer: bool = True
    high_limit: Annotated[float, Range("K", 173.15, 330.0)] = 301.15
    low_limit: Annotated[float, Range("K", 173.15, 330.0)] = 173.15
    enthalpy_limit: Annotated[float, Range("J/kg", 0.0, 2e5)] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        in_range("AirHandler.low_limit", self.low_limit, "K", 173.15, self.high_limit)
        if self.heating is not None and not isinstance(self.heating, WaterCoil | Heater):
            raise ModelError("AirHandler.heating", "a WaterCoil, a Heater or None", type(self.heating).__name__)

    @property
    def connectors(self) -> tuple[Port, ...]:
        """Supply air, and hot water where there is a coil for it."""
        return tuple(p for p in super().connectors if p.supplies or isinstance(self.heating, WaterCoil))

    @property
    def design_pressure(self) -> float:
        """Static pressure in the duct that holds where none is set [Pa]."""
        return self.supply_fan.static_pressure

    def run(self, ops: Operations, given: Given) -> Run:
        """Hear what air is drawn, mix, cool, warm and supply it.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Commands and weather.
        """
        command = AirCommand(**given.actions)
        pressure = command.supply_air_static_pressure_setpoint
        given.put("supply_air", Duct(command.fan_running * ops.sqrt(pressure / self.design_pressure)))
        coil = self.heating if isinstance(self.heating, WaterCoil) else None
        water: HotWater | None = (yield "hot_water") if coil else None
        drawn: AirDrawn = yield "supply_air"
        mixed = self.mix(ops, drawn, given.conditions, command, water.opening if water else 1.0)
        warmed = self.warm(ops, mixed, water.warmest if water else 0.0, water.opening if water else 1.0)
        given.put("supply_air", SupplyAir(warmed.offset, warmed.slope))
        end = SupplyWater(0.0)
        if coil:
            source = warmed.conductance * mixed.cooled_temperature
            given.put("hot_water", WaterDrawn(warmed.conductance, source, warmed.flow_share * coil.water_flow))
            end = yield "hot_water"
        return AirHandlerStep(mixed, warmed, *self.powers(mixed, warmed), end.temperature)

    def powers(self, mixed: Mixed, warmed: Warmed) -> tuple[Value, Value]:
        """Electric and fuel power [W].

        Parameters
        ----------
        mixed, warmed : Mixed, Warmed
            Air and heating coil [as there].
        """
        electric, fuel = self.heating.power(warmed.direct) if isinstance(self.heating, Heater) else (0.0, 0.0)
        return mixed.cooling_power + mixed.supply_fan_power + mixed.exhaust_fan_power + electric, fuel

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
        self, ops: Operations, drawn: AirDrawn, conditions: Conditions, command: AirCommand, opening: Value
    ) -> Mixed:
        """Mix return and outdoor air, cool what is too warm, and drive it.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        drawn : AirDrawn
            Supply air, and warmth of the return air.
        conditions : Conditions
            Outdoor air, and humidity of the return air.
        command : AirCommand
            Setpoints and switches.
        opening : Value
            Water through the open valve of the heating coil over the design flow [-].
        """
        flow, running = drawn.flow, command.fan_running
        returning, return_humidity = drawn.warmth / flow, conditions.return_humidity
        outdoor, outdoor_humidity = conditions.outdoor_temperature, conditions.outdoor_humidity
        rate = AIR_HEAT_CAPACITY * flow + _LEAST
        power = running * self.supply_fan.power(ops, flow, command.supply_air_static_pressure_setpoint)
        rise = self.supply_fan.heat_to_air * power / rate
        target = command.supply_air_temperature_setpoint - rise
        share = self.outdoor_share(ops, flow, returning, outdoor, target, command.ventilation, outdoor_humidity)
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
            direct = self.heating.heat(ops, wanted)
            return Warmed(entering + direct / rate + mixed.fan_rise, 0.0, 0.0, 0.0, direct)
        open_ = mixed.coil
        throttled = ops.capped(wanted / ops.maximum(water - entering, _LEAST), open_, 25.0)
        slope = throttled / rate
        valve = water_share(throttled, open_, self.heating.water_side(ops, opening).curve)
        return Warmed(entering * (1.0 - slope) + mixed.fan_rise, slope, throttled, valve, 0.0)

    def energy(self, conditions: Conditions, done: AirHandlerStep) -> EnergyBalance:
        """Where the energy of a step went.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : AirHandlerStep
            What `run` returned.
        """
        mixed = done.mixed
        warmth = AIR_HEAT_CAPACITY * (mixed.return_temperature - conditions.outdoor_temperature)
        damp = EVAPORATION_HEAT * (mixed.return_humidity - conditions.outdoor_humidity)
        electric, fuel = self.powers(mixed, done.warmed)
        return EnergyBalance(
            electricity=electric,
            fuel=fuel,
            moisture=EVAPORATION_HEAT * mixed.flow * (mixed.supply_humidity - mixed.return_humidity),
            exhaust=mixed.outdoor_flow * (warmth + damp) + mixed.exhaust_fan_power,
            condenser=mixed.sensible + mixed.latent + mixed.cooling_power,
            flue=sum(self.heating.power(done.warmed.direct)) - done.warmed.direct
            if isinstance(self.heating, Heater)
            else 0.0,
            plant_room=(1.0 - self.supply_fan.heat_to_air) * mixed.supply_fan_power,
        )

    def read(self, ops: Operations, given: Given, done: AirHandlerStep) -> list[Value]:
        """Values of its points.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : AirHandlerStep
            What `run` returned.
        """
        command, mixed = AirCommand(**given.actions), done.mixed
        held = command.supply_air_static_pressure_setpoint
        return [
            command.supply_air_temperature_setpoint, done.supply_temperature, mixed.mixed_temperature,
            mixed.return_temperature, given.conditions.outdoor_temperature, mixed.supply_fan_power,
            done.electric_power, done.fuel_power, held, command.fan_running * held,
        ]  # fmt: skip
