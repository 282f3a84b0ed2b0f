"""A case with its model and parameters, ready to run: what `simulate` and `evaluate` have in common."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibration import (
    CHECK_TOLERANCE,
    Interval,
    check_on_grid,
    horizon_steps,
    load_parameters,
)
from calibration.errors import NotEnoughDataError, ParameterFileError
from mpc.errors import MpcError
from thermal import Case, Inputs, SymbolicModel, build_network, reduced_model
from thermal.model import SCHEMES, Scheme

#: Stretch of telemetry on which a reduced model is compared with the grid [days].
COMPARED_DAYS = 2.0


@dataclass(frozen=True)
class _ReadyModel:
    """A model on the grid at one θ.

    Parameters
    ----------
    grid : SymbolicModel
        On the grid.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    source : str
        Where they come from, in a few words.
    """

    grid: SymbolicModel
    theta: NDArray[np.float64]
    source: str


def ready_model(case: Case, parameters: Path | None, dx: float | None) -> _ReadyModel:
    """Build a case's model with the parameters of a file, or those before calibration.

    Parameters
    ----------
    case : Case
        With a building.
    parameters : Path, optional
        A ``calibration.json``; its distance between control volumes is taken over too.
    dx : float, optional
        Another distance between control volumes of a plan [m].
    """
    content = _content(parameters) if parameters is not None else {}
    if dx is None:
        dx = content.get("dx")
        if dx is not None and (isinstance(dx, bool) or not isinstance(dx, int | float)):
            raise ParameterFileError(f"{parameters}: dx: expected a number of metres or null, found {dx!r}")
    names = content.get("parameters")
    scopes = {n.partition("@")[0]: "zone" for n in names if "@" in n} if isinstance(names, dict) else {}
    network = build_network(case.building, dx=dx, scopes=scopes)  # type: ignore[arg-type]
    if parameters is None:
        return _ReadyModel(SymbolicModel(network), network.start(), "uncalibrated start values")
    return _ReadyModel(SymbolicModel(network), load_parameters(parameters, network), parameters.name)


def quick_model(ready: _ReadyModel, inputs: Inputs, interval: Interval, horizon: str, scheme: Scheme) -> SymbolicModel:
    """Reduce a model, as `calibrate` does, and keep the grid where the reduced model is not accurate enough.

    Parameters
    ----------
    ready : _ReadyModel
        Model on the grid.
    inputs : Inputs
        The telemetry.
    interval : Interval
        The first days of it are compared on both.
    horizon : str
        Such as ``6h``.
    scheme : Scheme
        Time stepping.
    """
    import pandas as pd

    reduced = reduced_model(ready.grid, [ready.theta])
    steps = horizon_steps(horizon, inputs.step)
    begin = max(interval.start, inputs.stamps[0])
    length = pd.Timedelta(days=COMPARED_DAYS) + steps * pd.Timedelta(seconds=inputs.step)
    short = Interval(begin, min(interval.end, begin + length))
    try:
        check = check_on_grid(ready.grid, reduced, ready.theta, inputs, [short], steps, scheme)
    except NotEnoughDataError:
        check = check_on_grid(ready.grid, reduced, ready.theta, inputs, [interval], steps, scheme)
    return reduced if check.max_difference <= CHECK_TOLERANCE else ready.grid


def chosen_scheme(name: str) -> Scheme:
    """Look a time stepping up.

    Parameters
    ----------
    name : str
        ``implicit_euler`` or ``tr_bdf2``.
    """
    if name not in SCHEMES:
        raise MpcError(f"scheme: expected one of {', '.join(sorted(SCHEMES))}, came {name!r}")
    return SCHEMES[name]


def _content(path: Path) -> dict[str, Any]:
    """Read a file of parameters as far as it can be read; `load_parameters` says what is wrong with it."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
