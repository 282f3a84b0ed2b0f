"""What a controller decides: setpoints, each with its range and how fast it may move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from mpc.errors import ControlError
from thermal.errors import describe, nearest
from thermal.hvac._smooth import SmoothHvac

#: What a channel can set.
Quantity = Literal[
    "supply_air_temperature", "supply_water_temperature", "static_pressure", "differential_pressure",
    "heating_setpoint", "cooling_setpoint",
]  # fmt: skip


@dataclass(frozen=True)
class Channel:
    """A setpoint that is decided, of one device or common to several air handlers or zones.

    Parameters
    ----------
    quantity : str
        ``supply_air_temperature``, ``supply_water_temperature``, ``static_pressure``, ``differential_pressure``, or
        ``heating_setpoint`` or ``cooling_setpoint`` of thermostats.
    lower, upper : float
        Range [K or Pa].
    rate : float
        Most change in an hour, either way [K/h or Pa/h]; infinite by default.
    air_handlers : tuple of int, optional
        Which air handlers it belongs to; by default all of them. Of no meaning for water and its pressure.
    zones : tuple of int, optional
        Which zones a thermostat's setpoint belongs to; by default all of them.

    Raises
    ------
    ControlError
        When the quantity is not known, or a number is out of its range.
    """

    quantity: Quantity
    lower: float
    upper: float
    rate: float = np.inf
    air_handlers: tuple[int, ...] | None = None
    zones: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        if self.quantity not in get_args(Quantity):
            advice = nearest(self.quantity, get_args(Quantity))
            raise ControlError(describe("channel: quantity", "a setpoint of the plant", repr(self.quantity), advice))
        if not (-np.inf < self.lower < self.upper < np.inf and self.rate > 0.0):
            found = f"{self.lower!r} to {self.upper!r}, {self.rate!r} an hour"
            raise ControlError(describe(f"channel {self.quantity}", "a range, and a positive rate", found))

    @property
    def unit(self) -> str:
        """``K`` or ``Pa``."""
        return "Pa" if self.quantity.endswith("pressure") else "K"

    @property
    def name(self) -> str:
        """In words, for reports."""
        which = "" if self.air_handlers is None else f" of air handlers {', '.join(map(str, self.air_handlers))}"
        where = "" if self.zones is None else f" of zones {', '.join(map(str, self.zones))}"
        return self.quantity.replace("_", " ") + which + where

    def knobs(self, hvac: SmoothHvac) -> NDArray[np.intp]:
        """Tell where the setpoint stands among the knobs of a plant.

        Parameters
        ----------
        hvac : SmoothHvac
            The plant.

        Raises
        ------
        ControlError
            When an air handler or zone is not one of the plant's, or the plant's functions do not have the setpoint.
        """
        places: dict[str, slice | int | None] = {
            "supply_air_temperature": hvac.knobs.supply_air,
            "supply_water_temperature": hvac.knobs.supply_water,
            "static_pressure": hvac.knobs.static_pressure,
            "differential_pressure": hvac.knobs.differential_pressure,
            "heating_setpoint": hvac.knobs.heating_setpoint,
            "cooling_setpoint": hvac.knobs.cooling_setpoint,
        }
        at = places[self.quantity]
        if at is None or at == slice(0, 0):
            kind = "pressures" if self.unit == "Pa" else "setpoints"
            advice = f"make the plant's functions with SmoothHvac(system, {kind}=True)"
            raise ControlError(describe(f"channel {self.quantity}", f"a plant whose {kind} can be set", "none", advice))
        if isinstance(at, int):
            return np.array([at], dtype=np.intp)
        of_zones = self.quantity in ("heating_setpoint", "cooling_setpoint")
        count, given = (hvac.n_zone, self.zones) if of_zones else (hvac.n_air_handler, self.air_handlers)
        chosen = tuple(range(count)) if given is None else given
        if not chosen or not set(chosen) <= set(range(count)):
            expected = f"{'zones' if of_zones else 'air handlers'} from 0 to {count - 1}"
            raise ControlError(describe(f"channel {self.quantity}", expected, repr(given)))
        return np.arange(at.start, at.stop, dtype=np.intp)[list(chosen)]


def supply_channels(
    air: tuple[float, float] = (285.0, 300.0),
    water: tuple[float, float] = (310.0, 355.0),
    air_rate: float = np.inf,
    water_rate: float = np.inf,
) -> tuple[Channel, Channel]:
    """Decide what the paper's controller does: supply air, common to the air handlers, and supply water.

    Parameters
    ----------
    air, water : tuple of float
        Ranges [K]; the defaults are those of the paper's simulator.
    air_rate, water_rate : float
        Most change in an hour [K/h].
    """
    return (
        Channel("supply_air_temperature", *air, air_rate),
        Channel("supply_water_temperature", *water, water_rate),
    )
