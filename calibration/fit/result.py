"""What a calibration found: parameters with what is known of them, errors before and after, solver status."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from calibration.errors import CalibrationError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation
from calibration.evaluation.settings import ModelSettings
from calibration.fit.problem import Objective
from calibration.identifiability.information import Information
from thermal._types import FloatArray
from thermal.effects.catalogue import CATALOGUE
from thermal.network.network import ThermalNetwork


@dataclass(frozen=True)
class ParameterEstimate:
    """One parameter after calibration.

    Parameters
    ----------
    name, unit : str
        As in the model.
    value : float
        Estimate [parameter units].
    lower, upper, start : float
        Physical range and start [parameter units].
    at_bound : bool
        Whether the estimate lies within 1 % of the range (on the estimation scale) of a bound.
    standard_error : float or None
        Posterior standard error [parameter units]; None for what was not estimated.
    identifiable : bool
        Whether the data halve the prior's spread, not only because priors hold the others, and no bound is hit.
    source : str
        Where the range comes from, or why the value was not estimated.
    interval90 : tuple of float or None
        Ends of the 90 % interval within the physical range [parameter units].
    """

    name: str
    unit: str
    value: float
    lower: float | None
    upper: float | None
    start: float
    at_bound: bool
    standard_error: float | None
    identifiable: bool
    source: str
    interval90: tuple[float, float] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``calibration.json``."""
        return {k: getattr(self, k) for k in self.__dataclass_fields__ if k != "name"}


@dataclass(frozen=True)
class SolverReport:
    """How the solve went.

    Parameters
    ----------
    name, status : str
        Solver and its return status.
    success : bool
        Whether it converged.
    iterations : int
        Iterations of the best start, over all its rounds.
    seconds : float
        Wall time of the calibration [s].
    starts : int
        Number of starts.
    failures : tuple of str
        What went wrong in starts that failed.
    evaluations : int
        Evaluations of the errors with their derivatives, of the best start.
    settled : bool
        Whether its rounds of weighing and reducing ended because nothing moved any more.
    """

    name: str
    status: str
    success: bool
    iterations: int
    seconds: float
    starts: int
    failures: tuple[str, ...] = ()
    evaluations: int = 0
    settled: bool = True

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``calibration.json``."""
        return {**{k: getattr(self, k) for k in self.__dataclass_fields__}, "failures": list(self.failures)}


@dataclass(frozen=True)
class GridCheck:
    """The calibrated reduced model replayed beside the grid.

    Parameters
    ----------
    volumes, order : int
        Control volumes of the grid and states of the reduced model.
    runs : int
        Runs compared.
    max_difference, mean_difference : float
        Of zone means over all steps of these runs [K].
    """

    volumes: int
    order: int
    runs: int
    max_difference: float
    mean_difference: float

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``calibration.json``."""
        return {k: getattr(self, k) for k in self.__dataclass_fields__}


