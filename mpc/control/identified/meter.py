"""Level of a battery and peak of a month, from what an identified plant measures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import bought
from mpc.control.identified.electric import Electric, ElectricNow
from mpc.identify.model import PlantModel
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.building import Location


class ElectricMeter:
    """Level of the battery, and highest net power of the month, from what is measured.

    Parameters
    ----------
    electric : Electric
        What there is.
    model : PlantModel
        Whose maps say what machines take where that is not measured.
    """

    def __init__(self, electric: Electric, model: PlantModel) -> None:
        self.electric, self.model = electric, model
        self._level, self._peak, self._month, self._generation = 0.5, 0.0, 0, 0.0
        self._net: float | None = None
        self._modelled: FloatArray = np.zeros(len(model.maps))

    def read(self, measurements: Measurements, forecast: Forecast, location: Location) -> ElectricNow:
        """Take the step that has just ended.

        Parameters
        ----------
        measurements : Measurements
            Of that step.
        forecast : Forecast
            Of what comes.
        location : Location
            Where the plant stands.
        """
        electric, step = self.electric, self.model.step
        if self._net is not None:
            powers = [found.machine.power for found in self.model.maps]
            known = np.array([measurements[name] if name in measurements else np.nan for name in powers])
            self._peak = max(self._peak, self._net + float(np.where(np.isfinite(known), known, self._modelled).sum()))
        if measurements.stamp.month != self._month:
            self._month, self._peak = measurements.stamp.month, 0.0
        if electric.level in measurements and np.isfinite(measurements[electric.level]):
            self._level = float(np.clip(measurements[electric.level], 0.0, 1.0))
        generation = np.zeros(len(forecast.table))
        if electric.photovoltaic is not None:
            generation = electric.photovoltaic.power(forecast, location, step)
        self._generation = float(generation[0])
        return ElectricNow(generation, self._level, self._peak)

    def note(self, levels: FloatArray, values: Mapping[str, float], ahead: Ahead, state: FloatArray) -> None:
        """Write down what is done in the coming step.

        Parameters
        ----------
        levels : ndarray, shape (n_machine,)
            Duties and loads of the machines [-].
        values : mapping of str to float
            Of the actuators [unit of each].
        ahead : Ahead
            Whose first row is the step.
        state : ndarray
            Of the observer [K and W].
        """
        water = None if self.model.water is None else values.get(self.model.water.actuator.name)
        self._modelled = bought(self.model, ahead.beyond[0], state, levels, ahead.outdoor[0], water)[:, 0]
        power = 0.0 if self.electric.battery is None else self.electric.battery.power
        base = float(self.model.bought_anyway(ahead.running[0])[0])
        self._net = base + power * values.get(self.electric.command, 0.0) - self._generation
