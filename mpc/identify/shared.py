"""How much heat machines give at most together, where one source feeds them all."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import InitVar, dataclass, field

import numpy as np

from mpc.identify.limits import BIN, OUT_OF_REACH, RUNS, HeatLimit
from thermal._types import FloatArray

#: Least share of the loads that machines reach alone below which a source holds them back together [-].
_TOGETHER = 0.75

#: Least part of all machines, by their full loads, that must want more [-].
_PART = 0.5

#: Time that a reading is the mean of, at least and at most: a loop's water stores heat for some minutes [s].
_MEAN_OF = (2700.0, 3600.0)


@dataclass
class SharedLimit:
    """Most load of all machines together over outdoor air, as a share of the sum of their full loads.

    Terminals on one heat pump or boiler reach more alone than together. A source at its limit is told by steps at
    which machines of half the full load and more, two at least, have had their setpoints out of reach since the step
    before, and give less than three quarters of what each is *known* to reach alone in such weather: in weather that
    is new to them their own limits may have fallen. The source then gives what all machines give, in the mean of the
    steps since, for an hour at most. Until that has been seen machines are taken to have sources of their own.

    Parameters
    ----------
    weights : ndarray, shape (n_machine,)
        Full heat of machines that are led by a setpoint, 0 of others [W].
    step : float
        Of the control [s].
    seen : iterable of tuple of float
        Outdoor air [K] and load [-] of steps at the limit.

    Examples
    --------
    >>> import numpy as np
    >>> shared = SharedLimit(np.array([8e3, 8e3]), 900.0, [(268.0, 0.6)])
    >>> bool(shared.at(np.array([268.0]))[0] < 0.65)
    True
    """

    weights: FloatArray
    step: float
    seen: InitVar[Iterable[tuple[float, float]]] = ()
    _limit: HeatLimit = field(init=False)
    _totals: deque[float] = field(init=False)
    _wanted: np.ndarray = field(init=False)
    _run: int = field(default=0, init=False)

    def __post_init__(self, seen: Iterable[tuple[float, float]]) -> None:
        self._limit, self._totals = HeatLimit(seen), deque(maxlen=max(round(_MEAN_OF[1] / self.step), 1))
        self._wanted = np.zeros(self.weights.size, dtype=bool)

    @property
    def shares(self) -> FloatArray:
        """Of each machine in the sum of the full loads, shape (n_machine,) [-]."""
        return np.asarray(self.weights / self.weights.sum()) if self.weights.any() else self.weights

    @property
    def readings(self) -> tuple[tuple[float, float], ...]:
        """Outdoor air [K], rising, and load [-] of steps at the limit."""
        return self._limit.readings

    def at(self, outdoor: FloatArray, error: FloatArray | float = 0.0) -> FloatArray:
        """Load that is relied on, shape (n,) [-]; infinite where nothing has been seen.

        Parameters
        ----------
        outdoor : ndarray, shape (n,)
            Outdoor air [K].
        error : ndarray, shape (n,), or float
            Its standard deviation where it is forecast [K].
        """
        if not self.readings:
            return np.full(outdoor.shape, np.inf)
        return np.where(outdoor > self.readings[-1][0] + BIN, np.inf, self._limit.at(outdoor, error))

    def learn(self, outdoor: float, loads: FloatArray, wanted: np.ndarray, limits: Sequence[HeatLimit]) -> bool:
        """Take a step: whether the source held machines back.

        Parameters
        ----------
        outdoor : float
            Outdoor air [K].
        loads : ndarray, shape (n_machine,)
            Given; NaN where nothing tells [-].
        wanted : ndarray of bool, shape (n_machine,)
            Whether a setpoint is out of reach.
        limits : sequence of HeatLimit
            Of the machines alone [-].
        """
        shares, here = self.shares, np.array([outdoor])
        held, self._wanted = wanted & self._wanted, np.asarray(wanted)
        self._totals.append(float(np.nansum(shares * loads)))
        alone = np.array([limit.at(here)[0] if limit.knows(outdoor) else 0.0 for limit in limits])
        enough = held.sum() > 1 and shares[held].sum() >= _PART
        back = bool(enough and (shares * loads)[held].sum() < _TOGETHER * (shares * alone)[held].sum())
        self._run = self._run + 1 if back else 0
        steps = self._run + 1  # the step before had the setpoints out of reach too
        told = back and steps * self.step >= _MEAN_OF[0]
        mean = float(np.mean([*self._totals][-steps if told else 0 :]))
        # more than was thought possible, for an hour, is possible
        full = bool(self.readings) and len(self._totals) == self._totals.maxlen
        if told or (full and outdoor <= self.readings[-1][0] + BIN and mean > self._limit.likely(here)[0]):
            self._limit.learn(outdoor, mean)
        return back


def shared_of(
    weights: FloatArray, step: float, outdoor: FloatArray, loads: FloatArray, above: FloatArray,
    limits: Sequence[Iterable[tuple[float, float]]],
) -> tuple[tuple[float, float], ...]:  # fmt: skip
    """Find steps in telemetry at which a source held machines back: outdoor air [K], load of all [-].

    Parameters
    ----------
    weights : ndarray, shape (n_machine,)
        Full heat of machines that are led by a setpoint, 0 of others [W].
    step : float
        Of the telemetry [s].
    outdoor : ndarray, shape (n_time,)
        Outdoor air [K].
    loads : ndarray, shape (n_time, n_machine)
        Given [-].
    above : ndarray, shape (n_time, n_machine)
        How far setpoints lie above the air of their zones; NaN of machines [K].
    limits : sequence of iterable of tuple of float
        Outdoor air [K] and load [-] of steps at which each machine alone was at its limit, see `HeatLimit`.
    """
    shared, alone = SharedLimit(weights, step), [HeatLimit(seen) for seen in limits]
    wanted = (above > OUT_OF_REACH) & (loads > RUNS)
    for k in np.flatnonzero(np.isfinite(outdoor)):
        shared.learn(float(outdoor[k]), loads[k], wanted[k], alone)
    return shared.readings
