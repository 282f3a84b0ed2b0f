"""Tuning of the disturbance by maximum likelihood of the innovations, with exact derivatives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize as so

from calibration.errors import FilterError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.filtered import FilterSettings, prepare
from calibration.estimation.kalman import Filtered, KalmanFilter
from calibration.estimation.smoother import log_likelihood_slopes
from calibration.estimation.state_space import StateSpace
from calibration.evaluation.intervals import Interval
from calibration.progress import Progress
from calibration.results import Plain
from thermal._types import FloatArray
from thermal.model.case_replay import Inputs
from thermal.model.matrices import SymbolicModel
from thermal.network.network import ThermalNetwork


@dataclass(frozen=True)
class DisturbancePrior:
    """What is known of a number of the disturbance before the data: a median, a spread about it, and limits.

    Parameters
    ----------
    name, unit, source : str
        What it is, its unit, and where it comes from.
    median, lower, upper : float
        Median and limits [unit].
    spread : float
        Standard deviation of its logarithm [-].
    """

    name: str
    unit: str
    median: float
    lower: float
    upper: float
    spread: float
    source: str


#: What is known of the disturbance before the data; wide on purpose, so that a day of telemetry outweighs it.
DISTURBANCE_PRIORS: dict[str, DisturbancePrior] = {
    p.name: p
    for p in (
        DisturbancePrior(
            "deviation", "W", 100.0, 0.1, 1e5, 1.5,
            "a person and a computer come and go: ISO 7730 gives 126 W for seated office work (1.2 met, 1.8 m2), "
            "ASHRAE Fundamentals 2017, ch. 18, some 60 to 100 W for a computer with its screen",
        ),
        DisturbancePrior(
            "time_constant", "s", 7200.0, 60.0, 30 * 86400.0, 1.5,
            "occupancy, sun and clouds keep for minutes to a day: a factor of 20 about two hours",
        ),
        DisturbancePrior(
            "sensor_deviation", "K", 0.03, 1e-3, 1.0, 1.0,
            "a reading to the nearest 0.1 K is off by 0.1 / sqrt(12) K",
        ),
    )
}  # fmt: skip


#: Numbers that each zone may have of its own.
_ZONAL = ("deviation", "sensor_deviation")

#: Most evaluations of the likelihood.
EVALUATIONS = 200

#: Gain of log-likelihood in an iteration below which the optimiser stops [-].
_GAIN = 0.01

#: Relative change of a variance in a step below which it counts as steady in a fit [-]: log-likelihoods are then right
#: to a tenth.
ROUGH_TOLERANCE = 1e-5

#: Distance of a logarithm from a limit at which it counts as on it [-].
_AT_BOUND = 1e-3

#: Difference of logarithms for the curvature [-], and most numbers for which it is worth its evaluations.
_CURVATURE_STEP, _CURVATURE_NUMBERS = 1e-3, 30

#: Largest spread that is reported [-]: the data say nothing.
_WIDEST = 10.0


@dataclass(frozen=True)
class TuningSettings(FilterSettings):
    """How the disturbance is tuned.

    Parameters
    ----------
    scheme, covariance
        Of the filter, see `FilterSettings`; with ``steady`` the derivatives hold but for the ends of the intervals.
    spin_up_seconds : float
        Telemetry before an interval that the spin-up may use [s].
    tolerance : float
        See `KalmanFilter` [-].
    per_zone : sequence of str
        What each zone has a number of its own of: ``deviation``, ``sensor_deviation``; both are common by default.
    weights : ndarray, shape (n_zone,), optional
        Deviations of the zones in proportion to each other, such as floor areas [any unit]; equal by default.
    time_constant : float, optional
        Keep the time constant at this value [s]; infinite for a random walk.
    priors : mapping of str to DisturbancePrior
        Of ``deviation`` (that of a zone of mean weight), ``time_constant`` and ``sensor_deviation``.
    start : DisturbanceModel, optional
        Where to start, such as what was found at a θ close by; the medians of the priors by default.
    curvature : bool
        Whether the spread of the numbers is wanted: it takes one evaluation more for each.
    """

    tolerance: float = ROUGH_TOLERANCE
    per_zone: Sequence[str] = ()
    weights: FloatArray | None = None
    time_constant: float | None = None
    priors: Mapping[str, DisturbancePrior] = field(default_factory=lambda: DISTURBANCE_PRIORS)
    start: DisturbanceModel | None = None
    curvature: bool = True


@dataclass(frozen=True)
class TunedDisturbance(Plain):
    """Outcome of `tune_disturbance`.

    Parameters
    ----------
    disturbance : DisturbanceModel
        What was found.
    spread : mapping of str to float
        Standard deviation of the logarithm of each number [-], from the curvature at the optimum; 0.1 is about 10 %.
        Empty when there are more than 30, or when it is not wanted.
    log_likelihood : float
        Of all measurements of the intervals, the priors left out [-].
    count : int
        Number of measurements.
    success : bool
        Whether the optimiser converged.
    status : str
        What it says.
    evaluations : int
        Evaluations of the likelihood with its derivatives.
    at_bound : tuple of str
        Numbers that lie on a limit of their prior.
    """

    disturbance: DisturbanceModel
    spread: Mapping[str, float]
    log_likelihood: float
    count: int
    success: bool
    status: str
    evaluations: int
    at_bound: tuple[str, ...]


def tune_disturbance(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    intervals: Sequence[Interval],
    settings: TuningSettings | None = None,
    progress: Progress | None = None,
) -> TunedDisturbance:
    """Find the unmeasured heat and the sensors' noise that make the innovations likeliest.

    The logarithms of deviation, time constant and sensor deviation are found by L-BFGS-B within the limits of their
    priors, with exact derivatives of the likelihood and of the priors. Missing measurements count for nothing.

    Parameters
    ----------
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.
    intervals : sequence of Interval
        Tuning intervals.
    settings : TuningSettings, optional
        What is tuned, from where, and the filter.
    progress : callable, optional
        Called with stage, done, total after every evaluation; the total is the largest number of them.

    Raises
    ------
    FilterError
        When the model is not reduced, weights do not fit the zones, or there is no interval, or one too short.
    """
    FilterError.unless(intervals, "tune", "at least one interval", "none")
    chosen = settings or TuningSettings()
    ready = prepare(model, theta, inputs, chosen.scheme)
    parts = [ready.interval(interval, chosen) for interval in intervals]
    numbers = _numbers(model.network.zones, chosen)
    tuning = _Tuning(ready.space, inputs, parts, numbers, chosen)
    bounds = [(np.log(p.lower), np.log(p.upper)) for p in numbers.values()]
    start = [np.log(p.median) for p in numbers.values()]
    solved = so.minimize(
        tuning.cost,
        start if chosen.start is None else tuning.point(chosen.start, bounds),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        callback=None if progress is None else lambda _: progress("tune", tuning.evaluations, EVALUATIONS),
        options={"maxfun": EVALUATIONS, "ftol": _GAIN / tuning.count, "gtol": 1e-6},
    )
    low, high = np.array(bounds).T
    close = np.minimum(solved.x - low, high - solved.x) < _AT_BOUND
    return TunedDisturbance(
        disturbance=tuning.disturbance(solved.x),
        spread=_spread(tuning, solved.x, np.asarray(solved.jac)) if chosen.curvature else {},
        log_likelihood=float(tuning.prior(solved.x)[0] - tuning.count * solved.fun),
        count=tuning.count,
        success=bool(solved.success),
        status=str(solved.message),
        evaluations=int(solved.nfev),
        at_bound=tuple(name for name, c in zip(numbers, close, strict=True) if c),
    )


def air_volumes(network: ThermalNetwork) -> FloatArray:
    """Volume of each zone's air, shape (n_zone,) [m3]: unmeasured heat may be in proportion to it.

    Parameters
    ----------
    network : ThermalNetwork
        Control volumes and faces.
    """
    return np.array([network.anatomy.rooms[zone].volume for zone in network.zones])


#: Row at which the filter of an interval starts, its last row, and what it starts from.
_Part = tuple[int, int, FloatArray, FloatArray]


class _Tuning:
    """Negative log-posterior per measurement, over the logarithms of the numbers."""

    def __init__(
        self,
        space: StateSpace,
        inputs: Inputs,
        parts: Sequence[_Part],
        numbers: Mapping[str, DisturbancePrior],
        settings: TuningSettings,
    ) -> None:
        self.space, self.inputs, self.parts, self.numbers, self.settings = space, inputs, parts, numbers, settings
        self.time_constant, weights = settings.time_constant, _shares(settings.weights, space.n_zone)
        seen = np.concatenate([np.isfinite(inputs.zone[at + 1 : stop + 1]) for at, stop, *_ in parts])
        self.count = int(seen.sum())
        walks = self.time_constant is not None and np.isinf(self.time_constant)
        self.weights = np.where(seen.any(axis=0), weights, 0.0) if walks else weights  # nothing holds a walk unseen
        self.heats, self.sensors = (sum(n.startswith(name) for n in numbers) for name in _ZONAL)
        self.evaluations = 0

    def disturbance(self, x: FloatArray) -> DisturbanceModel:
        """Disturbance of a point."""
        values = np.exp(x)
        time = float(values[self.heats]) if self.time_constant is None else self.time_constant
        return DisturbanceModel(self.weights * values[: self.heats], time, values[-self.sensors :])

    def point(self, disturbance: DisturbanceModel, bounds: Sequence[tuple[float, float]]) -> FloatArray:
        """Point of a disturbance, within bounds; the mean over the zones of what is common to them."""
        whole = np.broadcast_to(np.asarray(disturbance.deviation), self.weights.shape)
        noise = np.broadcast_to(np.asarray(disturbance.sensor_deviation), self.weights.shape)
        share = np.where(self.weights > 0.0, self.weights, 1.0)
        values = [whole / share if self.heats > 1 else [whole.sum() / self.weights.sum()]]
        values += [[disturbance.time_constant]] if self.time_constant is None else []
        values += [noise if self.sensors > 1 else [noise.mean()]]
        low, high = np.array(bounds).T
        return np.asarray(np.clip(np.log(np.maximum(np.concatenate(values), 1e-12)), low, high))

    def filtered(self, disturbance: DisturbanceModel) -> list[Filtered]:
        """Filter every interval."""
        chosen = self.settings
        kalman = KalmanFilter(self.space, disturbance, covariance=chosen.covariance, tolerance=chosen.tolerance)
        return [kalman.filter(self.inputs, *part) for part in self.parts]

    def cost(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Cost and its derivatives [-]."""
        disturbance = self.disturbance(x)
        total, slopes = 0.0, np.zeros(x.size)
        for f in self.filtered(disturbance):
            total += f.log_likelihood
            slopes += self._slopes(f, disturbance)
        cost, pull = self.prior(x)
        self.evaluations += 1
        return (cost - total) / self.count, (pull - slopes) / self.count

    def prior(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Negative logarithm of the priors and its derivatives [-]."""
        spreads = np.array([p.spread for p in self.numbers.values()])
        off = (x - np.log([p.median for p in self.numbers.values()])) / spreads
        return 0.5 * float(off @ off), off / spreads

    def _slopes(self, filtered: Filtered, disturbance: DisturbanceModel) -> FloatArray:
        """Differentiate one interval's log-likelihood with respect to the logarithms."""
        by_drive, by_keep, by_noise = log_likelihood_slopes(filtered)
        whole, step = filtered.kalman.whole, self.space.step
        heat, noise = 2.0 * whole.heat_variance * by_drive, 2.0 * whole.noise_variance * by_noise
        slopes = [heat if self.heats > 1 else heat.sum(keepdims=True)]
        if self.time_constant is None:
            keep, rate = whole.keep, step / disturbance.time_constant
            variance = np.asarray(disturbance.deviation) ** 2
            slopes.append(np.array([keep * rate * (by_keep - 2.0 * keep * variance @ by_drive)]))
        slopes.append(noise if self.sensors > 1 else noise.sum(keepdims=True))
        return np.concatenate(slopes)


def _numbers(zones: Sequence[str], settings: TuningSettings) -> dict[str, DisturbancePrior]:
    """Numbers that are tuned, with their priors: deviations first, the sensors last."""
    priors, per_zone = settings.priors, settings.per_zone
    missing = sorted(set(DISTURBANCE_PRIORS) - set(priors))
    FilterError.unless(not missing, "priors", f"{sorted(DISTURBANCE_PRIORS)}", f"none for {missing}")
    own = {per_zone} if isinstance(per_zone, str) else set(per_zone)
    FilterError.unless(own <= set(_ZONAL), "per_zone", f"some of {', '.join(_ZONAL)}", sorted(own))
    names = {name: [f"{name}@{zone}" for zone in zones] if name in own else [name] for name in _ZONAL}
    names["time_constant"] = ["time_constant"] if settings.time_constant is None else []
    return {full: priors[name] for name in ("deviation", "time_constant", "sensor_deviation") for full in names[name]}


def _shares(weights: FloatArray | None, n_zone: int) -> FloatArray:
    """Weights of the zones, one in the mean."""
    given = np.ones(n_zone) if weights is None else np.asarray(weights, dtype=float)
    if given.shape != (n_zone,) or not (np.isfinite(given) & (given >= 0)).all() or given.sum() <= 0:
        raise FilterError(f"weights: expected {n_zone} numbers of 0 or more, one a zone, got {given}")
    return np.asarray(given / given.mean())


def _spread(tuning: _Tuning, x: FloatArray, slopes: FloatArray) -> dict[str, float]:
    """Take the standard deviation of each logarithm from the curvature of the cost, by differences of its slopes."""
    if x.size > _CURVATURE_NUMBERS:
        return {}
    steps = np.eye(x.size) * _CURVATURE_STEP
    curvature = np.array([(tuning.cost(x + step)[1] - slopes) / _CURVATURE_STEP for step in steps])
    values, vectors = np.linalg.eigh(0.5 * tuning.count * (curvature + curvature.T))
    variance = (vectors**2) @ (1.0 / np.maximum(values, 1.0 / _WIDEST**2))
    return dict(zip(tuning.numbers, np.sqrt(variance).tolist(), strict=True))
