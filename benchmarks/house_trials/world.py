"""The package as a world of blind trials."""

from __future__ import annotations

from pathlib import Path

from energyplus_trials import specification
from energyplus_trials.errors import EnergyPlusMissingError, TrialError
from energyplus_trials.specification import Kind

from house_trials.drawing import DAYS, draw_spec, without
from house_trials.specification import HouseSpec
from house_trials.trial import make_trial

__all__ = ["DAYS", "FAILED", "KINDS", "MISSING", "draw", "make"]

KINDS: tuple[Kind, ...] = (*specification.KINDS, "without")
FAILED, MISSING = TrialError, EnergyPlusMissingError


def draw(
    seed: int, kind: Kind, *, confirmation: bool = False, days: int = DAYS, lived_in: bool = False
) -> list[HouseSpec]:
    """Draw the trial of a seed and kind, or the twins of its pair less one effect.

    Parameters
    ----------
    seed : int
        Number of the trial in its stream, at least 0.
    kind : str
        One of `KINDS`.
    confirmation : bool
        Draw from the stream that nothing is tuned on.
    days : int
        Length of the telemetry [d].
    lived_in : bool
        With sun through glass and constant leakage, which the diagnosis is to be told of.
    """
    drawn = "pair" if kind == "without" else kind
    spec = draw_spec(seed, drawn, confirmation=confirmation, days=days, lived_in=lived_in)
    return list(without(spec)) if kind == "without" else [spec]


def make(spec: HouseSpec, cases: Path, sealed: Path) -> bool:
    """Make a trial unless it is there; returns whether it was made.

    Parameters
    ----------
    spec : HouseSpec
        The trial.
    cases, sealed : Path
        Folders of what the diagnosis gets, and of the labels.
    """
    return make_trial(spec, cases, sealed)
