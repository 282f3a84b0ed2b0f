"""A tank of hot water in layers, between what makes the water hot and those that draw it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from thermal.components.component import Actuator, Component, Conditions, Given, Port, Range, Run, State
from thermal.components.energy_balance import EnergyBalance
from thermal.components.moist_air import WATER_DENSITY, WATER_HEAT_CAPACITY
from thermal.components.operations import Operations, Value
from thermal.components.pump import Pump
from thermal.components.streams import HotWater, SupplyWater, WaterDrawn

_LAYERS = 4
_PARTS = 4  # of a step, each by implicit Euler: at 5 minutes a layer's water does not change more than once in one
#: A temperature as ``a + b T`` of the water that charges.
Line = tuple[Value, Value]
_CONDUCTIVITY = 0.64  # W/m/K, of water at 50 degC (IAPWS)
_LITRES = 0.03  # m3 per kW: 30 l, within the 20 to 50 that makers of heat pumps ask for


class TankStep(NamedTuple):
    """What a tank did in a step.

    Parameters
    ----------
    layer_1_temperature, layer_2_temperature, layer_3_temperature, layer_4_temperature : Value
        At the end of the step, from the top [K].
    charge, load, loss, storage : Value
        Heat from what charges it, to those that draw, to the plant room, and kept [W].
    charge_flow, water_flow : Value
        Water that charges it, and through the pump to those that draw [kg/s].
    electric_power : Value
        Of that pump [W].
    """

    layer_1_temperature: Value
    layer_2_temperature: Value
    layer_3_temperature: Value
    layer_4_temperature: Value
    charge: Value
    load: Value
    loss: Value
    storage: Value
    charge_flow: Value
    water_flow: Value
    electric_power: Value


class TankFlows(NamedTuple):
    """What goes through a tank in a step.

    Parameters
    ----------
    charge : Value
        Water in at the top and out at the bottom [kg/s].
    draw : Value
        Water out at the top and in at the bottom [kg/s].
    conductance, source : Value
        Of the load, ``conductance * top - source`` [W/K], [W].
    """

    charge: Value
    draw: Value
    conductance: Value
    source: Value


@dataclass(frozen=True)
class StorageTank(Component):
    """A tank of four layers, charged at the top and drawn from at the top.

    Parameters
    ----------
    volume : float
        Of the water [m3], positive.
    charge_flow : float
        Most water that charges it, at the supplier's design pressure [kg/s].
    pump : Pump
        To those that draw.
    height : float
        Of the tank [m].
    loss : float
        Conductance to the plant room [W/K]; the default is 1.8 W/K, that of a tank of 300 l in class B (EU 812/2013:
        1.7 kWh a day at 45 K make 1.6 W/K).
    band : float
        Below its setpoint over which the flow that charges it rises [K].

    Notes
    -----
    Water moves from layer to layer by the difference of both flows, always from where it comes (upwind); layers conduct
    with that of still water, and where a lower one is warmer at the start of the step they mix. A step has four parts;
    in each the balances of all layers are taken at its end, solved together with what draws: unconditionally stable,
    and the tank's balance closes. Those that draw see the top's mean over the step. Four layers mix as four stirred
    tanks in a row do; EnergyPlus' WaterHeater:Stratified has the same equations, with more nodes if wanted.
    """

    label, device = "storage tank", "storage_tank"
    ports = (
        Port("charge", "water", "kg/s"), Port("hot_water", "water", "kg/s", supplies=True),
        Port("electric_power", "electricity", "W"),
    )  # fmt: skip
    states = tuple(State(f"layer_{k}_temperature", "K", 273.15, 373.15, 313.15) for k in range(1, _LAYERS + 1))
    actuators = (Actuator("tank_temperature_setpoint", "K", 278.15, 368.15, (298.15, 343.15), 318.15),)
    sensors = ("supply_water_temperature_sensor", "return_water_temperature_sensor", "pump_power_sensor")

    volume: Annotated[float, Range("m3", 1e-3, 1e4)]
    charge_flow: Annotated[float, Range("kg/s", 1e-4, 1e4)]
    pump: Pump
    height: Annotated[float, Range("m", 0.2, 20.0)] = 1.8
    loss: Annotated[float, Range("W/K", 0.0, 1e4)] = 1.8
    band: Annotated[float, Range("K", 0.1, 30.0)] = 3.0

    @classmethod
    def sized(cls, capacity: float, water_flow: float) -> StorageTank:
        """Size a tank for what charges it.

        Parameters
        ----------
        capacity : float
            Largest heat [W].
        water_flow : float
            Through the open valves of all that draw from it [kg/s].
        """
        volume = max(0.1, _LITRES * capacity / 1000.0)
        return cls(volume, water_flow, Pump(water_flow), loss=1.8 * (volume / 0.3) ** (2.0 / 3.0))

    def layers_end(
        self, ops: Operations, before: Sequence[Value], flows: TankFlows, room: Value, seconds: Value
    ) -> tuple[list[Line], list[Line]]:
        """Solve the layers' balances; their temperatures are ``a + b T`` of the water T that charges [K].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        before : sequence of Value
            Of any number of layers, from the top [K].
        flows : TankFlows
            Through the tank.
        room : Value
            Temperature of the plant room [K].
        seconds : Value
            Length of the step [s].

        Returns
        -------
        tuple of list
            Lines of the layers at the end of the step, and of their means over it.
        """
        n, rate = len(before), WATER_HEAT_CAPACITY
        mass = self.volume * WATER_DENSITY * rate * _PARTS / n / seconds
        down, up = (rate * ops.positive(sign * (flows.charge - flows.draw), 0.1) for sign in (1.0, -1.0))
        # exactly the difference, however smooth
        up = down - rate * (flows.charge - flows.draw)
        leak, still = self.loss / n, _CONDUCTIVITY * (self.volume / self.height) * n / self.height
        matrix = [[0.0] * n for _ in range(n)]
        for k in range(n):
            matrix[k][k] = mass + leak
        for k in range(n - 1):  # between a layer and the one below
            mixing = still + mass / _PARTS * ops.step(before[k + 1] - before[k], 0.1)
            matrix[k][k] += down + mixing
            matrix[k][k + 1] -= up + mixing
            matrix[k + 1][k + 1] += up + mixing
            matrix[k + 1][k] -= down + mixing
        matrix[0][0] += rate * flows.draw
        matrix[-1][-1] += rate * flows.charge
        matrix[-1][0] -= rate * flows.draw - flows.conductance
        lines: list[Line] = [(t, 0.0) for t in before]
        sums: list[Line] = [(0.0, 0.0)] * n
        for _ in range(_PARTS):
            right = [[mass * a + leak * room, mass * b] for a, b in lines]
            right[0][1] = right[0][1] + rate * flows.charge
            right[-1][0] = right[-1][0] + flows.source
            lines = _solved([list(row) for row in matrix], right)
            sums = [(a + c, b + d) for (a, b), (c, d) in zip(sums, lines, strict=True)]
        return lines, [(a / _PARTS, b / _PARTS) for a, b in sums]

    def run(self, ops: Operations, given: Given) -> Run:
        """Hear what can charge it, offer water, and solve both.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Setpoint, the layers before, and the plant room's temperature.
        """
        before, rate = list(given.state.values()), WATER_HEAT_CAPACITY
        pipe: HotWater = yield "charge"
        wanted = ops.clip((given.actions["tank_temperature_setpoint"] - before[-1]) / self.band, 0.0, 1.0)
        share = wanted * ops.step(pipe.warmest - before[-1])
        charge = self.charge_flow * share
        given.put("hot_water", HotWater(1.0, ops.maximum(before[0], pipe.warmest)))
        drawn: WaterDrawn = yield "hot_water"
        flow = self.pump.flow(ops, drawn.flow, 1.0)
        through = TankFlows(charge * pipe.opening, flow, drawn.conductance, drawn.source)
        room = given.conditions.room_temperature
        lines, means = self.layers_end(ops, before, through, room, given.seconds)
        (offset, slope), taken = means[-1], rate * through.charge
        given.put("charge", WaterDrawn(taken * (1.0 - slope), taken * offset, charge))
        water: SupplyWater = yield "charge"
        layers, mean = ([a + b * water.temperature for a, b in each] for each in (lines, means))
        given.put("hot_water", SupplyWater(mean[0]))
        mass = self.volume * WATER_DENSITY * rate / len(layers) / given.seconds
        first, second, third, fourth = layers
        return TankStep(
            first, second, third, fourth,
            taken * (water.temperature - mean[-1]),
            drawn.conductance * mean[0] - drawn.source,
            self.loss / len(layers) * sum(t - room for t in mean),
            mass * sum(t - b for t, b in zip(layers, before, strict=True)),
            through.charge, flow, self.pump.power(flow, self.pump.differential_pressure),
        )  # fmt: skip

    def energy(self, conditions: Conditions, done: TankStep) -> EnergyBalance:
        """Where the energy of a step went; the pump's heat goes to the plant room.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : TankStep
            What `run` returned.
        """
        return EnergyBalance(
            electricity=done.electric_power, plant_room=done.loss + done.electric_power, storage=done.storage
        )  # fmt: skip

    def read(self, ops: Operations, given: Given, done: TankStep) -> list[Value]:
        """Values of its points: water to those that draw, and at the bottom.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : TankStep
            What `run` returned.
        """
        return [done.layer_1_temperature, done.layer_4_temperature, done.electric_power]


def _solved(matrix: list[list[Value]], right: list[list[Value]]) -> list[Line]:
    """Solve a diagonally dominant system with two right-hand sides by elimination; its entries are changed."""
    n = len(matrix)
    for k in range(n):
        for row in range(k + 1, n):
            factor = matrix[row][k] / matrix[k][k]
            for column in range(k + 1, n):
                matrix[row][column] = matrix[row][column] - factor * matrix[k][column]
            right[row] = [r - factor * p for r, p in zip(right[row], right[k], strict=True)]
    found: list[Line] = []
    for k in reversed(range(n)):
        below = [matrix[k][k + 1 + j] for j in range(len(found))]
        rest = [right[k][side] - sum(c * f[side] for c, f in zip(below, found, strict=True)) for side in (0, 1)]
        found.insert(0, (rest[0] / matrix[k][k], rest[1] / matrix[k][k]))
    return found
