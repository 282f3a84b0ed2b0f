"""Zones whose sensors are exchanged: a temperature that follows another zone's heat or setpoint rather than its own."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pandas as pd

from thermal._types import BoolArray, FloatArray, IntArray
from thermal.case.building import OUTDOOR
from thermal.case.case import Case
from thermal.case.plausibility.anomaly import Anomaly, Certainty
from thermal.case.plausibility.irradiance import SOLAR
from thermal.case.points import DISCHARGE_TEMPERATURE, HEATING_POWER, SUPPLY_FLOW
from thermal.units import AIR_HEAT_CAPACITY

SETPOINT = "zone_air_heating_temperature_setpoint"

#: Length of the steps over which a temperature answers to heat [s]: longer than the lag of a sensor (5 to 10
#: minutes), shorter than a thermostat's answer, which makes heat of a room follow its temperature.
BLOCK = 900.0

#: Logarithm of the likelihood that two places gain by each other's heat [-], at least and by step, and share of it
#: that must be lost with their own heat. Residuals of a regression are correlated over some steps, which divides what
#: counts by up to ten: 30 is then as good as 3. `MOST_LOST` bounds what one of the two may lose, as a share of what
#: both gain.
LEAST_GAIN, LEAST_GAIN_BY_STEP, LEAST_SHARE, MOST_LOST = 30.0, 0.05, 0.5, 0.05

#: Steps of `BLOCK` that are needed [-]: two days.
LEAST_STEPS = 48

#: How far a zone may be from its own setpoint, and how near to another's, to be taken for the other [K].
FAR, NEAR = 1.5, 0.75

#: How much further than the outdoors a zone is from the mean of the others [K], and how many times as much it varies,
#: when the two are exchanged: zones of one building are within a few kelvin of each other.
OUTSIDE, LIVELIER = 5.0, 1.5


def exchanged_zones(case: Case) -> Iterator[Anomaly]:
    """Find pairs of zones whose temperatures, or whose heat, are exchanged.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``exchanged``, one a pair.
    """
    temperatures = case.zone_temperatures()
    outdoor = case.boundary_temperatures()[OUTDOOR]
    names = [*map(str, temperatures), OUTDOOR]
    advice = "see which devices and sensors serve them; exchange the columns, or the zones in 'devices'"
    found: set[int] = set()
    for i in range(len(names) - 1 if len(names) > 2 else 0):
        inside = temperatures.drop(columns=names[i]).mean(axis=1).mean()
        there = temperatures[names[i]]
        further = abs(there.mean() - inside) - abs(outdoor.mean() - inside)
        if further > OUTSIDE and there.std() > LIVELIER * outdoor.std():
            means = [f"{mean - 273.15:.0f} degC" for mean in (outdoor.mean(), inside, there.mean())]
            what = f"zone {names[i]!r} and the outdoors look exchanged: the mean is {means[0]} outdoors, {means[1]} in "
            what += f"the other zones, and {means[2]} there"
            yield _anomaly(case, [names[i], OUTDOOR], what, "certain", "exchange the two columns")
            return
    gains = heat_gains(case, temperatures, outdoor)
    needed = max(LEAST_GAIN, LEAST_GAIN_BY_STEP * len(case.stamps) * case.step / max(BLOCK, case.step))
    bare = frozenset(k for k, zone in enumerate(names[:-1]) if not case.building.devices_of(zone))
    for i, j, own, other in _followers(gains, needed, bare):
        first, second = (_place(names[k]) for k in ((i, j) if j not in bare else (j, i)))
        follows = "the temperature of each follows the other's heat"
        if bare & {i, j}:
            follows = f"{first}, which has no heat of its own, follows the heat of {second} more than {second} does"
        by = f"by {other:.0f} of log-likelihood, as they are {own:.0f}"
        what = f"{first} and {second} look exchanged: {follows} ({by})"
        found |= {i, j}
        yield _anomaly(case, [names[i], names[j]], what, "likely", advice)
    setpoints = _setpoints(case)
    for i, j in combinations([k for k, name in enumerate(names) if name in setpoints], 2):
        if found & {i, j}:
            continue
        off = [_distance(temperatures[names[a]], setpoints[names[a]]) for a in (i, j)]
        near = [_distance(temperatures[names[a]], setpoints[names[b]]) for a, b in ((i, j), (j, i))]
        if min(off) > FAR and max(near) < NEAR:
            what = f"{_place(names[i])} and {_place(names[j])} look exchanged: each one keeps to the other's setpoint"
            yield _anomaly(case, [names[i], names[j]], what, "possible", advice)


def heat_gains(case: Case, temperatures: pd.DataFrame, outdoor: pd.Series) -> FloatArray:
    """Say how much of each zone's temperature each zone's heat explains.

    Parameters
    ----------
    case
        Case.
    temperatures
        Of zones, shape (n_time, n_zone) [K].
    outdoor
        Temperature, shape (n_time,) [K].

    Returns
    -------
    ndarray
        Shape (n_zone + 1, n_zone + 1) [-]: logarithm of the likelihood that the heat of the zone of a column adds to
        a regression of the change of the temperature of a row over `BLOCK`; the last of both is the outdoors. 0 where
        heat would cool, and without heat.

    Notes
    -----
    The change from t to t + 1 is regressed on a constant, the zone's temperature at t and t - 1, the mean of the
    others at t and its change, the outdoor temperature and the sun; then on heat at t and t + 1 too. Supply air
    counts from the mean of all zones, so that a wrong temperature does not come back as a wrong heat. A thermostat
    heats because a zone is cold: over short steps heat still warms within the step (its coefficient must be above 0),
    over steps longer than `BLOCK` that of the step and the one before must be, together.
    """
    rows = max(1, round(BLOCK / case.step))
    weather = case.weather()
    sun = (
        weather[[n for n in SOLAR if n in weather]].mean(axis=1).fillna(0.0) if len(weather.columns) else outdoor * 0.0
    )
    heat = _supplied(case, temperatures.mean(axis=1)).rolling(rows).mean().to_numpy()[::rows]
    light = sun.rolling(rows).mean().to_numpy()[::rows]
    places = pd.concat([temperatures, outdoor.rename(OUTDOOR)], axis=1).to_numpy()[::rows]
    outside, zones = places[:, -1], places[:, :-1]
    gains = np.zeros((places.shape[1],) * 2)
    heated = np.flatnonzero([np.isfinite(q).any() and np.nanstd(q) > 0.0 for q in heat.T])
    heats = np.isfinite(heat[2:, heated]) & np.isfinite(heat[1:-1, heated])
    one = np.ones(len(places))
    for i, own in enumerate(places.T):
        rest = np.delete(zones, i, axis=1) if zones.shape[1] > 1 and i < zones.shape[1] else zones
        others = rest.mean(axis=1) if zones.shape[1] > 1 or i == 1 else outside
        parts = [one[2:], own[1:-1], own[:-2], others[1:-1], others[2:] - others[1:-1], outside[1:-1], light[2:]]
        base, target = np.column_stack(parts), own[2:] - own[1:-1]
        known = np.isfinite(np.column_stack([base, target])).all(axis=1)
        for mine, there in _alike(known[:, None] & heats):
            if there.sum() >= LEAST_STEPS:
                further = (heat[first:last, heated[mine]][there] for first, last in ((2, None), (1, -1)))
                without, left, slopes = _beside(base[there], target[there], *further)
                warms = (slopes.sum(axis=1) if case.step > BLOCK else slopes[:, 0]) > 0.0
                gains[i, heated[mine]] = np.where(warms, 0.5 * there.sum() * np.log(without / left), 0.0)
    return gains


def _followers(gains: FloatArray, needed: float, bare: frozenset[int]) -> Iterator[tuple[int, int, float, float]]:
    """Pairs of places that follow each other's heat, with what their own explains and the other's: the clearest first.

    A place that is in a clearer pair is not in another: what follows its heat follows its neighbours' a little. Of a
    pair one of which is bare, without any device, that one alone can follow the other's heat.
    """
    pairs = []
    for i, j in combinations(range(len(gains)), 2):
        own, other = gains[i, i] + gains[j, j], gains[i, j] + gains[j, i]
        gained = [gains[a, b] - gains[a, a] for a, b in ((i, j), (j, i)) if b not in bare]
        if other - own > max(needed, LEAST_SHARE * other) and min(gained) >= -MOST_LOST * other:
            pairs.append((i, j, float(own), float(other)))
    taken: set[int] = set()
    for i, j, own, other in sorted(pairs, key=lambda p: p[2] - p[3]):
        if not taken & {i, j}:
            taken |= {i, j}
            yield i, j, own, other


def _alike(valid: BoolArray) -> Iterator[tuple[IntArray, BoolArray]]:
    """Columns that hold at the same rows, and these rows."""
    groups: dict[bytes, list[int]] = {}
    for j, column in enumerate(np.packbits(valid, axis=0).T):
        groups.setdefault(column.tobytes(), []).append(j)
    for mine in groups.values():
        yield np.array(mine), valid[:, mine[0]]


def _beside(
    base: FloatArray, target: FloatArray, first: FloatArray, second: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Squares that a regression leaves without and with each pair of further regressors, and the pairs' slopes.

    By what the base leaves of target and pairs (Frisch and Waugh 1933, doi:10.2307/1907330).
    """
    vectors, sizes, _ = np.linalg.svd(base / np.maximum(np.abs(base).max(axis=0), 1e-12), full_matrices=False)
    vectors = vectors[:, sizes > 1e-12 * sizes[0]]

    def beyond(values: FloatArray) -> FloatArray:
        return np.asarray(values - vectors @ (vectors.T @ values))

    rest = beyond(target)
    pair = [beyond(each / np.maximum(np.abs(each).max(axis=0), 1e-12)) for each in (first, second)]
    gram = np.array([[np.sum(a * b, axis=0) for b in pair] for a in pair]).transpose(2, 0, 1)
    pull = np.array([rest @ each for each in pair]).T
    slopes = np.einsum("jab,jb->ja", np.linalg.pinv(gram, rcond=1e-12, hermitian=True), pull)
    left = np.sum((rest[:, None] - slopes[:, 0] * pair[0] - slopes[:, 1] * pair[1]) ** 2, axis=0)
    return float(rest @ rest) + 1e-12, left + 1e-12, slopes


