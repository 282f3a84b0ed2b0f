"""Baselines by rule: a fixed schedule, outdoor reset, and all of them by name."""

from collections.abc import Callable, Mapping, Sequence

from mpc.baselines.guideline36 import Guideline36
from mpc.control.controller.site import ResetRule, SitePoints, values_of
from mpc.control.problem.channels import Channel
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER, Actuator, need_actuator
from mpc.loop.plant import Controller
from mpc.loop.run import FixedSetpoints
from mpc.scenario.forecast import Forecast
from thermal.case.points import OUTDOOR_TEMPERATURE

_SUPPLY = (SUPPLY_AIR, SUPPLY_WATER)


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
        By day [K]; the defaults are those that plants are sized for (`thermal.system.sizing.DesignConditions`), 12.8
        and 82.2 degC, as in the U.S. DOE's reference buildings.
    night_water : float
        From the end of the day to its begin [K].
    day : tuple of float
        Local hours between which the water is hot [h].

    Returns
    -------
    FixedSetpoints
        A controller.

    Raises
    ------
    ControlError
        When the plant has neither.

    Examples
    --------
    >>> boiler = Actuator("BOILER/supply_water_temperature_setpoint", "K", 310.0, 355.0)
    >>> schedule = day_schedule((boiler,))
    >>> [schedule.at_hour(hour)[boiler.name] for hour in (3.0, 12.0, 22.0)]
    [333.15, 355.0, 333.15]
    """
    need_actuator("day schedule", _SUPPLY, actuators)
    used = tuple(a for a in actuators if a.name.rpartition("/")[2] in _SUPPLY)

    def of(water_now: float) -> dict[str, float]:
        wanted = {SUPPLY_AIR: air, SUPPLY_WATER: water_now}
        return {a.name: min(max(wanted[a.name.rpartition("/")[2]], a.lowest), a.highest) for a in used}

    return FixedSetpoints(of(night_water), used, {day[0]: of(water), day[1]: of(night_water)})


class OutdoorReset:
    """Supply air and water follow the outdoor temperature that the weather station reports.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant: those of supply air and supply water are set.
    weather_station : str
        Its name.
    rule : ResetRule, optional
        Lines of the reset.

    Raises
    ------
    ControlError
        When the plant has neither.

    Examples
    --------
    >>> air = Actuator("AHU/supply_air_temperature_setpoint", "K", 285.0, 300.0)
    >>> reset = OutdoorReset((air,), "station")
    >>> reset.step({"station/outside_air_temperature_sensor": 289.15}, None)
    {'AHU/supply_air_temperature_setpoint': 286.15}
    """

    def __init__(self, actuators: Sequence[Actuator], weather_station: str, rule: ResetRule | None = None) -> None:
        need_actuator("outdoor reset", _SUPPLY, actuators)
        self.rule, self._outdoor = rule or ResetRule(), f"{weather_station}/{OUTDOOR_TEMPERATURE}"
        named = [(a, a.name.rpartition("/")[2]) for a in actuators]
        self._channels = {a.name: Channel(kind, a.lowest, a.highest) for a, kind in named if kind in _SUPPLY}

    def step(self, measurements: Mapping[str, float], forecast: Forecast | None) -> dict[str, float]:
        """Choose setpoints [K].

        Parameters
        ----------
        measurements : mapping of str to float
            The outdoor temperature counts [K]; half-way where it is missing.
        forecast : Forecast or None
            Without effect.
        """
        outdoor = float(values_of(measurements, [self._outdoor])[0])
        values = self.rule.setpoints(list(self._channels.values()), outdoor)
        return {name: float(value) for name, value in zip(self._channels, values, strict=True)}


#: Makes a controller of a plant's points, of the air handler of each terminal, and of the actuators.
Baseline = Callable[[SitePoints, Sequence[int], Sequence[Actuator]], Controller]

#: Every baseline by name, made in one and the same way: ``BASELINES["reset"](points, serving, actuators)``.
BASELINES: dict[str, Baseline] = {
    "schedule": lambda points, serving, actuators: day_schedule(actuators),
    "reset": lambda points, serving, actuators: OutdoorReset(actuators, points.weather_station),
    "guideline36": Guideline36,
}
