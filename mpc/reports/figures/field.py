"""The temperature of every control volume at the end of one run."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.model.case_replay import SPIN_UP, Inputs, spin_up
from thermal.model.matrices import SymbolicModel
from thermal.model.step import IMPLICIT_EULER, Scheme, Stepper
from thermal.network.network import ThermalNetwork

#: The steppers take temperatures as differences from this one [K], which costs no accuracy.
_REFERENCE = 293.15


@dataclass(frozen=True)
class Field:
    """Temperatures at the end of one run.

    Parameters
    ----------
    network : ThermalNetwork
        The grid.
    temperatures : ndarray, shape (n_node,)
        Of its control volumes [K].
    measured : ndarray, shape (n_zone,)
        Of the zones, at the same stamp [K].
    dx : float or None
        Distance between control volumes [m]; None is the plan's cell size.
    """

    network: ThermalNetwork
    temperatures: FloatArray
    measured: FloatArray
    dx: float | None


def spatial_field(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    start: pd.Timestamp,
    steps: int,
    dx: float | None = None,
    scheme: Scheme = IMPLICIT_EULER,
) -> Field:
    """Simulate one run on the grid to its last step.

    Parameters
    ----------
    model : SymbolicModel
        On the grid.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.
    start : Timestamp
        Start of the run; the spin-up takes three days before it, or what there is.
    steps : int
        N.
    dx : float, optional
        Distance between control volumes that the grid was built with [m].
    scheme : Scheme
        Time stepping.
    """
    matrices = model.matrices(theta)
    first = int(inputs.stamps.searchsorted(start))
    begin = max(0, first - round(SPIN_UP / inputs.step))
    states, _ = spin_up(matrices, inputs, begin, np.array([first]))
    states = states - _REFERENCE
    stepper = Stepper(matrices, inputs.step, scheme)
    for row in range(first + 1, first + steps + 1):
        boundary = inputs.boundary[row][:, None] - _REFERENCE
        states, *_ = stepper.advance(states, boundary, inputs.heat[row][:, None], inputs.airflow[row][:, None])
    return Field(model.network, np.asarray(states[:, 0] + _REFERENCE), inputs.zone[first + steps], dx)
