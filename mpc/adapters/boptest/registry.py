"""The tests that a server holds: by number, freed when they are stopped or nobody comes back to them."""

from __future__ import annotations

import asyncio
import time
import uuid
from collections.abc import Callable, Mapping, Sequence

from mpc.adapters.boptest.case import BoptestCase
from mpc.adapters.boptest.test import BoptestTest
from mpc.errors import BoptestError
from thermal.errors import describe

#: The test that requests without a number go to, as before BOPTEST 0.7.
DEFAULT_TEST = ""


class HeldTest:
    """A test with what a server needs to know about it.

    Parameters
    ----------
    test : BoptestTest
        Its state.
    now : float
        Time [s].
    """

    def __init__(self, test: BoptestTest, now: float) -> None:
        self.test, self.last_used, self.waiting = test, now, 0
        self.turn = asyncio.Lock()


class HeldTests:
    """Test cases that are served, and the tests of them that run.

    Parameters
    ----------
    cases : sequence of BoptestCase
        At least one, each with a name of its own.
    most : int
        How many tests run at once.
    idle_seconds : float
        A test that nobody asks for this long is freed [s].
    clock : callable
        Time that passes [s].

    Raises
    ------
    BoptestError
        When there is no case, two have one name, or a number is out of range.
    """

    def __init__(
        self,
        cases: Sequence[BoptestCase],
        most: int = 64,
        idle_seconds: float = 900.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.cases: Mapping[str, BoptestCase] = {case.name: case for case in cases}
        if not cases or len(self.cases) < len(cases):
            found = ", ".join(case.name for case in cases) or "none"
            raise BoptestError(describe("cases", "one or more, each with a name of its own", found))
        if not (most >= 1 and idle_seconds > 0):
            found = f"{most} and {idle_seconds} s"
            raise BoptestError(describe("server", "one test at least, and a positive idle time", found))
        self.most, self.idle_seconds, self._clock = most, idle_seconds, clock
        self._held: dict[str, HeldTest] = {}

    def __len__(self) -> int:
        return len(self._held)

    def select(self, name: str, testid: str | None = None) -> str | None:
        """Begin a test.

        Parameters
        ----------
        name : str
            Of a case that is served.
        testid : str, optional
            Its number; a new random one by default.

        Returns
        -------
        str or None
            Its number; None when as many run as may.
        """
        self.free_idle()
        if len(self._held) >= self.most:
            return None
        chosen = str(uuid.uuid4()) if testid is None else testid
        self._held[chosen] = HeldTest(BoptestTest(self.cases[name]), self._clock())
        return chosen

    def find(self, testid: str) -> HeldTest | None:
        """Look a test up, which counts as use of it.

        Parameters
        ----------
        testid : str
            Its number.
        """
        if testid == DEFAULT_TEST and testid not in self._held:
            self.select(next(iter(self.cases)), DEFAULT_TEST)
        held = self._held.get(testid)
        if held is not None:
            held.last_used = self._clock()
        return held

    def touch(self, held: HeldTest) -> None:
        """Note that a test was used now.

        Parameters
        ----------
        held : HeldTest
            Which.
        """
        held.last_used = self._clock()

    def stop(self, testid: str) -> bool:
        """Free a test; whether there was one.

        Parameters
        ----------
        testid : str
            Its number.
        """
        return self._held.pop(testid, None) is not None

    def free_idle(self) -> int:
        """Free the tests that nobody has come back to, and tell how many."""
        limit = self._clock() - self.idle_seconds
        # who has no number would not learn that the common test begins anew: it stays
        held = ((testid, held) for testid, held in self._held.items() if testid != DEFAULT_TEST)
        lost = [testid for testid, test in held if test.last_used < limit and not test.waiting]
        for testid in lost:
            del self._held[testid]
        return len(lost)
