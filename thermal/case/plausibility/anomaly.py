"""An anomaly: what in a case can hardly be true, where, how sure that is, and what to do."""

from dataclasses import dataclass
from typing import Literal

import pandas as pd

Severity = Literal["error", "warning", "remark"]
Certainty = Literal["certain", "likely", "possible"]


@dataclass(frozen=True)
class Anomaly:
    """What in a case can hardly be true.

    Parameters
    ----------
    kind
        ``no heat``, ``no outdoor temperature``, ``no zone temperature``, ``range``, ``unit``, ``disagreement``,
        ``night offset``, ``clock``, ``heat clock``, ``standstill``, ``exchanged``, ``heat`` or ``rate``.
    severity
        ``error``: the case is not valid for calibration; ``warning``: a fit would be wrong in part; ``remark``.
    certainty
        ``certain``: nothing else explains it; ``likely``; ``possible``: an unusual building can be so.
    columns
        Telemetry columns that it is about.
    start, end
        First and last stamp of it.
    what
        What was seen, with numbers, in a sentence.
    advice
        What to do about it.
    moved
        By how much the stamps of the columns have to be moved [h]; 0 unless it is a clock that is wrong throughout.
    """

    kind: str
    severity: Severity
    certainty: Certainty
    columns: tuple[str, ...]
    start: pd.Timestamp
    end: pd.Timestamp
    what: str
    advice: str
    moved: float = 0.0

    def __str__(self) -> str:
        """Sentence: what, how sure, what to do."""
        return f"{self.what} ({self.certainty}); {self.advice}"
