"""Variable-air-volume terminals: damper, minimum flow and reheat coil, all terminals of a building at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal._types import FloatArray
from thermal.components.checks import all_in_range, in_range
from thermal.components.component import Given, Group, IndexArray, Port, Range, Run
from thermal.components.last_value import LastValue
from thermal.components.moist_air import LEAST_AIR, WATER_HEAT_CAPACITY
from thermal.components.operations import NumpyOperations, Operations, Value
from thermal.components.streams import AirDrawn, Duct, HotWater, SupplyAir, SupplyWater, WaterDrawn
from thermal.components.water_coil import (
    LEAST_FLOW,
    WaterCoil,
    WaterSide,
    coil_conductance,
    valve_position,
    water_share,
    water_side,
)
from thermal.errors import ModelError
from thermal.units import AIR_HEAT_CAPACITY

_LEAST = 1e-9  # K, W/K, kg/s: next to nothing

_Flow = Annotated[FloatArray, Range("kg/s", 1e-9, 1e7)]
_Film = Annotated[FloatArray, Range("W/K", 1e-9, 1e7)]


class TerminalStep(NamedTuple):
    """What terminals did in a step; one value a terminal.

    Parameters
    ----------
    airflow : Value
        Supply air [kg/s].
    entering : Value
        Temperature of the supply air at the terminals [K].
    reheat : Value
        Heat from the water [W].
    valve_flow : Value
        Water over that of an open valve [-].
    heat : Value
        Heat into the zone [W]: flow x 1006 J/kg/K x (`discharge` - zone temperature).
    most_airflow : Value
        Supply air through open dampers [kg/s].
    """

    airflow: Value
    entering: Value
    reheat: Value
    valve_flow: Value
    heat: Value
    most_airflow: Value

    @property
    def discharge(self) -> Value:
        """Discharge temperatures [K]."""
        return self.entering + self.reheat / (AIR_HEAT_CAPACITY * self.airflow)


@dataclass(frozen=True, eq=False)
class Terminals(Group):
    """The VAV terminals of a building; single-maximum or dual-maximum by their heating flows.

    Parameters
    ----------
    design_flow : float or numpy.ndarray, shape (n_terminal,)
        Largest cooling flow at the design static pressure [kg/s], positive.
    minimum_flow : float or numpy.ndarray, shape (n_terminal,)
        Smallest flow while the air handler runs [kg/s], positive, up to `design_flow`.
    heating_flow : float or numpy.ndarray, shape (n_terminal,)
        Largest flow when heating [kg/s], `minimum_flow` to `design_flow`; at `minimum_flow` the control has a single
        maximum, above it two.
    air_film, water_film : float or numpy.ndarray, shape (n_terminal,)
        hA of the reheat coil's sides at design flows [W/K], as in `WaterCoil`; a terminal without coil has next to
        nothing.
    water_flow : float or numpy.ndarray, shape (n_terminal,)
        Water through the open valve at the design differential pressure [kg/s], positive.
    zone : numpy.ndarray of int, shape (n_terminal,)
        Position of the zone that each serves.
    air_handler : numpy.ndarray of int, shape (n_terminal,)
        Position of the air handler that supplies each.
    discharge_limit : float
        Warmest discharge air [K]. The default is 11 K above a zone at 21 degC, beyond which air stays under the
        ceiling (ASHRAE Guideline 36-2021, 5.6).
    reheat_first : float
        Share of the call for heating over which the reheat opens before the flow rises [-], 0.1 to 1. The default is
        Guideline 36's half for two maxima; a single maximum has no flow to raise and wants 1.
    discharge_control : bool
        True: the call sets a discharge temperature that the valve holds (Guideline 36). False: the call sets the
        share of the coil's heat at hand, as a valve without discharge sensor does.
    rangeability : float
        Of the equal-percentage valves [-], 2 to 200; the default is usual (ASHRAE HVAC Systems 2016, ch. 47).

    Notes
    -----
    Heat into the zone is ``m c_p (T_entering - T_zone) + G (T_water - T_entering)``: G of the coil behind its valve.
    Boxes are pressure-independent: dampers at ``flow / (design_flow sqrt(p / p_design))``, 1 at most, hold the flow.
    """

    label, device = "terminal", "vav"
    ports = (
        Port("supply_air", "air", "kg/s", "each"), Port("hot_water", "water", "kg/s"),
        Port("heat", "heat", "W", "each"),
    )  # fmt: skip
    sensors = (
        "zone_air_temperature_sensor", "zone_air_heating_temperature_setpoint", "zone_air_cooling_temperature_setpoint",
        "supply_air_flowrate_sensor", "discharge_air_temperature_sensor", "supply_air_damper_percentage_command",
        "heating_water_valve_percentage_command",
    )  # fmt: skip

    design_flow: _Flow
    minimum_flow: _Flow
    heating_flow: _Flow
    air_film: _Film
    water_film: _Film
    water_flow: _Flow
    zone: IndexArray
    air_handler: IndexArray
    discharge_limit: Annotated[float, Range("K", 288.15, 353.15)] = 305.15
    reheat_first: Annotated[float, Range("-", 0.1, 1.0)] = 0.5
    discharge_control: bool = True
    rangeability: Annotated[float, Range("-", 2.0, 200.0)] = 30.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "air_handler", self.positions("air_handler"))
        in_order = (self.minimum_flow <= self.heating_flow) & (self.heating_flow <= self.design_flow)
        if not in_order.all():
            k = int(np.argmin(in_order))
            found = f"{self.minimum_flow[k]:g}, {self.heating_flow[k]:g} and {self.design_flow[k]:g} kg/s"
            raise ModelError(f"Terminals: terminal {k}", "minimum_flow <= heating_flow <= design_flow", found)

    @classmethod
    def sized(
        cls,
        design_flow: ArrayLike,
        heating_capacity: ArrayLike,
        zone: NDArray[np.intp] | None = None,
        air_handler: ArrayLike = 0,
        minimum_share: float = 0.3,
        heating_share: float = 0.5,
        water_temperature: float = 355.35,
        supply_temperature: float = 285.95,
    ) -> Terminals:
        """Size terminals and their coils from flows and heating capacities.

        Parameters
        ----------
        design_flow : array_like, shape (n_terminal,)
            Largest flows [kg/s], positive.
        heating_capacity : array_like, shape (n_terminal,)
            Heat of each reheat coil at design [W]; 0 for a terminal without coil.
        zone : numpy.ndarray of int, shape (n_terminal,), optional
            Positions of the zones; by default the first terminal serves the first zone and so on.
        air_handler : array_like of int, shape (n_terminal,)
            Positions of the air handlers [-].
        minimum_share : float
            Smallest flow over design flow [-]; the default is the reference buildings'.
        heating_share : float
            Largest heating flow over design flow [-], at least `minimum_share`; the default is the most that ASHRAE
            90.1 lets dual-maximum boxes reheat. Equal to `minimum_share` gives single-maximum control.
        water_temperature, supply_temperature : float
            Of water and air that enter at design [K].

        Returns
        -------
        Terminals
            With water that falls by 11.1 K at design.

        Examples
        --------
        >>> terminals = Terminals.sized([0.3, 0.5], [2000.0, 4000.0])
        >>> terminals.minimum_flow.round(3).tolist()
        [0.09, 0.15]
        """
        flows = np.atleast_1d(np.asarray(design_flow, dtype=float))
        n = len(flows)
        in_range("Terminals.sized: minimum_share", minimum_share, "-", 1e-6, 1.0)
        in_range("Terminals.sized: heating_share", heating_share, "-", minimum_share, 1.0)
        heats = all_in_range("Terminals.sized: heating_capacity", heating_capacity, n, "W", 0.0, 1e7)
        films = np.full((n, 3), _LEAST)
        for k in np.flatnonzero(heats):
            coil = WaterCoil.sized(heats.item(k), heating_share * flows.item(k), supply_temperature, water_temperature)
            # films are stated at the design flow
            films[k] = coil.air_conductance * heating_share**-0.8, coil.water_conductance, coil.water_flow
        return cls(
            design_flow=flows,
            minimum_flow=minimum_share * flows,
            heating_flow=heating_share * flows,
            air_film=films[:, 0],
            water_film=films[:, 1],
            water_flow=films[:, 2],
            zone=np.arange(n) if zone is None else zone,
            air_handler=np.broadcast_to(np.asarray(air_handler), (n,)),
            reheat_first=0.5 if heating_share > minimum_share else 1.0,
        )

    def run(self, ops: Operations, given: Given) -> Run:
        """Let air through, warm it with hot water, and bring its heat into the zone.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Calls of the thermostats and temperatures of the zones.
        """
        conditions, calls, index, few = given.conditions, given.calls, self.air_handler, ops.scalar
        zone = self.of_zones(ops, conditions.zone_temperature)
        heating, cooling = self.of_zones(ops, calls.heating), self.of_zones(ops, calls.cooling)
        duct: Duct = yield "supply_air"
        pipe: HotWater = yield "hot_water"
        most = self.most_airflow(ops, duct.reach)
        airflow = self.airflow(ops, heating, cooling, most)
        rate = AIR_HEAT_CAPACITY * airflow
        given.put("supply_air", AirDrawn(ops.sums(airflow, self.members), ops.sums(airflow * zone, self.members)))
        supply: SupplyAir = yield "supply_air"
        coil = valve_flow = np.zeros(len(self))  # shut, where nobody calls
        if not (self._tight and ops.surely_below(heating, 0.0)):
            open_water = self.open_water(ops, pipe.opening)
            open_coil = self.conductance(ops, airflow, rate, open_water)
            at_warmest = [o + s * pipe.warmest for o, s in zip(*supply, strict=True)]
            allowance = ops.spread([self.allowance(few, air, pipe.warmest) for air in at_warmest], index)
            coil = self.throttled(ops, self.reheat_call(ops, heating), rate, open_coil, allowance)
            valve_flow = water_share(coil, open_coil, open_water.curve)
        # the coils of an air handler's terminals are as one: q = G (T - T_supply), T_supply = offset + slope T
        conductance = source = 0.0
        for total, offset, slope in zip(ops.sums(coil, self.members), *supply, strict=True):
            conductance, source = conductance + total * (1.0 - slope), source + total * offset
        given.put("hot_water", WaterDrawn(conductance, source, ops.dot(valve_flow, self.water_flow)))

        water: SupplyWater = yield "hot_water"
        entering = ops.spread([o + s * water.temperature for o, s in zip(*supply, strict=True)], index)
        reheat = coil * (water.temperature - entering)
        return TerminalStep(airflow, entering, reheat, valve_flow, rate * (entering - zone) + reheat, most)

    @cached_property
    def members(self) -> NDArray[np.float64]:
        """Terminals of each air handler as 1 of 0 and 1, (n_terminal, n_air_handler)."""
        return np.eye(int(self.air_handler.max()) + 1)[self.air_handler]

    # constants of each terminal as arrays: NumPy takes half as long for an array as for a float
    @cached_property
    def _spans(self) -> tuple[FloatArray, FloatArray]:
        """What calls for cooling, and for heating once the reheat is open, add to the flow [kg/s]."""
        rest = max(1.0 - self.reheat_first, _LEAST)
        return self.design_flow - self.minimum_flow, (self.heating_flow - self.minimum_flow) / rest

    @cached_property
    def _first(self) -> tuple[FloatArray, FloatArray]:
        """Share of the call over which the reheat opens, and one over it."""
        first = np.full(len(self), self.reheat_first)
        return first, 1.0 / first

    @cached_property
    def _resistance(self) -> FloatArray:
        """Of the air film, per power -0.8 of the flow."""
        return self.design_flow**0.8 / self.air_film

    @cached_property
    def _tight(self) -> bool:
        """Whether valves are shut where nobody calls: those of a subclass with rules of its own may leak."""
        own = type(self)
        return own.throttled is Terminals.throttled and own.reheat_call is Terminals.reheat_call

    @cached_property
    def _at_opening(self) -> LastValue:
        return LastValue(partial(water_side, NumpyOperations(), WATER_HEAT_CAPACITY * self.water_flow, self.water_film))

    @cached_property
    def _at_reach(self) -> LastValue:
        return LastValue(self._array_reach)

    def _array_reach(self, *reach: float) -> FloatArray:
        return self.design_flow * (np.array(reach)[self.air_handler] + LEAST_FLOW)

    def most_airflow(self, ops: Operations, reach: Sequence[Value]) -> Value:
        """Most air that the ducts' pressures drive through open dampers [kg/s].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        reach : sequence of Value
            That over the design flow, one an air handler [-].
        """
        if type(reach[0]) is float:
            return self._at_reach(*reach)
        return self.design_flow * (ops.spread(reach, self.air_handler) + LEAST_FLOW)

    def airflow(self, ops: Operations, heating: Value, cooling: Value, most: Value) -> Value:
        """Air that the boxes let through [kg/s].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        heating, cooling, most : Value
            Calls [-]; air that the ducts' pressures drive through open dampers [kg/s].
        """
        by_cooling, by_heating = self._spans
        wanted = self.minimum_flow + by_cooling * cooling
        if self.reheat_first < 1.0:
            wanted = wanted + by_heating * ops.positive(heating - self._first[0])
        return ops.lesser(wanted, most)

    def reheat_call(self, ops: Operations, heating: Value) -> Value:
        """Share of the reheat that is called for [-].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        heating : Value
            Calls [-].
        """
        return heating if self.reheat_first == 1.0 else ops.unit(heating * self._first[1])

    def open_water(self, ops: Operations, water: Value) -> WaterSide:
        """Give the water's side of the coils, valves open.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        water : Value
            Water through open valves over the design flow [-].
        """
        if type(water) is float:
            side: WaterSide = self._at_opening(water)
            return side
        return water_side(ops, WATER_HEAT_CAPACITY * self.water_flow, self.water_film, water)

    def conductance(self, ops: Operations, airflow: Value, rate: Value, water: WaterSide) -> Value:
        """Heat per difference of water and air at the coils' entry [W/K], valves open.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        airflow, rate : Value
            Air [kg/s], above 0, and its heat capacity rate [W/K].
        water : WaterSide
            As `open_water` gives it.
        """
        return coil_conductance(ops, rate, self._resistance * airflow**-0.8, water)

    def allowance(self, ops: Operations, entering: Value, water: Value) -> Value:
        """Rise up to the discharge limit over that up to the water's temperature [-], for the air of an air handler.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        entering, water : Value
            Air and water that enter the coils [K].
        """
        # a difference of nothing leaves valves open for cold water, and closed where nothing is wanted
        return ops.positive(self.discharge_limit - entering) / ops.maximum(water - entering, _LEAST)

    def throttled(self, ops: Operations, call: Value, rate: Value, conductance: Value, allowance: Value) -> Value:
        """Conductance of the coils with their valves as the calls want them [W/K].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        call : Value
            Share of the reheat that is called for [-].
        rate, conductance : Value
            Heat capacity rate of the air, and conductance of the open coils [W/K].
        allowance : Value
            As `allowance` gives it [-].
        """
        to_limit = rate * allowance
        if self.discharge_control:
            return ops.capped(call * to_limit, conductance, 2.5)
        return ops.capped(to_limit, call * conductance, 2.5)

    def read(self, ops: Operations, given: Given, done: TerminalStep) -> list[Value]:
        """Values of its points, one a terminal each.

        Parameters
        ----------
        ops, given, done : Operations, Given, TerminalStep
            Arithmetic; what `run` had, and what it returned.
        """
        damper = np.minimum(done.airflow / done.most_airflow, 1.0) * (done.most_airflow > LEAST_AIR)
        valve = valve_position(ops, done.valve_flow, self.rangeability)
        return [*(values[self.zone] for values in given.conditions[:3]), done.airflow, done.discharge, damper, valve]
