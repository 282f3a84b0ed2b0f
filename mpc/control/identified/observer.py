"""State of an identified plant from what is measured: the steady Kalman filter of its grey box."""

from __future__ import annotations

import numpy as np

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.fit import steady_gain
from calibration.grey_box.network import NODES
from mpc.control.identified.ahead import Ahead
from mpc.identify.model import PlantModel
from mpc.loop.plant import Measurements
from thermal._types import FloatArray
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE


class GreyBoxObserver:
    """Predicts nodes and unmeasured heat, and corrects them by the zones' temperatures.

    Parameters
    ----------
    model : PlantModel
        Identified.
    """

    def __init__(self, model: PlantModel) -> None:
        self.model, self._whole = model, model.box.disturbed(model.step)
        self._gain, _ = steady_gain(model.box, model.step)
        self._matrix = self._whole.dense()
        self._columns = [f"{zone}/{ZONE_TEMPERATURE}" for zone in model.box.zones]
        self.state: FloatArray = np.zeros(0)

    def zones(self, measurements: Measurements) -> FloatArray:
        """Measured temperatures, shape (n_zone,) [K]; NaN where missing.

        Parameters
        ----------
        measurements : Measurements
            Of the last step.
        """
        return np.array([measurements[c] if c in measurements else np.nan for c in self._columns])

    def outdoor(self, measurements: Measurements, before: Ahead) -> float:
        """Outdoor air over a step that has ended [K]: as measured, else as it was forecast.

        Parameters
        ----------
        measurements : Measurements
            Of that step.
        before : Ahead
            Whose first row was forecast for it.
        """
        for column in measurements.columns:
            if column.rpartition("/")[2] == OUTDOOR_TEMPERATURE and np.isfinite(measurements[column]):
                return measurements[column]
        return float(before.outdoor[0])

    def start(self, measurements: Measurements, outdoor: float) -> None:
        """Begin at rest: nodes at the temperatures that the air would hold them at.

        Parameters
        ----------
        measurements : Measurements
            Before the first step.
        outdoor : float
            Temperature of outdoor air [K].
        """
        box = self.model.box
        zone = np.nan_to_num(self.zones(measurements), nan=REFERENCE) - REFERENCE
        inner, outer = (np.exp(box.parts[f"conductance {link}"]) for link in ("air envelope", "envelope out"))
        envelope = (inner * zone + outer * (outdoor - REFERENCE)) / (inner + outer)
        self.state = np.concatenate([*[zone] * (len(NODES) - 1), envelope, np.zeros(len(zone))])

    def update(self, measurements: Measurements, before: Ahead, levels: FloatArray) -> FloatArray:
        """Take the step that has just ended.

        Parameters
        ----------
        measurements : Measurements
            Of that step.
        before : Ahead
            Whose first row was forecast for it.
        levels : ndarray, shape (n_machine,)
            Duties and loads that were set [-].

        Returns
        -------
        ndarray, shape (n_zone,)
            Innovations: measured less predicted [K]; NaN where missing.
        """
        model, space = self.model, self._whole.space
        outdoor = self.outdoor(measurements, before)
        machines = [found.machine for found in model.maps]
        told = np.array([m.sign * m.given(measurements) if m.meter else np.nan for m in machines])
        heat = np.where(np.isfinite(told), told, model.heat(self.state, levels, outdoor))
        given = model.box.delivered(heat, np.asarray(outdoor))
        gain = before.gain[0] + self._of_air_handler(measurements, float(before.running[0]))
        u = np.concatenate([[outdoor - REFERENCE], before.sun[0], given, gain])
        error = self.zones(measurements) - REFERENCE - self._whole.observation @ self.state - space.feedthrough @ u
        corrected = self.state + self._gain @ np.nan_to_num(error)
        self.state = self._matrix @ corrected
        self.state[: space.order] += space.drive @ u
        return np.asarray(error)

    def _of_air_handler(self, measurements: Measurements, running: float) -> FloatArray:
        """Heat of an air handler's own air to the zones, as measured, else as planned, shape (n_zone,) [W]."""
        model, handler = self.model, self.model.air_handler
        if handler is None:
            return np.zeros(len(model.box.zones))
        told, _ = handler.measured(measurements, [found.machine for found in model.maps])
        known = np.isfinite(told).all()
        return np.asarray(told @ model.box.serves) if known else model.lost(self.state, running)
