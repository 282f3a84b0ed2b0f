"""Weather at the building: readings or means at regular stamps, on any grid of steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator, make_interp_spline

from mpc.errors import WeatherError
from mpc.scenario.grid import StepGrid, index_seconds, regular_steps, require_cover
from thermal._types import BoolArray, FloatArray
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.inputs.sun import Sun, sun_of

DIRECTION = "wind_direction_sensor"
SUN_POINTS = (
    "direct_normal_irradiance_sensor",
    "diffuse_horizontal_irradiance_sensor",
    "global_horizontal_irradiance_sensor",
)
SKY = "horizontal_infrared_irradiance_sensor"

#: Points of the weather station, as the case format names them.
WEATHER_POINTS = (OUTDOOR_TEMPERATURE, "wind_speed_sensor", DIRECTION, *SUN_POINTS, SKY)

_LONGEST_STEP = 3600.0  # s
_SHORTEST_PIECE = 60  # s: sub-steps of the sun's spread over an hour
_DAY = 86400

_Pieces = tuple[FloatArray, FloatArray]  # edges of the pieces that two clocks share [s], sine of the sun's altitude


@dataclass(frozen=True, eq=False, repr=False)
class Weather:
    """Weather of an interval of time at one place.

    Parameters
    ----------
    frame : DataFrame, shape (n_time, n_point)
        Columns are `WEATHER_POINTS`, as far as known, in the library's units [K, m/s, deg, W/m2]. Regular local
        stamps. A value stands for the step that ends at its stamp. NaN is missing.
    location : Location
        Where.
    readings : bool
        True when temperature and wind are readings at the stamps, as in EPW and TMY3 files, rather than means over the
        step. Irradiances are means over the step always.
    typical : bool
        True for a year of hours that stands for any year: it repeats, and 29 February is like the day before.
    step : float
        Length of a step [s]; default 0: the time between stamps, which a single row does not tell.
    estimated : bool
        True when irradiances are estimated, as nobody measured them.

    Raises
    ------
    WeatherError
        When stamps are irregular or have no zone, a column is no weather point, or a typical year has not 8760 hours.
    """

    frame: pd.DataFrame
    location: Location
    readings: bool = False
    typical: bool = False
    step: float = 0.0
    estimated: bool = False

    def __post_init__(self) -> None:
        step = regular_steps(self.frame.index, "weather", WeatherError, self.step, _LONGEST_STEP)
        for column in self.frame.columns:
            WeatherError.unless_known(column, WEATHER_POINTS, "weather: column", "a weather point")
        count = len(self.frame)
        hours = not self.typical or (count == 8760 and step == 3600)
        WeatherError.unless(hours, "typical year", "8760 hours", f"{count} rows, a step of {step:g} s")
        object.__setattr__(self, "step", step)

    @property
    def stamps(self) -> pd.DatetimeIndex:
        """Ends of the steps, shape (n_time,), local."""
        return pd.DatetimeIndex(self.frame.index)

    def values(self, point: str) -> FloatArray:
        """Look a point up.

        Parameters
        ----------
        point : str
            One of `WEATHER_POINTS`.

        Returns
        -------
        ndarray, shape (n_time,)
            Without gaps [K, m/s, deg or W/m2].

        Raises
        ------
        WeatherError
            When the point is missing at any time.
        """
        self.require([point])
        return self.frame[point].to_numpy(dtype=float)

    def require(self, points: Sequence[str]) -> None:
        """Refuse weather that lacks something.

        Parameters
        ----------
        points : sequence of str
            Of `WEATHER_POINTS`.

        Raises
        ------
        WeatherError
            Which point is missing, how often, and when first.
        """
        for point in points:
            WeatherError.unless_known(point, WEATHER_POINTS, "weather", "a weather point")
            empty = self.frame.get(point, pd.Series(np.nan, self.frame.index)).isna().to_numpy()
            if empty.any():
                first = self.stamps[int(np.argmax(empty))]
                raise WeatherError(
                    f"weather lacks {point!r} for {empty.sum()} of {len(empty)} steps (first {first}); supply it, or "
                    "fill the gap"
                )

    def to_frame(self) -> pd.DataFrame:
        """Give the table, to be written to, in the library's units."""
        return self.frame.copy()

    def __repr__(self) -> str:
        return f"Weather({len(self.frame)} steps of {self.step:g} s to {self.stamps[-1]}, {[*self.frame]})"

    @cached_property
    def outdoor(self) -> FloatArray:
        """Outdoor air temperature, shape (n_time,) [K]."""
        return self.values(OUTDOOR_TEMPERATURE)

    @cached_property
    def sun(self) -> Sun:
        """Sun's place at the middle of the steps, and irradiances; what is not known is derived where that is possible.

        Raises
        ------
        EffectError
            When beam and diffuse irradiance are neither known nor derivable.
        """
        return sun_of(self.location, self.stamps, self.step, self.frame)

    def on(self, grid: StepGrid) -> Weather:
        """Average over the steps of a grid.

        Readings lie on straight lines. Means over longer steps than the grid's are kept exactly: irradiances are spread
        in proportion to the sine of the sun's altitude at the middle of each piece (the beam evenly over the time that
        the sun is up), other means by a monotone cubic of their integral. Where the steps agree, values pass unchanged.

        Parameters
        ----------
        grid : StepGrid
            Within the time that the weather covers; a typical year covers any.

        Returns
        -------
        Weather
            One row a step, means.

        Raises
        ------
        WeatherError
            When the weather does not cover the grid, or the two clocks have no common whole minutes.
        """
        source = self._around(grid)
        known = source.frame.columns[source.frame.notna().any()]
        sun = source._pieces(grid)
        columns: dict[str, FloatArray] = {}
        for point in known:
            whole = source.frame[point].notna().to_numpy()
            values = source.frame[point].interpolate(limit_direction="both").to_numpy(dtype=float)
            mean = source._means(str(point), values, grid, sun)
            columns[str(point)] = mean if whole.all() else np.where(_covered(source, whole, grid), mean, np.nan)
        return Weather(pd.DataFrame(columns, index=grid.stamps), self.location, step=grid.step)

    def _means(self, point: str, values: FloatArray, grid: StepGrid, sun: _Pieces | None) -> FloatArray:
        stamps, edges = index_seconds(self.stamps).astype(float), grid.edges.astype(float)
        bounds = np.concatenate([[stamps[0] - self.step], stamps])
        if point in SUN_POINTS and sun is not None:
            pieces, sine = sun  # the beam does not know how high the sun is, only whether it is up
            fine = means_by_shape(bounds, values, pieces, np.sign(sine) if point == SUN_POINTS[0] else sine)
            start, count = np.searchsorted(pieces, edges[0]), round(grid.step / (pieces[1] - pieces[0]))
            return np.asarray(fine[start : start + grid.n_steps * count].reshape(grid.n_steps, count).mean(axis=1))
        if point == DIRECTION:
            angle = np.radians(values)
            # 2 is added since a monotone cubic stands still where what it integrates changes its sign.
            east, north = (self._plain(part + 2.0, bounds, edges) - 2.0 for part in (np.sin(angle), np.cos(angle)))
            return np.asarray(np.degrees(np.arctan2(east, north)) % 360.0)
        if point in SUN_POINTS or point == SKY:
            return means_of_means(bounds, values, edges)
        return self._plain(values, bounds, edges)

    def _plain(self, values: FloatArray, bounds: FloatArray, edges: FloatArray) -> FloatArray:
        if self.readings:
            return means_of_readings(bounds, np.concatenate([values[:1], values]), edges)
        return means_of_means(bounds, values, edges)

    def _pieces(self, grid: StepGrid) -> _Pieces | None:
        """Pieces that both clocks consist of, for a grid that is finer than this weather."""
        if grid.step >= self.step or not set(SUN_POINTS) & set(self.frame.columns):
            return None
        from pvlib.solarposition import get_solarposition  # here: pvlib takes a second to import

        stamps = index_seconds(self.stamps)
        first = int(stamps[0] - self.step)
        piece = math.gcd(int(self.step), int(grid.step), int(grid.edges[0]) - first)
        expected = "clocks of weather and grid that differ by whole minutes"
        WeatherError.unless(piece >= _SHORTEST_PIECE, "weather", expected, f"{piece} s")
        edges = np.arange(first, stamps[-1] + piece, piece)
        middles = pd.to_datetime(edges[:-1] + piece / 2.0, unit="s", utc=True)
        place = self.location
        altitude = get_solarposition(middles, place.latitude, place.longitude, place.elevation)["elevation"].to_numpy()
        return edges.astype(float), np.maximum(np.sin(np.radians(altitude)), 0.0)

    def _around(self, grid: StepGrid) -> Weather:
        """Cut this weather to a day around a grid, after a typical year has been repeated as often as needed."""
        whole = self._repeated(grid) if self.typical else self
        seconds = index_seconds(whole.stamps)
        require_cover(grid, seconds[0] - self.step, seconds[-1], "weather", WeatherError)
        near = (seconds > grid.edges[0] - _DAY) & (seconds < grid.edges[-1] + _DAY)
        return Weather(whole.frame[near], self.location, self.readings)

    def _repeated(self, grid: StepGrid) -> Weather:
        zone = self.stamps.tz
        years = range(grid.start.tz_convert(zone).year - 1, grid.stamps[-1].tz_convert(zone).year + 2)
        # The year begins where its stamps say, whatever year they carry.
        ordered = self.frame.iloc[np.argsort((self.stamps - pd.Timedelta(hours=1)).day_of_year, kind="stable")]
        values = ordered.to_numpy(dtype=float)
        february = slice(58 * 24, 59 * 24)
        leap = np.concatenate([values[: 59 * 24], values[february], values[59 * 24 :]])
        rows = np.concatenate([leap if pd.Timestamp(year, 1, 1).is_leap_year else values for year in years])
        start = pd.Timestamp(years[0], 1, 1, 1).tz_localize(zone)
        index = pd.date_range(start, periods=len(rows), freq="h", name="timestamp")
        return Weather(pd.DataFrame(rows, index=index, columns=ordered.columns), self.location, self.readings)


