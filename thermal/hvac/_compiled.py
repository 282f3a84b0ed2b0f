"""The central devices of a plant as two compiled functions: exact, and many times faster than floats of Python."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi
import numpy as np

from thermal._types import FloatArray
from thermal.hvac._air_handler import Mixed, Warmed
from thermal.hvac._boiler import Heated
from thermal.hvac._central import Circulated, DirectCentral, Supplied
from thermal.hvac._operations import CasadiOperations
from thermal.hvac._settings import Settings
from thermal.hvac._step import Conditions
from thermal.hvac._system import HvacSystem

_AIR, _COIL, _LOOP = len(Mixed._fields), len(Warmed._fields), len(Heated._fields)


class CompiledCentral:
    """The equations of `DirectCentral`, written down once by CasADi and evaluated in place.

    Parameters
    ----------
    system : HvacSystem
        The plant.

    Notes
    -----
    A plant of two air handlers has some 900 operations on single numbers a step, 50 ns each in Python, 4 ns here. The
    two functions share their memory: the second reads what the first was given and what it gave.
    """

    def __init__(self, system: HvacSystem) -> None:
        self._system, self._count = system, len(system.air_handlers)
        n = self._count
        self._now, self._set, self._load = np.zeros(5 + 3 * n), np.zeros(4 + 4 * n), np.zeros(n + 1)
        self._air, self._loop = np.zeros((_AIR + _COIL + 1) * n), np.zeros(_LOOP + 5 + n)
        self._settings: Settings | None = None

    @cached_property
    def _runs(self) -> tuple[Any, ...]:
        """Both functions, bound to the arrays, and what must live as long as they do."""
        n, sizes = self._count, (self._now.size, self._set.size, self._load.size)
        now, fixed, load = (casadi.SX.sym(name, size) for name, size in zip(("now", "set", "load"), sizes, strict=True))
        direct = DirectCentral(CasadiOperations(), self._system)
        water, outdoor, damp, room, step = (now[k] for k in range(5))
        humid, flows, warmth = (_parts(now[5 + k * n : 5 + (k + 1) * n]) for k in range(3))
        each = [_parts(fixed[4 + k * n : 4 + (k + 1) * n]) for k in range(4)]
        supply_air, static_pressure, running, ventilation = each
        settings = Settings(
            supply_air, fixed[0], static_pressure, fixed[1], running, fixed[2], ventilation, None, fixed[3]
        )
        conditions = Conditions(None, None, None, outdoor, damp, humid, room)
        supplied = direct.supply(flows, warmth, water, conditions, settings, step)
        air = [*(v for m in supplied.mixed for v in m), *(v for w in supplied.warmed for v in w), *supplied.allowances]
        done = direct.circulate(_of_list(_parts(given := casadi.SX.sym("air", self._air.size)), n), _parts(load)[:n],
                                load[n])  # fmt: skip
        loop = [*done.loop, done.water_flow, done.return_water, done.pump_power, done.electric_power, done.fuel_power,
                *done.supply_temperature]  # fmt: skip
        first = casadi.Function("supply", [now, fixed], [casadi.densify(casadi.cse(casadi.vertcat(*air)))])
        second = casadi.Function(
            "circulate", [now, fixed, given, load], [casadi.densify(casadi.cse(casadi.vertcat(*loop)))]
        )
        bound = [
            _bound(first, (self._now, self._set), self._air),
            _bound(second, (self._now, self._set, self._air, self._load), self._loop),
        ]
        return bound[0][1], bound[1][1], first, second, bound

    def supply(
        self,
        flows: Sequence[float],
        warmth: Sequence[float],
        water: float,
        conditions: Conditions,
        settings: Settings,
        step: float,
    ) -> Supplied:
        """Mix, cool and warm the air; see `Central`.

        Parameters
        ----------
        flows, warmth, water, conditions, settings, step : as there
            [kg/s], [kg K/s], [K], ..., [s].
        """
        _, _, _, outdoor, damp, humid, room = conditions
        if settings is not self._settings:
            self._settings = settings
            self._set[:] = [
                settings.supply_water, settings.differential_pressure, settings.boiler, settings.opening,
                *settings.supply_air, *settings.static_pressure, *settings.running, *settings.ventilation,
            ]  # fmt: skip
        humidities = humid if type(humid) is tuple else (humid,) * self._count
        self._now[:] = [water, outdoor, damp, room, step, *humidities, *flows, *warmth]
        self._runs[0]()
        return _of_list(self._air.tolist(), self._count)

    def circulate(self, supplied: Supplied, reheat: Sequence[float], drawn: float) -> Circulated:
        """Heat the water of the same step; see `Central`.

        Parameters
        ----------
        supplied : Supplied
            As there; it is known here.
        reheat : sequence of float
            As there [W/K].
        drawn : float
            As there [kg/s].
        """
        self._load[:] = [*reheat, drawn]
        self._runs[1]()
        water, boiler, load, loss, storage, flow, back, pump, electric, fuel, *supply = self._loop.tolist()
        return Circulated(Heated(water, boiler, load, loss, storage), supply, flow, back, pump, electric, fuel)


def _parts(values: Any) -> tuple[Any, ...]:
    return tuple(casadi.vertsplit(values))


def _of_list(values: Sequence[Any], n: int) -> Supplied:
    """Lay out what stands in a row: air, coils and allowances of n air handlers."""
    mixed = tuple([Mixed._make(values[k : k + _AIR]) for k in range(0, _AIR * n, _AIR)])
    begin, end = _AIR * n, (_AIR + _COIL) * n
    warmed = tuple([Warmed._make(values[k : k + _COIL]) for k in range(begin, end, _COIL)])
    return Supplied(mixed, warmed, values[end:])


def _bound(function: Any, arguments: Sequence[FloatArray], result: FloatArray) -> tuple[Any, Any]:
    """Bind a function to the arrays that it reads and writes."""
    buffer, run = function.buffer()
    for k, array in enumerate(arguments):
        buffer.set_arg(k, memoryview(array.data))
    buffer.set_res(0, memoryview(result.data))
    return buffer, run
