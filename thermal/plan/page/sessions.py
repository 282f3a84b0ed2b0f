"""Who has a case open on the labelling page."""

import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thermal.errors import SessionHeldError
from thermal.plan.page.store import write_whole

_LOCK = "open.json"

#: A window that has said nothing for so long is gone [s]; browsers let hidden windows speak once a minute.
PATIENCE = 150.0


@dataclass
class _Holder:
    window: str
    since: float
    seen: float


class Sessions:
    """The window that may change a case, and the lock that tells other programs so.

    Parameters
    ----------
    own : Path
        The page's own folder of the case.
    take_over : bool
        Whether to take the case from another program.

    Raises
    ------
    SessionHeldError
        Another program that is still running labels the case.
    """

    def __init__(self, own: Path, *, take_over: bool = False) -> None:
        self._file = own / _LOCK
        self._id = f"{os.getpid()}-{time.time_ns()}"
        self._holder: _Holder | None = None
        other = self._lock()
        if other is not None and not take_over and _is_running(other.get("process")):
            expected = "a case that nobody labels at the moment"
            found = f"one that process {other.get('process')} has open since {other.get('since')}"
            raise SessionHeldError(str(own.parent), expected, found, "close that one, or pass --take-over")
        since = time.strftime("%Y-%m-%d %H:%M")
        content = {"program": self._id, "process": os.getpid(), "since": since}
        write_whole(self._file, json.dumps(content).encode("utf-8"))

    def _lock(self) -> dict[str, Any] | None:
        try:
            content = json.loads(self._file.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return content if isinstance(content, dict) else None

    def open(self, window: str, *, previous: str = "", take_over: bool = False) -> dict[str, Any]:
        """Ask for the case.

        Parameters
        ----------
        window : str
            Who asks.
        previous : str
            Who that was before it was loaded anew.
        take_over : bool
            Whether to take the case from another window.

        Returns
        -------
        dict
            ``mine``: whether the window may change the case; else ``since`` and ``seen``, how long ago another window
            came and last said something [s].
        """
        now = time.monotonic()
        holder = self._holder
        if holder is None or take_over or now - holder.seen > PATIENCE or holder.window in (window, previous):
            self._holder = _Holder(window, now, now)
            return {"mine": True}
        return {"mine": False, "since": now - holder.since, "seen": now - holder.seen}

    def close(self, window: str) -> None:
        """Give the case back, when it is that window's.

        Parameters
        ----------
        window : str
            Who closes.
        """
        if self._holder is not None and self._holder.window == window:
            self._holder = None

    def check(self, window: str) -> None:
        """Refuse a change by a window that does not have the case.

        Parameters
        ----------
        window : str
            Who asks.

        Raises
        ------
        SessionHeldError
            Another window, or another program, has it.
        """
        lock = self._lock()
        if lock is None or lock.get("program") != self._id:
            raise SessionHeldError("session", "a case that this program has open", "another program has it")
        if self._holder is None or self._holder.window != window:
            raise SessionHeldError("session", "the window that has the case", "another window has taken it")
        self._holder.seen = time.monotonic()

    def end(self) -> None:
        """Take the lock away, when it is this program's."""
        lock = self._lock()
        if lock is not None and lock.get("program") == self._id:
            self._file.unlink(missing_ok=True)


def _is_running(process: object) -> bool:
    """Whether a process is there; one of another user is."""
    if not isinstance(process, int) or process <= 0 or process == os.getpid():
        return False
    try:
        os.kill(process, 0)
    except PermissionError:
        return True
    except (OSError, OverflowError):
        return False
    return True
