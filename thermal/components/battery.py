"""A battery that a controller charges and discharges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from thermal.components.component import Actuator, Component, Conditions, Given, Port, Range, State
from thermal.components.energy_balance import EnergyBalance
from thermal.components.operations import Operations, Value


class BatteryStep(NamedTuple):
    """What a battery did in a step.

    Parameters
    ----------
    charge_level : Value
        Energy in it over its capacity, at the end [-].
    electric_power : Value
        Into it; negative while it discharges [W].
    storage, loss : Value
        Kept in it, and given off as heat to the plant room [W].
    """

    charge_level: Value
    electric_power: Value
    storage: Value
    loss: Value


@dataclass(frozen=True)
class Battery(Component):
    """A battery with its inverter.

    Parameters
    ----------
    capacity : float
        Energy between empty and full [J], positive.
    power : float
        Largest electric power either way [W], positive.
    charging, discharging : float
        Efficiencies [-]; the defaults make 0.9 there and back, usual for lithium ions with an inverter (NREL/TP-6A20-
        85332, Annual Technology Baseline: 0.85).

    Notes
    -----
    ``E = E_before + (eta_c P_in - P_out / eta_d) dt``, with the share of `power` that is commanded as far as there is
    room, or energy: exact for constant power, so a step may be of any length.
    """

    label, device = "battery", "battery"
    ports = (Port("electric_power", "electricity", "W"),)
    states = (State("charge_level", "-", 0.0, 1.0, 0.5),)
    actuators = (Actuator("battery_command", "-", -1.0, 1.0, (-1.0, 1.0), 0.0),)
    sensors = ("electrical_power_sensor",)

    capacity: Annotated[float, Range("J", 1e3, 1e13)]
    power: Annotated[float, Range("W", 1.0, 1e8)]
    charging: Annotated[float, Range("-", 0.5, 1.0)] = 0.95
    discharging: Annotated[float, Range("-", 0.5, 1.0)] = 0.95

    @classmethod
    def sized(cls, floor_area: float) -> Battery:
        """Size a battery by the floor it serves: 0.1 kWh/m2, empty in two hours (a house of 100 m2 has 10 kWh).

        Parameters
        ----------
        floor_area : float
            Of the building [m2].
        """
        return cls(0.1 * 3.6e6 * floor_area, 50.0 * floor_area)

    def run(self, ops: Operations, given: Given) -> BatteryStep:
        """Charge or discharge as commanded, as far as it goes.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            The command, and how full it is.
        """
        before, seconds = given.state["charge_level"], given.seconds
        wanted = self.power * given.actions["battery_command"]
        room = (1.0 - before) * self.capacity / (self.charging * seconds)
        left = before * self.capacity * self.discharging / seconds
        into = ops.clip(wanted, 0.0, ops.minimum(room, self.power, self.power), self.power)
        out = ops.clip(-wanted, 0.0, ops.minimum(left, self.power, self.power), self.power)
        storage = self.charging * into - out / self.discharging
        level = before + storage * seconds / self.capacity
        return BatteryStep(level, into - out, storage, into - out - storage)

    def energy(self, conditions: Conditions, done: BatteryStep) -> EnergyBalance:
        """Where the energy of a step went.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : BatteryStep
            What `run` returned.
        """
        return EnergyBalance(electricity=done.electric_power, plant_room=done.loss, storage=done.storage)

    def read(self, ops: Operations, given: Given, done: BatteryStep) -> list[Value]:
        """Values of its points.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : BatteryStep
            What `run` returned.
        """
        return [done.electric_power]
