"""The plant of a building: air handlers, hot-water loop, terminals and thermostats, and how they hang together."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from thermal.errors import ModelError, describe
from thermal.hvac._air_handler import AirHandler, Heater
from thermal.hvac._boiler import BoilerLoop
from thermal.hvac._coil import WaterCoil
from thermal.hvac._operations import Operations, Value
from thermal.hvac._terminals import Terminals
from thermal.hvac._thermostat import Thermostat


@dataclass(frozen=True)
class HvacSystem:
    """Devices of a building's plant and how they hang together.

    Parameters
    ----------
    air_handlers : tuple of AirHandler
        At least one.
    loop : BoilerLoop
        The hot-water loop, which every water coil hangs on.
    terminals : Terminals
        Each served by one of the air handlers.
    thermostat : Thermostat
        Of every zone.
    """

    air_handlers: tuple[AirHandler, ...]
    loop: BoilerLoop
    terminals: Terminals
    thermostat: Thermostat = field(default_factory=Thermostat)

    def __post_init__(self) -> None:
        n = len(self.air_handlers)
        served = set(self.terminals.air_handler.tolist())
        if n == 0 or not served or served != set(range(n)):
            expected = "at least one air handler, each with a terminal of its own"
            advice = "Terminals.air_handler holds positions in air_handlers"
            raise ModelError(describe("HvacSystem", expected, f"{n} of them and terminals at {served}", advice))
        zones = np.unique(self.terminals.zone)
        if len(zones) != zones[-1] + 1:
            missing = sorted(set(range(int(zones[-1]))) - set(zones.tolist()))
            raise ModelError(describe("HvacSystem", "a terminal in each zone", f"none in zones {missing[:8]}"))

    @cached_property
    def zone_count(self) -> int:
        """Zones that terminals serve."""
        return int(self.terminals.zone.max()) + 1

    @cached_property
    def members(self) -> NDArray[np.float64]:
        """Terminals of each air handler as 1 of 0 and 1, (n_terminal, n_air_handler)."""
        return np.eye(len(self.air_handlers))[self.terminals.air_handler]

    @cached_property
    def rooms(self) -> NDArray[np.float64]:
        """Terminals of each zone as 1 of 0 and 1, (n_terminal, n_zone)."""
        return np.eye(self.zone_count)[self.terminals.zone]

    @cached_property
    def one_each(self) -> bool:
        """Whether the first terminal serves the first zone and so on."""
        return bool(np.array_equal(self.terminals.zone, np.arange(self.zone_count)))

    @cached_property
    def static_pressures(self) -> tuple[float, ...]:
        """Design static pressures of the air handlers [Pa]."""
        return tuple(handler.supply_fan.static_pressure for handler in self.air_handlers)

    @cached_property
    def water_coils(self) -> tuple[tuple[int, WaterCoil], ...]:
        """Positions of the air handlers with a water coil, and the coils."""
        return tuple((k, h.heating) for k, h in enumerate(self.air_handlers) if isinstance(h.heating, WaterCoil))

    @cached_property
    def heaters(self) -> tuple[tuple[int, Heater], ...]:
        """Positions of the air handlers with a coil that is no water coil, and the coils."""
        return tuple((k, h.heating) for k, h in enumerate(self.air_handlers) if isinstance(h.heating, Heater))

    def at_terminals(self, ops: Operations, values: Value) -> Value:
        """Give values of the zones, one a terminal.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        values : Value
            One a zone.
        """
        return values if self.one_each else ops.pick(values, self.terminals.zone)

    def at_zones(self, ops: Operations, values: Value) -> Value:
        """Sum the terminals' values, one a zone.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        values : Value
            One a terminal.
        """
        return values if self.one_each else ops.columns(ops.sums(values, self.rooms))
