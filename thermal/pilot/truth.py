"""What a twin is drawn from, and what is true of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from thermal.errors import ThermalError
from thermal.parameters import Parameter

Series = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TwinRanges:
    """What a twin's unmeasured heat and sensors are drawn from, each log-uniformly between two values.

    Parameters
    ----------
    disturbance_deviation : tuple of float
        Stationary standard deviation of a zone's unmeasured heat per floor area [W/m2], 0 or more. The default goes
        from a well metered zone to an office whose people, plugs and sun nobody records.
    disturbance_time : tuple of float
        Its correlation time [s], positive. The default is half an hour (doors, meetings) to 8 hours (a working day).
    noise : tuple of float
        Standard deviation of the temperature sensors [K], 0 or more. The default goes from a calibrated probe to a wall
        thermostat.

    Raises
    ------
    ThermalError
        When a range is out of order, below its least value, or leads from zero to something.
    """

    disturbance_deviation: tuple[float, float] = (0.3, 3.0)
    disturbance_time: tuple[float, float] = (1800.0, 28800.0)
    noise: tuple[float, float] = (0.02, 0.1)

    def __post_init__(self) -> None:
        for name, (low, high) in vars(self).items():
            positive = low > 0.0 or (low == high == 0.0 and name != "disturbance_time")
            if not (positive and low <= high < np.inf):
                raise ThermalError(
                    f"ranges: {name}: expected two positive numbers in order (or twice 0 for none), found {low}, {high}"
                )


@dataclass(frozen=True, eq=False)
class TwinTruth:
    """What is true of a twin, and what its telemetry does not say.

    Parameters
    ----------
    seed : int
        That it was made from.
    parameters : tuple of Parameter
        Of its model.
    theta : numpy.ndarray, shape (n_parameter,)
        Their true values [parameter units].
    disturbance_deviation : float
        Stationary standard deviation of the unmeasured heat per floor area [W/m2].
    disturbance_time : float
        Its correlation time [s].
    noise : float
        Standard deviation of the temperature sensors [K].
    resolution : float
        Steps of the temperature sensors [K], 0 for none.
    zone_temperatures : numpy.ndarray, shape (n_time, n_zone)
        Mean air temperatures over the steps of the telemetry [K].
    heat : numpy.ndarray, shape (n_time, n_zone)
        Heat that the terminal units brought into the air [W].
    disturbance : numpy.ndarray, shape (n_time, n_zone)
        Unmeasured heat that entered the air beside it [W].
    states : numpy.ndarray, shape (n_node,)
        Temperatures of all control volumes at the first stamp [K].
    """

    seed: int
    parameters: tuple[Parameter, ...]
    theta: Series
    disturbance_deviation: float
    disturbance_time: float
    noise: float
    resolution: float
    zone_temperatures: Series
    heat: Series
    disturbance: Series
    states: Series

    @property
    def values(self) -> dict[str, float]:
        """True value of each parameter by name, as `Simulator` takes them [parameter units]."""
        return {p.name: float(value) for p, value in zip(self.parameters, self.theta, strict=True)}

    def to_dict(self) -> dict[str, Any]:
        """Give all but the series as plain types, for JSON; ``parameters`` is what `load_parameters` reads."""
        names = ("seed", "disturbance_deviation", "disturbance_time", "noise", "resolution")
        return {
            **{name: getattr(self, name) for name in names},
            "parameters": {name: {"value": value} for name, value in self.values.items()},
        }