def _supplied(case: Case, reference: pd.Series) -> pd.DataFrame:
    """Heat of each zone [W], supply air counted from a common temperature."""
    frame = case.usable
    heat = pd.DataFrame(0.0, index=frame.index, columns=list(case.building.zone_names))
    for device in case.building.devices:
        points = (SUPPLY_FLOW, DISCHARGE_TEMPERATURE, HEATING_POWER)
        flow, air, power = (frame.get(f"{device.name}/{point}") for point in points)
        if device.zone is not None and flow is not None and air is not None:
            heat[device.zone] += (flow * AIR_HEAT_CAPACITY * (air - reference)).where(flow != 0.0, 0.0)
        if device.zone is not None and power is not None:
            heat[device.zone] += power
    return heat


def _setpoints(case: Case) -> dict[str, pd.Series]:
    """Heating setpoint of each zone that has one [K]."""
    frame = case.usable
    owners = {name: name for name in case.building.zone_names}
    owners |= {device.name: device.zone for device in case.building.devices if device.zone is not None}
    return {zone: frame[f"{e}/{SETPOINT}"] for e, zone in owners.items() if f"{e}/{SETPOINT}" in frame}


def _distance(temperature: pd.Series, setpoint: pd.Series) -> float:
    """Median distance of a temperature from a setpoint [K]; NaN without a common stamp."""
    return float((temperature - setpoint).abs().median())


def _place(name: str) -> str:
    return "the outdoors" if name == OUTDOOR else f"zone {name!r}"


def _anomaly(case: Case, zones: list[str], what: str, certainty: Certainty, advice: str) -> Anomaly:
    of = {*zones, *(device.name for device in case.building.devices if device.zone in zones)}
    columns = tuple(str(c) for c in case.usable if str(c).rpartition("/")[0] in of)
    return Anomaly("exchanged", "warning", certainty, columns, case.stamps[0], case.stamps[-1], what, advice)
