"""Replay of a case's telemetry: inputs, spin-up with the zones held at their measured temperatures, and free runs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.case.case import Case
from thermal.case.estimated import DELAY, LONGEST_BRIDGE
from thermal.errors import ModelError
from thermal.inputs.provider import InputProvider, telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.model.matrices import Matrices
from thermal.model.modal import run_along
from thermal.model.step import IMPLICIT_EULER, Scheme, Stepper
from thermal.network.network import ThermalNetwork
from thermal.units import REFERENCE_TEMPERATURE as _REFERENCE

#: Length of the spin-up [s] (results contract: 3 days).
SPIN_UP = 3 * 86400.0

#: The least spin-up that is accepted [s] (results contract: 12 hours).
LEAST_SPIN_UP = 12 * 3600.0

#: One long implicit step towards the steady state that a spin-up starts from [s].
_STEADY_STEP = 10 * 86400.0

#: Change of a zone's temperature within a step that is fitted at most, by the step's length [K/s]: 1 K in five minutes.
#: Beyond, a mean over the step tells when in it heat came, which no telemetry says, rather than how much. Chosen on
#: EnergyPlus offices with ideal air, whose zones jump by 4 K in a step at the hour (practice cases); it leaves out 3 %
#: of their samples at most, 1 % of EnergyPlus' reference buildings', and none of the measured houses'.
SUDDEN = 12.0 / 3600.0


@dataclass(frozen=True, repr=False)
class Inputs:
    """What drives a replay, one row a stamp; a row stands for the step that ends at its stamp.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Ends of the steps.
    step : float
        Length of a step [s].
    heat : ndarray, shape (n_time, n_zone)
        Metered heat given to each zone [W].
    boundary : ndarray, shape (n_time, n_boundary)
        Boundary temperatures, outdoor first [K]; then the signals of the effects in the model, counted from the
        reference temperature like these [signal unit].
    airflow : ndarray, shape (n_time, n_airflow)
        Directed airflows [kg/s].
    zone : ndarray, shape (n_time, n_zone)
        Measured zone temperatures [K], NaN where missing and where the zone's heat is estimated; an unmeasured zone is
        NaN throughout.
    bridged : ndarray, shape (n_time, n_zone)
        Measured zone temperatures [K] with the last value kept for at most 30 minutes: a start may know nothing of
        what comes after it.
    held : ndarray, shape (n_time, n_zone)
        Measured zone temperatures [K] to hold the zones at in a spin-up; in a gap the last value for a day, and the
        estimated one then.
    complete : ndarray of bool, shape (n_time,)
        Whether heat, boundaries and airflows of this step are measured, bridged over at most 30 minutes, or
        estimated (`Case.estimated`).
    estimated : ndarray of bool, shape (n_time, n_zone), optional
        Where the heat of a zone is estimated; nowhere by default.
    """

    stamps: pd.DatetimeIndex
    step: float
    heat: FloatArray
    boundary: FloatArray
    airflow: FloatArray
    zone: FloatArray
    bridged: FloatArray
    held: FloatArray
    complete: NDArray[np.bool_]
    estimated: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.stamps)

    def __repr__(self) -> str:
        n, share = self.zone.shape[1], self.complete.mean()
        span = f"{self.stamps[0]} to {self.stamps[-1]} by {self.step:g} s" if len(self) else "no steps"
        return f"Inputs({span}, {n} zones, {self.boundary.shape[1]} boundaries and signals, {share:.0%} complete)"

    def targets(self, starts: IntArray, keep: IntArray, fastest: float = np.inf) -> FloatArray:
        """Temperatures that runs are held against.

        Parameters
        ----------
        starts : ndarray of int, shape (m,)
            Stamps at which the runs start.
        keep : ndarray of int, shape (n_keep,)
            Steps after the start.
        fastest : float
            Change since the step before beyond which a temperature is left out, by the step's length [K/s].

        Returns
        -------
        ndarray, shape (m, n_keep, n_zone)
            Measured temperatures [K]; NaN where a zone could not be matched at its start, or its heat has been
            estimated since, or where it changed too fast.
        """
        rows = starts[:, None] + keep
        known = np.isfinite(self.bridged[starts])[:, None, :]
        if self.estimated is not None:
            count = np.cumsum(self.estimated, axis=0)
            known = known & (count[rows] == count[starts][:, None, :])
        if np.isfinite(fastest):
            known = known & ~(np.abs(self.zone[rows] - self.zone[rows - 1]) > fastest * self.step)
        return np.where(known, self.zone[rows], np.nan)

    def to_frame(self) -> pd.DataFrame:
        """All inputs as a table, shape (n_time, n) [K], [W], [kg/s]; columns of two levels, kind and number."""
        kinds = ("boundary", "heat", "airflow", "zone")
        tables = {kind: pd.DataFrame(getattr(self, kind), index=self.stamps) for kind in kinds}
        return pd.concat({kind: table for kind, table in tables.items() if table.size}, axis=1)

    def plot(self) -> Any:
        """Draw zones with outdoors [degC] above their heat [kW]; returns a matplotlib figure."""
        import matplotlib.pyplot as plt

        figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
        above.plot(self.stamps, self.zone - 273.15)
        above.plot(self.stamps, self.boundary[:, 0] - 273.15, "k", linewidth=0.8, label="outdoor")
        above.legend(frameon=False)
        below.plot(self.stamps, self.heat / 1000.0)
        above.set_ylabel("temperature (degC)")
        below.set_ylabel("heat (kW)")
        return figure


def replay_inputs(case: Case, network: ThermalNetwork, provider: InputProvider | None = None) -> Inputs:
    """Collect the inputs of a replay from a case's telemetry.

    Parameters
    ----------
    case : Case
        With telemetry.
    network : ThermalNetwork
        Says which boundaries, airflows and signals the model has.
    provider : InputProvider, optional
        Of the same case, where it is at hand; else made of the telemetry with the network's normalisation.

    Returns
    -------
    Inputs
        In SI units.

    Raises
    ------
    ModelError
        When no zone temperature or no outdoor temperature is measured, or no step has all its inputs.
    """
    step = float(case.telemetry.step)
    zone = case.zone_temperatures()
    boundary = case.boundary_temperatures()
    if zone.isna().all(axis=None):
        raise ModelError("telemetry", "a zone_air_temperature_sensor of at least one zone", "none that is usable")
    missing = [str(c) for c in boundary.columns if boundary[c].isna().all()]
    ModelError.unless(not missing, "telemetry", "temperatures of the boundaries", f"none that is usable for {missing}")
    frames = [case.zone_heat_estimated(), boundary, case.airflow_rates_estimated()]
    estimated = case.heat_is_estimated().to_numpy()
    limit = int(LONGEST_BRIDGE // step)
    bridged = [_bridge(f, limit) for f in frames]
    told = _bridge(case.command_signals(), limit)
    complete = np.logical_and.reduce([f.notna().all(axis=1).to_numpy() for f in (*bridged, told)])
    if not complete.any():
        raise ModelError(f"telemetry: no step has all its inputs; {_most_missing(bridged)}")
    filled = [f.interpolate(limit_direction="both").fillna(0.0).to_numpy(dtype=float) for f in bridged]
    index = pd.DatetimeIndex(zone.index)
    signals = np.empty((len(index), 0))
    if network.signals:
        source = provider or telemetry_inputs(case, network.normalisation)
        signals = _REFERENCE + signal_values(network.signals, source)
    return Inputs(
        stamps=index,
        step=step,
        heat=filled[0],
        boundary=np.hstack([filled[1], signals]),
        airflow=filled[2],
        zone=np.where(estimated, np.nan, zone.to_numpy(dtype=float)),
        bridged=(zone.ffill(limit=limit) if limit else zone).to_numpy(dtype=float),
        held=_held(case).to_numpy(dtype=float),
        complete=complete,
        estimated=estimated,
    )


def _held(case: Case) -> pd.DataFrame:
    """Temperatures that zones are held at in a spin-up: measured, the last ones for a day, then the estimated ones."""
    measured, day = case.zone_temperatures(), max(1, round(DELAY / case.telemetry.step))
    if measured.shape[1] == 1:  # no other zone tells anything of it
        return measured.ffill().bfill()
    # before its first reading a zone has the one to come, and is not held where none ever comes
    late = case.zone_temperatures_estimated().where(measured.ffill().notna())
    return measured.ffill(limit=day).fillna(late).bfill()


def _most_missing(frames: list[pd.DataFrame]) -> str:
    """Name the inputs that are missing most."""
    kinds = ("heat of zone", "temperature of boundary", "airflow")
    shares = [(f[c].isna().mean(), f"{kind} {c}") for kind, f in zip(kinds, frames, strict=True) for c in f.columns]
    worst = sorted((s for s in shares if s[0] > 0), reverse=True)[:5]
    named = ", ".join(f"{name} ({share:.0%} missing)" for share, name in worst)
    return f"{named}; a device that gives heat must report its flow and discharge temperature, or its power"


def _bridge(frame: pd.DataFrame, limit: int) -> pd.DataFrame:
    """Bridge gaps of at most ``limit`` rows by straight lines and leave longer ones as they are."""
    if frame.empty or limit == 0 or not frame.isna().any(axis=None):
        return frame
    out = frame.copy()
    for name in frame.columns[frame.isna().any()]:
        column = frame[name]
        gap = column.isna()
        run = gap.groupby((gap != gap.shift()).cumsum()).transform("sum")
        out[name] = column.where(~gap | (run > limit), column.interpolate(limit_area="inside"))
    return out


def spin_up(
    matrices: Matrices,
    inputs: Inputs,
    begin: int,
    at: IntArray,
    progress: Callable[[int], None] | None = None,
) -> tuple[FloatArray, FloatArray | None]:
    """States at several stamps after holding the zones at their measured temperatures since stamp ``begin``.

    The zones are held by whatever heat that takes, so walls, slabs and furniture follow the building as it was
    measured. It starts
    from the steady state of the mean temperatures of the first day (or of what there is before the first start).

    Parameters
    ----------
    matrices : Matrices
        The model at one θ; with sensitivities, sensitivities are returned as well.
    inputs : Inputs
        The telemetry.
    begin : int
        First stamp of the spin-up.
    at : ndarray of int, shape (m,)
        Stamps at which states are wanted, increasing, none before ``begin``.
    progress : callable, optional
        Called with the number of steps done.

    Returns
    -------
    tuple
        States (n, m) [K] and their derivatives (n, n_parameter m) parameter by parameter, or None.
    """
    p = len(matrices.flow_sensitivities)
    # a day, or what lies before the first start: a state may know nothing of what comes after it
    first = slice(begin, min(begin + max(1, int(86400.0 / inputs.step)), int(at[0]) + 1))
    rows = np.arange(begin, int(at[-1]) + 1)
    # Temperatures are stepped as differences from the reference: rows of ``[K, -B]`` sum to zero but for signals, which
    # are counted from it, so nothing changes but round-off.
    held, boundary = inputs.held - _REFERENCE, inputs.boundary - _REFERENCE
    states = float(np.nanmean(held[first].mean(axis=0))) * matrices.uniform[:, None]
    sensitivities = np.zeros((matrices.n, p)) if p else None
    driven = (boundary, held, inputs.heat)
    stages = (
        (_STEADY_STEP, [v[first].mean(axis=0)[None] for v in driven], np.array([0]), None),
        (inputs.step, [v[rows] for v in driven], at - begin, progress),
    )
    for step, (outside, zone, heat), keep, told in stages:
        if matrices.reduced and matrices.modal.heated_as_observed:
            states, sensitivities = matrices.modal.hold(states, outside, zone, heat, keep, step, sensitivities)
        else:
            stepper = Stepper(matrices, step, IMPLICIT_EULER)
            states, sensitivities = stepper.hold_many(states, outside, zone, keep, sensitivities, heat, told)
    return states + _REFERENCE * matrices.uniform[:, None], sensitivities


def free_runs(
    matrices: Matrices,
    inputs: Inputs,
    starts: IntArray,
    steps: int | IntArray,
    states: FloatArray,
    sensitivities: FloatArray | None = None,
    scheme: Scheme = IMPLICIT_EULER,
    progress: Callable[[int], None] | None = None,
) -> tuple[FloatArray, FloatArray | None]:
    """Run the model freely from several stamps, driven by the telemetry's inputs.

    Parameters
    ----------
    matrices : Matrices
        The model at one θ.
    inputs : Inputs
        The telemetry.
    starts : ndarray of int, shape (m,)
        Stamps at which the runs start.
    steps : int or ndarray of int
        Number of steps N, or which steps to return, from 1 on and increasing.
    states : ndarray, shape (n, m)
        States at the starts [K].
    sensitivities : ndarray, shape (n, n_parameter m), optional
        Their sensitivities [K per unit of θ].
    scheme : Scheme
        Implicit Euler by default.
    progress : callable, optional
        Called with the number of steps done.

    Returns
    -------
    tuple
        Zone means over the kept steps (m, n_keep, n_zone) [K] and sensitivities (m, n_keep, n_zone, n_parameter), or
        None.
    """
    keep = np.arange(1, steps + 1) if isinstance(steps, int | np.integer) else steps
    states, boundary = states - _REFERENCE * matrices.uniform[:, None], inputs.boundary - _REFERENCE
    if matrices.reduced and not matrices.airflows:
        if sensitivities is None:
            modes = matrices.modal.modes
            along = run_along(modes, states, boundary, inputs.heat, starts, keep, inputs.step, scheme)
            return along + _REFERENCE, None
        row = starts + np.arange(1, int(keep[-1]) + 1)[:, None]
        boundary, heat = ((v[row]).transpose(0, 2, 1) for v in (boundary, inputs.heat))
        means, moved = matrices.modal.run(states, boundary, heat, keep, inputs.step, scheme, sensitivities)
        return means + _REFERENCE, moved
    stepper = Stepper(matrices, inputs.step, scheme)
    m, n_zone, p = starts.size, inputs.zone.shape[1], len(matrices.flow_sensitivities)
    means = np.empty((m, keep.size, n_zone))
    mean_sensitivities = np.empty((m, keep.size, n_zone, p)) if sensitivities is not None else None
    position = {int(s): i for i, s in enumerate(keep)}
    for k in range(1, int(keep[-1]) + 1):
        row = starts + k
        states, mean, sensitivities, mean_moved = stepper.advance(
            states, boundary[row].T, inputs.heat[row].T, inputs.airflow[row].T, sensitivities
        )
        if k in position:
            means[:, position[k]] = mean.T + _REFERENCE
            if mean_sensitivities is not None and mean_moved is not None:
                mean_sensitivities[:, position[k]] = mean_moved.reshape(n_zone, p, m).transpose(2, 0, 1)
        if progress is not None:
            progress(k)
    return means, mean_sensitivities
