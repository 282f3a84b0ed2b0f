"""A grey box fitted to telemetry: the errors of its predictions over the coming day are made small."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from calibration.errors import CalibrationError
from calibration.estimation.disturbance import DisturbanceModel, doubled_riccati
from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import LASTING, NODES, NOISE, UNMEASURED, GreyBox
from thermal._types import FloatArray, IntArray

#: How far ahead the fit predicts [s], how often runs start, and how far apart the errors are that it sees [s].
AHEAD, EVERY, SEEN = 86_400.0, 10_800.0, 3600.0

#: Time that a filter forgets its start in, left out of fits and judgements [s].
SPIN_UP = 86_400.0

#: Error that the spread of a parameter is weighed against [K]: too weak to be felt where telemetry says anything.
_DEVIATION = 0.3

#: Evaluations of a fit, without those of finite differences.
_EVALUATIONS = 40

#: Root mean square error over the coming day from which on a fit is begun again [K], and capacity of the air, and of
#: what follows it, over that of the start then [-]. Fits of the plants to develop on miss by 0.1 to 0.3 K; the one that
#: went astray, of a cooled shop, by 0.8.
_ASTRAY, _HEAVIER = 0.5, 3.0


@dataclass(frozen=True, eq=False)
class GreyBoxData:
    """What drives a grey box and what was measured, one row a step; inputs without gaps.

    Parameters
    ----------
    step : float
        Length of a step [s].
    zone : ndarray, shape (n_time, n_zone)
        Measured means over the steps [K]; NaN is missing.
    outdoor : ndarray, shape (n_time,)
        Outdoor air [K].
    sun : ndarray, shape (n_time, n_sun)
        Irradiances [W/m2].
    heat : ndarray, shape (n_time, n_source)
        Of each source, or what it buys where its heat is not measured [W].
    gain : ndarray, shape (n_time, n_zone)
        Heat of people and equipment [W].

    Raises
    ------
    CalibrationError
        When shapes do not fit, or an input has a gap.
    """

    step: float
    zone: FloatArray
    outdoor: FloatArray
    sun: FloatArray
    heat: FloatArray
    gain: FloatArray

    def __post_init__(self) -> None:
        n = len(self.zone)
        inputs = {name: getattr(self, name) for name in ("outdoor", "sun", "heat", "gain")}
        wrong = [name for name, values in inputs.items() if len(values) != n or not np.isfinite(values).all()]
        CalibrationError.unless(not wrong, "grey box data", f"{n} finite values of each input", f"others of {wrong}")
        CalibrationError.unless(np.isfinite(self.zone).any(), "grey box data", "measured zone temperatures", "none")

    def rows(self, first: int, last: int) -> GreyBoxData:
        """Take steps out.

        Parameters
        ----------
        first, last : int
            First, and the one after the last.
        """
        part = slice(first, last)
        return replace(self, **{k: v[part] for k, v in vars(self).items() if k != "step"})

    def pushes(self, box: GreyBox) -> FloatArray:
        """Collect the inputs of a network's state space, shape (n_time, n_input).

        Parameters
        ----------
        box : GreyBox
            Network.
        """
        return np.column_stack([self.outdoor - REFERENCE, self.sun, box.delivered(self.heat, self.outdoor),
                                self.gain + box.parts["constant gain"]])  # fmt: skip


@dataclass(frozen=True, eq=False)
class Followed:
    """What a filter with a steady gain made of telemetry.

    Parameters
    ----------
    states : ndarray, shape (n_time + 1, n)
        Temperatures of the nodes less the reference [K], then unmeasured heat [W]: before each step, from what was
        measured before it, and after the last.
    innovations : ndarray, shape (n_time, n_zone)
        Measured less predicted [K]; NaN where not measured.
    log_likelihood : float
        Of the innovations after the spin-up [-].
    """

    states: FloatArray
    innovations: FloatArray
    log_likelihood: float


def steady_gain(box: GreyBox, step: float) -> tuple[FloatArray, FloatArray]:
    """Gain of the steady Kalman filter, (n, n_zone) [K/K and W/K], and covariance of its innovations [K2].

    Parameters
    ----------
    box : GreyBox
        Network.
    step : float
        Length of a step [s].
    """
    whole, r = box.disturbed(step), box.capacity.size
    heat = np.sqrt(whole.heat_variance)
    unit = np.concatenate([np.ones(r), heat])  # kelvins, and what a step adds to the unmeasured heat
    seen = whole.observation * unit
    drive = np.diag(np.concatenate([np.zeros(r), np.ones(heat.size)]))
    information = seen.T @ (seen / whole.noise_variance[:, None])
    covariance, _ = doubled_riccati(whole.dense() / unit[:, None] * unit, information, drive)
    spread = (covariance * np.outer(unit, unit)) @ whole.observation.T
    innovation = whole.observation @ spread + np.diag(np.broadcast_to(whole.noise_variance, len(box.zones)))
    return np.asarray(np.linalg.solve(innovation, spread.T).T, dtype=float), innovation


def follow(box: GreyBox, data: GreyBoxData) -> Followed:
    """Filter telemetry: predict, correct by what is measured, and predict on.

    Parameters
    ----------
    box : GreyBox
        Network.
    data : GreyBoxData
        Telemetry.
    """
    whole, u = box.disturbed(data.step), data.pushes(box)
    space, nz = whole.space, len(box.zones)
    gain, innovation = steady_gain(box, data.step)
    pushed, through = u @ space.drive.T, u @ space.feedthrough.T
    z = np.zeros(whole.n)
    first = np.nanmean(np.vstack([data.zone[:4], np.nanmean(data.zone, axis=0)]), axis=0) - REFERENCE
    z[: 4 * nz] = np.tile(first, len(NODES))
    matrix, observe = whole.dense(), whole.observation
    seen = data.zone - REFERENCE - through
    known = np.isfinite(seen)
    states, inward = np.empty((len(u) + 1, whole.n)), matrix @ gain
    # prediction and correction in one: x' = (A - A K C) x + A K y + B u, where all zones are measured
    closed, given = matrix - inward @ observe, np.where(known, seen, 0.0) @ inward.T
    given[:, : space.order] += pushed
    for k, whole_row in enumerate(np.asarray(known.all(axis=1)).tolist()):
        states[k] = z
        if whole_row:
            z = closed @ z + given[k]
        else:
            z = matrix @ z - inward @ np.where(known[k], observe @ z, 0.0) + given[k]
    states[-1] = z
    errors = seen - states[:-1] @ observe.T
    judged = errors[min(round(SPIN_UP / data.step), len(errors) // 2) :]
    judged = judged[np.isfinite(judged).all(axis=1)]
    _, determinant = np.linalg.slogdet(innovation)
    misfit = np.einsum("ki,ij,kj->", judged, np.linalg.inv(innovation), judged)
    likelihood = -0.5 * (misfit + len(judged) * (determinant + nz * np.log(2.0 * np.pi)))
    return Followed(states, errors, float(likelihood))


def predict(box: GreyBox, data: GreyBoxData, states: FloatArray, starts: IntArray, steps: int) -> FloatArray:
    """Zone means of runs from filtered states, inputs as they came, shape (n_run, steps, n_zone) [K].

    Parameters
    ----------
    box : GreyBox
        Network.
    data : GreyBoxData
        Telemetry.
    states : ndarray, shape (n_time + 1, n)
        Of `follow` [K and W].
    starts : ndarray of int
        First step of each run.
    steps : int
        Length of the runs.
    """
    whole, u = box.disturbed(data.step), data.pushes(box)
    space = whole.space
    pushed, through = u @ space.drive.T, u @ space.feedthrough.T
    z, means, matrix = states[starts].T, np.empty((steps, len(starts), len(box.zones))), whole.dense()
    for k in range(steps):
        means[k] = (whole.observation @ z).T + through[starts + k]
        z = matrix @ z
        z[: space.order] += pushed[starts + k].T
    return np.asarray(means.transpose(1, 0, 2) + REFERENCE)


def run_starts(data: GreyBoxData, steps: int, every: float = EVERY) -> IntArray:
    """First steps of runs, after the spin-up.

    Parameters
    ----------
    data : GreyBoxData
        Telemetry.
    steps : int
        Length of the runs.
    every : float
        Time between two of them [s].

    Raises
    ------
    CalibrationError
        When it is too short for a run.
    """
    first, stride = round(SPIN_UP / data.step), max(round(every / data.step), 1)
    starts = np.arange(first, len(data.zone) - steps + 1, stride)
    expected, hours = "telemetry of a day for the spin-up and a day to predict", len(data.zone) * data.step / 3600.0
    CalibrationError.unless(len(starts), "grey box", expected, f"{hours:.3g} h", "give more days")
    return starts


def fit_grey_box(start: GreyBox, data: GreyBoxData, progress: Callable[[str, int, int], None] | None = None) -> GreyBox:
    """Fit a network by least squares on the errors of predictions over a day, from filtered states.

    That is what a controller needs of it, rather than the likelihood of the next step alone (Zhao, Lu, Yan and Li 2011
    speak of model relevant identification). Unmeasured heat and noise are then made as likely as they get, and the
    network fitted once more with them. A fit that misses by much has gone astray, such as to a building that is joined
    to outdoor air by kilowatts a kelvin: it is begun again with heavier air, and the better of the two is kept.

    Parameters
    ----------
    start : GreyBox
        Where the fit begins.
    data : GreyBoxData
        Telemetry.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    CalibrationError
        When the telemetry is too short.
    """
    first, error = _fitted(start, data, progress, 0)
    if error > _ASTRAY:
        point = start.point.copy()
        point[: len(start.zones)] += np.log(_HEAVIER)
        again, other = _fitted(replace(start, point=point), data, progress, 0)
        first = again if other < error else first
    return _fitted(tune_noise(first, data), data, progress, 1)[0]


def _fitted(
    start: GreyBox, data: GreyBoxData, progress: Callable[[str, int, int], None] | None, part: int
) -> tuple[GreyBox, float]:
    """Fit once: the network, and its root mean square error over the coming day [K]."""
    from scipy.optimize import least_squares

    steps, stride = round(AHEAD / data.step), max(round(SEEN / data.step), 1)
    starts = run_starts(data, steps)
    keep = np.arange(steps - 1, -1, -stride)[::-1]
    target = data.zone[starts[:, None] + keep]
    seen, count = np.isfinite(target), 0

    def residuals(point: FloatArray) -> FloatArray:
        nonlocal count
        count += 1
        if progress is not None and count % (point.size + 1) == 1:
            progress("fit", part * _EVALUATIONS + count // (point.size + 1), 2 * _EVALUATIONS)
        box = replace(start, point=point)
        errors = predict(box, data, follow(box, data).states, starts, steps)[:, keep] - target
        pull = _DEVIATION * (point - start.centre) / start.scale
        return np.concatenate([np.nan_to_num(errors[seen], nan=1e3, posinf=1e3, neginf=-1e3).clip(-1e3, 1e3), pull])

    found = least_squares(
        residuals, start.point, bounds=(start.lowest - 1e-9, np.inf), x_scale=start.scale, max_nfev=_EVALUATIONS,
        ftol=1e-4, xtol=1e-5, loss="soft_l1", f_scale=1.0,
    )  # fmt: skip
    errors = found.fun[: int(seen.sum())]
    return replace(start, point=found.x), float(np.sqrt(np.mean(errors**2)))


def tune_noise(box: GreyBox, data: GreyBoxData) -> GreyBox:
    """Give a network the unmeasured heat and the sensors' noise that make its innovations likeliest.

    Parameters
    ----------
    box : GreyBox
        Network.
    data : GreyBoxData
        Telemetry.
    """
    from scipy.optimize import minimize

    # heat per floor area [W/m2], how long it lasts [h], noise [K]
    low, high = np.log([0.05, 2.0, 0.003]), np.log([50.0, 200.0, 0.5])

    def disturbance(x: FloatArray) -> DisturbanceModel:
        heat, hours, noise = np.exp(np.clip(x, low, high))
        return DisturbanceModel(heat * box.areas, hours * 3600.0, noise)

    def cost(x: FloatArray) -> float:
        return -follow(replace(box, disturbance=disturbance(x)), data).log_likelihood

    begin = np.log([UNMEASURED, LASTING / 3600.0, NOISE])
    found = minimize(cost, begin, method="Nelder-Mead", options={"maxfev": 60, "xatol": 0.1, "fatol": 1.0})
    return replace(box, disturbance=disturbance(found.x))
