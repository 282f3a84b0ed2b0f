"""Worlds of blind trials: makers that share no code for the building, each a package beside the scripts."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol, cast

from _sealed import Made, make_trial

#: Package of each world by its name on the command line, whose module ``world`` has a `World` by the name ``WORLD``.
PACKAGES = {"office": "energyplus_trials", "house": "house_trials", "reference": "reference_trials",
            "ideal_air": "ideal_air_trials"}  # fmt: skip


@dataclass(frozen=True)
class Effect:
    """One effect that a building holds.

    Parameters
    ----------
    name : str
        Id of the catalogue, or a name of its own outside of it.
    form : str
        Parametric form.
    strength : float
        Of what is typical, 1 [-].
    zones : tuple of str
        Zones that have it; empty for the whole building.
    parameters : dict
        Numbers that the form needs, strength applied; names end in their unit.
    answers : tuple of str
        Names that count as right.
    unexplained_is_right : bool
        Whether `unexplained` counts as right, too: for an effect or a form that the catalogue does not know.
    """

    name: str
    form: str
    strength: float
    zones: tuple[str, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    answers: tuple[str, ...] = ()
    unexplained_is_right: bool = False

    def holds(self, zone: str) -> bool:
        """Tell whether a zone has the effect.

        Parameters
        ----------
        zone : str
            Name in the building.
        """
        return not self.zones or zone in self.zones


class Drawn(Protocol):
    """What a trial is to be, all of it drawn from its seed."""

    @property
    def name(self) -> str:
        """Name of case folder and label, which tells nothing of the effects."""


@dataclass(frozen=True)
class World:
    """A maker of trials.

    Parameters
    ----------
    draws : tuple of str
        Kinds of trials that are drawn, of ``null``, ``single``, ``pair`` and ``outside``.
    days : int
        Length of the telemetry where nothing else is asked for [d].
    draw_spec : callable
        Draws a trial: seed, kind; keywords ``confirmation``, ``days`` and what this world alone has.
    run_trial : callable
        Runs what was drawn.
    less_one : callable, optional
        Gives a pair less one effect, each of both: the kind ``without``.
    """

    draws: tuple[str, ...]
    days: int
    draw_spec: Callable[..., Drawn]
    run_trial: Callable[[Any], Made]
    less_one: Callable[[Any], Sequence[Drawn]] | None = None

    @property
    def kinds(self) -> tuple[str, ...]:
        """All kinds of trials that it makes."""
        return self.draws if self.less_one is None else (*self.draws, "without")

    def draw(
        self, seed: int, kind: str, *, confirmation: bool = False, days: int | None = None, **options: Any
    ) -> Sequence[Drawn]:
        """Draw the trial of a seed and kind, or the twins of its pair less one effect.

        Parameters
        ----------
        seed : int
            Number of the trial in its stream, at least 0.
        kind : str
            One of `kinds`.
        confirmation : bool
            Draw from the stream that nothing is tuned on.
        days : int, optional
            Length of the telemetry [d].
        **options
            Of this world alone.
        """
        drawn = "pair" if kind == "without" else kind
        spec = self.draw_spec(seed, drawn, confirmation=confirmation, days=days or self.days, **options)
        return [spec] if kind == drawn or self.less_one is None else self.less_one(spec)

    def make(self, spec: Drawn, cases: Path, sealed: Path) -> bool:
        """Write ``cases/NAME`` and ``sealed/NAME.json`` unless they are there; returns whether they were made.

        Parameters
        ----------
        spec : Drawn
            The trial.
        cases, sealed : Path
            Folders of what the diagnosis gets, and of the labels.

        Raises
        ------
        ValueError, TrialError
            As of `make_trial`.
        """
        return make_trial(spec.name, cases, sealed, partial(self.run_trial, spec))


def world(name: str) -> World:
    """Load a world.

    Parameters
    ----------
    name : str
        Key of `PACKAGES`.
    """
    return cast(World, importlib.import_module(f"{PACKAGES[name]}.world").WORLD)
