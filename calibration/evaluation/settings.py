"""How a case's model is built, run and calibrated, and what a file of parameters says of it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from calibration.errors import CalibrationError
from calibration.evaluation.population import Population, population_from
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.effects.catalogue import chosen, is_effect
from thermal.errors import ModelError, nearest
from thermal.inputs.normalisation import Normalisation
from thermal.model.case_replay import LEAST_SPIN_UP, SPIN_UP
from thermal.model.step import SCHEMES, Scheme
from thermal.network.build import build_network
from thermal.network.network import ThermalNetwork
from thermal.network.structure import BASELINE, Structure
from thermal.parameters import Scope

#: ``linear`` is plain least squares; ``pseudo_huber`` takes errors far beyond the others for outliers.
Loss = Literal["linear", "pseudo_huber"]

#: Errors of N-step runs, or whitened innovations of a Kalman filter.
Objective = Literal["multi_step", "innovations"]

#: Intervals of telemetry that `calibrate` takes beside its settings.
INTERVALS = ("tune", "hold_out")


@dataclass(frozen=True)
class ModelSettings:
    """How a case's model is built and run, beside its parameters.

    Parameters
    ----------
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    reach : float, optional
        Reach of the shuffle [m]; None is the whole zone.
    scheme : str
        ``implicit_euler`` or ``tr_bdf2``.
    scopes : mapping of str to {"global", "facade", "zone"}
        Parameters with one value a facade or a zone, shrunk towards a common one as far as the data let them.
    spin_up_seconds : float
        Length of the spin-up before an interval [s].
    structure : Structure
        What the model is made of: furniture, slabs, nodes of a wall, radiant node.
    effects : mapping of str to sequence of str
        Effects of the catalogue in the model, each with its zones; none is the whole building.
    normalisation : Normalisation, optional
        Constants that the inputs of the effects are counted by, of the tuning intervals; by default, as in files that
        have none, those of whatever telemetry the model is run on.

    Raises
    ------
    CalibrationError
        When the scheme is unknown, the spin-up shorter than 12 hours, or the structure no `Structure`.
    """

    dx: float | None = None
    reach: float | None = None
    scheme: str = "implicit_euler"
    scopes: Mapping[str, Scope] = field(default_factory=dict)
    spin_up_seconds: float = SPIN_UP
    structure: Structure = BASELINE
    effects: Mapping[str, Sequence[str]] = field(default_factory=dict)
    normalisation: Normalisation | None = None

    def __post_init__(self) -> None:
        CalibrationError.unless_known(self.scheme, SCHEMES, "scheme", f"one of {', '.join(sorted(SCHEMES))}")
        fits = LEAST_SPIN_UP <= self.spin_up_seconds < float("inf")
        CalibrationError.unless(fits, "spin_up_seconds", f"at least {LEAST_SPIN_UP:g} s", self.spin_up_seconds)
        CalibrationError.unless(isinstance(self.structure, Structure), "structure", "a Structure", repr(self.structure))

    @property
    def stepping(self) -> Scheme:
        """Time stepping of the free runs."""
        return SCHEMES[self.scheme]

    def network(self, building: Building) -> ThermalNetwork:
        """Build the control volumes and faces of a building.

        Parameters
        ----------
        building : Building
            What the case folder describes.
        """
        network = build_network(
            building,
            dx=self.dx,
            reach=self.reach,
            scopes=self.scopes,
            structure=self.structure,
            effects=chosen(self.effects),
        )
        return replace(network, normalisation=self.normalisation)

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``calibration.json``."""
        effects = {name: list(zones) for name, zones in self.effects.items()}
        counted = self.effects or self.structure.is_counted
        kept = self.normalisation.to_dict() if counted and self.normalisation is not None else None
        return {**asdict(replace(self, normalisation=None)), "effects": effects, "normalisation": kept}


