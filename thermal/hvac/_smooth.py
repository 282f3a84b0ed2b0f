"""The smooth plant with its slopes: what a terminal does depends on its own zone, and on a few sums over terminals."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import casadi
import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.hvac._advance import advance
from thermal.hvac._operations import CasadiOperations, Value
from thermal.hvac._settings import settings_of
from thermal.hvac._step import Actions, Calls, Conditions, HvacStep
from thermal.hvac._system import HvacSystem


class _SumOperations(CasadiOperations):
    """Operations that write down every sum over terminals, and put a symbol in its place if so wanted."""

    def __init__(self, width: float, system: HvacSystem, cut: bool) -> None:
        super().__init__(width)
        self._members, self._cut = system.members, cut
        self.terms: list[Value] = []
        self.symbols: list[Value] = []

    def sums(self, values: Value, members: NDArray[np.float64]) -> list[Value]:
        """Sum the terminals of each group; those of a zone stay as they are, since they see no other zone."""
        if members is not self._members:
            return list(super().sums(values, members))
        return [self._sum(values * casadi.DM(column)) for column in members.T]

    def dot(self, a: Value, b: Value) -> Value:
        """Sum products over the terminals."""
        return self._sum(a * b)

    def _sum(self, term: Value) -> Value:
        symbol = casadi.SX.sym(f"sum{len(self.terms)}")
        self.terms.append(term)
        self.symbols.append(symbol)
        return symbol if self._cut else casadi.sum1(term)


class KnobLayout(NamedTuple):
    """Where the states and actions of a plant stand in its vector of knobs.

    Parameters
    ----------
    water : int
        Supply water at the start [K].
    supply_air : slice
        Setpoints of the supply air, one an air handler [K].
    supply_water : int
        Setpoint of the supply water [K].
    static_pressure : slice
        Setpoints of the ducts, one an air handler [Pa]; empty where pressures stay at their design values.
    differential_pressure : int or None
        Setpoint of the loop [Pa].
    heating_setpoint, cooling_setpoint : slice
        Of the thermostats, one a zone [K]; empty where they are among what surrounds the plant.
    size : int
        Length of the vector.
    """

    water: int
    supply_air: slice
    supply_water: int
    static_pressure: slice
    differential_pressure: int | None
    heating_setpoint: slice
    cooling_setpoint: slice
    size: int


@dataclass(frozen=True, eq=False)
class HvacSlopes:
    """Derivatives of the smooth plant over N steps.

    Those of the heat by zone temperatures are ``diag(local) + reach @ pull``: air handlers and boiler see the zones
    through m sums only.

    Parameters
    ----------
    local : ndarray, shape (N, n_zone)
        Of a zone's heat by its own temperature, sums held [W/K].
    reach : ndarray, shape (N, n_zone, m)
        Of the heat by the sums [W per unit of the sum].
    pull : ndarray, shape (N, m, n_zone)
        Of the sums by zone temperatures [unit of the sum per K].
    heat_by_knobs : ndarray, shape (N, n_zone, n_knob)
        Of the heat by the knobs [W per K or Pa].
    totals_by_zone : ndarray, shape (N, 3, n_zone)
        Of electric power, fuel power and water at the end [W/K; the water's: K/K].
    totals_by_knobs : ndarray, shape (N, 3, n_knob)
        The same by the knobs [W or K per K or Pa].
    """

    local: FloatArray
    reach: FloatArray
    pull: FloatArray
    heat_by_knobs: FloatArray
    totals_by_zone: FloatArray
    totals_by_knobs: FloatArray


class SmoothHvac:
    """Steps of a plant as a controller's predictor takes them, and their exact slopes.

    Parameters
    ----------
    system : HvacSystem
        The plant; its thermostats act without memory.
    width : float
        Smoothing width as in `hvac_function` [-].
    pressures : bool
        Whether the pressures of ducts and loop are among the knobs; else they stay at their design values.
    setpoints : bool
        Whether the thermostats' setpoints are among the knobs; else they are those of `around`.

    Notes
    -----
    Return air couples all zones of an air handler, so that the Jacobian of a plant is full. It is a diagonal and a
    product of rank m, with m the number of sums over terminals: flow, warmth and coils of each air handler, and drawn
    water. Slopes cost one sweep for all zones together, and one for each sum and knob.

    Examples
    --------
    >>> from thermal.hvac._air_handler import AirHandler
    >>> from thermal.hvac._boiler import BoilerLoop, Pump
    >>> from thermal.hvac._fan import Fan
    >>> from thermal.hvac._terminals import Terminals
    >>> system = HvacSystem((AirHandler(Fan(1.0)),), BoilerLoop(2e4, Pump(0.5)), Terminals.sized([0.5], 4000.0))
    >>> smooth = SmoothHvac(system)
    >>> smooth.knobs.size, smooth.n_sum
    (3, 4)
    """

    def __init__(
        self, system: HvacSystem, width: float = 0.02, pressures: bool = False, setpoints: bool = False
    ) -> None:
        n_air = len(system.air_handlers)
        self.system, self.width, self.n_zone, self.n_air_handler = system, width, system.zone_count, n_air
        size = 2 + n_air + (n_air + 1 if pressures else 0)
        ducts, loop = (slice(2 + n_air, 2 + 2 * n_air), 2 + 2 * n_air) if pressures else (slice(0, 0), None)
        first, last = (size, size + self.n_zone) if setpoints else (0, 0)
        rooms = slice(first, last), slice(last, last + last - first)
        size += 2 * (last - first)
        self.knobs = KnobLayout(0, slice(1, 1 + n_air), 1 + n_air, ducts, loop, *rooms, size)
        zone, knobs = casadi.SX.sym("zone", self.n_zone), casadi.SX.sym("knobs", self.knobs.size)
        around = casadi.SX.sym("around", 2 * self.n_zone + 5 + 3 * n_air)
        plain, cut = (_SumOperations(width, system, c) for c in (False, True))
        done = self._advanced(plain, zone, knobs, around)
        self.n_sum = len(plain.terms)
        self.n_around = int(around.numel())
        sums = casadi.vertcat(*[casadi.sum1(term) for term in plain.terms])
        heat = system.at_zones(plain, done.terminal_heat)
        self._slopes, local = self._slope_functions(cut, zone, knobs, around)
        # both graphs hold the step itself, which is computed once
        supply = casadi.vertcat(*done.supply_temperature)
        everything = casadi.cse(casadi.vertcat(heat, *_totals(done), sums, supply, local(zone, knobs, around, sums)))
        self._step = casadi.Function("hvac_step", [zone, knobs, around], [casadi.densify(everything)])
        self._buffers: dict[int, Any] = {}
        self._outputs = 2 * self.n_zone + 3 + self.n_sum + n_air

    def around(
        self,
        heating_setpoint: FloatArray,
        cooling_setpoint: FloatArray,
        outdoor_temperature: FloatArray,
        outdoor_humidity: FloatArray,
        running: FloatArray,
        boiler: FloatArray,
        ventilation: FloatArray,
        seconds: FloatArray,
        return_humidity: float = 0.006,
        room_temperature: float = 293.15,
    ) -> FloatArray:
        """Put what surrounds the plant over N steps together, shape (N, n_around).

        Parameters
        ----------
        heating_setpoint, cooling_setpoint : ndarray, shape (N, n_zone)
            Of the thermostats [K].
        outdoor_temperature, outdoor_humidity : ndarray, shape (N,)
            [K], [kg/kg].
        running, ventilation : ndarray, shape (N, n_air_handler)
            As in `Actions` [-].
        boiler : ndarray, shape (N,)
            As there [-].
        seconds : ndarray, shape (N,)
            Lengths of the steps [s].
        return_humidity : float
            Of the return air [kg/kg].
        room_temperature : float
            Of the plant room [K].
        """
        n, n_air = len(seconds), self.n_air_handler
        parts = (
            heating_setpoint, cooling_setpoint, outdoor_temperature[:, None], outdoor_humidity[:, None],
            np.full((n, n_air), return_humidity), np.full((n, 1), room_temperature), running, boiler[:, None],
            ventilation, seconds[:, None],
        )  # fmt: skip
        return np.ascontiguousarray(np.hstack(parts))

    def _advanced(self, ops: _SumOperations, zone: Value, knobs: Value, around: Value) -> HvacStep:
        n, n_air, system, at = self.n_zone, self.n_air_handler, self.system, self.knobs
        ends = np.cumsum([0, n, n, 1, 1, n_air, 1, n_air, 1, n_air, 1]).tolist()
        heating, cooling, outdoor, damp, humid, room, running, boiler, ventilation, seconds = (
            around[a:b] for a, b in pairwise(ends)
        )
        if at.heating_setpoint != slice(0, 0):
            heating, cooling = knobs[at.heating_setpoint], knobs[at.cooling_setpoint]
        heat, cool = system.thermostat.calls(ops, zone, heating, cooling)
        calls = Calls(system.at_terminals(ops, heat), system.at_terminals(ops, cool))
        conditions = Conditions(zone, heating, cooling, outdoor, damp, _each(humid), room)
        loop = None if at.differential_pressure is None else knobs[at.differential_pressure]
        ducts = None if loop is None else _each(knobs[at.static_pressure])
        actions = Actions(
            _each(knobs[at.supply_air]), knobs[at.supply_water], ducts, loop, _each(running), boiler, _each(ventilation)
        )
        settings = settings_of(ops, system, actions)
        return advance(ops, system, knobs[at.water], calls, conditions, settings, seconds)

    def _slope_functions(self, ops: _SumOperations, zone: Value, knobs: Value, around: Value) -> tuple[Any, Any]:
        """All slopes, and those of the heat by each zone's own temperature alone."""
        done = self._advanced(ops, zone, knobs, around)
        heat, symbols = self.system.at_zones(ops, done.terminal_heat), casadi.vertcat(*ops.symbols)
        rooms, every = casadi.sparsify(casadi.DM(self.system.rooms.T)), casadi.DM.ones(self.n_zone)
        # a term of a terminal sees its own zone only, so one sweep along all zones gives each term's slope
        pulls = [casadi.mtimes(rooms, casadi.jtimes(term, zone, every)) for term in ops.terms]
        sums = casadi.vertcat(*[casadi.sum1(term) for term in ops.terms])
        by = casadi.vertcat(symbols, knobs)
        local = casadi.jtimes(heat, zone, every)
        outputs = [
            local,
            casadi.horzcat(*pulls),
            casadi.jacobian(sums, by),
            casadi.jacobian(casadi.vertcat(heat, *_totals(done)), by),
        ]
        inputs = [zone, knobs, around, symbols]
        slopes = casadi.Function("hvac_slopes", inputs, [casadi.densify(output) for output in outputs])
        return slopes, casadi.Function("hvac_local", inputs, [local])

    def stepper(self) -> HvacStepper:
        """Make what takes one step at a time, without overhead."""
        return HvacStepper(self._step, self.n_zone, self.knobs.size, self.n_around, self._outputs)

    def slopes(self, zone: FloatArray, knobs: FloatArray, around: FloatArray, sums: FloatArray) -> HvacSlopes:
        """Differentiate N steps, all at once.

        Parameters
        ----------
        zone : ndarray, shape (N, n_zone)
            Temperatures at the starts [K].
        knobs : ndarray, shape (N, n_knob)
            Water at the start, and actions [K or Pa].
        around : ndarray, shape (N, n_around)
            Of `around` [as there].
        sums : ndarray, shape (N, m)
            Of the stepper, at the same point [unit of the sum].
        """
        count, n, m, n_knob = len(zone), self.n_zone, self.n_sum, self.knobs.size
        if count not in self._buffers:
            mapped = self._slopes if count == 1 else self._slopes.map(count)
            sizes = (n, n * m, m * (m + n_knob), (n + 3) * (m + n_knob))
            out = [np.empty((count, size)) for size in sizes]
            buffer, run = mapped.buffer()
            for k, array in enumerate(out):
                buffer.set_res(k, memoryview(array.data))
            self._buffers[count] = (mapped, buffer, run, out)
        _, buffer, run, out = self._buffers[count]
        given = [np.ascontiguousarray(a, dtype=float) for a in (zone, knobs, around, sums)]
        for k, array in enumerate(given):
            buffer.set_arg(k, memoryview(array.data))
        run()
        local, pulls, of_sums, of_all = out  # columns first, as CasADi stores matrices
        of_sums = of_sums.reshape(count, m + n_knob, m).transpose(0, 2, 1)
        of_all = of_all.reshape(count, m + n_knob, n + 3).transpose(0, 2, 1)
        inverse = np.linalg.inv(np.eye(m) - of_sums[:, :, :m])
        pull, by_knobs = inverse @ pulls.reshape(count, m, n), inverse @ of_sums[:, :, m:]
        reach, direct = of_all[:, :, :m], of_all[:, :, m:] + of_all[:, :, :m] @ by_knobs
        return HvacSlopes(
            local.copy(), np.ascontiguousarray(reach[:, :n]), pull, np.ascontiguousarray(direct[:, :n]),
            reach[:, n:] @ pull, np.ascontiguousarray(direct[:, n:]),
        )  # fmt: skip


class HvacStepper:
    """Takes one step of the smooth plant after the other, in the same memory.

    Parameters
    ----------
    function : casadi.Function
        Of zone temperatures, knobs and surroundings.
    n_zone, n_knob, n_around, n_output : int
        Sizes.
    """

    def __init__(self, function: Any, n_zone: int, n_knob: int, n_around: int, n_output: int) -> None:
        self.zone, self.knobs, self.around = np.zeros(n_zone), np.zeros(n_knob), np.zeros(n_around)
        self.output = np.zeros(n_output)
        self._function = function
        self._buffer, self._run = function.buffer()
        for k, array in enumerate((self.zone, self.knobs, self.around)):
            self._buffer.set_arg(k, memoryview(array.data))
        self._buffer.set_res(0, memoryview(self.output.data))

    def step(self) -> FloatArray:
        """Take a step from what stands in `zone`, `knobs` and `around`.

        Returns
        -------
        ndarray, shape (2 n_zone + 3 + m + n_air_handler,)
            Heat [W]; electric and fuel power [W]; water at the end [K]; sums; supply air as it leaves each air handler
            [K]; slope of each zone's heat by its own temperature, sums held [W/K]. Overwritten by the next step.
        """
        self._run()
        return self.output


def _each(values: Value) -> tuple[Value, ...]:
    return tuple(casadi.vertsplit(values))


def _totals(done: HvacStep) -> tuple[Value, Value, Value]:
    return done.electric_power, done.fuel_power, done.loop.water
