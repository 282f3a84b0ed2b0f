"""Where the gap lies: shares of the squared error by zone, hour, mode and weather, and the sentence that says it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from calibration.diagnosis.decide.drift import DriftCurve, drift_of
from calibration.diagnosis.refit.comparison import Bench, Fit
from calibration.diagnosis.screen.missing import Missing, at_start, missing_heat
from calibration.evaluation.n_step import Predictions
from thermal._types import BoolArray, FloatArray
from thermal.case.building import FloorPlans
from thermal.inputs.provider import InputProvider
from thermal.network.network import ThermalNetwork

#: Resamples of the days for intervals, and the share of them that an interval holds [-].
_RESAMPLES, _LEVEL = 400, 0.9

#: Irradiance on the horizontal from which the sun counts as shining [W/m2], and metered heat from which a zone counts
#: as heated or cooled, over the largest [-].
_SUNNY, _ACTIVE = 100.0, 0.02

#: Least share of predictions that a part of the sentence may be of [-].
_LEAST = 0.02


@dataclass(frozen=True)
class Share:
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


@dataclass(frozen=True)
class Where:
    """Where a fitted model is wrong on held-out telemetry.

    Parameters
    ----------
    sentence : str
        The part that stands out most.
    zones : tuple of Share
        By zone.
    hours : ndarray, shape (24,)
        Share of the squared error by hour of the day, in the building's time [-].
    modes : mapping of str to Share
        Heated, cooled or neither; with and without sun; windy or calm; occupied or not.
    groups : tuple of Share
        Perimeter by orientation, core, floors.
    missing, missing_at_start : Missing
        Heat that the model lacks by hour and zone, at its estimate and with every parameter at its start.
    drift : DriftCurve
        How the error of a free run grows.
    """

    sentence: str
    zones: tuple[Share, ...]
    hours: FloatArray
    modes: Mapping[str, Share]
    groups: tuple[Share, ...]
    missing: Missing
    missing_at_start: Missing
    drift: DriftCurve

    @property
    def missing_watts(self) -> dict[str, float]:
        """Root mean square by zone of the hourly heat that the model lacks [W]; 0 where it is not measured."""
        return _by_zone(self.missing)

    @property
    def missing_watts_at_start(self) -> dict[str, float]:
        """As `missing_watts`, with every parameter at its start [W]."""
        return _by_zone(self.missing_at_start)


def _by_zone(missing: Missing) -> dict[str, float]:
    return dict(zip(missing.watts.columns, np.nan_to_num(missing.rms).tolist(), strict=True))


def where_it_lies(bench: Bench, fit: Fit) -> Where:
    """Say where a fitted model is wrong on the held-out intervals.

    Parameters
    ----------
    bench : Bench
        The case.
    fit : Fit
        The model.
    """
    parts = _Parts(bench, fit, bench.predictions(fit))
    zones = parts.zone_groups()
    times = parts.times()
    single = {z: parts.zone_mask([z]) for z in parts.zones}
    stepping, spin_up = bench.settings.stepping, bench.settings.spin_up_seconds
    missing = missing_heat(fit, bench.judged, stepping, spin_up)
    start = missing_heat(at_start(fit), bench.judged, stepping, spin_up, fixed=True, near=missing.disturbance)
    return Where(
        sentence=parts.sentence(zones, times),
        zones=tuple(parts.share(z, mask) for z, mask in single.items()),
        hours=parts.by_hour(),
        modes={name: parts.share(name, mask) for name, mask in times.items()},
        groups=tuple(parts.share(name, mask) for name, mask in zones.items()),
        missing=missing,
        missing_at_start=start,
        drift=drift_of(fit, bench.judged, stepping, spin_up),
    )


class _Parts:
    """Squared errors of predictions with what was going on at their targets, each of shape (n_run, n_zone)."""

    def __init__(self, bench: Bench, fit: Fit, predictions: Sequence[Predictions]) -> None:
        self.bench, self.zones = bench, fit.built.network.zones
        step = pd.Timedelta(seconds=fit.built.inputs.step)
        targets = [p.start + int(p.steps[-1]) * step for p in predictions]
        self.target = pd.DatetimeIndex(targets[0].append(targets[1:]))
        squared = np.concatenate([p.error for p in predictions]) ** 2
        self.known = np.isfinite(squared)
        self.squared = np.where(self.known, squared, 0.0)
        self.row = fit.built.inputs.stamps.get_indexer(self.target)
        self.days = np.unique((self.target - step).normalize(), return_inverse=True)[1]  # a stamp ends its step
        self.heat = fit.built.inputs.heat[self.row]
        self.network: ThermalNetwork = fit.built.network

    def zone_mask(self, names: Sequence[str]) -> BoolArray:
        return np.broadcast_to(np.isin(self.zones, names), self.squared.shape)

    def zone_groups(self) -> dict[str, BoolArray]:
        """Perimeter by orientation, core, and floors."""
        groups: dict[str, list[str]] = {}
        facades = _facades(self.bench)
        for zone in self.zones:
            sides = facades.get(zone, [])
            for side in sides:
                groups.setdefault(f"the {side} perimeter", []).append(zone)
            groups.setdefault("the perimeter" if sides else "the core", []).append(zone)
        geometry = self.bench.case.building.geometry
        if isinstance(geometry, FloorPlans) and len(geometry.floors) > 1:
            for floor in geometry.floors:
                groups[f"floor {floor.name}"] = list(floor.zone_names)
        return {name: self.zone_mask(members) for name, members in groups.items() if len(members) < len(self.zones)}

    def times(self) -> dict[str, BoolArray]:
        """Parts of the time, as far as the case measures what they go by."""
        drivers, shape = self.bench.drivers, self.squared.shape
        most = np.maximum(np.abs(self.heat).max(axis=0), 1e-9)
        heated, cooled = self.heat > _ACTIVE * most, self.heat < -_ACTIVE * most
        found = {"heating": heated, "cooling": cooled, "neither heating nor cooling": ~heated & ~cooled}
        found |= {name: np.broadcast_to(m[self.row][:, None], shape) for name, m in _weather(drivers).items()}
        return found

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

    def sentence(self, zones: Mapping[str, BoolArray], times: Mapping[str, BoolArray]) -> str:
        """Name the part that holds more of the squared error than anything else beyond its share of predictions."""
        everywhere = np.ones(self.squared.shape, dtype=bool)
        places = {"": everywhere, **zones, **{f"zone {z}": self.zone_mask([z]) for z in self.zones}}
        moments = {"": everywhere, **times}
        best, found = 0.0, ""
        for place, here in places.items():
            for moment, now in moments.items():
                mask = here & now
                part = float(mask[self.known].mean())
                share = float((self.squared * mask).sum() / max(float(self.squared.sum()), 1e-30))
                if not (place or moment) or part < _LEAST or share <= part:
                    continue
                # what it adds to the divergence from an even spread; finer parts must earn their finer name
                weight = share * np.log(share / part) - 0.02 * (bool(place) + bool(moment))
                if weight > best:
                    best = weight
                    found = (
                        f"{share:.0%} of the squared error is {_spoken(place, moment)}, "
                        f"which has {part:.0%} of the predictions"
                    )
        return f"{found}." if found else "The error is spread evenly over zones, hours and weather."


def _spoken(place: str, moment: str) -> str:
    when = moment if not moment or moment.startswith(("with", "in")) else f"when {moment}"
    return " ".join(part for part in (f"in {place}" if place else "", when) if part)


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


def _facades(bench: Bench) -> dict[str, list[str]]:
    """Sides of each zone that look outside: names of the nearest points of the compass."""
    found: dict[str, list[str]] = {}
    for (zone, azimuth), area in bench.anatomy.facades.items():
        if area > 0.0:
            found.setdefault(zone, []).append(_POINTS[int((azimuth + 22.5) % 360.0 // 45.0)])
    return found


_POINTS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
