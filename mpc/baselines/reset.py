"""Outdoor reset as a controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mpc.control.controller.rules import ResetRule
from mpc.control.problem.channels import Channel
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER, Actuator
from mpc.scenario.forecast import Forecast
from thermal.case.points import OUTDOOR_TEMPERATURE


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

    Examples
    --------
    >>> air = Actuator("AHU/supply_air_temperature_setpoint", "K", 285.0, 300.0)
    >>> reset = OutdoorReset((air,), "station")
    >>> reset.step({"station/outside_air_temperature_sensor": 289.15}, None)
    {'AHU/supply_air_temperature_setpoint': 286.15}
    """

    def __init__(self, actuators: Sequence[Actuator], weather_station: str, rule: ResetRule | None = None) -> None:
        self.rule, self._outdoor = rule or ResetRule(), f"{weather_station}/{OUTDOOR_TEMPERATURE}"
        self._channels: dict[str, Channel] = {}
        for a in actuators:
            if a.name.endswith(f"/{SUPPLY_AIR}"):
                self._channels[a.name] = Channel(SUPPLY_AIR, a.lowest, a.highest)
            elif a.name.endswith(f"/{SUPPLY_WATER}"):
                self._channels[a.name] = Channel(SUPPLY_WATER, a.lowest, a.highest)

    def step(self, measurements: Mapping[str, float], forecast: Forecast | None) -> dict[str, float]:
        """Choose setpoints [K].

        Parameters
        ----------
        measurements : mapping of str to float
            The outdoor temperature counts [K]; half-way where it is missing.
        forecast : Forecast or None
            Without effect.
        """
        outdoor = float(measurements[self._outdoor]) if self._outdoor in measurements else np.nan
        values = self.rule.setpoints(list(self._channels.values()), outdoor)
        return {name: float(value) for name, value in zip(self._channels, values, strict=True)}
