"""Set-points that excite a building more than a schedule does: pseudo-random binary sequences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.signal import max_len_seq

from thermal.pilot.thermostat import Thermostats, draw_thermostats

Series = npt.NDArray[np.float64]

_STREAM = 5  # of random numbers of a seed; thermostats have the seed itself
_BITS = 9  # of the shift register: 511 levels before the sequence repeats, 21 days of one hour
_CLOCK = (1.0, 4.0)  # h, between the time constants of the air and of the slabs
_AMPLITUDE = 1.5  # K, about both set-points: no more than a night set-back takes


@dataclass(frozen=True, eq=False)
class PrbsThermostats(Thermostats):
    """Thermostats whose two set-points go up and down together in a pseudo-random binary sequence, day and night.

    Such a signal is as good as white up to its clock, unlike a schedule, which repeats every day as the weather does;
    identification experiments in buildings use it (Bacher and Madsen 2011, doi:10.1016/j.enbuild.2011.02.005).

    Parameters
    ----------
    heating, cooling : numpy.ndarray, shape (n_zone,)
        Setpoints half-way between the two levels [K], heating below cooling.
    heating_set_back, cooling_set_back, start, stop, saturday : numpy.ndarray, shape (n_zone,)
        As in `Thermostats` [K], [h] and [-]; without effect here.
    clock : numpy.ndarray of int, shape (n_zone,)
        Time between two levels of a zone's sequence [s], positive.
    phase : numpy.ndarray of int, shape (n_zone,)
        Where each zone is in the sequence of 511 levels at the epoch [-].
    amplitude : float
        Distance of either level from these setpoints [K].
    """

    clock: npt.NDArray[np.int64]
    phase: npt.NDArray[np.int64]
    amplitude: float

    def setpoints(self, times: pd.DatetimeIndex) -> tuple[Series, Series]:
        """Read the sequences.

        Parameters
        ----------
        times : pandas.DatetimeIndex
            Local times, shape (n_time,).

        Returns
        -------
        tuple of numpy.ndarray, shape (n_time, n_zone)
            Heating and cooling setpoints [K].
        """
        levels = 2.0 * max_len_seq(_BITS)[0] - 1.0
        ticks = times.as_unit("s").asi8[:, np.newaxis] // self.clock + self.phase
        shift = self.amplitude * levels[ticks % levels.size]
        return self.heating + shift, self.cooling + shift


def draw_prbs_thermostats(seed: int, n_zone: int) -> PrbsThermostats:
    """Draw pseudo-random set-points about those of `draw_thermostats`.

    Parameters
    ----------
    seed : int
        Same seed, same set-points; 0 or more.
    n_zone : int
        Number of zones, at least 1.

    Returns
    -------
    PrbsThermostats
        Levels 1.5 K above and below the occupied set-points, each zone's with a clock of its own, 1 to 4 h in quarter
        hours: fast enough to show the air, slow enough to show what lies behind it.

    Examples
    --------
    >>> hours = pd.date_range("2023-01-09", periods=240, freq="h", tz="UTC")
    >>> heating, cooling = draw_prbs_thermostats(0, 2).setpoints(hours)
    >>> bool(np.allclose(np.ptp(heating, axis=0), 3.0))
    True
    """
    base = draw_thermostats(seed, n_zone)
    rng = np.random.default_rng([seed, _STREAM])
    clock = 900 * np.round(4.0 * rng.uniform(*_CLOCK, n_zone)).astype(np.int64)
    return PrbsThermostats(
        **vars(base), clock=clock, phase=rng.integers(2**_BITS - 1, size=n_zone), amplitude=_AMPLITUDE
    )
