"""Offices with ideal air as a world of blind trials."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from ideal_air_trials.drawing import draw_spec
from ideal_air_trials.errors import EnergyPlusNotThereError, TrialError
from ideal_air_trials.specification import DAYS, KINDS, Kind, Spec
from ideal_air_trials.trial import make_trial

__all__ = ["DAYS", "FAILED", "KINDS", "MISSING", "draw", "make"]

FAILED, MISSING = TrialError, EnergyPlusNotThereError


def draw(seed: int, kind: Kind, *, confirmation: bool = False, days: int = DAYS) -> list[Spec]:
    """Draw the trial of a seed and kind.

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
    """
    return [draw_spec(seed, kind, confirmation=confirmation, days=days)]


def make(spec: Spec, cases: Path, sealed: Path) -> bool:
    """Make a trial unless it is there; returns whether it was made.

    Parameters
    ----------
    spec : Spec
        The trial.
    cases, sealed : Path
        Folders of what the diagnosis gets, and of the labels.

    Raises
    ------
    EnergyPlusNotThereError
        When EnergyPlus is not installed.
    """
    if find_spec("pyenergyplus") is None:
        raise EnergyPlusNotThereError("EnergyPlus is not installed: pip install -e .[energyplus]")
    return make_trial(spec, cases, sealed)
