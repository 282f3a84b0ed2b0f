"""Trim and respond, ASHRAE Guideline 36-2021, 5.1.14: a setpoint drifts to where it costs least until zones object."""

from __future__ import annotations

from dataclasses import dataclass

from mpc.errors import ControlError
from thermal.errors import describe


@dataclass(frozen=True)
class TrimRespond:
    """Parameters of trim and respond under the guideline's names (Table 5.1.14.3).

    Every `time_step` the setpoint changes by `trim`; with more than `ignored` requests it changes back by `respond` for
    each one above, by no more than `most_response`.

    Parameters
    ----------
    initial : float
        SP0, held while the device is off and for `delay` after its start [K].
    lowest, highest : float
        SPmin and SPmax [K].
    trim, respond, most_response : float
        SPtrim, SPres and SPres-max [K]; the latter two have the sign that `trim` has not.
    delay, time_step : float
        Td and T [s].
    ignored : int
        I, requests that are left unanswered.

    Raises
    ------
    ControlError
        When a number is out of its range or a sign is wrong.
    """

    initial: float
    lowest: float
    highest: float
    trim: float
    respond: float
    most_response: float
    delay: float = 600.0
    time_step: float = 120.0
    ignored: int = 2

    def __post_init__(self) -> None:
        if not self.lowest <= self.initial <= self.highest:
            found = f"{self.lowest:g}, {self.initial:g} and {self.highest:g} K"
            raise ControlError(describe("trim and respond", "lowest <= initial <= highest", found))
        if not (self.trim * self.respond < 0.0 and self.respond * self.most_response > 0.0):
            found = f"{self.trim:g}, {self.respond:g} and {self.most_response:g} K"
            raise ControlError(describe("trim and respond", "a response against the trim", found))
        if not (self.delay >= 0.0 and self.time_step > 0.0 and self.ignored >= 0):
            found = f"{self.delay:g} s, {self.time_step:g} s and {self.ignored}"
            raise ControlError(describe("trim and respond", "a delay, a positive time step, no negative count", found))

    def change(self, requests: int) -> float:
        """Give the change of the setpoint in a time step [K].

        Parameters
        ----------
        requests : int
            R.

        Examples
        --------
        >>> air = TrimRespond(291.15, 285.15, 291.15, 0.1, -0.2, -0.6)
        >>> [round(air.change(r), 1) for r in (0, 2, 3, 4, 9)]
        [0.1, 0.1, -0.1, -0.3, -0.5]
        """
        answered = max(requests - self.ignored, 0) * self.respond
        limit = self.most_response
        return self.trim + (max(answered, limit) if limit < 0.0 else min(answered, limit))


class TrimRespondLoop:
    """Trim and respond as it runs.

    Parameters
    ----------
    parameters : TrimRespond
        Its parameters.
    """

    def __init__(self, parameters: TrimRespond) -> None:
        self.parameters = parameters
        #: Setpoint now [K].
        self.setpoint = parameters.initial
        self._running = 0.0

    def advance(self, on: bool, requests: int, seconds: float) -> float:
        """Pass some time, with requests that stay as they are meanwhile.

        Parameters
        ----------
        on : bool
            Whether the device is proven on.
        requests : int
            R.
        seconds : float
            How long [s].

        Returns
        -------
        float
            Setpoint [K].
        """
        if not on:
            self.setpoint, self._running = self.parameters.initial, 0.0
            return self.setpoint
        ticks = self._ticks(self._running + seconds) - self._ticks(self._running)
        self._running += seconds
        for _ in range(ticks):
            moved = self.setpoint + self.parameters.change(requests)
            self.setpoint = min(max(moved, self.parameters.lowest), self.parameters.highest)
        return self.setpoint

    def _ticks(self, running: float) -> int:
        """Count the time steps that have come since the start: the first when the delay is over."""
        over = running - self.parameters.delay
        return 0 if over < 0.0 else 1 + int(over / self.parameters.time_step + 1e-9)
