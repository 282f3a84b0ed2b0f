"""The log of a run: what went wrong or stood in the way, in words, each thing once."""

from __future__ import annotations

import re
from typing import NamedTuple

import pandas as pd

from mpc.studies.run import ControlRun

_CHANGING = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d|\b\d+(\.\d+)?\b")  # times and numbers within a reason


class _Reason(NamedTuple):
    """A reason that was given once or more.

    Parameters
    ----------
    first, last : pandas.Timestamp
        When it was given first and last, local.
    times : int
        How often.
    reason : str
        In the words of the first time.
    """

    first: pd.Timestamp
    last: pd.Timestamp
    times: int
    reason: str


def reason_rows(run: ControlRun) -> list[_Reason]:
    """Give the reasons of a run, those that differ in times and numbers only taken together, the first time first.

    Parameters
    ----------
    run : ControlRun
        Of `run_controller`.
    """
    found: dict[str, _Reason] = {}
    for decision in run.decisions:
        for reason in decision.reasons:
            kind = _CHANGING.sub("#", reason)
            before = found.get(kind)
            if before is None:
                found[kind] = _Reason(decision.stamp, decision.stamp, 1, reason)
            else:
                found[kind] = before._replace(last=decision.stamp, times=before.times + 1)
    return list(found.values())