@dataclass(frozen=True)
class CalibrationSettings(ModelSettings):
    """How a case is calibrated: its model, what is estimated, and how.

    Parameters
    ----------
    dx, reach : float, optional
        Of the model, see `ModelSettings` [m].
    spin_up_seconds : float
        Length of the spin-up before an interval [s].
    scheme, scopes, structure, effects
        Of the model, see `ModelSettings`.
    fixed : mapping of str to float
        Parameters that keep a given value [parameter units].
    horizon : str
        Prediction horizon, such as ``6h``.
    objective : {"multi_step", "innovations"}
        Errors of N-step runs, or the likelihood of a Kalman filter's innovations, whose disturbance is tuned with the
        parameters in turn.
    loss : {"linear", "pseudo_huber"}
        Least squares, or a loss that outlying errors do not pull.
    starts : int
        Number of starts: the given one, where a fit would go that may compensate freely, then draws from the prior.
        The best is kept, and a start that fails costs that start only.
    seed : int
        Seed of the draws.
    climb : bool
        Whether the building is also fitted lumped, and what predicts left-out tuning days better is kept; see
        `calibration.fit.ladder`.
    yardsticks : bool
        Whether simple models are fitted too, whose errors stand beside the model's.
    population : Population, optional
        Prior of the parameters that a fleet has taught, see `read_population`; the physical ranges by default.

    Raises
    ------
    CalibrationError
        When a choice is unknown, or a number out of range.
    """

    fixed: Mapping[str, float] = field(default_factory=dict)
    horizon: str = "6h"
    objective: Objective = "multi_step"
    loss: Loss = "linear"
    starts: int = 3
    seed: int = 0
    climb: bool = False
    yardsticks: bool = False
    population: Population | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, known in (("loss", get_args(Loss)), ("objective", get_args(Objective))):
            CalibrationError.unless_known(getattr(self, name), known, name, f"one of {', '.join(known)}")
        for name, least in (("starts", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise CalibrationError(f"{name}: expected at least {least}, got {getattr(self, name)}")

    @property
    def model(self) -> ModelSettings:
        """Settings of the model alone."""
        return ModelSettings(**{f.name: getattr(self, f.name) for f in fields(ModelSettings)})


def calibration_settings(
    given: ModelSettings | Mapping[str, Any] | None, further: Mapping[str, Any] | None = None
) -> CalibrationSettings:
    """Make settings of a calibration from values by name, such as a file or a command has.

    Parameters
    ----------
    given : CalibrationSettings, ModelSettings, mapping of str to Any, or None
        Settings, or values by name; ``effects`` may be their names only, ``structure`` a mapping. None is the defaults.
    further : mapping of str to Any, optional
        Values that replace those.

    Raises
    ------
    CalibrationError
        When a name is unknown.
    """
    base = given if isinstance(given, CalibrationSettings) else CalibrationSettings()
    changes = {**(vars(given) if isinstance(given, ModelSettings) else given or {}), **(further or {})}
    known = [f.name for f in fields(CalibrationSettings)]
    for name in changes:
        if name in INTERVALS:
            raise CalibrationError(f"settings: {name!r} is no setting; give it to calibrate beside the settings")
        if name not in known:
            raise CalibrationError(f"settings: calibrate takes no {name!r}; {nearest(name, known)}")
    effects, structure = changes.get("effects"), changes.get("structure")
    if effects is not None and not isinstance(effects, Mapping):
        changes["effects"] = {name: () for name in effects}
    if isinstance(structure, Mapping):
        changes["structure"] = Structure(**structure)
    if isinstance(changes.get("population"), Mapping):
        changes["population"] = population_from(changes["population"])
    return replace(base, **changes)


def read_settings(path: str | Path) -> dict[str, Any]:
    """Read the settings in a file of parameters; `load_parameters` says what else is wrong with it.

    Parameters
    ----------
    path : str or Path
        A ``calibration.json``.

    Returns
    -------
    dict
        Arguments of `ModelSettings`, as far as the file has them.

    Raises
    ------
    CalibrationError
        When the settings are not as `ModelSettings` writes them.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return told_settings(content.get("settings", {}) if isinstance(content, dict) else {}, path)


def told_settings(settings: Any, path: Path) -> dict[str, Any]:
    """Read settings as `ModelSettings.to_dict` tells them; arguments of `ModelSettings`.

    Parameters
    ----------
    settings : mapping of str to Any
        Out of a file.
    path : Path
        The file, which errors name.

    Raises
    ------
    CalibrationError
        When they are something else.
    """

    def refuse(what: str, expected: str, found: Any) -> CalibrationError:
        return CalibrationError(f"{path}: {what}: expected {expected}, found {found!r}")

    known = sorted(f.name for f in fields(ModelSettings))
    if not isinstance(settings, dict) or set(settings) - set(known):
        raise refuse("settings", f"a mapping with keys {known}", settings)
    for name in ("dx", "reach", "spin_up_seconds"):
        value = settings.get(name)
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float) or value <= 0):
            raise refuse(f"settings.{name}", "a positive number or null", value)
    scopes, effects = settings.get("scopes", {}), settings.get("effects", {})
    if not isinstance(scopes, dict) or not set(scopes.values()) <= set(get_args(Scope)):
        raise refuse("settings.scopes", f"a mapping to {', '.join(get_args(Scope))}", scopes)
    lists = isinstance(effects, dict) and all(isinstance(zones, list) for zones in effects.values())
    if not lists or not all(is_effect(name) for name in effects):
        raise refuse("settings.effects", "a mapping from effects of the catalogue to lists of zones", effects)
    if "structure" in settings:
        entry, names = settings["structure"], sorted(f.name for f in fields(Structure))
        if not isinstance(entry, dict) or set(entry) - set(names):
            raise refuse("settings.structure", f"a mapping with keys among {names}", entry)
        try:
            settings["structure"] = Structure(**entry)
        except ModelError as error:
            raise CalibrationError(f"{path}: settings.{error}") from error
    if settings.get("normalisation") is not None:
        try:
            settings["normalisation"] = Normalisation.from_dict(settings["normalisation"])
        except ValueError as error:
            raise CalibrationError(f"{path}: settings.normalisation: {error}") from error
    return settings


def load_parameters(path: str | Path, network: ThermalNetwork) -> FloatArray:
    """Read θ from a ``calibration.json`` (or any JSON with its ``parameters`` key).

    Parameters
    ----------
    path : str or Path
        The file.
    network : ThermalNetwork
        Whose parameters they are.

    Returns
    -------
    ndarray, shape (n_parameter,)
        θ [parameter units].

    Raises
    ------
    CalibrationError
        When the file cannot be read, or does not hold the parameters of this building.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CalibrationError(f"parameters: cannot read {path}: {error.strerror or error}") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise CalibrationError(f"{path}: expected JSON as `calibrate` writes it, found {error}") from error
    entries = content.get("parameters") if isinstance(content, dict) else None
    if not isinstance(entries, dict) or not entries:
        raise CalibrationError(f"{path}: expected a key 'parameters' with an entry a parameter, as in calibration.json")
    scales = {p.name: p.scale for p in network.parameters}
    unknown, missing = sorted(set(entries) - set(scales) - set(network.nominal)), sorted(set(scales) - set(entries))
    if unknown or missing:
        raise CalibrationError(
            f"{path}: parameters of another building, or of an earlier version: unknown {unknown or 'none'}, missing "
            f"{missing or 'none'}; calibrate this case, or give the file that belongs to it"
        )
    values: dict[str, float] = {}
    for name, entry in entries.items():
        value: Any = entry.get("value") if isinstance(entry, dict) else entry
        scale = scales.get(name, "log")
        usable = isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
        if not usable or (value <= 0 and scale != "linear") or (value > 1 and scale == "logit"):
            kind = {"linear": "a number", "logit": "a positive number of at most 1"}.get(scale, "a positive number")
            raise CalibrationError(f"{path}: parameters.{name}: expected {kind} under 'value', found {value!r}")
        values[name] = float(value)
    return network.values({name: value for name, value in values.items() if name in scales})
