"""What a trial is, drawn from its seed: building, weather, use of sensors, and the effects that it holds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import date, timedelta
from typing import Any, Literal

import numpy as np

from reference_trials.buildings import REFERENCES

Kind = Literal["null", "single"]
Spaces = Literal["boundaries", "zones"]
KINDS: tuple[Kind, ...] = ("null", "single")
DAYS = 21
#: Before the telemetry, after EnergyPlus' own warm-up [d].
RUN_IN_DAYS = 10
DEVELOPMENT, CONFIRMATION = 0, 1
YEAR = 2023  # stands for the typical years, which have none
#: Of what the building has, drawn evenly on the logarithmic scale [-].
STRENGTHS = (0.35, 1.6)
_WORLD = 2  # first number of every seed, so that no other world draws the same
_BUILDING, _SENSORS, _EFFECTS, WHERE, NOISE = range(5)  # purposes of random numbers
_SEASONS = {"winter": (15, 60), "spring": (61, 130), "summer": (150, 240), "autumn": (244, 340)}  # days of the year

#: Weather files that EnergyPlus brings, from cold to hot.
WEATHER = (
    "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3",
    "USA_CO_Denver-Aurora-Buckley.AFB.724695_TMY3",
    "USA_NJ_Newark.Intl.AP.725020_TMY3",
    "USA_VA_Sterling-Washington.Dulles.Intl.AP.724030_TMY3",
    "USA_OK_Oklahoma.City-Will.Rogers.World.AP.723530_TMY3",
    "USA_CA_San.Francisco.Intl.AP.724940_TMY3",
    "USA_NV_Las.Vegas-McCarran.Intl.AP.723860_TMY3",
    "USA_FL_Tampa.Intl.AP.722110_TMY3",
)
#: Of these one can lie anywhere between its own least and most strength; of the others what the building has counts.
SCALED = ("solar_gain", "solar_opaque", "infiltration", "internal_gains", "hidden_mass", "zone_mixing", "valve_leak",
          "sensor_bias", "sensor_lag", "flow_gain", "duct_loss")  # fmt: skip
AS_IT_IS = ("longwave_sky", "wind_film", "ground_exchange", "clock_shift")
EFFECTS = (*SCALED, *AS_IT_IS)


@dataclass(frozen=True)
class Effect:
    """One effect that the building holds.

    Parameters
    ----------
    name : str
        Id of the catalogue.
    strength : float
        Of what the building has, or of what is typical [-].
    zones : tuple of str
        Zones that have it, as the case calls them; empty for the whole building.
    parameters : dict
        Numbers; names end in their unit.
    """

    name: str
    strength: float
    zones: tuple[str, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Sensors:
    """How well things are measured.

    Parameters
    ----------
    temperature_noise, temperature_resolution, discharge_noise, outdoor_noise : float
        [K]
    flow_noise : float
        [-], share of the flow.
    """

    temperature_noise: float
    temperature_resolution: float
    discharge_noise: float
    outdoor_noise: float
    flow_noise: float


@dataclass(frozen=True)
class Spec:
    """A trial, whole, but for where its effects are, which `effects.resolve` finds in the building.

    Parameters
    ----------
    stream : int
        `DEVELOPMENT` or `CONFIRMATION`.
    seed : int
        Number in its stream.
    kind : str
        One of `KINDS`.
    days : int
        Length of the telemetry [d].
    building : str
        Key of `REFERENCES`.
    weather : str
        Weather file.
    start : str
        First day of the telemetry, ISO 8601.
    steps_per_hour : int
        Steps of simulation and telemetry.
    spaces : str
        How plenums and attics, which no air is conditioned for, are in the case: ``boundaries``, whose air is measured,
        or ``zones`` without a device.
    sensors : Sensors
        Their noise.
    wanted : tuple of (str, float)
        Names of effects with their strengths.
    """

    stream: int
    seed: int
    kind: Kind
    days: int
    building: str
    weather: str
    start: str
    steps_per_hour: int
    spaces: Spaces
    sensors: Sensors
    wanted: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        """Name of case folder and label, which says nothing about the effects."""
        text = f"reference:{self.stream}:{self.seed}:{self.kind}:{self.days}"
        return "trial_" + hashlib.sha256(text.encode()).hexdigest()[:10]

    def twin(self) -> Spec:
        """Return the null of the same seed."""
        return replace(self, kind="null", wanted=())

    def label(self, effects: tuple[Effect, ...], run: Mapping[str, Any]) -> dict[str, Any]:
        """Write down what the trial holds.

        Parameters
        ----------
        effects : tuple of Effect
            In full.
        run : mapping
            What was measured while it was made.
        """
        told = [asdict(e) | {"answers": [e.name], "unexplained_is_right": False} for e in effects]
        words = REFERENCES[self.building].words
        plain: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return plain | {
            "name": self.name, "world": "reference", "building": words, "twins": [self.twin().name for _ in effects],
            "effects": told, "run": dict(run),
        }  # fmt: skip


def generator(spec: Spec, purpose: int) -> np.random.Generator:
    """Return the random numbers of one purpose of a trial.

    Parameters
    ----------
    spec : Spec
        Of which stream and seed count.
    purpose : int
        What they are for, so that no purpose disturbs another.
    """
    return _generator(spec.stream, spec.seed, purpose)


def _generator(stream: int, seed: int, *purpose: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence([_WORLD, stream, seed], spawn_key=purpose))


def draw_spec(seed: int, kind: Kind, *, confirmation: bool = False, days: int = DAYS) -> Spec:
    """Draw a trial.

    Building, weather and sensors depend on stream and seed alone, so that the null of a seed is the twin of its single.

    Parameters
    ----------
    seed : int
        Number of the trial in its stream, at least 0; buildings take turns, and so do `Spec.spaces`.
    kind : {"null", "single"}
        No effect, or one.
    confirmation : bool
        Draw from the stream that nothing is tuned on.
    days : int
        Length of the telemetry [d].

    Raises
    ------
    ValueError
        On a seed or a kind that does not exist.
    """
    if kind not in KINDS or seed < 0:
        raise ValueError(f"expected a seed of 0 or more and a kind of {KINDS}, found {seed} and {kind!r}")
    stream = CONFIRMATION if confirmation else DEVELOPMENT
    rng = _generator(stream, seed, _BUILDING)
    low, high = _SEASONS[str(rng.choice(list(_SEASONS)))]
    start = date(YEAR, 1, 1) + timedelta(days=int(rng.integers(low, min(high, 365 - days) + 1)) - 1)
    null = Spec(
        stream, seed, "null", days,
        building=list(REFERENCES)[seed % len(REFERENCES)],
        weather=str(rng.choice(WEATHER)),
        start=start.isoformat(),
        steps_per_hour=int(rng.choice([12, 6, 4], p=[0.5, 0.3, 0.2])),
        spaces=("boundaries", "zones")[seed // len(REFERENCES) % 2],
        sensors=_sensors(_generator(stream, seed, _SENSORS)),
    )  # fmt: skip
    if kind == "null":
        return null
    rng = _generator(stream, seed, _EFFECTS)
    name = str(rng.choice([e for e in EFFECTS if e not in _LACKS.get(null.building, ())]))
    drawn = round(float(np.exp(rng.uniform(*np.log(STRENGTHS)))), 3)
    return replace(null, kind=kind, wanted=((name, drawn if name in SCALED else 1.0),))


#: What a building cannot have: a leaking valve needs a coil at the terminal.
_LACKS: Mapping[str, tuple[str, ...]] = {
    key: ("valve_leak",) for key in ("small_office", "heat_pump_office", "strip_mall", "retail", "restaurant")
}


def _sensors(rng: np.random.Generator) -> Sensors:
    return Sensors(
        temperature_noise=round(float(rng.uniform(0.02, 0.06)), 3),
        temperature_resolution=float(rng.choice([0.01, 0.05, 0.1])),
        discharge_noise=round(float(rng.uniform(0.05, 0.15)), 3),
        outdoor_noise=round(float(rng.uniform(0.05, 0.15)), 3),
        flow_noise=round(float(rng.uniform(0.003, 0.02)), 4),
    )
