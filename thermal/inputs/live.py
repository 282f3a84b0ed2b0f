"""Inputs of a model that runs beside a building: one step at a time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.inputs.normalisation import Normalisation
from thermal.inputs.provider import INPUTS, InputProvider


class LiveInputs(InputProvider):
    """Inputs of one step at a time, as they are measured; what takes several stamps it cannot give.

    Parameters
    ----------
    building : Building
        Zones and location.
    step : float
        Length of a step [s].
    normalisation : Normalisation
        Constants that some inputs are counted by.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> case = load_bundled_case()
    >>> now = LiveInputs(case.building, case.step, Normalisation())
    >>> now.put(case.stamps[:1], {"outdoor": np.array([273.15])})
    >>> now.values("outdoor", "K").tolist(), now.gives("outdoor_rate")
    ([273.15], False)
    """

    def __init__(self, building: Building, step: float, normalisation: Normalisation) -> None:
        super().__init__(building, pd.DatetimeIndex([]), step, {}, normalisation, "live feed")

    def put(self, stamp: pd.DatetimeIndex, row: Mapping[str, FloatArray]) -> None:
        """Take in a row of the feed in the place of the last one.

        Parameters
        ----------
        stamp : DatetimeIndex, length 1
            End of the step.
        row : mapping of str to ndarray
            Series as in `InputProvider`, shape (1,) or (1, n_zone) [units of `INPUTS`].
        """
        for name in (*INPUTS, "weather"):
            self.__dict__.pop(name, None)  # what was made of the last row
        self.stamps, self.series = stamp, row
        self.openings = np.zeros((1, len(self.zones)))
        self.switched = np.zeros_like(self.openings)
