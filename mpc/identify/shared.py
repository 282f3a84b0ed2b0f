"""How much heat machines give at most together, where one source feeds them all."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import InitVar, dataclass, field

import numpy as np

from mpc.identify.limits import BIN, OUT_OF_REACH, RUNS, HeatLimit
from thermal._types import BoolArray, FloatArray

#: Part of all machines, by their full loads, that wants more where a source may hold them back, and where what they
#: give together is their limit whatever holds them back [-].
_SEVERAL, _ALL = 0.5, 0.8

#: Share of the loads that machines reach alone below which a source holds several of them back [-].
_TOGETHER = 0.75

#: Time that a reading is the mean of, at least and at most: a loop's water stores heat for some minutes [s].
_MEAN_OF = (2700.0, 3600.0)

#: Time over which what was given is there to be had, in that weather and in any that is milder [s].
_SHOWN = 7200.0


def out_of_reach(above: FloatArray, law: FloatArray) -> BoolArray:
    """Tell where a zone's own controller asks for all that its machine has, shape (..., n_machine).

    Parameters
    ----------
    above : ndarray, shape (..., n_machine)
        How far setpoints lie above the air; NaN where nothing tells [K].
    law : ndarray, shape (n_machine,)
        How far they lie above it at full load: a proportional thermostat is below its setpoint at part load too [K].
    """
    return np.asarray(above > OUT_OF_REACH + np.maximum(law, 0.0))


@dataclass
class SharedLimit:
    """Most load of all machines together over outdoor air, as a share of the sum of their full loads.

    Terminals on one heat pump or boiler reach more alone than together. What they give together is a limit

    - where nearly all of them have had setpoints out of reach since the step before, whatever holds them back;
    - where half of them have, and give less than three quarters of what each is *known* to reach alone in such weather.

    It is the mean of the steps since, of three quarters of an hour at least and an hour at most. Where more has been
    given for two hours in weather as hard, it is none: terminals also give less the warmer their zones are (fan coils
    that cool, the colder), so that setpoints deep in the band are out of reach of what holds the edge of it.

    Until it has been seen, and in milder weather than that, machines are taken to have sources of their own: sources
    are weakest in the cold, where most is asked of them. A data sheet says it in any weather. All machines are taken
    for one source's: where there are two, and one of them is at its limit alone, too little is relied on until more is
    seen.

    Parameters
    ----------
    weights : ndarray, shape (n_machine,)
        Full heat of machines that are led by a setpoint, 0 of others [W].
    step : float
        Of the control [s].
    seen : iterable of tuple of float
        Outdoor air [K] and load [-] of steps at the limit.
    sheet : sequence of tuple of float
        Outdoor air [K], rising, and largest load [-] by a data sheet of the source, as of `HeatLimit`.

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
    sheet: Sequence[tuple[float, float]] = ()
    _limit: HeatLimit = field(init=False)
    _course: deque[tuple[float, float]] = field(init=False)
    _wanted: BoolArray = field(init=False)
    _shown: list[tuple[float, float]] = field(default_factory=list, init=False)
    _run: int = field(default=0, init=False)

    def __post_init__(self, seen: Iterable[tuple[float, float]]) -> None:
        self._limit, self._course = HeatLimit(seen, self.sheet), deque(maxlen=max(round(_SHOWN / self.step), 1))
        self._wanted = np.zeros(self.weights.size, dtype=bool)

    @property
    def shares(self) -> FloatArray:
        """Of each machine in the sum of the full loads, shape (n_machine,) [-]; all 0 where fewer than two are led."""
        return shares_of(self.weights)

    @property
    def readings(self) -> tuple[tuple[float, float], ...]:
        """Outdoor air [K], rising, and load [-] of steps at the limit."""
        return self._limit.readings

    def at(self, outdoor: FloatArray, error: FloatArray | float = 0.0) -> FloatArray:
        """Load that is relied on, shape (n,) [-]; infinite where nothing is known.

        Parameters
        ----------
        outdoor : ndarray, shape (n,)
            Outdoor air [K].
        error : ndarray, shape (n,), or float
            Its standard deviation where it is forecast [K].
        """
        if not self.readings and not self.sheet:
            return np.full(outdoor.shape, np.inf)
        known = self._limit.at(outdoor, error)
        if not self.sheet:
            known = np.where(outdoor > self.readings[-1][0] + BIN, np.inf, known)
        else:  # readings that are no less than the sheet says are no reason to rely on less
            told = self._limit.expected(outdoor, error)
            known = np.where(self._limit.likely(outdoor) >= told - 1e-9, np.maximum(known, told), known)
        return np.maximum(known, self.shown(outdoor))

    def shown(self, outdoor: FloatArray) -> FloatArray:
        """Load that was given for two hours in weather as hard, shape (n,) [-]; 0 where none was.

        Parameters
        ----------
        outdoor : ndarray, shape (n,)
            Outdoor air [K].
        """
        most = np.zeros(np.shape(outdoor))
        for weather, load in self._shown:
            most = np.where(outdoor >= weather, np.maximum(most, load), most)
        return most

    def learn(self, outdoor: float, loads: FloatArray, wanted: BoolArray, limits: Sequence[HeatLimit]) -> BoolArray:
        """Take a step, and tell which machines it says something of alone, shape (n_machine,).

        Parameters
        ----------
        outdoor : float
            Outdoor air [K].
        loads : ndarray, shape (n_machine,)
            Given; NaN where nothing tells [-].
        wanted : ndarray of bool, shape (n_machine,)
            Whether all that there is was asked for.
        limits : sequence of HeatLimit
            Of the machines alone [-].
        """
        shares, free = self.shares, np.ones(self.weights.size, dtype=bool)
        if not shares.any() or not np.isfinite(outdoor) or not np.isfinite(loads[shares > 0.0]).all():
            self._course.clear()  # a mean over a gap is none
            self._wanted, self._run = np.zeros_like(self._wanted), 0
            return free
        held, self._wanted = wanted & self._wanted, np.array(wanted)
        self._course.append((outdoor, float(shares @ np.nan_to_num(loads))))
        self._show()
        known = np.array([limit.knows(outdoor) for limit in limits])
        back = self._holds_back(held, loads, known, limits, outdoor)
        self._run = self._run + 1 if back else 0
        steps = self._run + 1  # the step before had the setpoints out of reach too
        hour = max(round(_MEAN_OF[1] / self.step), 1)
        if back and steps * self.step >= _MEAN_OF[0]:
            mean = self._mean(min(steps, hour))
            if mean >= self.shown(np.array([outdoor]))[0]:
                self._limit.learn(outdoor, mean)
        elif len(self._course) >= hour and (self.sheet or self._limit.knows(outdoor)):
            # more than was thought possible, for an hour, is possible
            mean = self._mean(hour)
            if mean > self._limit.likely(np.array([outdoor]))[0]:
                self._limit.learn(outdoor, mean)
        part = shares[wanted].sum() if wanted.sum() > 1 else 0.0
        return ~wanted if part >= _ALL or (part >= _SEVERAL and known[wanted].all()) else free

    def _mean(self, steps: int) -> float:
        """Mean load of the last steps [-]."""
        return float(np.mean([load for _, load in self._course][-steps:]))

    def _show(self) -> None:
        """Take what was given for two hours, in the mildest weather of them: of those in weather as hard, the most."""
        count = len(self._course)
        if count != self._course.maxlen:
            return
        mean, outdoor = self._mean(count), max(weather for weather, _ in self._course)
        if mean > self.shown(np.array([outdoor]))[0]:
            self._shown = [(w, load) for w, load in self._shown if w < outdoor or load > mean] + [(outdoor, mean)]

    def _holds_back(
        self, held: BoolArray, loads: FloatArray, known: BoolArray, limits: Sequence[HeatLimit], outdoor: float
    ) -> bool:
        """Tell whether what all machines give is what there is."""
        shares = self.shares
        part = shares[held].sum()
        if held.sum() < 2 or part < _SEVERAL:
            return False
        if part >= _ALL:
            return True
        alone = np.array([limit.at(np.array([outdoor]))[0] for limit in limits])
        return bool(known[held].all() and (shares * loads)[held].sum() < _TOGETHER * (shares * alone)[held].sum())


