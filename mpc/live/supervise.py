"""Starts the parts of a site as processes, and starts each anew that ends."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from mpc.live.state import write_state

#: In the order of their start: the guard, which gives everything back first, before anything can be planned.
PARTS = ("guard", "collector", "controller", "page")

#: Waits before a part that ended is started anew [s]: the first, and the longest after it has doubled.
_WAIT, _LONGEST = 1.0, 60.0

#: How long a part may take to end [s]; the guard gives everything back in that time.
_PATIENCE = 20.0


class Supervisor:
    """Runs parts of a site.

    Parameters
    ----------
    site : Path
        The ``site.yaml``.
    folder : Path
        Where each part's output goes.
    parts : sequence of str
        Names of parts; `PARTS` by default.
    command : callable, optional
        Gives the command line of a part; that of ``buildingmpc operate`` by default.
    """

    def __init__(
        self,
        site: Path,
        folder: Path,
        parts: Sequence[str] = PARTS,
        command: Callable[[str], list[str]] | None = None,
    ) -> None:
        self.site, self.folder, self.parts = site, folder, tuple(parts)
        self._command = command or self._own
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self._next = dict.fromkeys(self.parts, 0.0)
        self._wait = dict.fromkeys(self.parts, _WAIT)
        self._stop = threading.Event()

    def _own(self, part: str) -> list[str]:
        return [sys.executable, "-m", "mpc.cli", "operate", str(self.site), "--part", part]

    def run(self) -> int:
        """Run until the process is ended; return the exit code."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: self._stop.set())
        try:
            while not self._stop.wait(0.2):
                self.look()
            return 0
        finally:
            self.end()

    def look(self) -> None:
        """Start what does not run, after a wait that doubles while it keeps ending."""
        now = time.monotonic()
        for part in self.parts:
            process = self.processes.get(part)
            if process is not None and process.poll() is None:
                if now - self._next[part] > _LONGEST:
                    self._wait[part] = _WAIT
                continue
            if process is not None:
                del self.processes[part]
                self._next[part] = now + self._wait[part]
                self._wait[part] = min(2.0 * self._wait[part], _LONGEST)
            elif now >= self._next[part]:
                self._start(part)
                self._next[part] = now
        write_state(self.folder / "parts.json", {part: one.pid for part, one in self.processes.items()})

    def _start(self, part: str) -> None:
        with (self.folder / f"{part}.out").open("ab") as output:
            self.processes[part] = subprocess.Popen(
                self._command(part), stdout=output, stderr=output, stdin=subprocess.DEVNULL, start_new_session=True
            )

    def end(self) -> None:
        """End all parts at a time: the guard gives everything back at once, whatever the others still do."""
        for process in self.processes.values():
            process.terminate()
        while self.processes:
            _, process = self.processes.popitem()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(_PATIENCE)
            if process.poll() is None:
                process.kill()
                process.wait()
