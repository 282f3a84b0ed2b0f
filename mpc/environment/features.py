"""Entries of an observation, each with a fixed physical range: measurements, forecast and clock."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import yaml

from mpc.errors import MpcError
from mpc.loop.actuators import Actuator
from mpc.scenario.forecast import Forecast, Forecaster, column_unit
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, split_column
from thermal.units import QUANTITIES

#: Ends of the range that each point is counted in [library's units], as the file says.
OBSERVED_RANGES: Mapping[str, tuple[float, float]] = {
    point: (lowest, highest)
    for point, (lowest, highest) in yaml.safe_load(Path(__file__).with_name("ranges.yaml").read_bytes()).items()
}

#: Ends of the blocks over which a forecast is averaged, from now on [h]: the horizon of the paper's predictions, six
#: hours, fine at first as its beginning matters most.
BLOCK_ENDS = (0.5, 1.0, 2.0, 3.0, 4.5, 6.0)

_HOUR = 3600.0  # s
_OF_ALL = ("electricity_price", "gas_price", "electricity_carbon_intensity", "gas_carbon_intensity")
_OF_ZONES = ("internal_gain", "comfort_lower_temperature", "comfort_upper_temperature")

#: Values are cut at this many times half of their range from its middle [-].
LARGEST = 4.0

_BY_AREA = ("air_flow", "power", "count")


@dataclass(frozen=True)
class Feature:
    """An entry of an observation.

    Parameters
    ----------
    name : str
        ``ENTITY/POINT``, or what it says of the forecast or the clock.
    unit : str
        Of the ends of its range.
    lowest, highest : float
        What counts as -1 and as 1 [unit].
    """

    name: str
    unit: str
    lowest: float
    highest: float


def measured_features(
    columns: Sequence[str],
    actuators: Sequence[Actuator],
    floor_area: float,
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[tuple[int, ...], tuple[Feature, ...]]:
    """Lay out what is observed of a plant's measurements.

    Directions (of the wind) have no range from low to high and are left out.

    Parameters
    ----------
    columns : sequence of str
        Of the plant's measurements, ``ENTITY/POINT``.
    actuators : sequence of Actuator
        Their own ranges hold for the setpoints that are measured.
    floor_area : float
        Of the building [m2].
    ranges : mapping of str to tuple of float, optional
        By point, or by column, in the place of `OBSERVED_RANGES` and as they are there [library's units].

    Returns
    -------
    tuple
        Positions among the columns, and a feature for each.

    Raises
    ------
    MpcError
        When the floor area or a range is none, or a range is for nothing that is measured.
    """
    points = [split_column(column, "plant")[1] for column in columns]
    given = dict(ranges or {})
    for name, (lowest, highest) in given.items():
        MpcError.unless_known(name, {*points, *columns, *OBSERVED_RANGES}, "ranges", "a point that is observed")
        rises = -np.inf < lowest < highest < np.inf
        MpcError.unless(rises, f"ranges: {name}", "a lower and a higher number", (lowest, highest))
    MpcError.unless(0.0 < floor_area < np.inf, "floor area", "a positive number of m2", floor_area)
    own = {a.name: (a.lowest, a.highest) for a in actuators if a.required}
    count, kept, features = Counter(points), [], []
    for at, (column, point) in enumerate(zip(columns, points, strict=True)):
        quantity = POINT_TYPES[point].quantity
        if quantity == "angle":
            continue
        per_device = floor_area / count[point] if quantity in _BY_AREA else 1.0
        default = own.get(column) or tuple(per_device * v for v in {**OBSERVED_RANGES, **given}[point])
        lowest, highest = given.get(column, default)
        kept.append(at)
        features.append(Feature(column, QUANTITIES[quantity].unit, lowest, highest))
    return tuple(kept), tuple(features)


def scaling(features: Sequence[Feature]) -> tuple[FloatArray, FloatArray]:
    """Factors and offsets that bring values into their ranges: ``factor * value + offset``.

    Parameters
    ----------
    features : sequence of Feature
        In the order of the values.

    Returns
    -------
    tuple of ndarray, shape (n_feature,)
        Factors [1/unit] and offsets [-].
    """
    lowest, highest = (np.array([getattr(f, end) for f in features], dtype=float) for end in ("lowest", "highest"))
    factor = 2.0 / (highest - lowest)
    return factor, -1.0 - factor * lowest


class Outlook:
    """Means of a forecast over blocks of time: weather, prices, emissions, and of the zones' gains and bands.

    It takes from a forecast all that an optimal controller gets: every column of weather but the wind's direction,
    prices, emissions, the sum of the zones' gains and the means of the ends of their bands. Beyond the end of a
    forecast its last values hold.

    Parameters
    ----------
    columns : sequence of str
        That forecasts have.
    zones : sequence of str
        Names of the zones.
    step : float
        Of forecasts [s].
    floor_area : float
        Of the building [m2].
    block_ends : sequence of float
        Ends of the blocks from now on [h], rising, whole numbers of steps.

    Raises
    ------
    MpcError
        When the blocks are not whole numbers of steps that rise, or forecasts lack a zone.
    """

    def __init__(
        self,
        columns: Sequence[str],
        zones: Sequence[str],
        step: float,
        floor_area: float,
        block_ends: Sequence[float] = BLOCK_ENDS,
    ) -> None:
        ends = np.asarray(block_ends, dtype=float) * _HOUR / step
        edges = np.concatenate([[0], np.round(ends).astype(int)])
        whole = len(ends) and (np.diff(edges) >= 1).all() and np.allclose(edges[1:], ends)
        expected = f"ends that rise, whole numbers of steps of {step:g} s"
        MpcError.unless(whole, "outlook: block_ends", expected, tuple(block_ends))
        for column in (f"{zone}/{name}" for name in _OF_ZONES for zone in zones):
            MpcError.unless(column in columns, "outlook", f"forecasts with {column!r}", "none", "use a Forecaster")
        weather = [c for c in columns if "/" not in c and c.endswith("_sensor") and "direction" not in c]
        single = [*weather, *(c for c in _OF_ALL if c in columns)]
        self.columns = (*single, *(f"{zone}/{name}" for name in _OF_ZONES for zone in zones))
        self._position = {column: k for k, column in enumerate(self.columns)}
        self._weights = np.zeros((len(ends), int(edges[-1])))
        for k, (first, last) in enumerate(pairwise(edges.tolist())):
            self._weights[k, first:last] = 1.0 / (last - first)
        self._zones = np.zeros((len(self.columns), len(single) + len(_OF_ZONES)))
        self._zones[: len(single), : len(single)] = np.eye(len(single))
        for k, name in enumerate(_OF_ZONES):
            rows = [self._position[f"{zone}/{name}"] for zone in zones]
            self._zones[rows, len(single) + k] = 1.0 if name == "internal_gain" else 1.0 / len(zones)
        #: What is observed, block by block.
        self.features = tuple(
            _feature(name, f"{begin:g} to {end:g} h", floor_area)
            for begin, end in zip((0.0, *block_ends[:-1]), block_ends, strict=True)
            for name in (*single, *_OF_ZONES)
        )
        self._factor, self._offset = scaling(self.features)

    @property
    def steps(self) -> int:
        """Steps of a forecast that are looked at."""
        return int(self._weights.shape[1])

    def of_values(self, values: FloatArray) -> FloatArray:
        """Observe a forecast given as an array.

        Parameters
        ----------
        values : ndarray, shape (n_steps, n_column)
            Columns as `columns` [library's units].

        Returns
        -------
        ndarray, shape (n_feature,)
            Scaled [-].
        """
        if len(values) < self.steps:
            values = np.vstack([values, np.repeat(values[-1:], self.steps - len(values), axis=0)])
        means = self._weights @ (values[: self.steps] @ self._zones)
        return np.asarray(self._factor * means.ravel() + self._offset)

    def of_forecast(self, forecast: Forecast) -> FloatArray:
        """Observe a forecast.

        Parameters
        ----------
        forecast : Forecast
            On regular steps, from now on.

        Returns
        -------
        ndarray, shape (n_feature,)
            Scaled [-].
        """
        return self.of_values(forecast.values(self.columns, fill="hold"))

    def table(self, forecaster: Forecaster) -> FloatArray:
        """Observe all forecasts that a forecaster can give.

        Parameters
        ----------
        forecaster : Forecaster
            Of the scenario.

        Returns
        -------
        ndarray, shape (n, n_feature)
            One row for each step that a forecast begins at, scaled [-].
        """
        at = [forecaster.columns.index(column) for column in self.columns]
        count = forecaster.scenario.grid.n_steps - forecaster.horizon + 1
        return np.stack([self.of_values(forecaster.values(k)[:, at]) for k in range(count)])


def _feature(name: str, when: str, floor_area: float) -> Feature:
    unit = column_unit(f"zone/{name}") if name in _OF_ZONES else column_unit(name)
    share = floor_area if name == "internal_gain" else 1.0
    lowest, highest = (share * end for end in OBSERVED_RANGES[name])
    return Feature(f"{name}, {when}", unit, lowest, highest)


#: Entries of the clock: the local hour of the day, the day of the week and the day of the year as points on circles.
CLOCK_FEATURES = tuple(
    Feature(f"{part} of the {whole}", "-", -1.0, 1.0)
    for whole in ("day", "week", "year")
    for part in ("sine", "cosine")
)


@lru_cache(maxsize=100_000)
def clock(seconds: int, timezone: str) -> FloatArray:
    """Observe the local clock.

    Parameters
    ----------
    seconds : int
        Since 1970 in UTC [s].
    timezone : str
        IANA name.

    Returns
    -------
    ndarray, shape (6,)
        Sine and cosine of the time of day, of week and of year, as `CLOCK_FEATURES` [-].

    Examples
    --------
    >>> clock(6 * 3600, "UTC")[:2].round(3).tolist()  # six in the morning
    [1.0, 0.0]
    """
    now = datetime.fromtimestamp(seconds, ZoneInfo(timezone))
    day = (now.hour + now.minute / 60.0 + now.second / 3600.0) / 24.0
    shares = day, (now.weekday() + day) / 7.0, (now.timetuple().tm_yday - 1 + day) / 365.25
    return np.array([f(2.0 * math.pi * share) for share in shares for f in (math.sin, math.cos)])
