"""Requests to a BOPTEST server: what may be sent again, and which answers say what was asked for."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mpc.adapters.boptest.requests import Answer
from mpc.adapters.foreign import SAME
from mpc.errors import BoptestError, BoptestTimeoutError
from thermal._types import FloatArray

if TYPE_CHECKING:
    import httpx

#: Versions of BOPTEST that the client talks to: lists of point names came with 0.4, and 2 is not there yet.
OLDEST_VERSION, NEXT_VERSION = (0, 4), (2, 0)

_CONNECT = 10.0  # s
_FIRST_WAIT = 0.2  # s before the first repetition, doubled each time
_KEEP = 2.0  # s: below the 5 s after which servers such as Node's close an idle connection


class BoptestClient:
    """Requests to a BOPTEST server, checked.

    Requests that ask or set are sent again when the server does not answer: they may be done twice. A request that
    advances a test may not: it is sent once, and once more only where no connection came about at all.

    Parameters
    ----------
    url : str
        Of the server, such as ``http://127.0.0.1:8000``.
    timeout : float
        How long to wait for an answer [s].
    repeats : int
        How often a request is sent again that may be.

    Raises
    ------
    BoptestError
        When the address is none, or a number is out of range.
    """

    def __init__(self, url: str, timeout: float = 600.0, repeats: int = 2) -> None:
        try:
            import httpx
        except ModuleNotFoundError as error:
            raise BoptestError('a client needs httpx: pip install "buildingmpc[boptest]"') from error
        if not re.fullmatch(r"https?://[^/\s]+(/.*)?", url):
            raise BoptestError("url", "such as 'http://127.0.0.1:8000'", repr(url))
        found = f"{timeout} s and {repeats}"
        BoptestError.unless(timeout > 0 and repeats >= 0, "client", "a positive timeout, and 0 or more repeats", found)
        self.url, self.timeout, self.repeats = url.rstrip("/"), timeout, repeats
        limits = httpx.Limits(keepalive_expiry=_KEEP)
        wait = httpx.Timeout(timeout, connect=min(_CONNECT, timeout))
        # the machine's proxies are no way to a server of one's own, and redirects no way to another one
        self._http = httpx.Client(timeout=wait, limits=limits, trust_env=False, follow_redirects=False)

    def close(self) -> None:
        """Close its connections."""
        self._http.close()

    def ask(self, method: str, path: str, body: dict[str, Any] | None = None, *, repeat: bool = True) -> Answer:
        """Send a request and take its wrapped answer apart.

        Parameters
        ----------
        method, path : str
            Such as ``PUT`` and ``step/<testid>``.
        body : dict, optional
            Arguments.
        repeat : bool
            Whether it may be done twice.

        Raises
        ------
        BoptestError
            When the server refuses, or its answer is not of the form ``{"status", "message", "payload"}``.
        BoptestTimeoutError
            When there is no answer.
        """
        content = self.plain(method, path, body, repeat=repeat)
        if not isinstance(content, dict) or "payload" not in content:
            found = _short(content)
            raise BoptestError(f"{method} /{path}", "an object with status, message, payload", found)
        message, status = str(content.get("message", "")), content.get("status", 200)
        if status != 200:
            raise BoptestError(f"{method} /{path}: the server refuses with status {status}: {message[:500]}")
        return Answer(message, content["payload"])

    def plain(self, method: str, path: str, body: dict[str, Any] | None = None, *, repeat: bool = True) -> Any:
        """Send a request whose answer is JSON without a wrapper.

        Parameters
        ----------
        method, path : str
            As in `ask`.
        body : dict, optional
            Arguments.
        repeat : bool
            Whether it may be done twice.
        """
        response = self._send(method, path, body, repeat)
        try:
            content = response.json()
        except ValueError:
            content = None
        if response.status_code != 200:
            said = content.get("message") or content.get("errors") if isinstance(content, dict) else response.text
            raise BoptestError(f"{method} /{path}: status {response.status_code}: {_short(said)}")
        if content is None:
            raise BoptestError(f"{method} /{path}", "JSON", _short(response.text))
        return content

    def check_version(self) -> str:
        """Ask for the server's version and refuse one that speaks otherwise.

        Raises
        ------
        BoptestError
            When it is not one that the client knows.
        """
        payload = self.ask("GET", "version").payload
        text = payload.get("version") if isinstance(payload, dict) else None
        found = re.match(r"v?(\d+)\.(\d+)", str(text))
        number = (int(found[1]), int(found[2])) if found else (0, 0)
        expected = f"version {'.'.join(map(str, OLDEST_VERSION))} or later, below {NEXT_VERSION[0]}"
        BoptestError.unless(OLDEST_VERSION <= number < NEXT_VERSION, f"BOPTEST server {self.url}", expected, repr(text))
        return str(text)

    def stop(self, testid: str) -> None:
        """Free a test; one that is gone already is fine.

        Parameters
        ----------
        testid : str
            Its number.
        """
        import httpx

        if self._http.is_closed:
            return
        try:
            self._http.put(f"{self.url}/stop/{testid}", timeout=min(_CONNECT, self.timeout))
        except httpx.HTTPError:
            return  # the server frees it when nobody asks for it

    def _send(self, method: str, path: str, body: dict[str, Any] | None, repeat: bool) -> httpx.Response:
        import httpx

        for turn in range(self.repeats + 1):
            last = turn == self.repeats
            try:
                response = self._http.request(method, f"{self.url}/{path}", json=body)
            except (httpx.ConnectError, httpx.ConnectTimeout) as error:  # nothing was sent: nothing was done
                if last:
                    raise BoptestTimeoutError(f"{self.url}: no server answers: {error}") from error
            except (httpx.HTTPError, httpx.InvalidURL) as error:
                if last or not repeat:
                    raise BoptestTimeoutError(self._no_answer(method, path, error, repeat)) from error
            else:
                if response.status_code not in (502, 503, 504) or last or not repeat:
                    return response
            time.sleep(_FIRST_WAIT * 2**turn)
        raise BoptestTimeoutError(f"{self.url}: no answer")

    def _no_answer(self, method: str, path: str, error: Exception, repeat: bool) -> str:
        what = f"{method} /{path}: no answer within {self.timeout:g} s ({type(error).__name__})"
        return what if repeat else f"{what}; whether the step was taken is not known: reset the plant"


def time_of(values: Any, what: str) -> float:
    """Read the time of measurements [s].

    Parameters
    ----------
    values : object
        Payload of a step or of a start.
    what : str
        Which, for the message.

    Raises
    ------
    BoptestError
        When there is none.
    """
    time = values.get("time") if isinstance(values, dict) else None
    if isinstance(time, bool) or not isinstance(time, int | float) or not math.isfinite(time):
        raise BoptestError(f"measurements of {what}", "their time", repr(values)[:200])
    return float(time)


def check_step(sent: Mapping[str, float], message: str, values: Any, expected: float) -> None:
    """Refuse an answer that says, openly or not, that the step was another one.

    Parameters
    ----------
    sent : mapping of str to float
        Inputs by name [their units].
    message : str
        Of the server.
    values : object
        Its payload.
    expected : float
        Time after the step [s].

    Raises
    ------
    BoptestError
        When the time is another, or the server used another value than was sent.
    """
    time = time_of(values, "a step")
    if abs(time - expected) > 1e-3:
        raise BoptestError("time of the test", f"{expected:g} s", f"{time:g} s", "does another use it?")
    for name, value in sent.items():
        used = values.get(name)
        if isinstance(used, int | float) and abs(used - value) > SAME * max(abs(value), 1.0):
            raise BoptestError(f"input {name}: {value:g} was sent, the server used {used:g}: {message}")
    if "WARNING" in message:
        raise BoptestError(f"the server changed what was sent: {message}")


def regular(payload: Any, points: list[str]) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Bring results to one step, that of most of their times.

    Parameters
    ----------
    payload : object
        Lists of numbers by point, and of their times.
    points : list of str
        Which points.

    Returns
    -------
    tuple
        Times [s], and values by point [their units].

    Raises
    ------
    BoptestError
        When a list is missing, or there are not two values.
    """
    lists = {name: payload.get(name) if isinstance(payload, dict) else None for name in ("time", *points)}
    counts = {len(values) if isinstance(values, list) else -1 for values in lists.values()}
    if len(counts) > 1 or max(counts) < 2:
        raise BoptestError("results", "two or more values of each point", repr(sorted(counts)))
    columns = {name: np.array(values, dtype=float) for name, values in lists.items()}
    times, first = np.unique(columns.pop("time"), return_index=True)
    columns = {name: values[first] for name, values in columns.items()}
    gaps = np.diff(times)
    if np.ptp(gaps) <= 1e-6 * gaps[0]:
        return times, columns
    count = max(round((times[-1] - times[0]) / float(np.median(gaps))), 1)
    even = np.linspace(times[0], times[-1], count + 1)
    return even, {name: np.interp(even, times, values) for name, values in columns.items()}


def _short(content: Any) -> str:
    text = content if isinstance(content, str) else repr(content)
    return text if len(text) <= 300 else f"{text[:300]}..."