def shares_of(weights: FloatArray) -> FloatArray:
    """Share of each machine in the sum of the full loads, shape (n_machine,) [-]; all 0 where fewer than two have one.

    Parameters
    ----------
    weights : ndarray, shape (n_machine,)
        Full heat of machines that are led by a setpoint, 0 of others [W].
    """
    full = np.maximum(weights, 0.0)
    return full / full.sum() if np.count_nonzero(full) > 1 else np.zeros(full.size)


def shared_of(
    weights: FloatArray, step: float, outdoor: FloatArray, loads: FloatArray, wanted: BoolArray,
    limits: Sequence[Iterable[tuple[float, float]]], sheet: Sequence[tuple[float, float]] = (),
) -> tuple[tuple[float, float], ...]:  # fmt: skip
    """Find steps in telemetry at which machines gave all that there is for them: outdoor air [K], load of all [-].

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
    wanted : ndarray of bool, shape (n_time, n_machine)
        Whether all that there is was asked for.
    limits : sequence of iterable of tuple of float
        Outdoor air [K] and load [-] of steps at which each machine alone was at its limit, see `HeatLimit`.
    sheet : sequence of tuple of float
        As of `SharedLimit`, outdoor air [K] and load [-].
    """
    shared, alone = SharedLimit(weights, step, (), sheet), [HeatLimit(seen) for seen in limits]
    for k in range(len(outdoor)):
        shared.learn(float(outdoor[k]), loads[k], wanted[k] & (loads[k] > RUNS), alone)
    return tuple((at, load) for at, load in shared.readings if load >= shared.shown(np.array([at]))[0])
