"""Where the energy of a step goes."""

from __future__ import annotations

from typing import NamedTuple

from thermal.hvac._air import EVAPORATION_HEAT
from thermal.hvac._air_handler import Heater
from thermal.hvac._operations import Value
from thermal.hvac._step import Conditions, HvacStep
from thermal.hvac._system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY


class EnergyBalance(NamedTuple):
    """Energy into the plant and out of it; means over a step.

    Parameters
    ----------
    electricity, fuel : Value
        Taken up [W].
    zones : Value
        Heat into the zones' air [W].
    moisture : Value
        Latent heat of the water vapour that the supply air brings into the zones; negative where it is dried [W].
    exhaust : Value
        What the exhaust carries away beyond what the outdoor air brought in, with the heat of its fan [W].
    condenser : Value
        Rejected by the refrigeration outdoors [W].
    flue : Value
        Up the chimneys of boiler and gas coils [W].
    plant_room : Value
        From pipes, jacket and motors into the plant room [W].
    storage : Value
        Kept in the water of the loop [W].
    """

    electricity: Value
    fuel: Value
    zones: Value
    moisture: Value
    exhaust: Value
    condenser: Value
    flue: Value
    plant_room: Value
    storage: Value

    @property
    def residual(self) -> Value:
        """What goes in and neither comes out nor stays [W]."""
        out = self.zones + self.moisture + self.exhaust + self.condenser + self.flue + self.plant_room + self.storage
        return self.electricity + self.fuel - out

    @property
    def turnover(self) -> Value:
        """Sum of all terms' sizes [W], which a residual is to be compared with."""
        return sum(abs(term) for term in self)


def energy_balance(system: HvacSystem, conditions: Conditions, step: HvacStep) -> EnergyBalance:
    """Add up where the energy of a step went, from its flows and temperatures.

    Parameters
    ----------
    system : HvacSystem
        The plant.
    conditions : Conditions
        That it met.
    step : HvacStep
        What it did.

    Returns
    -------
    EnergyBalance
        Closes to round-off.
    """
    pump_loss = (1.0 - system.loop.pump.heat_to_water) * step.pump_power
    electricity, fuel_coils = step.pump_power, 0.0
    flue: Value = 0.0
    moisture: Value = 0.0
    exhaust: Value = 0.0
    condenser: Value = 0.0
    motors: Value = 0.0
    for handler, m, w in zip(system.air_handlers, step.mixed, step.warmed, strict=True):
        electricity = electricity + m.cooling_power + m.supply_fan_power + m.exhaust_fan_power
        motors = motors + (1.0 - handler.supply_fan.heat_to_air) * m.supply_fan_power
        moisture = moisture + EVAPORATION_HEAT * m.flow * (m.supply_humidity - m.return_humidity)
        warmth = AIR_HEAT_CAPACITY * (m.return_temperature - conditions.outdoor_temperature)
        damp = EVAPORATION_HEAT * (m.return_humidity - conditions.outdoor_humidity)
        exhaust = exhaust + m.outdoor_flow * (warmth + damp) + m.exhaust_fan_power
        condenser = condenser + m.sensible + m.latent + m.cooling_power
        if isinstance(handler.heating, Heater):
            taken = w.direct / handler.heating.efficiency
            flue = flue + taken - w.direct
            if handler.heating.electric:
                electricity = electricity + taken
            else:
                fuel_coils = fuel_coils + taken
    flue = flue + (step.fuel_power - fuel_coils) - step.loop.boiler
    zones = step.terminal_heat.sum(axis=-1)
    room = step.loop.loss + pump_loss + motors
    return EnergyBalance(
        electricity, step.fuel_power, zones, moisture, exhaust, condenser, flue, room, step.loop.storage
    )
