"""What machines buy beyond their maps, as a controller counts with it: a rising price of load at each step."""

from __future__ import annotations

from typing import Any

import numpy as np

from mpc.identify.corrections import PowerCorrection
from mpc.identify.curves import EMITTER
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import CARRIERS
from mpc.loop.plant import Measurements
from thermal._types import FloatArray

#: Loads between which what is beyond a map is straight [-], and how far corners are rounded [-].
KNOTS = np.linspace(0.0, 1.6, 9)
_ROUND = 0.05

#: Number of weights of a machine at a step.
WEIGHTS = len(KNOTS) - 1


def carrier_of(found: MachineMap) -> str:
    """Tell what a machine's own sensor of power measures.

    Parameters
    ----------
    found : MachineMap
        Of the machine.
    """
    return CARRIERS[1] if found.machine.power.rpartition("/")[2].startswith("gas") else CARRIERS[0]


def beyond(weights: Any, load: Any) -> Any:
    """Power beyond the map, with numbers, arrays or symbols [W].

    Parameters
    ----------
    weights : indexable of length `WEIGHTS`
        See `weights_of` [W].
    load : number, array or symbol
        Duty or load [-].
    """
    power = weights[0] * load
    for k in range(1, WEIGHTS):
        over = load - KNOTS[k]
        zero = 0.5 * ((KNOTS[k] ** 2 + _ROUND**2) ** 0.5 - KNOTS[k])
        power = power + weights[k] * (0.5 * (over + (over * over + _ROUND**2) ** 0.5) - zero)
    return power


def bought(
    model: PlantModel, weights: FloatArray, states: FloatArray, levels: FloatArray, outdoor: FloatArray | float,
    water: FloatArray | float | None = None,
) -> FloatArray:  # fmt: skip
    """Power that each machine buys with what is beyond its map, shape (..., n_machine, n_carrier) [W].

    Parameters
    ----------
    model : PlantModel
        Identified.
    weights : ndarray, shape (..., n_machine, `WEIGHTS`)
        See `weights_of` [W].
    states, levels, outdoor, water : ndarray
        As of `PlantModel.bought` [K less the reference], [-] and [K].
    """
    powers = model.bought(states, levels, outdoor, water)
    for k, found in enumerate(model.maps):
        if found.own is not None:
            power = beyond(np.moveaxis(weights[..., k, :], -1, 0), levels[..., k])
            powers[..., k, CARRIERS.index(carrier_of(found))] += power
    return powers


class PowerLearner:
    """Corrects the power of machines that have a sensor of it, step by step.

    Parameters
    ----------
    model : PlantModel
        Identified.
    """

    def __init__(self, model: PlantModel) -> None:
        self._model = model
        self._corrections = [found.correction() for found in model.maps]

    def learn(self, measurements: Measurements, levels: FloatArray, outdoor: float, state: FloatArray) -> None:
        """Take a step that has ended.

        Parameters
        ----------
        measurements : Measurements
            Of the step.
        levels : ndarray, shape (n_machine,)
            Duties and loads that were planned for it [-].
        outdoor : float
            Outdoor air over it [K].
        state : ndarray
            Of the observer at its start [K and W].
        """
        emitter = self._model.box.emitter(state)
        for k, (found, correction) in enumerate(zip(self._model.maps, self._corrections, strict=True)):
            machine, load = found.machine, float(levels[k])
            if found.own is None or machine.power not in measurements:
                continue
            if found.operation == "setpoint":  # its zone's own controller chose the load
                full = float(found.at(found.heat, 1.0, outdoor, emitter[k]))
                load = machine.given(measurements) / full if machine.meter else np.nan
            ratio = found.ratio(measurements[machine.power], load, outdoor, float(emitter[k]))
            if np.isfinite(load) and np.isfinite(ratio):
                correction.learn(outdoor, load, ratio)

    def along(self, outdoor: FloatArray, most: FloatArray) -> FloatArray:
        """Weights of the coming steps, shape (N, n_machine, `WEIGHTS`) [W].

        Parameters
        ----------
        outdoor : ndarray, shape (N,)
            Outdoor air [K].
        most : ndarray, shape (N, n_machine)
            Largest loads [-].
        """
        maps = enumerate(zip(self._model.maps, self._corrections, strict=True))
        return np.stack([weights_of(found, learned, outdoor, most[:, k]) for k, (found, learned) in maps], axis=1)


def weights_of(found: MachineMap, correction: PowerCorrection, outdoor: FloatArray, most: FloatArray) -> FloatArray:
    """Weights of a machine's power beyond its map, shape (N, `WEIGHTS`) [W].

    With them power is the largest convex one that is nowhere above the corrected map: what lies above it is avoided by
    a thermostat that goes on and off, and a solver finds the least cost of it. Loads beyond the largest one are not
    looked at.

    Parameters
    ----------
    found : MachineMap
        Of the machine.
    correction : PowerCorrection
        What was learned of it.
    outdoor : ndarray, shape (N,)
        Outdoor air [K].
    most : ndarray, shape (N,)
        Largest loads [-].
    """
    weights = np.zeros((len(outdoor), WEIGHTS))
    if found.own is None or not correction.readings:
        return weights
    if found.operation == "duty":
        full = found.at(found.own.curve, 1.0, outdoor, EMITTER)
        weights[:, 0] = full * correction.at(outdoor, np.ones((len(outdoor), 1)))[:, 0]
        return weights
    mapped = np.column_stack([found.at(found.own.curve, u, outdoor, EMITTER) for u in KNOTS])
    ratio = correction.at(outdoor, np.minimum(KNOTS, most[:, None]))
    lacking = _convex(mapped * (1.0 + ratio)) - mapped
    slopes = np.diff(lacking, axis=1) / np.diff(KNOTS)
    return np.column_stack([slopes[:, 0], np.diff(slopes, axis=1)])


def _interpolations() -> tuple[FloatArray, np.ndarray]:
    """Weights of all straight lines between two knots at each knot between them, and where each knot's begin."""
    at, begin = list[FloatArray](), list[int]()
    for j, u in enumerate(KNOTS):
        begin.append(len(at))
        for i in range(j + 1):
            for k in range(max(j, i), len(KNOTS)):
                line = np.zeros(len(KNOTS))
                share = (u - KNOTS[i]) / (KNOTS[k] - KNOTS[i]) if k > i else 0.0
                line[i] += 1.0 - share
                line[k] += share
                at.append(line)
    return np.array(at).T, np.array(begin)


_LINES, _FIRST = _interpolations()


def _convex(values: FloatArray) -> FloatArray:
    """Largest convex function at the knots that is nowhere above values there, row by row."""
    return np.asarray(np.minimum.reduceat(values @ _LINES, _FIRST, axis=1))
