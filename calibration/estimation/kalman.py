"""Predictor-corrector: a Kalman filter on a reduced model with a heat disturbance in each zone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration.errors import FilterError
from calibration.estimation.disturbance import DisturbanceModel, DisturbedSpace
from calibration.estimation.gains import TOLERANCE, Covariance, Gain, exact_gains, pays_off, runs, steady_gains
from calibration.estimation.state_space import REFERENCE, StateSpace
from thermal._types import BoolArray, FloatArray
from thermal.model.case_replay import Inputs


@dataclass(frozen=True)
class Filtered:
    """What the filter made of an interval of telemetry; nothing is NaN but innovations of what was not measured.

    Parameters
    ----------
    kalman : KalmanFilter
        The filter.
    stamps : DatetimeIndex, length n_time
        Ends of the filtered steps.
    begin : int
        Row of the telemetry before the first of them.
    states : ndarray, shape (n_time + 1, n)
        Predicted ``z = [x; d]`` of every step, from what was measured before it, and of the one after the last
        [(W K)^0.5 and W].
    predicted, zone : ndarray, shape (n_time, n_zone)
        Zone temperatures one step ahead, and corrected by the step's own measurements [K].
    zone_deviation : ndarray, shape (n_time, n_zone)
        Standard deviation of ``zone`` [K].
    disturbance, disturbance_deviation : ndarray, shape (n_time, n_zone)
        Unmeasured heat from what was measured so far, and its standard deviation [W].
    innovations : ndarray, shape (n_time, n_zone)
        Measured minus predicted [K]; NaN where not measured, or where the inputs of the step are incomplete.
    innovation_deviation : ndarray, shape (n_time, n_zone)
        Their standard deviation according to the model [K].
    log_likelihood : float
        Of all measurements [-].
    errors : ndarray, shape (n_time, n_zone)
        What corrected the states: measured minus predicted, zero where not measured [K].
    gains : tuple of Gain
        Every gain that was used, first the steady one of all sensors that report at all.
    gain_of : ndarray of int, shape (n_time,)
        Which of them a step used.
    """

    kalman: KalmanFilter
    stamps: pd.DatetimeIndex
    begin: int
    states: FloatArray
    predicted: FloatArray
    zone: FloatArray
    zone_deviation: FloatArray
    disturbance: FloatArray
    disturbance_deviation: FloatArray
    innovations: FloatArray
    innovation_deviation: FloatArray
    log_likelihood: float
    errors: FloatArray
    gains: tuple[Gain, ...]
    gain_of: NDArray[np.int64]

    @property
    def measured(self) -> BoolArray:
        """Zones with a sensor that reported at least once, shape (n_zone,)."""
        return np.asarray(np.diag(self.gains[0].weight) > 0.0)

    @property
    def count(self) -> int:
        """Number of innovations."""
        return int(np.isfinite(self.innovations).sum())

    @property
    def standardised(self) -> FloatArray:
        """Innovations over their deviations, shape (n_time, n_zone) [-]."""
        return np.asarray(self.innovations / self.innovation_deviation)


class KalmanFilter:
    """Predicts the zones a step ahead, corrects state and disturbance by what is then measured, and predicts on.

    Parameters
    ----------
    space : StateSpace
        The building.
    disturbance : DisturbanceModel
        Its unmeasured heat and sensors.
    covariance : {"exact", "steady"}
        ``exact`` follows the covariance from a step where the pattern of missing sensors changes to where it is steady
        again. ``steady`` keeps the steady one and only leaves missing sensors out of the correction: what a large
        building with many short gaps can afford.
    tolerance : float
        Relative change in a step of the variances of zones and disturbances below which they count as steady [-].

    Raises
    ------
    FilterError
        When the disturbance does not fit the zones, or ``covariance`` is unknown.

    Examples
    --------
    >>> from calibration.estimation.state_space import state_space
    >>> from thermal.data import load_bundled_case
    >>> from thermal.model.reduce import reduced_model
    >>> from thermal.model.case_replay import replay_inputs, spin_up
    >>> from thermal.model.matrices import SymbolicModel
    >>> from thermal.network.build import build_network
    >>> case = load_bundled_case()
    >>> grid = SymbolicModel(build_network(case.building, dx=1.0))
    >>> inputs, theta = replay_inputs(case, grid.network), grid.network.start()
    >>> matrices = reduced_model(grid, [theta]).matrices(theta)
    >>> kalman = KalmanFilter(state_space(matrices.modal.modes, inputs.step), DisturbanceModel(100.0, 3600.0, 0.05))
    >>> found = kalman.filter(inputs, 288, 576, spin_up(matrices, inputs, 0, np.array([288]))[0])
    >>> found.zone.shape, bool(np.nanstd(found.innovations) < 0.3)
    ((288, 5), True)
    """

    def __init__(
        self,
        space: StateSpace,
        disturbance: DisturbanceModel,
        *,
        covariance: Covariance = "exact",
        tolerance: float = TOLERANCE,
    ) -> None:
        known = get_args(Covariance)
        FilterError.unless_known(covariance, known, "covariance", f"one of {', '.join(known)}")
        self.space, self.disturbance, self.covariance, self.tolerance = space, disturbance, covariance, tolerance
        self.whole = DisturbedSpace(space, disturbance)
        self._steady: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def steady(self, measured: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Steady covariance of the prediction and information of the future, see `DisturbedSpace.steady`.

        Parameters
        ----------
        measured : ndarray of bool, shape (n_zone,)
            Zones with a sensor.
        """
        key = measured.tobytes()
        if key not in self._steady:
            self._steady[key] = self.whole.steady(measured)
        return self._steady[key]

    def filter(
        self, inputs: Inputs, begin: int, stop: int, states: FloatArray, spread: FloatArray | None = None
    ) -> Filtered:
        """Filter the telemetry's rows ``begin + 1`` to ``stop``.

        It starts from the steady covariance and what is said to be unknown beside it.

        A step whose heat, boundary or airflow is not known has what the replay fills in for it. The unmeasured heat of
        each zone then gains the variance that the zone's metered heat has over the telemetry, so that what is measured
        still guides the state, and no innovation is reported.

        Parameters
        ----------
        inputs : Inputs
            The telemetry.
        begin, stop : int
            Row at whose stamp the states stand, and last row.
        states : ndarray, shape (n_reduced, 1)
            States of the reduced model at stamp ``begin``, from `thermal.spin_up` [K].
        spread : ndarray, shape (r, m), optional
            Columns whose outer products are the covariance of what a spin-up leaves unknown of x [(W K)^0.5]; nothing
            by default, and with ``covariance="steady"``.

        Raises
        ------
        FilterError
            When there is no row, no sensor in any of them, or a state that is not finite.
        """
        if not 0 <= begin < stop < len(inputs):
            raise FilterError(f"filter: expected rows with 0 <= begin < stop < {len(inputs)}, got {begin} and {stop}")
        if not np.isfinite(states).all():
            raise FilterError("filter: expected finite states to start from, got NaN; see `thermal.spin_up`")
        rows = slice(begin + 1, stop + 1)
        measured, known = np.isfinite(inputs.zone[rows]), inputs.complete[rows]
        FilterError.unless(measured.any(), "filter", f"zone temperatures in rows {begin + 1} to {stop}", "none")
        unknown = inputs.heat[inputs.complete].std(axis=0)
        ever = np.asarray(measured.any(axis=0))
        if self.covariance == "steady":
            gains, gain_of = steady_gains(self.whole, self.steady(ever)[0], measured, known, unknown)
        else:
            start = np.empty((self.space.order, 0)) if spread is None else spread
            gains, gain_of = exact_gains(
                self.whole, self.steady(ever)[0], start, measured, known, unknown, self.tolerance
            )
        return self._corrected(inputs, rows, self.space.start(states)[:, 0], gains, np.array(gain_of))

    def _corrected(
        self, inputs: Inputs, rows: slice, start: FloatArray, gains: list[Gain], index: NDArray[np.int64]
    ) -> Filtered:
        """Predict and correct step by step."""
        space, whole, r = self.space, self.whole, self.space.order
        u = space.drives(inputs.boundary[rows], inputs.heat[rows])
        pushed, through = u @ space.drive.T, u @ space.feedthrough.T
        zone, airflow = inputs.zone[rows] - REFERENCE, inputs.airflow[rows]
        measured, count = np.isfinite(zone), len(zone)
        seen = np.where(measured, zone, 0.0)
        states = np.empty((count + 1, whole.n))
        states[0, :r], states[0, r:] = start, 0.0
        for at, gain in runs(gains, index):
            if space.flow is None and pays_off(at, whole):
                loop, gained = whole.corrected(gain.reach, gain.weight), gain.reach @ gain.weight
                pull = (seen[at] - through[at]) @ whole.advance(gained).T
                pull[:, :r] += pushed[at]
                for k, pulled in zip(range(at.start, at.stop), pull, strict=True):
                    states[k + 1] = loop @ states[k] + pulled
                continue
            for k in range(at.start, at.stop):
                z = states[k]
                if space.flow is not None:
                    extra = space.directed_heat(airflow[k][:, None], z[:r, None])[:, 0]
                    pushed[k] += space.heat_drive @ extra
                    through[k] += space.heat_feedthrough @ extra
                weighted = gain.weight @ (seen[k] - through[k] - whole.observation @ z)
                states[k + 1] = whole.advance(z + gain.reach @ weighted)
                states[k + 1, :r] += pushed[k]
        predicted = states[:count] @ whole.observation.T + through
        errors = np.where(measured, zone - predicted, 0.0)
        filtered, misfit = states[:count].copy(), 0.0
        for at, gain in runs(gains, index):
            weighted = errors[at] @ gain.weight
            filtered[at] += weighted @ gain.reach.T
            misfit += float(np.sum(errors[at] * weighted))
        spread = np.array([np.diag(g.seen) + whole.noise_variance for g in gains])
        left = np.array([np.diag(g.seen) - ((g.seen @ g.weight) * g.seen).sum(axis=1) for g in gains])
        heat = np.array([np.diag(g.heat[:, r:]) - ((g.reach[r:] @ g.weight) * g.reach[r:]).sum(axis=1) for g in gains])
        determinant = np.array([g.log_determinant for g in gains])[index]
        likelihood = -0.5 * (misfit + determinant.sum() + measured.sum() * np.log(2.0 * np.pi))
        return Filtered(
            kalman=self,
            stamps=inputs.stamps[rows],
            begin=rows.start - 1,
            states=states,
            predicted=predicted + REFERENCE,
            zone=filtered @ whole.observation.T + through + REFERENCE,
            zone_deviation=np.sqrt(np.maximum(left, 0.0))[index],
            disturbance=filtered[:, r:],
            disturbance_deviation=np.sqrt(np.maximum(heat, 0.0))[index],
            innovations=np.where(measured & inputs.complete[rows, None], errors, np.nan),
            innovation_deviation=np.sqrt(spread)[index],
            log_likelihood=float(likelihood),
            errors=errors,
            gains=tuple(gains),
            gain_of=index,
        )

    def predict(
        self,
        states: FloatArray,
        boundary: FloatArray,
        heat: FloatArray,
        keep: NDArray[np.int64],
        airflow: FloatArray | None = None,
    ) -> FloatArray:
        """Zone means of m runs over N steps from filtered states; their disturbances fade at their time constant.

        Parameters
        ----------
        states : ndarray, shape (n, m)
            Columns of ``Filtered.states`` at the starts [(W K)^0.5 and W].
        boundary : ndarray, shape (N, n_boundary, m)
            Boundary temperatures of each step [K].
        heat : ndarray, shape (N, n_zone, m)
            Heat given to the zones [W].
        keep : ndarray of int, shape (n_keep,)
            Steps whose means are returned, 1 to N, increasing.
        airflow : ndarray, shape (N, n_airflow, m), optional
            Directed airflows [kg/s]; their mean by default.

        Returns
        -------
        ndarray, shape (m, n_keep, n_zone)
            Zone means over the kept steps [K].
        """
        space, whole, r, z = self.space, self.whole, self.space.order, states
        means = np.empty((states.shape[1], len(keep), space.n_zone))
        position = {int(k): i for i, k in enumerate(keep)}
        for k in range(int(keep[-1])):
            given = heat[k]
            if airflow is not None and space.flow is not None:
                given = given + space.directed_heat(airflow[k], z[:r])
            u = np.concatenate([boundary[k] - REFERENCE, given])
            if k + 1 in position:
                means[:, position[k + 1]] = (whole.observation @ z + space.feedthrough @ u).T + REFERENCE
            z = whole.advance(z)
            z[:r] += space.drive @ u
        return means

    def prediction_deviation(self, steps: int, measured: BoolArray | None = None) -> FloatArray:
        """Deviation of predicted zone means from a steady filtered state on, shape (steps, n_zone) [K].

        Parameters
        ----------
        steps : int
            N.
        measured : ndarray of bool, shape (n_zone,), optional
            Zones with a sensor; all by default.
        """
        whole, r = self.whole, self.space.order
        covariance = self.steady(np.ones(self.space.n_zone, dtype=bool) if measured is None else measured)[0]
        rows, added = np.ascontiguousarray(whole.observation.T), np.zeros(self.space.n_zone)
        variance = np.empty((steps, self.space.n_zone))
        for k in range(steps):
            variance[k] = np.einsum("iz,iz->z", rows, covariance @ rows) + added
            added = added + whole.heat_variance @ rows[r:] ** 2
            rows = whole.retreat(rows)
        return np.sqrt(variance)
