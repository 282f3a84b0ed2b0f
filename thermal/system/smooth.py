"""The smooth system with its Jacobian: a terminal sees its own zone, and all else through a few sums over terminals."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.components.component import Conditions
from thermal.components.moist_air import USUAL_HUMIDITY
from thermal.components.operations import CasadiOperations, Value
from thermal.errors import ModelError
from thermal.system.step import HvacStep
from thermal.system.symbolic import step_of
from thermal.system.system import HvacSystem


class _SumOperations(CasadiOperations):
    """Operations that write down every sum over elements of groups, and put a symbol in its place if so wanted."""

    def __init__(self, width: float, cut: bool) -> None:
        super().__init__(width)
        self._cut, self._group = cut, ""
        self.terms: list[Value] = []
        self.groups: list[str] = []
        self.symbols: list[Value] = []

    def of(self, group: str) -> CasadiOperations:
        """Operations that know whose sums they write down, into the same lists."""
        mine = copy(self)
        mine._group = group
        return mine

    @property
    def scalar(self) -> CasadiOperations:
        """Operations of single components, which sum nothing."""
        return CasadiOperations(self.width)

    def sums(self, values: Value, members: NDArray[np.float64]) -> list[Value]:
        """Sum the elements of each supplier."""
        return [self._sum(values * casadi.DM(column)) for column in members.T]

    def dot(self, a: Value, b: Value) -> Value:
        """Sum products over the elements."""
        return self._sum(a * b)

    def _sum(self, term: Value) -> Value:
        symbol = casadi.SX.sym(f"sum{len(self.terms)}")
        self.terms.append(term)
        self.groups.append(self._group)
        self.symbols.append(symbol)
        return symbol if self._cut else casadi.sum1(term)


@dataclass(frozen=True, eq=False)
class HvacJacobian:
    """Derivatives of the smooth system over N steps.

    Those of the heat by zone temperatures are ``diag(local) + heat_by_sums @ sums_by_zone``: air handlers and boiler
    see the zones through m sums only.

    Parameters
    ----------
    local : ndarray, shape (N, n_zone)
        Of a zone's heat by its own temperature, sums held [W/K].
    heat_by_sums : ndarray, shape (N, n_zone, m)
        Of the heat by the sums [W per unit of the sum].
    sums_by_zone : ndarray, shape (N, m, n_zone)
        Of the sums by zone temperatures [unit of the sum per K].
    heat_by_inputs : ndarray, shape (N, n_zone, n_input)
        Of the heat by the inputs [W per K or Pa].
    totals_by_zone : ndarray, shape (N, 2 + n_state, n_zone)
        Of electric power, fuel power and states at the end [W/K; a temperature's: K/K].
    totals_by_inputs : ndarray, shape (N, 2 + n_state, n_input)
        The same by the inputs [W or K per K or Pa].
    """

    local: FloatArray
    heat_by_sums: FloatArray
    sums_by_zone: FloatArray
    heat_by_inputs: FloatArray
    totals_by_zone: FloatArray
    totals_by_inputs: FloatArray


class SmoothHvac:
    """Steps of a system as a controller's predictor takes them, and their exact Jacobian.

    Parameters
    ----------
    system : HvacSystem
        The system; its thermostats act without memory.
    width : float
        Smoothing width as in `hvac_function` [-].
    pressures : bool
        Whether the pressures of ducts and loop are among the inputs; else they stay at their design values.
    setpoints : bool
        Whether the thermostats' setpoints are among the inputs; else they are exogenous.

    Attributes
    ----------
    inputs : dict of str to slice
        Where states and manipulated inputs stand in the vector of inputs, by ``ENTITY/state`` and by type of the point.
    exogenous : dict of str to slice
        Where conditions and switches stand in the vector of exogenous inputs.

    Notes
    -----
    Return air couples all zones of an air handler, so that the Jacobian of a system is full. It is a diagonal and a
    product of rank m, with m the number of sums over terminals: flow, warmth and coils of each air handler, and drawn
    water. It costs one sweep for all zones together, and one for each sum and input.

    Examples
    --------
    >>> from thermal.components.air_handler import AirHandler
    >>> from thermal.components.boiler_loop import BoilerLoop
    >>> from thermal.components.fan import Fan
    >>> from thermal.components.pump import Pump
    >>> from thermal.components.terminals import Terminals
    >>> from thermal.system.system import vav_system
    >>> system = vav_system([AirHandler(Fan(1.0))], BoilerLoop(2e4, Pump(0.5)), Terminals.sized([0.5], 4000.0))
    >>> smooth = SmoothHvac(system)
    >>> smooth.n_input, smooth.n_sum
    (3, 4)
    """

    def __init__(
        self, system: HvacSystem, width: float = 0.02, pressures: bool = False, setpoints: bool = False
    ) -> None:
        self.system, self.width, self.n_zone = system, width, system.zone_count
        self.n_air_handler, self.n_state = len(system.air_handlers), len(system.states)
        zones = dict.fromkeys(Conditions._fields[1:3], self.n_zone)
        kinds = {a.point: a for _, a in system.actuators.values()}
        sizes = {point: len(keys) for point, keys in system.by_point.items()}
        decided = {p: sizes[p] for p, a in kinds.items() if a.usual and a.default is None}
        held = {p: sizes[p] for p, a in kinds.items() if a.usual and a.default is not None and pressures}
        self.inputs = _slices(dict.fromkeys(system.states, 1) | decided | held | (zones if setpoints else {}))
        others = {"outdoor_temperature": 1, "outdoor_humidity": 1, "return_humidity": max(self.n_air_handler, 1),
                  "room_temperature": 1, "seconds": 1}  # fmt: skip
        switches = {p: sizes[p] for p, a in kinds.items() if not a.usual}
        self.exogenous = _slices(zones | others | switches)
        self.n_input, self.n_exogenous = (
            max((s.stop for s in d.values()), default=0) for d in (self.inputs, self.exogenous)
        )
        symbols = [
            casadi.SX.sym(*row)
            for row in (("zone", self.n_zone), ("inputs", self.n_input), ("exogenous", self.n_exogenous))
        ]
        plain, cut = (_SumOperations(width, c) for c in (False, True))
        done = self._advanced(plain, *symbols)
        self.n_sum = len(plain.terms)
        sums = casadi.vertcat(*[casadi.sum1(term) for term in plain.terms])
        heat = system.at_zones(plain, done.results)
        self._jacobian, local = self._jacobian_functions(cut, *symbols)
        # both graphs hold the step itself, which is computed once
        supply = casadi.vertcat(*done.supply_temperature)
        everything = casadi.cse(casadi.vertcat(heat, *_totals(done), sums, supply, local(*symbols, sums)))
        self._step = casadi.Function("hvac_step", symbols, [casadi.densify(everything)])
        self._buffers: dict[int, Any] = {}

    def surroundings(self, values: Mapping[str, FloatArray]) -> FloatArray:
        """Put the exogenous inputs of N steps together, shape (N, n_exogenous).

        Parameters
        ----------
        values : mapping of str to ndarray
            By name, as in `exogenous`, shape (N,) or (N, n) [unit of each]; the usual humidity, a plant room of 293.15
            K and the actuators' defaults where they are not given.
        """
        usual: dict[str, Any] = {"return_humidity": USUAL_HUMIDITY, "room_temperature": 293.15}
        points, known = self.system.by_point, self.system.defaults
        usual |= {point: np.array([[known.get(key, 1.0) for key in keys]]) for point, keys in points.items()}
        rows = np.empty((len(values["seconds"]), self.n_exogenous))
        for name, at in self.exogenous.items():
            found = values.get(name, usual.get(name))
            ModelError.unless(found is not None, "exogenous inputs", f"values of {name!r}", "none")
            given = np.asarray(found, dtype=float)
            rows[:, at] = given[:, None] if given.ndim == 1 else given
        return rows

    def _advanced(self, ops: _SumOperations, zone: Value, inputs: Value, exogenous: Value) -> HvacStep:
        known = {name: exogenous[at] for name, at in self.exogenous.items()}
        known |= {name: inputs[at] for name, at in self.inputs.items()} | {"zone_temperature": zone}
        return step_of(ops, self.system, known)

    def _jacobian_functions(self, ops: _SumOperations, zone: Value, inputs: Value, exogenous: Value) -> tuple[Any, Any]:
        """All derivatives, and those of the heat by each zone's own temperature alone."""
        done = self._advanced(ops, zone, inputs, exogenous)
        heat, symbols = self.system.at_zones(ops, done.results), casadi.vertcat(*ops.symbols)
        every = casadi.DM.ones(self.n_zone)
        # a term of an element sees its own zone only, so one sweep along all zones gives each term's derivative
        by_zone = [
            ops.gather(casadi.jtimes(term, zone, every), self.system.rooms[group])
            for term, group in zip(ops.terms, ops.groups, strict=True)
        ]
        sums = casadi.vertcat(*[casadi.sum1(term) for term in ops.terms])
        by = casadi.vertcat(symbols, inputs)
        local = casadi.jtimes(heat, zone, every)
        outputs = [
            local,
            casadi.horzcat(*by_zone),
            casadi.jacobian(sums, by),
            casadi.jacobian(casadi.vertcat(heat, *_totals(done)), by),
        ]
        given = [zone, inputs, exogenous, symbols]
        jacobian = casadi.Function("hvac_jacobian", given, [casadi.densify(output) for output in outputs])
        return jacobian, casadi.Function("hvac_local", given, [local])

    def stepper(self) -> HvacStepper:
        """Make what takes one step at a time, without overhead."""
        return HvacStepper(self._step)

    def jacobian(self, zone: FloatArray, inputs: FloatArray, exogenous: FloatArray, sums: FloatArray) -> HvacJacobian:
        """Differentiate N steps, all at once.

        Parameters
        ----------
        zone : ndarray, shape (N, n_zone)
            Temperatures at the starts [K].
        inputs : ndarray, shape (N, n_input)
            States at the start, and manipulated inputs [K or Pa].
        exogenous : ndarray, shape (N, n_exogenous)
            Of `surroundings` [as there].
        sums : ndarray, shape (N, m)
            Of the stepper, at the same point [unit of the sum].
        """
        count, n, m, n_input, n_total = len(zone), self.n_zone, self.n_sum, self.n_input, 2 + self.n_state
        if count not in self._buffers:
            mapped = self._jacobian if count == 1 else self._jacobian.map(count)
            sizes = (n, n * m, m * (m + n_input), (n + n_total) * (m + n_input))
            out = [np.empty((count, size)) for size in sizes]
            buffer, run = mapped.buffer()
            for k, array in enumerate(out):
                buffer.set_res(k, memoryview(array.data))
            self._buffers[count] = (mapped, buffer, run, out)
        _, buffer, run, out = self._buffers[count]
        given = [np.ascontiguousarray(a, dtype=float) for a in (zone, inputs, exogenous, sums)]
        for k, array in enumerate(given):
            buffer.set_arg(k, memoryview(array.data))
        run()
        local, by_zone, of_sums, of_all = out  # columns first, as CasADi stores matrices
        of_sums = of_sums.reshape(count, m + n_input, m).transpose(0, 2, 1)
        of_all = of_all.reshape(count, m + n_input, n + n_total).transpose(0, 2, 1)
        inverse = np.linalg.inv(np.eye(m) - of_sums[:, :, :m])
        sums_by_zone, by_inputs = inverse @ by_zone.reshape(count, m, n), inverse @ of_sums[:, :, m:]
        by_sums, direct = of_all[:, :, :m], of_all[:, :, m:] + of_all[:, :, :m] @ by_inputs
        return HvacJacobian(
            local.copy(), np.ascontiguousarray(by_sums[:, :n]), sums_by_zone, np.ascontiguousarray(direct[:, :n]),
            by_sums[:, n:] @ sums_by_zone, np.ascontiguousarray(direct[:, n:]),
        )  # fmt: skip


class HvacStepper:
    """Takes one step of the smooth system after the other, in the same memory.

    Parameters
    ----------
    function : casadi.Function
        Of zone temperatures, inputs and exogenous inputs.
    """

    def __init__(self, function: Any) -> None:
        self.zone, self.inputs, self.exogenous = (np.zeros(function.size1_in(k)) for k in range(3))
        self.output = np.zeros(function.size1_out(0))
        self._function = function
        self._buffer, self._run = function.buffer()
        for k, array in enumerate((self.zone, self.inputs, self.exogenous)):
            self._buffer.set_arg(k, memoryview(array.data))
        self._buffer.set_res(0, memoryview(self.output.data))

    def step(self) -> FloatArray:
        """Take a step from what stands in `zone`, `inputs` and `exogenous`.

        Returns
        -------
        ndarray, shape (2 n_zone + 2 + n_state + m + n_air_handler,)
            Heat [W]; electric and fuel power [W]; states at the end, water [K]; sums; supply air as it leaves each air
            handler [K]; derivative of each zone's heat by its own temperature, sums held [W/K]. Overwritten by the next
            step.
        """
        self._run()
        return self.output


def _slices(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Where vectors of these sizes stand behind each other."""
    ends = list(accumulate(sizes.values(), initial=0))
    return {name: slice(*ends[k : k + 2]) for k, name in enumerate(sizes)}


def _totals(done: HvacStep) -> tuple[Value, ...]:
    return done.electric_power, done.fuel_power, *done.state
