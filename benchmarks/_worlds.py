"""Worlds of blind trials: makers that share no code for the building, each a package beside the scripts."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol, cast

#: Package of each world by its name on the command line; its module ``world`` holds what `World` lists.
PACKAGES = {"office": "energyplus_trials", "house": "house_trials", "reference": "reference_trials",
            "ideal_air": "ideal_air_trials"}  # fmt: skip


class Drawn(Protocol):
    """What a trial is to be, all of it drawn from its seed."""

    @property
    def name(self) -> str:
        """Name of case folder and label, which tells nothing of the effects."""


class World(Protocol):
    """What the module ``world`` of a package has.

    Attributes
    ----------
    KINDS : tuple of str
        Kinds of trials that it makes, of ``null``, ``single``, ``pair``, ``outside`` and ``without``, the twins of
        trials of several effects.
    DAYS : int
        Length of the telemetry where nothing else is asked for [d].
    FAILED : type of Exception
        A trial could not be made; the others are worth having.
    MISSING : type of Exception
        Nothing can be made here, such as for want of a program.
    """

    KINDS: tuple[str, ...]
    DAYS: int
    FAILED: type[Exception]
    MISSING: type[Exception]

    def draw(self, seed: int, kind: str, *, confirmation: bool, days: int, **options: Any) -> Sequence[Drawn]:
        """Draw the trials of a seed and kind: one, or the twins of one, or none where the seed has none.

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
        **options
            Of this world alone.
        """

    def make(self, spec: Any, cases: Path, sealed: Path) -> bool:
        """Write ``cases/NAME`` and ``sealed/NAME.json`` unless they are there; returns whether they were made.

        Parameters
        ----------
        spec : Drawn
            The trial.
        cases, sealed : Path
            Folders of what the diagnosis gets, and of the labels.
        """


def world(name: str) -> World:
    """Load a world.

    Parameters
    ----------
    name : str
        Key of `PACKAGES`.
    """
    return cast(World, importlib.import_module(f"{PACKAGES[name]}.world"))
