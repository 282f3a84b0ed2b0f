"""How an instance of a unit is begun and goes on: by its own solver (co-simulation), or by CVODE (model exchange)."""

import math
from collections.abc import Callable
from typing import Any

from fmpy.sundials import CVodeSolver

from mpc.errors import PlantError

#: Relative tolerance of CVODE [-]; absolute ones are this times the unit's nominal values. Over a day of quarter hours,
#: a restart each, the heated floor of the tests keeps within 0.0004 K of its solution, and within 0.004 K at 1e-6.
TOLERANCE = 1e-7

_MOST_STEPS = 20_000  # of CVODE's own between two readings: its default of 500 is soon used up where a unit chatters
_MOST_ITERATIONS = 1_000  # of an event: a unit that still asks for more has none
_MOST_EVENTS = 10_000  # between two readings: a unit that chatters more gets nowhere
_MOST_AT_ONCE = 100  # events one after another that do not move time: a unit that has more stands still
_SAME_TIME = 1e-6  # s

Change = Callable[[], None]


class CoSimulation:
    """A unit that brings its own solver.

    Parameters
    ----------
    instance : object
        Of FMPy.
    fmi3 : bool
        Whether it is of FMI 3.0.
    """

    def __init__(self, instance: Any, fmi3: bool) -> None:
        self._instance, self._fmi3 = instance, fmi3

    def begin(self, time: float, change: Change) -> None:
        """Initialise.

        Parameters
        ----------
        time : float
            At which it begins [s].
        change : callable
            Sets parameters and inputs.
        """
        change()
        _initialise(self._instance, time, self._fmi3)

    def change(self, change: Change) -> None:
        """Change inputs between two steps.

        Parameters
        ----------
        change : callable
            Sets them.
        """
        change()

    def advance(self, time: float, length: float) -> None:
        """Go on by a communication step.

        Parameters
        ----------
        time : float
            Where it is [s].
        length : float
            Of the step [s].
        """
        done = self._instance.doStep(currentCommunicationPoint=time, communicationStepSize=length)
        if self._fmi3 and done[1]:
            raise PlantError(f"the unit asked to end the simulation at {time:g} s")


class ModelExchange:
    """A unit that gives derivatives: FMPy's CVODE (BDF, rooted) solves it, restarted at each event.

    Parameters
    ----------
    instance : object
        Of FMPy.
    fmi3 : bool
        Whether it is of FMI 3.0.
    description : object
        Model description of FMPy.
    longest : float
        Longest step of CVODE [s]: what comes and goes within a step is not seen.
    """

    def __init__(self, instance: Any, fmi3: bool, description: Any, longest: float) -> None:
        self._instance, self._fmi3, self._longest = instance, fmi3, longest
        self._completes = bool(description.modelExchange.needsCompletedIntegratorStep)
        self._sizes = int(description.numberOfContinuousStates), int(description.numberOfEventIndicators)
        self._time = self._next = math.nan
        self._solver: Any = None

    def begin(self, time: float, change: Change) -> None:
        """Initialise.

        Parameters
        ----------
        time : float
            At which it begins [s].
        change : callable
            Sets parameters and inputs.
        """
        change()
        _initialise(self._instance, time, self._fmi3)
        self._time, unit = time, self._instance
        self._settle()
        derivatives = unit.getContinuousStateDerivatives if self._fmi3 else unit.getDerivatives
        self._solver = _Solver(
            *self._sizes, unit.getContinuousStates, unit.setContinuousStates, derivatives, unit.getEventIndicators,
            unit.getNominalsOfContinuousStates, unit.setTime, _Held(), time, self._longest, TOLERANCE,
            _MOST_STEPS,
        )  # fmt: skip

    def change(self, change: Change) -> None:
        """Change inputs: an event.

        Parameters
        ----------
        change : callable
            Sets them.
        """
        self._instance.enterEventMode()
        change()
        self._settle()
        self._solver.reset(self._time)

    def advance(self, time: float, length: float) -> None:
        """Go on, over all events on the way.

        Parameters
        ----------
        time : float
            Where it is [s].
        length : float
            How far [s].

        Raises
        ------
        PlantError
            When the unit asks to end, has events without end, or cannot be solved.
        """
        end, unit = time + length, self._instance
        events, at_once, last = 0, 0, -math.inf
        while self._time < end - _SAME_TIME:
            target, event, ends = min(end, self._next), False, False
            if target > self._time + _SAME_TIME:
                event, _, self._time = self._solver.solve(self._time, target)
                unit.setTime(self._time)
                if self._completes:
                    asked, ends = unit.completedIntegratorStep()
                    event = event or asked
            if ends:
                raise PlantError(f"the unit asked to end the simulation at {self._time:g} s")
            if event or self._next <= self._time + _SAME_TIME:
                unit.enterEventMode()
                self._settle()
                self._solver.reset(self._time)
                events, at_once = events + 1, at_once + 1 if self._time <= last + _SAME_TIME else 1
                last = self._time
                if events > _MOST_EVENTS or at_once > _MOST_AT_ONCE:
                    raise PlantError(f"events without end: {events} from {time:g} to {self._time:g} s")

    def _settle(self) -> None:
        """Iterate an event until the unit is content, and go back to continuous time."""
        update = self._instance.updateDiscreteStates if self._fmi3 else self._instance.newDiscreteStates
        for _ in range(_MOST_ITERATIONS):
            again, ends, _, _, defined, next_time = update()
            if ends:
                raise PlantError(f"the unit asked to end the simulation at {self._time:g} s")
            if not again:
                break
        else:
            raise PlantError(f"an event at {self._time:g} s does not settle within {_MOST_ITERATIONS} iterations")
        self._next = float(next_time) if defined else math.inf
        self._instance.enterContinuousTimeMode()


def _initialise(instance: Any, time: float, fmi3: bool) -> None:
    if fmi3:
        instance.enterInitializationMode(startTime=time)
    else:
        instance.setupExperiment(startTime=time)
        instance.enterInitializationMode()
    instance.exitInitializationMode()


class _Held:
    """Inputs that stay as they were set, as FMPy's solver asks for them."""

    def apply(self, time: float) -> None:
        """Leave them."""


class _Solver(CVodeSolver):  # type: ignore[misc]
    """CVODE; what a unit refuses to compute is tried again with a shorter step, and told if that does not help."""

    refused: Exception | None = None

    def f(self, *arguments: Any) -> int:
        """Give derivatives, or 1 where the unit refuses."""
        return self._tried(super().f, arguments)

    def g(self, *arguments: Any) -> int:
        """Give event indicators, or 1 where the unit refuses."""
        return self._tried(super().g, arguments)

    def solve(self, time: float, until: float) -> tuple[bool, Any, float]:
        """Go on to a time or the next event."""
        self.refused = None
        try:
            event, roots, reached = self.step(time, until)
        except Exception as error:
            raise PlantError(f"CVODE: {self.refused or error}") from error
        return bool(event), roots, float(reached)

    def _tried(self, function: Callable[..., int], arguments: tuple[Any, ...]) -> int:
        try:
            return function(*arguments)
        except Exception as error:  # it must not leave through C
            self.refused = error
            return 1
