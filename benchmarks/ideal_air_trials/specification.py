"""What a trial is: an office, its weather and use, and the effect that it holds. All of it is drawn from a seed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import date, timedelta
from typing import Any, Literal

import numpy as np
import pandas as pd
from _worlds import Effect

from ideal_air_trials.plan import Layout

Kind = Literal["null", "single", "pair", "outside", "without"]
KINDS: tuple[Kind, ...] = ("null", "single", "pair", "outside")
DAYS = 21  # of telemetry
LEAD_DAYS = 3  # that EnergyPlus runs after its warm-up and before the telemetry
MOST_DAYS = 60  # so that the latest start, in October, ends within the year of the weather file
STEP = pd.Timedelta(minutes=5)  # of EnergyPlus and of the telemetry
STEPS_PER_HOUR, STEPS_PER_DAY = 12, 288
YEAR = 2023  # stands for the typical years of weather files, which have none; its 2 January is a Monday

DEVELOPMENT, CONFIRMATION = 0, 1
#: Purposes of random numbers, so that none disturbs another.
BUILDING, WEATHER, USE, NOISE, SINGLE, OUTSIDE, OPENINGS, PAIR = range(8)
#: First number of every seed sequence of a stream, so that what one draws the other never does.
_FIRST = {DEVELOPMENT: 20261130, CONFIRMATION: 20261201}


@dataclass(frozen=True)
class Fabric:
    """Constructions and films.

    Parameters
    ----------
    wall : str
        Key of `fabric.WALLS`.
    wall_resistance : float
        Of the exterior wall's layers, films left out [m2K/W].
    partition : str
        ``stud`` or ``block``.
    partition_thickness : float
        [m]
    slab_thickness, slab_conductivity, slab_density : float
        Concrete between two floors [m], [W/m/K], [kg/m3].
    carpet_resistance, tile_resistance : float
        On the slab and below it [m2K/W].
    gap : float
        Air between the two panes of a window [m].
    emissivity : float
        Of the inner pane's face to the gap [-], 0.84 where it is not coated.
    air_multiplier : float
        Heat capacity of zones over that of their air [-]: light contents.
    inside_convection, outside_convection : str
        EnergyPlus' algorithms.
    terrain : str
        Of the wind's profile with height.
    """

    wall: str
    wall_resistance: float
    partition: str
    partition_thickness: float
    slab_thickness: float
    slab_conductivity: float
    slab_density: float
    carpet_resistance: float
    tile_resistance: float
    gap: float
    emissivity: float
    air_multiplier: float
    inside_convection: str
    outside_convection: str
    terrain: str


@dataclass(frozen=True)
class Terminal:
    """Ideal air of a zone.

    Parameters
    ----------
    heating_power, cooling_power : float
        Most that it gives and takes, per floor area [W/m2].
    heating_temperature, cooling_temperature : float
        Of supply air [degC].
    """

    heating_power: float
    cooling_power: float
    heating_temperature: float
    cooling_temperature: float


@dataclass(frozen=True)
class Climate:
    """Weather.

    Parameters
    ----------
    source : str
        Weather file that comes with EnergyPlus, without ``.epw``.
    kind : str
        Key of `drawing.SITES`.
    season : str
        Key of `drawing.SEASONS`.
    start : str
        First day of the telemetry, a Monday, ISO 8601.
    warmer : float
        Added to the file's air temperature and dew point [K].
    wind_factor : float
        On the file's wind speed [-].
    """

    source: str
    kind: str
    season: str
    start: str
    warmer: float
    wind_factor: float


@dataclass(frozen=True)
class Spec:
    """A trial, whole.

    Parameters
    ----------
    stream : int
        `DEVELOPMENT` or `CONFIRMATION`.
    seed : int
        Number of the trial in its stream. All but the effects depends on stream and seed only.
    kind : str
        One of `KINDS`, or ``without``: a pair less one effect.
    days : int
        Length of the telemetry [d].
    layout, fabric, terminal, climate
        The office.
    excitation : str
        Set points: ``schedule`` or ``prbs``, pseudo-random.
    drawing_errors : tuple of float
        Glazed areas of the drawing over the true ones [-], by zones in the order of their names and then by facade.
    effects : tuple of Effect
        What it holds beside walls, windows, slabs and heat; empty for a null.
    """

    stream: int
    seed: int
    kind: Kind
    days: int
    layout: Layout
    fabric: Fabric
    terminal: Terminal
    climate: Climate
    excitation: str
    drawing_errors: tuple[float, ...]
    effects: tuple[Effect, ...] = ()

    @property
    def name(self) -> str:
        """Name of case folder and label, which says nothing about the effects."""
        text = f"ideal_air:{self.stream}:{self.seed}:{self.kind}:{self.days}"
        if self.kind == "without":  # a pair has two of them
            text += f":{','.join(effect.name for effect in self.effects)}"
        return "trial_" + hashlib.sha256(text.encode()).hexdigest()[:10]

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Every zone of the building, floor by floor."""
        return self.layout.zone_names

    @property
    def starts(self) -> pd.DatetimeIndex:
        """First moments of all steps that are run, lead included, shape (n_time,), standard time without zone."""
        first = date.fromisoformat(self.climate.start) - timedelta(days=LEAD_DAYS)
        return pd.date_range(first, periods=(LEAD_DAYS + self.days) * STEPS_PER_DAY, freq=STEP)

    def twins(self) -> tuple[Spec, ...]:
        """Return the trials of the same seed without each of the effects: the null of a single."""
        return tuple(self._less(effect) for effect in self.effects)

    def _less(self, effect: Effect) -> Spec:
        others = tuple(other for other in self.effects if other is not effect)
        return replace(self, kind="without" if others else "null", effects=others)

    def effect(self, name: str) -> Effect | None:
        """Return the effect of a name, None where the trial has it not.

        Parameters
        ----------
        name : str
            Of the effect.
        """
        return next((effect for effect in self.effects if effect.name == name), None)

    def label(self, run: Mapping[str, Any]) -> dict[str, Any]:
        """Write down what the trial holds.

        Parameters
        ----------
        run : mapping
            What was measured while it was made.
        """
        plain: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        words = f"{self.layout.kind}, {self.layout.floors} floors, {len(self.zone_names)} zones"
        return plain | {
            "name": self.name, "world": "ideal_air", "building": words,
            "twins": [twin.name for twin in self.twins()], "run": dict(run),
        }  # fmt: skip


def generator(stream: int, seed: int, purpose: int) -> np.random.Generator:
    """Return the random numbers of one purpose of one trial.

    Parameters
    ----------
    stream : int
        `DEVELOPMENT` or `CONFIRMATION`.
    seed : int
        Number of the trial in its stream, at least 0.
    purpose : int
        What they are for: `BUILDING` to `PAIR`.
    """
    return np.random.default_rng([_FIRST[stream], seed, purpose])
