"""What is seen beyond a model to be there at times: windows that stand open, heat that is switched on."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from calibration.diagnosis.screen.equipment import EQUIPPED
from calibration.diagnosis.screen.openings import opened_when
from calibration.diagnosis.screen.switched import switched_when
from calibration.estimation.heat_balance import step_balance
from calibration.evaluation.settings import ModelSettings
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.inputs.provider import InputProvider
from thermal.model.case_replay import Inputs, replay_inputs
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model

#: The effect of windows, whose signal is seen and not measured.
WINDOWS = "window_opening"

#: Zones beyond which nothing is sought: one more model of a large building would take its time.
_MOST_ZONES = 40


class Seen(NamedTuple):
    """Courses that are seen and not measured, 1 while it is so.

    Parameters
    ----------
    openings : ndarray, shape (n_time, n_zone)
        A window stands open [-].
    switched : ndarray, shape (n_time, n_zone)
        Heat is on [-].
    """

    openings: FloatArray
    switched: FloatArray

    @classmethod
    def nothing(cls, drivers: InputProvider) -> Seen:
        """Make courses of nothing.

        Parameters
        ----------
        drivers : InputProvider
            Of the case.
        """
        return cls(np.zeros_like(drivers.openings), np.zeros_like(drivers.switched))

    @classmethod
    def of(cls, drivers: InputProvider) -> Seen:
        """Take what inputs of a case have.

        Parameters
        ----------
        drivers : InputProvider
            Of the case.
        """
        return cls(drivers.openings, drivers.switched)

    def give(self, drivers: InputProvider) -> None:
        """Let inputs of a case have them.

        Parameters
        ----------
        drivers : InputProvider
            Of the case.
        """
        drivers.openings, drivers.switched = self


def seen_at_first(case: Case, drivers: InputProvider, settings: ModelSettings) -> Seen:
    """Tell what is seen before anything is fitted.

    Parameters
    ----------
    case : Case
        With telemetry.
    drivers : InputProvider
        Its inputs.
    settings : ModelSettings
        How its model is built.
    """
    if len(drivers.zones) > _MOST_ZONES:
        return Seen.nothing(drivers)
    # as long as nothing is fitted the air is what is drawn
    drawn = replace(settings, structure=replace(settings.structure, light_contents=False))
    network = drawn.network(case.building)
    theta = np.array([p.start for p in network.parameters])
    return seen_beyond(SymbolicModel(network), theta, drivers, replay_inputs(case, network, drivers))


def seen_beyond(grid: SymbolicModel, theta: FloatArray, drivers: InputProvider, inputs: Inputs) -> Seen:
    """Tell what is seen in heat that is lost, or brought, beyond a model.

    Parameters
    ----------
    grid : SymbolicModel
        The model, whose windows are shut and whose heat is metered.
    theta : ndarray, shape (n_parameter,)
        Its parameters [parameter units].
    drivers : InputProvider
        Of the case.
    inputs : Inputs
        Its telemetry, as the model takes it.
    """
    seen = Seen.nothing(drivers)
    if len(drivers.zones) <= _MOST_ZONES:
        model = reduced_model(grid, [theta])
        rows, metered, needed = step_balance(model, theta, inputs)
        unit = -model.network.anatomy.air_heat_capacity * drivers.through_windows[rows]
        seen.openings[rows] = opened_when(metered - needed, unit, drivers.awake[rows], inputs.step)
        seen.switched[rows] = switched_when(needed - metered, inputs.step)
    return seen


def look(
    grid: SymbolicModel, theta: FloatArray, drivers: InputProvider, inputs: Inputs, there: Collection[str]
) -> None:
    """Let inputs of a case have what is seen beyond a model, but for what is in a model already.

    Parameters
    ----------
    grid, drivers, inputs
        As in `seen_beyond`.
    theta : ndarray, shape (n_parameter,)
        Parameters of the model [parameter units].
    there : collection of str
        Effects whose courses stay as they are.
    """
    if WINDOWS not in there or EQUIPPED not in there:
        before, seen = Seen.of(drivers), seen_beyond(grid, theta, drivers, inputs)
        opened = before.openings if WINDOWS in there else seen.openings
        Seen(opened, before.switched if EQUIPPED in there else seen.switched).give(drivers)
