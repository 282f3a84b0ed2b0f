"""Where the gap lies: shares of the squared error by zone, hour, mode and weather, the part that stands out, and drift.

Drift is how the error of a free run grows with time; its slope on logarithmic axes says of what cause it is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import ClassVar, Literal, NamedTuple

import numpy as np
import pandas as pd

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.screen.missing import Missing, at_start, missing_heat
from calibration.errors import NotEnoughDataError
from calibration.evaluation.intervals import Interval, Runs, select_runs
from calibration.evaluation.n_step import Wanted, predict_runs
from calibration.results import Plain
from thermal._types import BoolArray, FloatArray
from thermal.case.building import FloorPlans
from thermal.inputs.provider import InputProvider
from thermal.model.case_replay import Inputs

Kind = Literal["sensors", "random", "persistent", "hump"]

#: Length of the runs where the telemetry allows [s], and steps of them that are kept at most.
_LENGTH, _KEPT = 86400.0, 48

#: Time between starts beyond the hour's whole steps [steps]: runs that all start on the hour would have every switch of
#: a schedule at the same place.
_OFF_THE_HOUR = 1

#: The curve grows until it is this share of its largest [-], or for so many points; what follows is the end of growth.
_GROWN, _FEWEST = 0.6, 4

#: Borders of the slopes 0, 1/2 and 1 [-]. The upper is below the middle: walls that warm after the air pull the slope
#: of a persistent heat down, and nothing pulls that of a random one up.
_HARDLY, _RANDOM = 0.25, 0.62

#: Steepest slope that is sought [-]: no heat makes a temperature run ahead of time.
_STEEPEST = 1.1

#: Where a wrong mass or lag shows [s], and the least ratio to the smallest error of the six hours after [-].
_HUMP, _HIGHER, _AFTER = (600.0, 3600.0), 1.1, 21600.0

#: Resamples of the days for intervals, and the share of them that an interval holds [-].
_RESAMPLES, _LEVEL = 400, 0.9

#: Irradiance on the horizontal from which the sun counts as shining [W/m2], and metered heat from which a zone counts
#: as heated or cooled, over the largest [-].
_SUNNY, _ACTIVE = 100.0, 0.02

#: Sides of a building.
_POINTS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")

#: Least share of predictions that the part that stands out may be of [-].
_LEAST = 0.02


@dataclass(frozen=True)
class Share(Plain):
    """Share of the squared error that falls on a part of the predictions.

    Parameters
    ----------
    name : str
        Of the part.
    share : float
        Of the squared error [-].
    predictions : float
        Of the predictions [-].
    interval : tuple of float
        90 % interval of the first, from resampled days [-].
    """

    name: str
    share: float
    predictions: float
    interval: tuple[float, float]
    key: ClassVar[str] = "name"


class Outstanding(NamedTuple):
    """Part of the predictions that holds more of the squared error than any other, beyond its share of them.

    Parameters
    ----------
    place, moment : str
        A zone or a group of zones, and a mode; empty for everywhere and always.
    share, predictions : float
        Of the squared error, and of the predictions [-].
    """

    place: str
    moment: str
    share: float
    predictions: float


@dataclass(frozen=True)
class DriftCurve:
    """Root mean square error over runs and zones by time since the start.

    Parameters
    ----------
    seconds : ndarray, shape (n_kept,)
        Time since the start, ends of steps [s].
    rms : ndarray, shape (n_kept,)
        Error [K].

    Examples
    --------
    >>> time = 300.0 * np.arange(1, 289)
    >>> walk = DriftCurve(time, 0.1 * np.sqrt(time / 300.0))
    >>> walk.kind, round(walk.slope, 2)
    ('random', 0.5)
    """

    seconds: FloatArray
    rms: FloatArray

    @cached_property
    def slope(self) -> float:
        """Slope p on logarithmic axes while the error grows [-].

        ``E² = s² + a² (1 - exp(-t/τ))^2p``: beside an error s that is there from the start, and before it levels off
        with τ, it grows as t^p. s and τ are tried on a grid, a and p follow by least squares of log E.
        """
        time, error = self._growth()
        best, slope = np.inf, 0.0
        target = np.log(error)
        for share in np.concatenate([[0.0], np.linspace(0.3, 0.95, 14)]):
            floor = (share * float(error.min())) ** 2
            grown = 0.5 * np.log(error**2 - floor)
            for time_constant in [*(time[-1] * np.geomspace(0.3, 5.0, 12)), np.inf]:
                x = np.log(time if np.isinf(time_constant) else -np.expm1(-time / time_constant))
                p, a = np.polyfit(x, grown, 1)
                misfit = float(np.mean((0.5 * np.log(floor + np.exp(2.0 * (a + p * x))) - target) ** 2))
                if misfit < best and -0.1 <= p <= _STEEPEST:
                    best, slope = misfit, float(p)
        return slope

    @cached_property
    def hump(self) -> tuple[float, float, float] | None:
        """When the error is largest in the first hour [s], how large [K], and to what it falls [K]; None without."""
        inside = (self.seconds >= _HUMP[0]) & (self.seconds <= _HUMP[1])
        if not inside.any():
            return None
        top = int(np.argmax(np.where(inside, self.rms, -np.inf)))
        after = (self.seconds > self.seconds[top]) & (self.seconds <= self.seconds[top] + _AFTER)
        if not after.any() or self.rms[top] < _HIGHER * max(float(self.rms[after].min()), float(self.rms[0])):
            return None
        return float(self.seconds[top]), float(self.rms[top]), float(self.rms[after].min())

    @property
    def kind(self) -> Kind:
        """What such a curve comes from: slope 0 sensors, 1/2 random heat, 1 persistent heat, a hump mass or lag."""
        if self.hump is not None:
            return "hump"
        if self.slope < _HARDLY:
            return "sensors"
        return "random" if self.slope < _RANDOM else "persistent"

    def _growth(self) -> tuple[FloatArray, FloatArray]:
        """Find times and errors while it grows; all of a curve that begins near its top."""
        error = np.maximum(self.rms, 1e-9)
        enough = _GROWN * float(error.max())
        if error[0] >= enough:
            return self.seconds, error
        count = max(int(np.argmax(error >= enough)) + 1, _FEWEST)
        return self.seconds[:count], error[:count]


def drift_of(fit: Fit, intervals: Sequence[Interval]) -> DriftCurve:
    """Error of a fitted model's free runs over a day, or as long as the telemetry allows.

    Parameters
    ----------
    fit : Fit
        The model.
    intervals : sequence of Interval
        Where the runs end.

    Raises
    ------
    NotEnoughDataError
        When there is no room for a run of a single step.
    """
    inputs, matrices = fit.built.inputs, fit.model.matrices(fit.theta)
    steps, runs = _longest(inputs, intervals, fit.settings.spin_up_seconds)
    keep = np.unique(np.round(np.geomspace(1, steps, min(steps, _KEPT))).astype(np.int64))
    squared = np.zeros(len(keep))
    count = np.zeros(len(keep))
    for interval, chosen in zip(intervals, runs, strict=True):
        found = predict_runs(fit.model, matrices, inputs, interval, Wanted(chosen, keep), fit.settings.stepping)
        error = (found.simulated - found.measured) ** 2
        squared += np.nansum(error, axis=(0, 2))
        count += np.isfinite(error).sum(axis=(0, 2))
    return DriftCurve(np.asarray(keep * inputs.step, dtype=float), np.sqrt(squared / np.maximum(count, 1)))


def _longest(inputs: Inputs, intervals: Sequence[Interval], spin_up_seconds: float) -> tuple[int, list[Runs]]:
    """Count the steps of a day and find the runs of each interval; half as many until every interval has a run."""
    steps = max(1, round(_LENGTH / inputs.step))
    every = inputs.step * (max(1, round(3600.0 / inputs.step)) + _OFF_THE_HOUR)
    while steps:
        try:
            runs = [select_runs(inputs, i, steps, every=every, spin_up=spin_up_seconds) for i in intervals]
        except NotEnoughDataError:
            runs = []
        if runs and all(r.starts.size for r in runs):
            return steps, runs
        steps //= 2
    raise NotEnoughDataError(f"drift: expected room for a run of one step in each of {len(intervals)} intervals")


@dataclass(frozen=True)
class Where:
    """Where a fitted model is wrong on held-out telemetry.

    Parameters
    ----------
    most : Outstanding or None
        The part that stands out most; None where the error is spread evenly.
    zones : tuple of Share
        By zone.
    hours : ndarray, shape (24,)
        Share of the squared error by hour of the day, in the building's time [-].
    modes : tuple of Share
        Heated, cooled or neither; with and without sun; windy or calm; occupied or not.
    groups : tuple of Share
        Perimeter by orientation, core, floors.
    missing, missing_at_start : Missing
        Heat that the model lacks by hour and zone, at its estimate and with every parameter at its start.
    drift : DriftCurve
        How the error of a free run grows.
    """

    most: Outstanding | None
    zones: tuple[Share, ...]
    hours: FloatArray
    modes: tuple[Share, ...]
    groups: tuple[Share, ...]
    missing: Missing
    missing_at_start: Missing
    drift: DriftCurve


def where_it_lies(models: ModelComparison, fit: Fit) -> Where:
    """Say where a fitted model is wrong on the held-out intervals.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        The model.
    """
    parts = _Parts(models, fit)
    zones, times = parts.zone_groups(), parts.times()
    missing = missing_heat(fit, models.judged)
    start = missing_heat(at_start(fit), models.judged, fixed=True, near=missing.disturbance)
    return Where(
        most=parts.most(zones, times),
        zones=tuple(parts.share(z, parts.zone_mask([z])) for z in parts.zones),
        hours=parts.by_hour(),
        modes=tuple(parts.share(name, mask) for name, mask in times.items()),
        groups=tuple(parts.share(name, mask) for name, mask in zones.items()),
        missing=missing,
        missing_at_start=start,
        drift=drift_of(fit, models.judged),
    )


class _Parts:
    """Squared errors of predictions with what was going on at their targets, each of shape (n_run, n_zone)."""

    def __init__(self, models: ModelComparison, fit: Fit) -> None:
        predictions = fit.evaluate(models.judged, models.horizon).predictions
        self.models, self.zones = models, fit.built.network.zones
        step = pd.Timedelta(seconds=fit.built.inputs.step)
        targets = [p.start + int(p.steps[-1]) * step for p in predictions]
        self.target = pd.DatetimeIndex(targets[0].append(targets[1:]))
        squared = np.concatenate([p.error for p in predictions]) ** 2
        self.known = np.isfinite(squared)
        self.squared = np.where(self.known, squared, 0.0)
        self.row = fit.built.inputs.stamps.get_indexer(self.target)
        self.days = np.unique((self.target - step).normalize(), return_inverse=True)[1]  # a stamp ends its step
        self.heat = fit.built.inputs.heat[self.row]

    def zone_mask(self, names: Sequence[str]) -> BoolArray:
        return np.broadcast_to(np.isin(self.zones, names), self.squared.shape)

    def zone_groups(self) -> dict[str, BoolArray]:
        """Perimeter by orientation, core, and floors."""
        groups: dict[str, list[str]] = {}
        facades = [at for at, area in self.models.anatomy.facades.items() if area > 0.0]
        for zone in self.zones:
            sides = [_POINTS[int((azimuth + 22.5) % 360.0 // 45.0)] for z, azimuth in facades if z == zone]
            for name in (*(f"the {side} perimeter" for side in sides), "the perimeter" if sides else "the core"):
                groups.setdefault(name, []).append(zone)
        geometry = self.models.case.building.geometry
        if isinstance(geometry, FloorPlans) and len(geometry.floors) > 1:
            for floor in geometry.floors:
                groups[f"floor {floor.name}"] = list(floor.zone_names)
        return {name: self.zone_mask(members) for name, members in groups.items() if len(members) < len(self.zones)}

    def times(self) -> dict[str, BoolArray]:
        """Parts of the time, as far as the case measures what they go by."""
        active = _ACTIVE * np.maximum(np.abs(self.heat).max(axis=0), 1e-9)
        heated, cooled, shape = self.heat > active, self.heat < -active, self.squared.shape
        weather = {name: m[self.row][:, None] for name, m in _weather(self.models.drivers).items()}
        found = {"heating": heated, "cooling": cooled, "neither heating nor cooling": ~heated & ~cooled, **weather}
        return {name: np.broadcast_to(mask, shape) for name, mask in found.items()}

    def by_hour(self) -> FloatArray:
        """Shares of the squared error by hour of the day."""
        total = np.bincount(np.asarray(self.target.hour), self.squared.sum(axis=1), minlength=24)
        return np.asarray(total / max(float(total.sum()), 1e-30))

    def share(self, name: str, mask: BoolArray) -> Share:
        """Share of a part, with an interval from resampled days."""
        inside, whole = (np.bincount(self.days, (self.squared * m).sum(axis=1)) for m in (mask, np.ones_like(mask)))
        drawn = np.random.default_rng(0).integers(inside.size, size=(_RESAMPLES, inside.size))
        sums = inside[drawn].sum(axis=1) / np.maximum(whole[drawn].sum(axis=1), 1e-30)
        ends = np.quantile(sums, [(1.0 - _LEVEL) / 2.0, (1.0 + _LEVEL) / 2.0])
        share = float(inside.sum() / max(float(whole.sum()), 1e-30))
        return Share(name, share, float(mask[self.known].mean()), (float(ends[0]), float(ends[1])))

    def most(self, zones: Mapping[str, BoolArray], times: Mapping[str, BoolArray]) -> Outstanding | None:
        """Part that holds more of the squared error than any other beyond its share of the predictions."""
        everywhere = np.ones(self.squared.shape, dtype=bool)
        places = {"": everywhere, **zones, **{f"zone {z}": self.zone_mask([z]) for z in self.zones}}
        best, found = 0.0, None
        for (place, here), (moment, now) in product(places.items(), {"": everywhere, **times}.items()):
            mask = here & now
            part = float(mask[self.known].mean())
            share = float((self.squared * mask).sum() / max(float(self.squared.sum()), 1e-30))
            if not (place or moment) or part < _LEAST or share <= part:
                continue
            # what it adds to the divergence from an even spread; finer parts must earn their finer name
            weight = share * np.log(share / part) - 0.02 * (bool(place) + bool(moment))
            if weight > best:
                best, found = weight, Outstanding(place, moment, share, part)
        return found


def _weather(drivers: InputProvider) -> dict[str, BoolArray]:
    """Sun, wind, cold, people: masks over the stamps, shape (n_time,)."""
    found: dict[str, BoolArray] = {}
    if drivers.measured("direct_normal_irradiance_sensor") or drivers.measured("global_horizontal_irradiance_sensor"):
        shining = drivers.sun.horizontal > _SUNNY
        found |= {"in sun hours": shining, "without sun": ~shining}
    if drivers.measured("wind_speed_sensor"):
        found["in strong wind"] = drivers.wind > np.quantile(drivers.wind, 0.75)
    found["in the coldest quarter"] = drivers.outdoor < np.quantile(drivers.outdoor, 0.25)
    found["in working hours"] = drivers.occupancy > 0.5
    return found
