"""BOPTEST's clock: seconds since the new year, by the standard time of the place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import pandas as pd

#: Length of a day [s].
DAY = 86_400.0


@dataclass(frozen=True)
class YearClock:
    """Seconds of a year: 0 is the local midnight that it begins with, and no clock is ever put forward or back.

    Parameters
    ----------
    year : int
        Which year begins at 0.
    timezone : str
        IANA name of the building's time zone.

    Examples
    --------
    >>> clock = YearClock(2023, "America/Los_Angeles")
    >>> clock.stamp(200 * 86_400.0).isoformat()  # in summer an hour from midnight
    '2023-07-20T01:00:00-07:00'
    """

    year: int
    timezone: str

    @cached_property
    def zero(self) -> int:
        """The begin of the year, since 1970 in UTC [s]."""
        return int(pd.Timestamp(self.year, 1, 1).tz_localize(self.timezone).timestamp())

    def time(self, seconds: float) -> float:
        """Tell BOPTEST's time [s].

        Parameters
        ----------
        seconds : float
            Since 1970 in UTC [s].
        """
        return float(seconds - self.zero)

    def stamp(self, time: float) -> pd.Timestamp:
        """Tell the local time.

        Parameters
        ----------
        time : float
            BOPTEST's [s]; whole seconds count.
        """
        return pd.Timestamp(self.zero + round(time), unit="s", tz="UTC").tz_convert(self.timezone)
