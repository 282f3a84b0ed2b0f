"""How a case's model is built and run: what belongs to a set of parameters beside their values."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

from calibration.errors import CalibrationError
from thermal.case.building import Building
from thermal.effects.catalogue import CATALOGUE, chosen
from thermal.errors import ModelError
from thermal.inputs.normalisation import Normalisation
from thermal.model.replay import LEAST_SPIN_UP, SPIN_UP
from thermal.model.step import SCHEMES, Scheme
from thermal.network.build import build_network
from thermal.network.network import ThermalNetwork
from thermal.network.structure import BASELINE, Structure
from thermal.parameters import Scope


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
        Parameters with one value a facade or a zone.
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
        if self.scheme not in SCHEMES:
            raise CalibrationError(f"scheme: expected one of {', '.join(sorted(SCHEMES))}, came {self.scheme!r}")
        if not LEAST_SPIN_UP <= self.spin_up_seconds < float("inf"):
            raise CalibrationError(
                f"spin_up_seconds: expected at least {LEAST_SPIN_UP:g} s, came {self.spin_up_seconds}"
            )
        if not isinstance(self.structure, Structure):
            raise CalibrationError(f"structure: expected a Structure, came {self.structure!r}")

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
        plain: dict[str, Any] = {"scopes": dict(self.scopes), "structure": asdict(self.structure)}
        plain["effects"] = {name: list(zones) for name, zones in self.effects.items()}
        kept = self.normalisation if self.effects else None
        plain["normalisation"] = None if kept is None else kept.to_dict()
        return {**{k: getattr(self, k) for k in self.__dataclass_fields__}, **plain}


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
    settings = content.get("settings", {}) if isinstance(content, dict) else {}
    known = set(ModelSettings.__dataclass_fields__)
    if not isinstance(settings, dict) or set(settings) - known:
        raise CalibrationError(f"{path}: settings: expected a mapping with keys {sorted(known)}, found {settings!r}")
    for name in ("dx", "reach", "spin_up_seconds"):
        value = settings.get(name)
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float) or value <= 0):
            raise CalibrationError(f"{path}: settings.{name}: expected a positive number or null, found {value!r}")
    if "scopes" in settings:
        _check_scopes(path, settings["scopes"])
    if "effects" in settings:
        _check_effects(path, settings["effects"])
    if "structure" in settings:
        settings["structure"] = _structure(path, settings["structure"])
    if settings.get("normalisation") is not None:
        try:
            settings["normalisation"] = Normalisation.from_dict(settings["normalisation"])
        except ValueError as error:
            raise CalibrationError(f"{path}: settings.normalisation: {error}") from error
    return settings


def _check_scopes(path: Path, scopes: Any) -> None:
    """Refuse scopes that are not as `ModelSettings` writes them; the network says whether they fit the building."""
    if not isinstance(scopes, dict) or not all(scope in get_args(Scope) for scope in scopes.values()):
        raise CalibrationError(
            f"{path}: settings.scopes: expected a mapping to {', '.join(get_args(Scope))}, found {scopes!r}"
        )


def _check_effects(path: Path, effects: Any) -> None:
    """Refuse effects that are not as `ModelSettings` writes them; the network says whether they fit the building."""
    lists = isinstance(effects, dict) and all(isinstance(zones, list) for zones in effects.values())
    if not lists or not set(effects) <= set(CATALOGUE):
        raise CalibrationError(
            f"{path}: settings.effects: expected a mapping from effects of the catalogue to lists of zones, "
            f"found {effects!r}"
        )


def _structure(path: Path, entry: Any) -> Structure:
    """Make the structure that a file names."""
    known = sorted(Structure.__dataclass_fields__)
    if not isinstance(entry, dict) or set(entry) - set(known):
        raise CalibrationError(
            f"{path}: settings.structure: expected a mapping with keys among {known}, found {entry!r}"
        )
    try:
        return Structure(**entry)
    except ModelError as error:
        raise CalibrationError(f"{path}: settings.{error}") from error
