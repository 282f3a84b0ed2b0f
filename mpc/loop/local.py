"""Local control that settles within a step: the zone temperatures at which thermostats and terminals come to rest.

Thermostats act within a minute or two, on air that a terminal can warm or cool by several kelvin in a step of five: a
loop closed from step to step would swing. So the temperature that they see is that of the end of the step,

    T = T_free + R q(T),

with T_free what the zone would reach without supply air, R its response to heat over a step, and q the heat of its
terminals, which falls as T rises. q is taken as lines between the ends of the thermostat's ranges.
"""

from typing import Any

import numpy as np

from thermal._types import FloatArray
from thermal.components.operations import Value
from thermal.components.terminals import Terminals
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY

_FAR = 50.0  # K beyond the thermostat's ranges, where terminals are at their limits and q is a line
_ENDLESS = 1e9  # K
_USUAL = 293.15  # K
_PER_FLOW = 1e4  # J/kg: air 10 K above the zone
_FOLLOW = 0.5  # share of what the last step missed that is made up for in the next


def most_heat(system: HvacSystem) -> FloatArray:
    """Heat that the zones may get, about, shape (n_zone,) [W]: of their air, or else of what stands in them.

    Parameters
    ----------
    system : HvacSystem
        The plant.
    """
    heat = _PER_FLOW * system.by_zone(system.terminals.design_flow)
    others = np.zeros(system.zone_count)
    for group in system.groups.values():
        likely = group.likely_heat(1.0, np.full(len(group), _USUAL))
        others += np.bincount(group.zone, likely, system.zone_count)
    return np.where(heat > 0.0, heat, np.maximum(others, 1.0))


