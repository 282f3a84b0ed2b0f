"""Draws a trial from its seed."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta

import numpy as np

from energyplus_trials import climate, plan
from energyplus_trials.draw_effects import draw_effects
from energyplus_trials.sites import TOWNS, WEATHER_FILES
from energyplus_trials.specification import (
    CONFIRMATION,
    DEVELOPMENT,
    KINDS,
    Climate,
    Fabric,
    Kind,
    Layout,
    TrialSpec,
    Use,
    stream_generator,
)

DAYS = 21
_LAYOUT, _FABRIC, _CLIMATE, _USE, _EFFECTS = range(5)  # purposes of random numbers
_MOST_ZONES = 18
_SEASONS = {"winter": (12, 71), "spring": (72, 150), "summer": (152, 240), "autumn": (244, 335)}  # days of the year


def draw_spec(
    seed: int, kind: Kind, *, confirmation: bool = False, days: int = DAYS, uneven: bool = False
) -> TrialSpec:
    """Draw a trial.

    Building, weather, use and noise are drawn from stream and seed alone, so that trials of one seed differ in their
    effects only and the null of a seed is the twin of its other trials.

    Parameters
    ----------
    seed : int
        Number of the trial in its stream, at least 0.
    kind : {"null", "single", "pair", "outside"}
        No effect; one of the catalogue; two or three of them; one that it does not know, or not in this form.
    confirmation : bool
        Draw from the stream that nothing is tuned on.
    days : int
        Length of the telemetry.
    uneven : bool
        Films and furniture as in other makers' offices, see `Fabric`.

    Raises
    ------
    ValueError
        On a seed or a kind that does not exist.
    """
    if kind not in KINDS or seed < 0:
        raise ValueError(f"expected a seed of 0 or more and a kind of {KINDS}, found {seed} and {kind!r}")
    stream = CONFIRMATION if confirmation else DEVELOPMENT
    layout = _layout(stream_generator(stream, seed, _LAYOUT))
    null = TrialSpec(
        stream=stream,
        seed=seed,
        kind="null",
        days=days,
        layout=layout,
        fabric=replace(_fabric(stream_generator(stream, seed, _FABRIC)), uneven=uneven),
        climate=_climate(stream_generator(stream, seed, _CLIMATE), days),
        use=_use(stream_generator(stream, seed, _USE)),
        effects=(),
    )
    return draw_effects(null, kind, stream_generator(stream, seed, _EFFECTS, KINDS.index(kind)))


def without(spec: TrialSpec) -> tuple[TrialSpec, ...]:
    """Twins of a trial of several effects: the same without each of them in turn.

    Parameters
    ----------
    spec : TrialSpec
        With two effects or more.
    """
    left = ([e for e in spec.effects if e is not effect] for effect in spec.effects)
    return tuple(replace(spec, kind="without", effects=tuple(effects)) for effects in left)


def twins_of(spec: TrialSpec) -> tuple[TrialSpec, ...]:
    """For each effect of a trial, the same trial without it.

    Parameters
    ----------
    spec : TrialSpec
        Of any kind.
    """
    return without(spec) if len(spec.effects) > 1 else tuple(spec.twin() for _ in spec.effects)


def _layout(rng: np.random.Generator) -> Layout:
    zones = plan.draw_zones(rng)
    floors = min(int(rng.choice([1, 2, 3], p=[0.35, 0.4, 0.25])), _MOST_ZONES // len(zones))
    glazing = {side: round(float(rng.uniform(0.15, 0.5)), 3) for side in plan.SIDES}
    blank = str(rng.choice(plan.SIDES))
    if rng.random() < 0.4:
        glazing[blank] = 0.0
    height = round(float(rng.uniform(2.8, 3.5)), 2)
    orientation = round(float(rng.uniform(-60.0, 60.0)), 1)
    return Layout(zones, floors, height, orientation, glazing, round(float(rng.uniform(1.3, 1.8)), 2))


def _fabric(rng: np.random.Generator) -> Fabric:
    wall = str(rng.choice(["mass_inside", "light", "mass_outside"], p=[0.6, 0.25, 0.15]))
    return Fabric(
        wall=wall,
        wall_u_value=round(float(rng.uniform(0.25, 0.9)), 3),
        structure=round(float(rng.uniform(0.12, 0.24)), 3),
        partition=str(rng.choice(["brick", "gypsum"])),
        slab=round(float(rng.uniform(0.06, 0.14)), 3),
        furniture_area=round(float(rng.uniform(0.4, 1.2)), 2),
        furniture_thickness=round(float(rng.uniform(0.02, 0.04)), 3),
        window_u_value=round(float(rng.uniform(1.1, 2.9)), 2),
        exterior_film=round(float(rng.uniform(12.0, 22.0)), 1),
        interior_convection=str(rng.choice(["TARP", "Simple"], p=[0.7, 0.3])),
    )


def _climate(rng: np.random.Generator, days: int) -> Climate:
    low, high = _SEASONS[str(rng.choice(list(_SEASONS)))]
    start = date(climate.YEAR, 1, 1) + timedelta(days=int(rng.integers(low, min(high, 365 - days) + 1)) - 1)
    seed, warmer = int(rng.integers(2**31)), round(float(rng.normal(0.0, 1.5)), 2)
    generated = rng.random() < 0.2
    places = TOWNS if generated else WEATHER_FILES
    site = places[int(rng.integers(len(places)))]
    if generated:
        warmer = round(warmer - float(rng.uniform(0.0, 9.0)), 2)  # the generator's own climate is a mild one
    swing = round(float(rng.uniform(0.85, 1.15)), 3)
    return Climate(
        source=site.source,
        seed=seed,
        latitude=site.latitude,
        longitude=site.longitude,
        elevation=site.elevation,
        utc_offset=site.utc_offset,
        start=start.isoformat(),
        warmer=warmer,
        swing=swing,
    )


def _use(rng: np.random.Generator) -> Use:
    return Use(
        excitation=str(rng.choice(["schedule", "prbs", "float"], p=[0.5, 0.35, 0.15])),
        seed=int(rng.integers(2**31)),
        flow=round(float(rng.uniform(0.0025, 0.0045)), 5),
        temperature_noise=round(float(rng.uniform(0.02, 0.05)), 3),
        temperature_resolution=float(rng.choice([0.01, 0.02, 0.05])),
        discharge_noise=round(float(rng.uniform(0.04, 0.1)), 3),
        outdoor_noise=round(float(rng.uniform(0.03, 0.12)), 3),
        flow_noise=round(float(rng.uniform(0.003, 0.012)), 4),
        idle_discharge=str(rng.choice(["room", "duct"])),
    )
