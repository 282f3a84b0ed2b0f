"""An air handler that VAV boxes share: while it runs it blows cold air at all of their rooms, whichever is heated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from scipy.optimize import nnls

from mpc.identify.limits import OUT_OF_REACH
from mpc.identify.machines import Machine
from mpc.identify.telemetry import PlantTelemetry
from mpc.loop.plant import Measurements
from mpc.scenario.grid import hours_of_week
from mpc.scenario.scenario import OCCUPANCY_POINT
from thermal._types import BoolArray, FloatArray
from thermal.units import AIR_HEAT_CAPACITY

#: Share of a box's usual flow from which its air handler runs [-], and of the steps in which all boxes agree on that.
_RUNS, _AGREE = 0.2, 0.95

#: Flow over the usual one that is more than steady [-], and the share of the steps that may have more.
_STEADY, _MORE = 1.15, 0.2

#: How cold the air of boxes that heat nothing is within [K], in which share of the steps some box shows it [-], and how
#: much colder than the rooms it is at least [K]. Air that the handler itself heats at times is not of this kind.
_SAME, _SHOWN, _COLDER = 1.0, 0.2, 3.0

#: Load up to which a box heats nothing [-].
_IDLE = 0.02

#: Share of a step that it ran from which what a box gave tells what it has at most [-].
WHOLE = 0.95

#: Hours of a day.
_DAY = 24


@dataclass(frozen=True)
class AirHandler:
    """What the boxes of several zones share.

    While it runs, each room loses ``conductance (T - supply)`` to its air, which its box may make up for by reheating.
    It runs in hours of its own, and in others for as long as any box heats.

    Parameters
    ----------
    supply : float
        Air that boxes get, and give on where they heat nothing [K].
    conductances : tuple of float
        Heat capacity of each box's flow while it runs, in the order of the machines [W/K].
    powers : mapping of str to float
        Of each kind that is bought while it runs, whatever the boxes do [W].
    hours : tuple of tuple
        Hours of the week from Monday's first, of which is known whether it runs without being asked to, and whether it
        does.
    """

    supply: float
    conductances: tuple[float, ...]
    powers: Mapping[str, float] = field(default_factory=dict)
    hours: tuple[tuple[int, bool], ...] = ()

    def lost(self, running: float, air: FloatArray) -> FloatArray:
        """Heat of its air to the rooms, negative as it is cold, shape (n_machine,) [W].

        Parameters
        ----------
        running : float
            Share of the time [-].
        air : ndarray, shape (n_machine,)
            Of the rooms [K].
        """
        return np.asarray(running * np.array(self.conductances) * (self.supply - air))

    def measured(self, measurements: Measurements, machines: Sequence[Machine]) -> tuple[FloatArray, float]:
        """Give the same as measured, shape (n_machine,) [W], and the share of the step that it ran [-]; NaN if unknown.

        Parameters
        ----------
        measurements : Measurements
            Of the step.
        machines : sequence of Machine
            Of the boxes.
        """
        known = [[measurements[c] if c in measurements else np.nan for c in m.air] for m in machines]
        flow, _, air = np.array(known).T
        return self.blown(flow, air), float(self.share(flow))

    def blown(self, flow: FloatArray, air: FloatArray) -> FloatArray:
        """Heat of its air to the rooms by measured flows, negative as it is cold, shape (..., n_machine) [W].

        Parameters
        ----------
        flow : ndarray, shape (..., n_machine)
            [kg/s].
        air : ndarray, shape (..., n_machine)
            Of the rooms [K].
        """
        return np.asarray(AIR_HEAT_CAPACITY * flow * (self.supply - air))

    def share(self, flow: FloatArray) -> FloatArray:
        """Share of the time that it runs by the flow of its boxes, shape (...) [-]; NaN where one is not known.

        Parameters
        ----------
        flow : ndarray, shape (..., n_machine)
            [kg/s].
        """
        usual = np.array(self.conductances) / AIR_HEAT_CAPACITY
        return np.asarray(np.minimum(flow / usual, 1.0).mean(axis=-1))


def running(own: FloatArray, levels: FloatArray, most: FloatArray) -> FloatArray:
    """Share of the time that an air handler runs where boxes heat together, shape (...) [-].

    Parameters
    ----------
    own : ndarray, shape (...)
        That in hours of its own [-].
    levels, most : ndarray, shape (..., n_machine)
        Loads of the boxes, and the largest of those [-].
    """
    shares = np.divide(levels, most, out=np.zeros_like(levels), where=most > 0.0)
    return np.asarray(np.maximum(own, np.clip(shares.max(axis=-1), 0.0, 1.0)))


class RunningHours:
    """Learns in which hours of the week an air handler runs by itself, from steps in which no room asks it to.

    An hour of which nothing is known is as the same one of another working day, if it is one; else it runs where
    people are in.

    Parameters
    ----------
    seen : sequence of tuple
        As of `AirHandler`.

    Examples
    --------
    >>> import numpy as np
    >>> hours = RunningHours(((7, True),))
    >>> hours.at(np.array([7, 31, 127]), np.array([False, False, False])).tolist()
    [1.0, 1.0, 0.0]
    """

    def __init__(self, seen: Sequence[tuple[int, bool]] = ()) -> None:
        self._known: dict[int, bool] = {}
        self._usual: dict[int, bool] = {}
        for hour, runs in seen:
            self.learn(hour, runs)

    @property
    def seen(self) -> tuple[tuple[int, bool], ...]:
        """What is known, by hour."""
        return tuple(sorted(self._known.items()))

    def learn(self, hour: int, runs: bool) -> None:
        """Take a step in which it was not asked to run.

        Parameters
        ----------
        hour : int
            Of the week.
        runs : bool
            Whether it did.
        """
        self._known[hour] = runs
        if hour < 5 * _DAY:
            self._usual[hour % _DAY] = runs

    def at(self, hours: np.ndarray, occupied: BoolArray) -> FloatArray:
        """Tell where it runs, shape (n,): 1 or 0 [-].

        Parameters
        ----------
        hours : ndarray of int, shape (n,)
            Of the week.
        occupied : ndarray of bool, shape (n,)
            Whether people are in.
        """
        found = []
        for hour, people in zip(hours.tolist(), occupied.tolist(), strict=True):
            usual = self._usual.get(hour % _DAY, people) if hour < 5 * _DAY else people
            found.append(float(self._known.get(hour, usual)))
        return np.array(found)


def find_air_handler(
    telemetry: PlantTelemetry, machines: Sequence[Machine], above: FloatArray
) -> tuple[AirHandler | None, list[Machine], FloatArray]:
    """Find the air handler of VAV boxes, and count their heat beyond its air.

    Parameters
    ----------
    telemetry : PlantTelemetry
        Of the plant.
    machines : sequence of Machine
        That are controlled.
    above : ndarray, shape (n_time, n_machine)
        How far setpoints lie above the air of their rooms [K].

    Returns
    -------
    AirHandler or None
        None unless all machines are boxes that heat, whose steady flow begins and ends together, and some show cold
        air.
    list of Machine
        Those given; with an air handler each with its air.
    ndarray, shape (n_time, n_zone)
        Heat of its air to the zones, negative; zeros without one [W].
    """
    zones = list(telemetry.site.areas)
    nothing = None, list(machines), np.zeros((len(telemetry.frame), len(zones)))
    served = [m.serves[0] for m in machines]
    boxes = all(m.air and m.role == "setpoint" and m.sign > 0.0 and len(m.serves) == 1 for m in machines)
    if not boxes or len(set(served)) < len(served) or len(served) < 2:
        return nothing
    flow, discharge, air = (
        np.column_stack([telemetry.bridged(telemetry.frame[m.air[part]], np.nan) for m in machines])
        for part in range(3)
    )
    if not (np.nan_to_num(flow).max(axis=0) > 0.0).all():
        return nothing
    usual = np.array([np.nanmedian(column[column > _RUNS * np.nanmax(column)]) for column in flow.T])
    on = flow > _RUNS * usual
    runs = on.mean(axis=1) > 0.5
    coldest = np.where(on & np.isfinite(discharge), discharge, np.inf).min(axis=1)
    steady = ((flow > _STEADY * usual) & on).sum(axis=0) <= _MORE * on.sum(axis=0)
    if (on == runs[:, None]).all(axis=1).mean() < _AGREE or not (runs & np.isfinite(coldest)).any() or not steady.all():
        return nothing
    runs &= np.isfinite(coldest)
    supply = float(np.quantile(coldest[runs], 0.05))
    shown = np.mean(coldest[runs] < supply + _SAME)
    if shown < _SHOWN or supply > float(np.nanmean(air[runs])) - _COLDER:
        return nothing
    made = [replace(m, supply=supply) for m in machines]
    found = AirHandler(supply, tuple(float(AIR_HEAT_CAPACITY * each) for each in usual))
    heat, blown = np.zeros_like(nothing[2]), found.blown(flow, air)
    for k, zone in enumerate(served):
        heat[:, zones.index(zone)] = telemetry.bridged(pd.Series(blown[:, k]))
    level = np.column_stack([m.level(telemetry) for m in made])
    asked = (level > _IDLE).any(axis=1) | ~(np.nan_to_num(above, nan=np.inf) < -OUT_OF_REACH).all(axis=1)
    of_week, hours = hours_of_week(pd.DatetimeIndex(telemetry.frame.index), telemetry.step), RunningHours()
    for hour, ran in zip(of_week[~asked | ~runs].tolist(), runs[~asked | ~runs].tolist(), strict=True):
        hours.learn(hour, ran)
    return replace(found, hours=hours.seen), made, heat


def told_by_whole_steps(runs: FloatArray, above: FloatArray) -> FloatArray:
    """Leave out steps of which an air handler ran only a part: what boxes gave then is not all that they have.

    Parameters
    ----------
    runs : ndarray, shape (n_time,)
        Share of the steps that it runs [-].
    above : ndarray, shape (n_time, n_machine)
        How far setpoints lie above the air of their rooms [K].
    """
    return np.where((runs >= WHOLE)[:, None], above, np.nan)


def with_powers(
    handler: AirHandler, telemetry: PlantTelemetry, machines: Sequence[Machine], bought: Mapping[str, FloatArray],
    runs: FloatArray,
) -> tuple[AirHandler, dict[str, FloatArray]]:  # fmt: skip
    """Find what is bought while an air handler runs, by least squares beside the heat of the boxes, none below zero.

    In its own hours it runs anyway: what counts is what it buys in others, where dampers to outdoor air are shut.
    Nothing where it always runs, for then nobody can tell.

    Parameters
    ----------
    handler : AirHandler
        Found.
    telemetry : PlantTelemetry
        Of the plant.
    machines : sequence of Machine
        Boxes.
    bought : mapping of str to ndarray, shape (n_time,)
        Of each kind [W].
    runs : ndarray, shape (n_time,)
        Share of the steps that it runs [-].

    Returns
    -------
    AirHandler
        With `powers`.
    dict of str to ndarray, shape (n_time,)
        What is bought beyond that [W].
    """
    hours = hours_of_week(pd.DatetimeIndex(telemetry.frame.index), telemetry.step)
    people = [telemetry.column(f"{zone}/{OCCUPANCY_POINT}") > 0.0 for zone in telemetry.site.areas]
    free = RunningHours(handler.hours).at(hours, np.any(people, axis=0)) < 0.5
    rows = free if free.any() and np.ptp(runs[free]) > 0.5 else np.ones_like(free)
    if np.ptp(runs[rows]) < 0.5:
        return handler, dict(bought)
    heat = np.column_stack([m.signal(telemetry) for m in machines])
    design = np.column_stack([np.ones(len(runs)), runs, np.maximum(heat, 0.0)])[rows]
    size = np.maximum(np.abs(design).max(axis=0), 1e-9)
    powers = {kind: float(nnls(design / size, values[rows])[0][1] / size[1]) for kind, values in bought.items()}
    return replace(handler, powers=powers), {kind: values - powers[kind] * runs for kind, values in bought.items()}
