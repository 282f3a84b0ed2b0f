"""Errors of sensors and meters: white, drawn from seed and step alone."""

from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mpc.errors import PlantError
from mpc.loop.plant import PointLayout
from mpc.loop.random_numbers import normal_numbers, stream_key
from thermal._types import FloatArray
from thermal.components.operations import Value

STREAM = 7  # of random numbers of a seed, apart from those of people, forecasts and the shuffle
_BLOCK = 64  # steps whose noise is drawn together
_FREEZING = 273.15  # K: sensors count their resolution from here


@dataclass(frozen=True)
class SensorNoise:
    """Errors of sensors and meters, independent from step to step.

    Parameters
    ----------
    temperature : float
        Standard deviation of temperature sensors [K]; the default is that of the shared practice cases.
    resolution : float
        Steps of temperature sensors [K]; 0 reports every digit.
    flow : float
        Standard deviation of air flow stations as a share of the flow [-]; the default is that of new ones (ASHRAE
        Handbook, Fundamentals 2017, ch. 37).
    power : float
        Standard deviation of meters as a share of the power [-]; the default is a class 1 meter's (IEC 62053-21).
    pressure : float
        Standard deviation of pressure transmitters as a share of the pressure [-]; the default is usual for those of
        ducts and pumps (accuracy of 1 %).

    Raises
    ------
    PlantError
        When one is negative or no number.
    """

    temperature: float = 0.03
    resolution: float = 0.02
    flow: float = 0.02
    power: float = 0.01
    pressure: float = 0.01

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            PlantError.unless(0.0 <= value < np.inf, f"sensor noise: {name}", "0 or more", repr(value))


class NoiseSource:
    """Noise of the columns of a plant.

    Parameters
    ----------
    layout : PointLayout
        Columns; setpoints, commands and weather have none.
    noise : SensorNoise
        How much.
    """

    def __init__(self, layout: PointLayout, noise: SensorNoise) -> None:
        self.layout, self.noise = layout, noise
        self._block: tuple[tuple[int, int], FloatArray] = ((-1, -1), np.zeros((0, 0)))

    @cached_property
    def _groups(self) -> list[tuple[NDArray[np.intp], NDArray[np.intp], float, float, float]]:
        """Columns with noise, which random numbers are theirs, absolute and relative deviation, steps they count in."""
        noise = self.noise
        by = {"temperature": (noise.temperature, 0.0), "air_flow": (0.0, noise.flow), "power": (0.0, noise.power),
              "pressure": (0.0, noise.pressure)}  # fmt: skip
        columns = enumerate(zip(self.layout.columns, self.layout.quantities, strict=True))
        kept = [(k, q) for k, (name, q) in columns if name.endswith("_sensor") and q in by]
        found = []
        for quantity, deviations in by.items():
            rows = [(k, n) for n, (k, q) in enumerate(kept) if q == quantity]
            if rows:
                column, number = (np.array(v, dtype=np.intp) for v in zip(*rows, strict=True))
                found.append((column, number, *deviations, noise.resolution * (quantity == "temperature")))
        return found

    @cached_property
    def width(self) -> int:
        """Random numbers of a step."""
        return sum(column.size for column, *_ in self._groups)

    def disturb(self, k: int, values: FloatArray, seed: int) -> FloatArray:
        """Add the noise of a step to its values, which depends on seed and step only.

        Parameters
        ----------
        k : int
            Number of the step, 0 or more.
        values : ndarray, shape (n_column,)
            Exact values [library's units]; written to.
        seed : int
            0 or more.
        """
        number, row = divmod(k, _BLOCK)
        if self._block[0] != (seed, number):
            steps = _BLOCK * number + np.arange(_BLOCK)
            drawn = normal_numbers(np.full(_BLOCK, stream_key(seed, STREAM)), steps, self.width)
            self._block = ((seed, number), drawn.T.astype(float))
        self.add(values, self._block[1][row])
        return values

    def add(self, values: Value, drawn: Value) -> None:
        """Add noise to values.

        Parameters
        ----------
        values : Value, shape (n_column,)
            Exact values [library's units]; written to.
        drawn : Value, shape (width,)
            Random numbers [-].
        """
        for column, number, absolute, relative, step in self._groups:
            exact, drawn_here = values[column], drawn[number]
            seen = exact + (np.abs(exact) * relative if relative else absolute) * drawn_here
            values[column] = np.rint((seen - _FREEZING) / step) * step + _FREEZING if step > 0.0 else seen
