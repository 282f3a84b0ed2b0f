"""How many cases are handled: by whom, how often, and for how long."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

from calibration.errors import CalibrationError


@dataclass(frozen=True)
class Handling:
    """How cases are handled.

    Parameters
    ----------
    workers : int or Executor, optional
        As `calibration.calibrate_many` takes them.
    retries : int
        How often a case is given to another worker after its own died [-].
    force : bool
        Do anew what has results, or was set aside.
    limit : float, optional
        Longest time that a case may take a worker, which is ended then [s]; none by default.

    Raises
    ------
    CalibrationError
        When a number is out of range.
    """

    workers: Executor | int | None = None
    retries: int = 2
    force: bool = False
    limit: float | None = None

    def __post_init__(self) -> None:
        for name, value, least in (("retries", self.retries, 0), ("workers", self.workers, 1)):
            CalibrationError.unless(not isinstance(value, int) or value >= least, name, f"at least {least}", value)
        fine = self.limit is None or self.limit > 0.0
        CalibrationError.unless(fine, "limit", "a positive number of seconds", self.limit)
