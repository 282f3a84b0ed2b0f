"""Population of a fleet's parameters as the prior of a building, in the place of the physical ranges."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibration.errors import CalibrationError
from calibration.results import plain
from thermal._types import FloatArray
from thermal.parameters import Parameter

#: First key of the file.
_FORMAT = "buildingmpc population 1"


@dataclass(frozen=True)
class Population:
    """Normal prior of the parameters of a fleet's next building, a setting of `calibrate`.

    Parameters
    ----------
    names : tuple of str
        Of the parameters, without facade or zone.
    mean : ndarray, shape (p,)
        On the estimation scale, from the drawing on [-].
    covariance : ndarray, shape (p, p)
        Of the next building about it [-].
    members : tuple of str
        Buildings that it was learned from.
    weights : ndarray, shape (n_member,)
        What each counts; below one half it is unlike the others [-].
    """

    names: tuple[str, ...]
    mean: FloatArray
    covariance: FloatArray
    members: tuple[str, ...]
    weights: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """Contents of the file."""
        content: dict[str, Any] = plain({"format": _FORMAT, **vars(self)})
        return content

    def prior(
        self, parameters: Sequence[Parameter], own: FloatArray
    ) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
        """Put the population in the place of the physical ranges, where it knows a parameter.

        Parameters
        ----------
        parameters : sequence of Parameter
            Of a building.
        own : ndarray, shape (n,)
            Spread of a group's members about what they have in common [-].

        Returns
        -------
        tuple
            Which parameters it knows (n,), what moves their centres (n,) [-], and the covariance (n, n) [-] among them,
            zero elsewhere.
        """
        index = {name: i for i, name in enumerate(self.names)}
        of = np.array([-1 if p.effect is not None else index.get(p.base, -1) for p in parameters])
        known: NDArray[np.bool_] = np.asarray(of >= 0)
        at = np.maximum(of, 0)
        covariance = np.where(np.outer(known, known), self.covariance[np.ix_(at, at)], 0.0)
        moved = np.where(known, self.mean[at], 0.0)
        return known, moved, np.asarray(covariance + np.diag(np.where(known, own**2, 0.0)), dtype=float)


def read_population(path: str | Path) -> Population:
    """Read a population that was written to a file.

    Parameters
    ----------
    path : str or Path
        A file of `buildingmpc priors`.

    Raises
    ------
    CalibrationError
        When it is none.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise CalibrationError(f"priors: cannot read {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise CalibrationError(f"{path}: expected JSON as `buildingmpc priors` writes it, got {error}") from error
    return population_from(content, str(path))


def population_from(content: Any, where: str = "priors") -> Population:
    """Make a population of the contents of its file.

    Parameters
    ----------
    content : Any
        From JSON.
    where : str
        Stands in errors.

    Raises
    ------
    CalibrationError
        When it is none, or its covariance is none.
    """
    if not isinstance(content, Mapping) or content.get("format") != _FORMAT:
        raise CalibrationError(f"{where}: expected a population as `buildingmpc priors` writes it")
    try:
        mean, covariance, weights = (np.array(content[k], dtype=float) for k in ("mean", "covariance", "weights"))
        names, members = tuple(map(str, content["names"])), tuple(map(str, content["members"]))
        fits = mean.shape == (len(names),) and covariance.shape == (len(names),) * 2
        fits = fits and bool(np.linalg.eigvalsh(covariance).min() > 0.0) and weights.shape == (len(members),)
    except (KeyError, TypeError, ValueError, np.linalg.LinAlgError) as error:
        raise CalibrationError(f"{where}: expected names, mean, covariance, members and weights: {error!r}") from error
    if not fits:
        raise CalibrationError(f"{where}: expected a mean and a positive definite covariance of {len(names)} names")
    return Population(names, mean, covariance, members, weights)
