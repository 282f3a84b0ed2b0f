"""Everything about a horizon that changes from solve to solve: parameters of a problem that is built once."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from mpc.errors import ControlError
from thermal._types import FloatArray
from thermal.errors import describe


@dataclass(frozen=True, eq=False)
class PeakData:
    """Windows of demand charges over a horizon.

    Parameters
    ----------
    weights : ndarray, shape (n_window, N)
        Share of each window's mean power that each step has [-]; rows of zeros are no window.
    offset : ndarray, shape (n_window,)
        What was used of it before the horizon began [W].
    bucket : ndarray of int, shape (n_window,)
        Peak that each window belongs to.
    rate : ndarray, shape (n_bucket,)
        Charge [currency/kW].
    so_far : ndarray, shape (n_bucket,)
        Highest mean of the month up to now: what is below it is free [W].
    """

    weights: FloatArray
    offset: FloatArray
    bucket: NDArray[np.int64]
    rate: FloatArray
    so_far: FloatArray

    @classmethod
    def none(cls, n_steps: int) -> PeakData:
        """No demand charge.

        Parameters
        ----------
        n_steps : int
            N.
        """
        return cls(np.zeros((0, n_steps)), np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))

    def means(self, power: FloatArray) -> FloatArray:
        """Mean power over each window, shape (n_window,) [W].

        Parameters
        ----------
        power : ndarray, shape (N,)
            Electricity [W].
        """
        return self.weights @ power + self.offset

    def peaks(self, power: FloatArray) -> FloatArray:
        """Highest mean of each bucket, not below what it was, shape (n_bucket,) [W].

        Parameters
        ----------
        power : ndarray, shape (N,)
            Electricity [W].
        """
        highest = self.so_far.copy()
        np.maximum.at(highest, self.bucket, self.means(power))
        return highest


@dataclass(frozen=True, eq=False)
class HorizonData:
    """State, forecasts, prices, bands and schedules of one solve; N steps of the horizon.

    Parameters
    ----------
    state : ndarray, shape (r,)
        Of the modes, as `calibration.StateSpace` counts it [(W K)^0.5].
    water : float
        Supply water now [K].
    disturbance : ndarray, shape (n_zone,)
        Unmeasured heat now [W].
    previous : ndarray, shape (n_channel,)
        Setpoints that stand now [unit of the channel].
    boundary : ndarray, shape (N, n_boundary)
        Boundary temperatures, then signals of effects, counted from `thermal.inputs.REFERENCE_TEMPERATURE`
        [signal unit].
    outdoor_temperature, outdoor_humidity : ndarray, shape (N,)
        Of the air that is drawn in [K], [kg/kg].
    gains : ndarray, shape (N, n_zone)
        Expected heat of people and equipment [W].
    lower, upper : ndarray, shape (N, n_zone)
        Comfort band at the end of each step [K].
    heating_setpoint, cooling_setpoint : ndarray, shape (N, n_zone)
        Of the local thermostats [K].
    running, ventilation : ndarray, shape (N, n_air_handler)
        Whether fans run, and the share of the minimum of outdoor air [-].
    boiler : ndarray, shape (N,)
        As there [-].
    electricity_price, gas_price : ndarray, shape (N,)
        Emissions included, at their price [currency/kWh].
    comfort_price : ndarray, shape (N, n_zone)
        Of a kelvin outside of the band for an hour [currency/K/h].
    peaks : PeakData
        Demand charges.
    heat_value : float
        Of a kilowatt-hour of heat that the building holds at the end [currency/kWh]; negative where it is a burden.

    Raises
    ------
    ControlError
        Which of them has the wrong shape, or is not finite and where.
    """

    state: FloatArray
    water: float
    disturbance: FloatArray
    previous: FloatArray
    boundary: FloatArray
    outdoor_temperature: FloatArray
    outdoor_humidity: FloatArray
    gains: FloatArray
    lower: FloatArray
    upper: FloatArray
    heating_setpoint: FloatArray
    cooling_setpoint: FloatArray
    running: FloatArray
    ventilation: FloatArray
    boiler: FloatArray
    electricity_price: FloatArray
    gas_price: FloatArray
    comfort_price: FloatArray
    peaks: PeakData
    heat_value: float = 0.0

    def __post_init__(self) -> None:
        n_steps, n_zone = self.gains.shape
        each, zones = (n_steps,), (n_steps, n_zone)
        air = (n_steps, self.running.shape[-1])
        shapes = {
            "state": self.state.shape, "disturbance": (n_zone,), "previous": self.previous.shape,
            "boundary": (n_steps, self.boundary.shape[-1]), "outdoor_temperature": each, "outdoor_humidity": each,
            "gains": zones, "lower": zones, "upper": zones, "heating_setpoint": zones, "cooling_setpoint": zones,
            "running": air, "ventilation": air, "boiler": each, "electricity_price": each, "gas_price": each,
            "comfort_price": zones, "water": (), "heat_value": (),
        }  # fmt: skip
        for name in (f.name for f in fields(self) if f.name in shapes):
            values = np.asarray(getattr(self, name), dtype=float)
            if values.shape != shapes[name]:
                raise ControlError(describe(f"horizon data: {name}", f"shape {shapes[name]}", f"{values.shape}"))
            if not np.isfinite(values).all():
                at = np.argwhere(~np.isfinite(np.atleast_1d(values)))[0].tolist()
                raise ControlError(describe(f"horizon data: {name}", "finite numbers", f"{values.ravel()[0]} at {at}"))
        if self.peaks.weights.shape[1:] != each:
            expected, found = f"weights of {n_steps} steps", f"{self.peaks.weights.shape}"
            raise ControlError(describe("horizon data: peaks", expected, found))

    @property
    def n_zone(self) -> int:
        """Number of zones."""
        return int(self.gains.shape[1])
