"""What a plant did, on its own steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpc.errors import MpcError
from thermal._types import FloatArray
from thermal.errors import describe


@dataclass(frozen=True, eq=False)
class PlantRecord:
    """A run of a plant, one row a step of its own.

    Parameters
    ----------
    step : float
        Step of the plant [s].
    zone_temperature : ndarray, shape (n + 1, n_zone)
        At the edges of the steps, straight lines in between [K].
    electricity : ndarray, shape (n,)
        Power taken up by fans, pumps, chillers and heaters, means over the steps [W].
    gas : ndarray, shape (n,)
        Power of the fuel by its upper heating value, means over the steps [W]; None for a plant without.
    district_heating : ndarray, shape (n,)
        Heat bought, means over the steps [W]; None for a plant without.
    co2 : ndarray, shape (n + 1, n_zone)
        Carbon dioxide in the zones' air at the edges of the steps, as a share of volume [-]; None where it is not
        simulated.
    controller_seconds : ndarray, shape (n_action,)
        Time that the controller took for each action [s]; None when it was not measured.

    Raises
    ------
    MpcError
        When shapes do not fit or a value is not finite.
    """

    step: float
    zone_temperature: FloatArray
    electricity: FloatArray
    gas: FloatArray | None = None
    district_heating: FloatArray | None = None
    co2: FloatArray | None = None
    controller_seconds: FloatArray | None = None

    def __post_init__(self) -> None:
        temperature = np.asarray(self.zone_temperature, dtype=float)
        if temperature.ndim != 2 or len(temperature) < 2 or not self.step > 0:
            found = f"shape {temperature.shape}, a step of {self.step} s"
            raise MpcError(describe("record: zone_temperature", "(n + 1, n_zone) over n positive steps", found))
        each = (len(temperature) - 1,)
        shapes = dict.fromkeys(("electricity", "gas", "district_heating"), each) | {"co2": temperature.shape}
        for name in ("zone_temperature", *shapes, "controller_seconds"):
            given = getattr(self, name)
            if given is None:
                continue
            values = np.asarray(given, dtype=float)
            shape = shapes.get(name, values.shape)
            if values.shape != shape:
                raise MpcError(describe(f"record: {name}", f"shape {shape}", f"shape {values.shape}"))
            if not np.isfinite(values).all():
                at = int(np.argmax(~np.isfinite(values).reshape(len(values), -1).all(axis=1)))
                raise MpcError(describe(f"record: {name}", "finite numbers", f"{values[at]} in row {at}"))
            object.__setattr__(self, name, values)

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.electricity)
