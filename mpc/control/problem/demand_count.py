"""Demand so far: peaks of the month, and what was used of the windows that run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mpc.scenario.grid import StepGrid
from mpc.scenario.tariff import DemandCharge


class DemandCount:
    """Counts the power of each step for the windows of demand charges.

    Parameters
    ----------
    charges : sequence of DemandCharge
        Of the tariff.
    """

    def __init__(self, charges: Sequence[DemandCharge]) -> None:
        self.charges = tuple(charges)
        #: Highest mean of each peak so far, by name [W].
        self.peaks: dict[str, float] = {}
        #: Of each charge: start of the window that runs [s since 1970], and energy used in it [J].
        self.windows = [(0.0, 0.0)] * len(self.charges)

    def add(self, electricity: float, now: pd.Timestamp, step: float) -> None:
        """Add the power of the step that has ended to the window that it began in; a window that is over is a peak.

        Parameters
        ----------
        electricity : float
            Mean over the step [W]; NaN counts as nothing.
        now : pandas.Timestamp
            End of the step.
        step : float
            Its length [s].
        """
        for k, charge in enumerate(self.charges):
            begin = float(np.floor((now.timestamp() - step) / charge.window) * charge.window)
            start, used = self.windows[k] if self.windows[k][0] == begin else (begin, 0.0)
            used += electricity * step if np.isfinite(electricity) else 0.0
            if now.timestamp() >= begin + charge.window:
                one = pd.Timestamp(begin, unit="s", tz="UTC").tz_convert(now.tz)
                for name in charge.on(StepGrid(one, charge.window, 1)).names:
                    self.peaks[name] = max(self.peaks.get(name, 0.0), used / max(charge.window, step))
                start, used = begin + charge.window, 0.0
            self.windows[k] = (start, used)

    def used(self, now: pd.Timestamp) -> list[float]:
        """Mean power since the window of now began, of each charge [W].

        Parameters
        ----------
        now : pandas.Timestamp
            Time.
        """
        means = []
        for (start, energy), charge in zip(self.windows, self.charges, strict=True):
            lasted = now.timestamp() - start
            means.append(energy / lasted if 0.0 < lasted < charge.window else 0.0)
        return means