@dataclass(frozen=True)
class CalibrationResult:
    """Outcome of `calibration.calibrate`.

    Parameters
    ----------
    case : str
        Name of the case.
    zones : tuple of str
        Zone names.
    parameters : tuple of ParameterEstimate
        Every parameter, estimated or nominal.
    theta : ndarray, shape (n_parameter,)
        θ of the network [parameter units].
    tuning, held_out : tuple of Interval
        Where it was fitted and where it is judged.
    uncalibrated, calibrated : mapping of str to Evaluation
        Errors at the start and at the estimate; keys ``tuning`` and ``held_out``.
    solver : SolverReport
        Status of the solve.
    grid_check : GridCheck
        Certificate of the reduced model that the numbers were made with.
    disturbance : DisturbanceModel or None
        Unmeasured heat and sensor noise that the standard errors follow.
    excess : float
        Mean square of the tuning errors, or of what a day's innovations pull at, over that which the disturbance makes
        [-]; far above 1, physics is missing.
    information : Information
        What the data determine, in numbers and in words.
    horizon : str
        Prediction horizon.
    settings : ModelSettings
        How the model was built and run.
    seed : int
        Seed of the starts.
    version : str
        Of the library.
    objective : {"multi_step", "innovations"}
        What was minimised.
    """

    case: str
    zones: tuple[str, ...]
    parameters: tuple[ParameterEstimate, ...]
    theta: FloatArray
    tuning: tuple[Interval, ...]
    held_out: tuple[Interval, ...]
    uncalibrated: Mapping[str, Evaluation]
    calibrated: Mapping[str, Evaluation]
    solver: SolverReport
    grid_check: GridCheck
    disturbance: DisturbanceModel | None
    excess: float
    information: Information
    horizon: str
    settings: ModelSettings
    seed: int
    version: str = field(default="")
    objective: Objective = "multi_step"

    def effects(self) -> list[dict[str, Any]]:
        """Effects in the model with their zones and parameters, an entry of ``calibration.json`` each."""
        return effect_entries(self.settings.effects, self.parameters)

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``calibration.json``."""

        def errors(evaluations: Mapping[str, Evaluation]) -> dict[str, dict[str, float]]:
            return {name: e.metrics.to_dict() for name, e in evaluations.items()}

        return {
            "parameters": {p.name: p.to_dict() for p in self.parameters},
            "uncalibrated": errors(self.uncalibrated),
            "calibrated": errors(self.calibrated),
            "effects": self.effects(),
            "solver": self.solver.to_dict(),
            "grid_check": self.grid_check.to_dict(),
            "disturbance": None if self.disturbance is None else self.disturbance.to_dict(),
            "excess": self.excess,
            "information": self.information.to_dict(),
            "intervals": {
                "tuning": [i.to_dict() for i in self.tuning],
                "held_out": [i.to_dict() for i in self.held_out],
            },
            "objective": self.objective,
            "horizon": self.horizon,
            "settings": self.settings.to_dict(),
            "case": self.case,
            "version": self.version,
            "seed": self.seed,
        }


def effect_entries(
    effects: Mapping[str, Sequence[str]], parameters: Sequence[ParameterEstimate]
) -> list[dict[str, Any]]:
    """Effects of a model with their zones and parameters, an entry of ``calibration.json`` each.

    Parameters
    ----------
    effects : mapping of str to sequence of str
        Ids, each with its zones.
    parameters : sequence of ParameterEstimate
        Of the model.
    """
    entries = []
    for name, zones in effects.items():
        own = {p.name for p in CATALOGUE[name].parameters}
        values = {p.name: {"value": p.value, "unit": p.unit} for p in parameters if p.name.partition("@")[0] in own}
        entries.append({"effect": name, "zones": list(zones), "parameters": values})
    return entries


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
        raise CalibrationError(
            f"{path}: expected a key 'parameters' with an entry a parameter, as in calibration.json"
        )
    values: dict[str, float] = {}
    for name, entry in entries.items():
        value = entry.get("value") if isinstance(entry, dict) else entry
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise CalibrationError(
                f"{path}: parameters.{name}: expected a positive number under 'value', found {value!r}"
            )
        values[name] = float(value)
    signed = {p.name for p in network.parameters if p.scale == "linear"}
    wrong = [name for name, value in values.items() if value <= 0 and name not in signed]
    if wrong:
        raise CalibrationError(
            f"{path}: parameters.{wrong[0]}: expected a positive number under 'value', found {values[wrong[0]]!r}"
        )
    for p in network.parameters:
        if p.scale == "logit" and values.get(p.name, 0.0) > 1.0:
            raise CalibrationError(f"{path}: parameters.{p.name}: expected at most 1, found {values[p.name]!r}")
    wanted = {p.name for p in network.parameters}
    unknown = sorted(set(values) - wanted - set(network.nominal))
    missing = sorted(wanted - set(values))
    if unknown or missing:
        raise CalibrationError(
            f"{path}: parameters of another building: unknown {unknown or 'none'}, missing {missing or 'none'}; "
            "calibrate this case, or give the file that belongs to it"
        )
    return network.values({name: value for name, value in values.items() if name in wanted})
