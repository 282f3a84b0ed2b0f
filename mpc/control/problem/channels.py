"""What a controller decides: setpoints, each with its range and how fast it may move."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mpc.errors import ControlError
from mpc.loop.actuators import COOLING_SETPOINT, HEATING_SETPOINT, STATIC_PRESSURE, SUPPLY_AIR, SUPPLY_WATER
from thermal.components.registry import setpoints
from thermal.system.smooth import SmoothHvac

_WORD = {STATIC_PRESSURE: "static pressure", HEATING_SETPOINT: "heating setpoint", COOLING_SETPOINT: "cooling setpoint"}


@dataclass(frozen=True)
class Channel:
    """A setpoint that is decided, of one device or common to several air handlers or zones.

    Parameters
    ----------
    quantity : str
        Type of the point, such as ``supply_air_temperature_setpoint`` or ``zone_air_heating_temperature_setpoint``.
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

    quantity: str
    lower: float
    upper: float
    rate: float = np.inf
    air_handlers: tuple[int, ...] | None = None
    zones: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        ControlError.unless_known(self.quantity, setpoints(), "channel: quantity", "a setpoint of the plant")
        if not (-np.inf < self.lower < self.upper < np.inf and self.rate > 0.0):
            found = f"{self.lower!r} to {self.upper!r}, {self.rate!r} an hour"
            raise ControlError(f"channel {self.quantity}", "a range, and a positive rate", found)

    @property
    def unit(self) -> str:
        """``K`` or ``Pa``."""
        return setpoints()[self.quantity].unit

    @property
    def name(self) -> str:
        """In words, for reports."""
        which = "" if self.air_handlers is None else f" of air handlers {', '.join(map(str, self.air_handlers))}"
        where = "" if self.zones is None else f" of zones {', '.join(map(str, self.zones))}"
        return _WORD.get(self.quantity, self.quantity.removesuffix("_setpoint").replace("_", " ")) + which + where

    @property
    def of_zones(self) -> bool:
        """Whether it is a thermostat's setpoint."""
        return self.quantity in (HEATING_SETPOINT, COOLING_SETPOINT)

    def places(self, hvac: SmoothHvac) -> NDArray[np.intp]:
        """Tell where the setpoint stands among the inputs of a system.

        Parameters
        ----------
        hvac : SmoothHvac
            The system.

        Raises
        ------
        ControlError
            When an air handler or zone is not one of the system's, or its functions do not have the setpoint.
        """
        at = hvac.inputs.get(self.quantity)
        if at is None:
            kind = "pressures" if self.unit == "Pa" else "setpoints"
            advice = f"make the plant's functions with SmoothHvac(system, {kind}=True)"
            raise ControlError(f"channel {self.quantity}", f"a plant whose {kind} can be set", "none", advice)
        count, given = at.stop - at.start, self.zones if self.of_zones else self.air_handlers
        chosen = tuple(range(count)) if given is None or count == 1 else given
        expected, found = f"{'zones' if self.of_zones else 'air handlers'} from 0 to {count - 1}", repr(given)
        ControlError.unless(chosen and set(chosen) <= set(range(count)), f"channel {self.quantity}", expected, found)
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
    return Channel(SUPPLY_AIR, *air, air_rate), Channel(SUPPLY_WATER, *water, water_rate)