def _covered(source: Weather, known: BoolArray, grid: StepGrid) -> BoolArray:
    """Find the steps of a grid that lie wholly within known intervals of the source."""
    stamps = index_seconds(source.stamps)
    gap = np.concatenate([[0], np.cumsum(~known)])
    first = np.clip(np.searchsorted(stamps, grid.edges[:-1], side="right"), 0, len(known))
    last = np.clip(np.searchsorted(stamps, grid.edges[1:], side="left") + 1, 0, len(known))
    if source.readings:  # a straight line needs the reading before, too
        first = np.maximum(first - 1, 0)
    return np.asarray(gap[last] == gap[first])


def means_of_readings(times: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Average straight lines between readings over steps, exactly.

    Parameters
    ----------
    times : ndarray, shape (n_reading,)
        When they were taken [s]; rising.
    values : ndarray, shape (n_reading,)
        What they were [any].
    edges : ndarray, shape (n_steps + 1,)
        Edges of the steps [s], within the times.

    Returns
    -------
    ndarray, shape (n_steps,)
        Means [as given].
    """
    integral = make_interp_spline(times, values, k=1).antiderivative()
    return np.asarray(np.diff(integral(edges)) / np.diff(edges))


def means_of_means(source: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Average over steps what is known as means over other intervals, keeping those means.

    The integral of the values is known at the edges of their intervals. Between them it is a monotone cubic (Fritsch
    and Carlson 1980, doi:10.1137/0717021), whose derivative is continuous, and not negative where the values are not.

    Parameters
    ----------
    source : ndarray, shape (n_interval + 1,)
        Edges of the intervals [s].
    values : ndarray, shape (n_interval,)
        Means over them [any].
    edges : ndarray, shape (n_steps + 1,)
        Edges of the steps [s], within those of the intervals.

    Returns
    -------
    ndarray, shape (n_steps,)
        Means [as given]; where steps and intervals are the same, the values themselves.
    """
    start = np.searchsorted(source, edges[0])
    same = source[start : start + len(edges)]
    if len(same) == len(edges) and (same == edges).all():
        return np.asarray(values[start : start + len(edges) - 1])
    integral = np.concatenate([[0.0], np.cumsum(values * np.diff(source))])
    return np.asarray(np.diff(PchipInterpolator(source, integral)(edges)) / np.diff(edges))


def means_by_shape(source: FloatArray, values: FloatArray, pieces: FloatArray, shape: FloatArray) -> FloatArray:
    """Spread means over intervals to their pieces in proportion to a shape, keeping the means.

    Parameters
    ----------
    source : ndarray, shape (n_interval + 1,)
        Edges of the intervals [s].
    values : ndarray, shape (n_interval,)
        Means over them [any].
    pieces : ndarray, shape (n_piece + 1,)
        Edges of equal pieces [s], each within one interval; together they cover the intervals from first to last.
    shape : ndarray, shape (n_piece,)
        Not negative [-]; where it is 0 throughout an interval, the value is spread evenly.

    Returns
    -------
    ndarray, shape (n_piece,)
        Means over the pieces [as given].
    """
    owner = np.searchsorted(source, 0.5 * (pieces[1:] + pieces[:-1])) - 1
    count = np.bincount(owner, minlength=len(values))
    mean = np.bincount(owner, shape, minlength=len(values)) / np.maximum(count, 1)
    even = mean[owner] <= 0.0
    return np.asarray(values[owner] * np.where(even, 1.0, shape / np.where(even, 1.0, mean[owner])))
