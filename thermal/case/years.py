"""The years in which time stamps can lie: what is outside of them is a mistyped stamp, and breaks clocks as well."""

import numpy as np
import pandas as pd

from thermal._types import BoolArray

#: First and last year of time stamps. Nobody logged a building before 1900; the last one lies inside of what
#: nanoseconds since 1970 can count (1677 to 2262) and of the calendars of time zones (0001 to 9999).
FIRST_YEAR, LAST_YEAR = 1900, 2199

EXPECTED = f"time stamps of the years {FIRST_YEAR} to {LAST_YEAR}"


def within_years(stamps: pd.DatetimeIndex) -> BoolArray:
    """Tell which stamps lie in the years that stamps can lie in.

    Parameters
    ----------
    stamps
        Shape (n_time,), with a time zone (then judged in UTC) or without.

    Returns
    -------
    ndarray
        Shape (n_time,); a missing stamp (NaT) does not.

    Examples
    --------
    >>> within_years(pd.DatetimeIndex(["2023-07-06", None, "1500-01-01"])).tolist()
    [True, False, False]
    """
    # by numbers: a stamp beyond the year 9999 cannot even be shown in a time zone
    ends = (np.datetime64(f"{year}-01-01", stamps.unit).astype(np.int64) for year in (FIRST_YEAR, LAST_YEAR + 1))
    first, last = ends
    seconds = stamps.asi8
    return np.asarray((seconds >= first) & (seconds < last))


def shown(stamps: pd.DatetimeIndex, row: int) -> str:
    """Show a stamp of any year, in UTC where it has a time zone.

    Parameters
    ----------
    stamps
        Shape (n_time,).
    row
        Which one [-].
    """
    return "no time" if stamps.isna()[row] else f"{np.datetime64(int(stamps.asi8[row]), stamps.unit)}"
