"""Heating seasons of EnergyPlus houses in which one thing changes, or nothing: another maker's years for monitoring.

The houses are those of `house_trials`, with what people live with: sun through the windows, leakage, and heat of
people, cooking and appliances of which no telemetry says anything. From a day that is drawn something is added to
EnergyPlus' input (a leak, heat, a window or a door that stands open, a heater that gives less), or to what sensors,
meters and the station's clock say.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from _monitored_years import Array, Change
from energyplus_trials import climate
from energyplus_trials.sites import WEATHER_FILES
from house_trials import folder, model, plant, readings
from house_trials.changes import leak, open_area
from house_trials.draw_effects import CATALOGUE, doors, heated
from house_trials.drawing import draw_spec
from house_trials.faces import faces
from house_trials.specification import HouseSpec
from house_trials.trial import build

from thermal import Case, load_case

DAYS = 130

_ROOM = 20.0  # m2 of floor

#: First days of the telemetry: to the end of May, or to that of December.
_STARTS = ("2023-01-20", "2023-08-20")

#: What changes, with the ids of the catalogue that are right for it, whether it is in one zone, and the range of its
#: size: K, m2 in a room of 20 m2, 1/h, share, share, W/m2, m3/s, h. As in `_monitored_years`, where houses have it; but
#: rooms are of all sizes, and nobody lets a window stand open for weeks that has a bath at 10 degC.
CHANGES: dict[str, tuple[tuple[str, ...], bool, tuple[float, float]]] = {
    "sensor_bias": (("sensor_bias",), True, (0.5, 1.3)),
    "window_open": (("window_opening",), True, (0.04, 0.15)),
    "infiltration": (("infiltration",), False, (0.3, 0.8)),
    "flow_gain": (("flow_gain",), True, (0.15, 0.3)),
    "capacity_limit": (("capacity_limit",), True, (0.4, 0.7)),
    "internal_gains": (("internal_gains",), False, (3.0, 6.0)),
    "door_open": (("zone_mixing",), True, (0.05, 0.2)),
    "clock_shift": (("clock_shift",), False, (1.0, 1.0)),
}


def make_year(seed: int, changed: bool) -> tuple[Case, Change]:
    """Make a season of telemetry, and say what changed.

    Parameters
    ----------
    seed : int
        Of house, weather, people, noise and change.
    changed : bool
        Whether anything does.
    """
    spec = _drawn(seed)
    change = _change(spec, seed) if changed else Change(start=DAYS, end=DAYS)
    made = build(spec)
    _added(made, change)
    results = plant.simulate(made)
    readings.check_run(made, results)
    reported = readings.Readings(made, results)
    _read_wrong(reported, change)
    with tempfile.TemporaryDirectory() as name:
        folder.write_case(Path(name) / spec.name, spec, reported.telemetry())
        return load_case(Path(name) / spec.name), change


def _drawn(seed: int) -> HouseSpec:
    """Draw the house of a seed that has a meter and a sensor in each room, and a door."""
    rng = np.random.default_rng([seed, 21])
    for attempt in range(100):
        spec = draw_spec(1_000_000 + 100 * seed + attempt, "null", confirmation=True, lived_in=True)
        if spec.heating.meter == "room" and spec.heating.emitter != "floor" and doors(spec):
            break
    else:
        raise RuntimeError(f"seed {seed}: expected a house with meters by room and a door, found none in 100")
    start = _STARTS[int(rng.integers(2))]
    site = next(s for s in WEATHER_FILES if s.source == spec.climate.source)
    place = replace(spec.climate, start=start, warmer=round(float(rng.uniform(0.0, 6.0)) - site.mean, 2))
    people = CATALOGUE["internal_gains"](spec, rng, float(rng.uniform(0.5, 1.2)))
    return replace(spec, days=DAYS, climate=place, known=(*spec.known, people))


def _change(spec: HouseSpec, seed: int) -> Change:
    """Draw what changes: kinds take turns, half of them are mended after three weeks or more."""
    rng = np.random.default_rng([seed, 22])
    kind = list(CHANGES)[seed % len(CHANGES)]
    effects, zonal, (low, high) = CHANGES[kind]
    turned = kind in ("sensor_bias", "flow_gain", "clock_shift") and rng.random() < 0.5
    rooms = {"window_open": _glazed(spec), "capacity_limit": heated(spec), "flow_gain": heated(spec)}
    zones: tuple[str, ...] = (str(rng.choice(rooms.get(kind, spec.zone_names))),)
    if kind == "door_open":
        zones = doors(spec)[int(rng.integers(len(doors(spec))))]
    start = int(rng.integers(50, DAYS - 50))
    end = start + int(rng.integers(21, 36)) if (seed // len(CHANGES)) % 2 else DAYS
    size = float(rng.uniform(low, high)) * (-1.0 if turned else 1.0)
    if kind == "window_open":
        size *= spec.room(zones[0]).area / _ROOM
    if kind == "capacity_limit" and spec.heating.control == "on_off":
        effects = (*effects, "flow_gain")  # off, or on and less than it says: a meter that reads too much
    return Change(kind, effects, zones if zonal else (), size, start, end)


def _glazed(spec: HouseSpec) -> tuple[str, ...]:
    return tuple(sorted({f.room for f in faces(spec.house) if f.glass > 0.0}))


def _rows(change: Change, n: int) -> slice:
    """Give the steps of a run in which a change acts; the run begins before the telemetry."""
    run_in = n - DAYS * climate.STEPS_PER_DAY
    return slice(run_in + change.start * climate.STEPS_PER_DAY, run_in + change.end * climate.STEPS_PER_DAY)


def _added(made: plant.Plant, change: Change) -> None:
    """Add what changes to EnergyPlus' input."""
    spec, rows = made.spec, _rows(change, len(made.station))
    acts: Array = np.zeros(len(made.station))
    acts[rows] = 1.0
    if change.kind == "window_open":
        open_area(made, change.zones[0], "left window", change.size, made.follow("left open", acts), 0.6)
    elif change.kind == "infiltration":
        for room in sorted({f.room for f in faces(spec.house) if f.side}):
            flow = change.size * spec.room(room).area * spec.house.height / 3600.0
            leak(made, room, "new leak", flow, made.follow("new leak", acts))
    elif change.kind == "internal_gains":
        for room in spec.zone_names:
            made.heat(room, "new gains", change.size * spec.room(room).area * acts, 0.4)
    elif change.kind == "door_open":
        made.objects.setdefault("ZoneCrossMixing", {})["left door"] = model.mixing(
            (change.zones[0], change.zones[1]), change.size, made.follow("left door", acts)
        )
    elif change.kind == "capacity_limit":
        made.heaters[change.zones[0]] |= {"limit": 1.0 - change.size, "limited": [rows.start, rows.stop]}


def _read_wrong(reported: readings.Readings, change: Change) -> None:
    """Let sensors, meters and clocks read wrong while the change lasts."""
    rows = _rows(change, len(reported.station))
    if change.kind == "sensor_bias":
        reported.temperature.iloc[rows, reported.temperature.columns.get_loc(change.zones[0])] += change.size  # type: ignore[index]
    elif change.kind == "flow_gain":
        # the air brought (1 + size) times what the meter says, as in `_monitored_years`
        reported.heat.iloc[rows, reported.heat.columns.get_loc(change.zones[0])] /= 1.0 + change.size  # type: ignore[index]
    elif change.kind == "clock_shift":
        steps = round(change.size * 3600.0 / climate.STEP.total_seconds())
        for k in range(reported.station.shape[1]):
            moved = np.roll(reported.station.iloc[:, k].to_numpy(), steps)
            reported.station.iloc[rows, k] = moved[rows]