class LocalControl:
    """Finds where the zones of a plant come to rest within a step.

    Parameters
    ----------
    system : HvacSystem
        Thermostat and terminals.
    response : ndarray, shape (n_zone,)
        Rise of the zones over a step per heat [K/W].
    """

    def __init__(self, system: HvacSystem, response: FloatArray) -> None:
        self._system, self.response = system, response
        self._rest = np.zeros(len(response))
        self._columns = np.arange(len(response))
        self._known: tuple[Any, ...] = ()
        self._line: tuple[FloatArray, ...] = ()
        self._start = self._table = np.zeros((0, 0))
        self.missed = np.zeros(len(response))

    @property
    def settles(self) -> bool:
        """Whether the thermostats have no memory; those with one switch from step to step."""
        return not self._system.thermostat.remembers

    def settle(
        self,
        free: FloatArray,
        heating: FloatArray,
        cooling: FloatArray,
        supply: tuple[float, ...],
        reach: tuple[float, ...],
    ) -> FloatArray:
        """Find the zones' temperatures at the end of a step.

        Parameters
        ----------
        free : ndarray, shape (n_zone,)
            That they would reach without supply air [K].
        heating, cooling : ndarray, shape (n_zone,)
            Setpoints [K].
        supply : tuple of float
            Setpoints of the supply air, one an air handler [K].
        reach : tuple of float
            Most flow over the design flow that each duct's pressure drives; 0 where fans are off [-].

        Returns
        -------
        ndarray, shape (n_zone,)
            Temperatures [K].
        """
        known = (id(heating), id(cooling), supply, reach)
        if known != self._known:
            self._lay_out(heating, cooling, supply, reach)
            self._known, self._kept = known, (heating, cooling)  # kept, or others might get their numbers
            self._line = self._lines(free + self.missed)
        free = free + self.missed
        low, high, offset, slope = self._line
        within = (free - low) * (high - free)  # above 0 between the ends of a zone's line
        if not within[within.argmin()] > 0.0:
            *_, offset, slope = self._line = self._lines(free)
        self._rest = offset + free * slope
        return self._rest

    def rest(self, free: Value, lines: tuple[Value, Value, Value, Value]) -> Value:
        """Find the zones' temperatures at the end of a step among lines: `settle` without looking anything up.

        Parameters
        ----------
        free : Value, shape (n_zone,)
            That they would reach without supply air, with what the last step missed [K].
        lines : tuple of Value
            As `segments` gives them.
        """
        begin, _, offset, slope = lines
        chosen_offset, chosen_slope = offset[0], slope[0]
        for k in range(1, len(begin)):
            beyond = begin[k] < free
            chosen_offset = np.where(beyond, offset[k], chosen_offset)
            chosen_slope = np.where(beyond, slope[k], chosen_slope)
        return chosen_offset + free * chosen_slope

    def _lines(self, free: FloatArray) -> tuple[FloatArray, ...]:
        """On which line each zone is: where it begins and ends, and its offset and slope."""
        place = np.add.reduce(self._start < free, axis=0) * free.size + self._columns
        return tuple(self._table.take(place, axis=1))

    def learn(self, reached: FloatArray) -> None:
        """Take note of where the zones came to, for what the next step is to make up for.

        Parameters
        ----------
        reached : ndarray, shape (n_zone,)
            Temperatures at the end of the step [K].
        """
        self.missed = self.missing(self.missed, reached, self._rest)

    @staticmethod
    def missing(missed: Value, reached: Value, rest: Value) -> Value:
        """Give what the next step is to make up for [K].

        Parameters
        ----------
        missed : Value
            That the last one was to make up for [K].
        reached, rest : Value
            Where the zones came to, and where they were expected [K].
        """
        return missed + _FOLLOW * (reached - rest)

    def _lay_out(
        self, heating: FloatArray, cooling: FloatArray, supply: tuple[float, ...], reach: tuple[float, ...]
    ) -> None:
        """Tabulate which end temperature belongs to which free temperature."""
        _, end, offset, slope = self.segments(heating, cooling, np.array(supply), np.array(reach))
        # points fall where more air warms a zone that is too warm: the last line that is reached counts, as in `rest`
        self._start = np.minimum.accumulate(end[-2::-1])[::-1]
        endless = np.full((1, len(slope[0])), _ENDLESS)  # the outer lines go on for ever
        begin, end = np.concatenate([-endless, self._start]), np.concatenate([self._start, endless])
        self._table = np.stack([t.ravel() for t in (begin, end, offset, slope)])

    def segments(
        self, heating: Value, cooling: Value, supply: Value, reach: Value, zero: float = 0.0
    ) -> tuple[Value, Value, Value, Value]:
        """Lay out which end temperature belongs to which free temperature: lines between seven rising points.

        Parameters
        ----------
        heating, cooling : Value, shape (n_zone,)
            Setpoints, counted from `zero` [K].
        supply : Value, shape (n_air_handler,)
            Setpoints of the supply air, counted from `zero` [K].
        reach : Value, shape (n_air_handler,)
            Most flow over the design flow that each duct's pressure drives [-].
        zero : float
            Temperature that the others are counted from [K].

        Returns
        -------
        tuple of Value, shape (6, n_zone)
            Free temperatures at which the lines begin and end, counted from `zero` [K]; offset [K] and slope [-].
        """
        system, terminals, width = self._system, self._system.terminals, self._system.thermostat.throttling_range
        first = min(terminals.reheat_first, 0.999)
        air, most = supply[terminals.air_handler], reach[terminals.air_handler] * terminals.design_flow
        limit = np.maximum(air, terminals.discharge_limit - zero)
        low, high = heating, heating + np.maximum(cooling - heating, 1e-3)
        full = low - width
        ends = np.stack([full - _FAR, full, low - first * width, low, high, high + width, high + width + _FAR])
        least, warm, cool = (np.minimum(most, f) for f in (
            terminals.minimum_flow, terminals.heating_flow, terminals.design_flow))  # fmt: skip
        flows = np.stack([warm, warm, least, least, least, cool, cool])
        discharge = np.stack([limit, limit, limit, air, air, air, air])
        seen = ends if terminals.one_each == system.zone_count else ends[:, terminals.zone]
        heat = system.by_zone(AIR_HEAT_CAPACITY * flows * (discharge - seen))
        if len(system.groups) > bool(len(terminals)):
            heat = heat + np.stack([self._likely(call, end + zero) for call, end in zip(
                (1.0, 1.0, first, 0.0, 0.0, -1.0, -1.0), ends, strict=True)])  # fmt: skip
        start = ends - self.response * heat
        begin, end = start[:-1], start[1:]
        slope = (ends[1:] - ends[:-1]) / (end - begin)
        return begin, end, ends[:-1] - slope * begin, slope

    def _likely(self, call: float, zone: Value) -> Value:
        """Heat that all but terminals are likely to bring to the zones [W]."""
        system = self._system
        others = [(name, g) for name, g in system.groups.items() if not isinstance(g, Terminals)]
        return sum(g.likely_heat(call, zone[g.zone]) @ system.rooms[name] for name, g in others)
