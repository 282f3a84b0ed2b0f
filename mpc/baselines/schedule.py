"""A fixed schedule: the design values by day, cooler water by night."""

from __future__ import annotations

from collections.abc import Sequence

from mpc.loop.actuators import Actuator
from mpc.loop.run import FixedSetpoints

_AIR, _WATER = "supply_air_temperature_setpoint", "supply_water_temperature_setpoint"


def day_schedule(
    actuators: Sequence[Actuator],
    *,
    air: float = 285.95,
    water: float = 355.35,
    night_water: float = 333.15,
    day: tuple[float, float] = (4.0, 20.0),
) -> FixedSetpoints:
    """Hold the design temperatures, as a building does whose setpoints were never looked at again.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant: those of supply air and supply water are set, each within its range.
    air, water : float
        By day [K]; the defaults are those that plants are sized for (`thermal.pilot.DesignConditions`), 12.8 and
        82.2 degC, as in the U.S. DOE's reference buildings.
    night_water : float
        From the end of the day to its begin [K].
    day : tuple of float
        Local hours between which the water is hot [h].

    Returns
    -------
    FixedSetpoints
        A controller.

    Examples
    --------
    >>> boiler = Actuator("BOILER/supply_water_temperature_setpoint", "K", 310.0, 355.0)
    >>> schedule = day_schedule((boiler,))
    >>> [schedule.at_hour(hour)[boiler.name] for hour in (3.0, 12.0, 22.0)]
    [333.15, 355.0, 333.15]
    """
    used = tuple(a for a in actuators if a.name.rpartition("/")[2] in (_AIR, _WATER))

    def of(water_now: float) -> dict[str, float]:
        wanted = {_AIR: air, _WATER: water_now}
        return {a.name: min(max(wanted[a.name.rpartition("/")[2]], a.lowest), a.highest) for a in used}

    return FixedSetpoints(of(night_water), used, {day[0]: of(water), day[1]: of(night_water)})
