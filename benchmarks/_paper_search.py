"""The paper's calibration: 100 evaluations of its metric over the eight ranges of its Table 1.

Goldfeder and Sipple (2023), "Simulator Calibration and Evaluation" and Table 1. The paper says how many settings were
tried, in which ranges, and no more; no gradients. Two searches stand for it here:

- `sobol_search`, the plain one: 100 points of a scrambled Sobol sequence, of which the best counts;
- `bayesian_search`, as good a one as is in use for 100 evaluations of eight parameters: a Gaussian process with a
  Matérn 5/2 kernel, expected improvement, on the logarithm of the metric (Snoek, Larochelle and Adams 2012,
  arXiv:1206.2944), after the first 16 points of the plain one. It reaches bounds, as the paper's search did.

Both see the ranges on a unit cube: logarithmic where a range spans more than a decade, linear elsewhere (heat capacity
of interior walls, shuffle probability). The paper does not give its scale; on a linear one, nine points in ten would
lie in the top decade of every wide range.

Its eight become the θ of a network as follows (`theta`). Conductivities and the convection coefficient are taken as
they are: θ of a plan's wall is that of a wall as thick as it is drawn, one cell, which is what the paper's control
volumes are. (The ranges of `thermal.PARAMETERS` are for a wall 1 m thick; networks have scaled them already.) The
exterior conductivity is that of the insulation: the network adds 0.15 m2K/W of structure, against 0.5 to 50 m2K/W of
half a metre in the paper's range. Density times heat capacity is one parameter: their product over the network's
nominal density is its heat capacity. Values outside of the network's own physical ranges are evaluated all the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize, special, stats

from thermal import ThermalNetwork

FloatArray = NDArray[np.float64]

#: From a point of the unit cube to the metric [K].
Objective = Callable[[FloatArray], float]

#: Evaluations that the paper spends.
EVALUATIONS = 100

#: A parameter is on a bound within this share of its range, on the scale of the search [-]; as for our own.
BOUND_SHARE = 0.01

#: What a shuffle probability of zero is evaluated at [-]: a model's parameters are positive.
LEAST_PROBABILITY = 1e-6

#: Points of the plain search that the Bayesian one begins with.
FIRST_POINTS = 16

#: The length scales of the process have this log-normal prior on the unit cube, and its noise these bounds over the
#: signal's variance: the metric is exact, but not as smooth as a Matérn 5/2 process.
LENGTH_CENTRE, LENGTH_DEVIATION = 0.7, 0.8
LEAST_NOISE, MOST_NOISE = 1e-6, 1e-1

#: Step of the finite differences of expected improvement on the unit cube [-].
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class Range:
    """A row of the paper's Table 1, with the value that it found."""

    name: str
    unit: str
    lower: float
    upper: float
    best: float

    @property
    def logarithmic(self) -> bool:
        """Whether it is searched on a logarithmic scale."""
        return self.lower > 0.0 and self.upper > 10.0 * self.lower

    def value(self, share: float) -> float:
        """Return the value at a share of the range, on the scale of the search."""
        if self.logarithmic:
            return float(self.lower * (self.upper / self.lower) ** share)
        return self.lower + share * (self.upper - self.lower)


#: Table 1 of the paper.
RANGES = (
    Range("exterior convection coefficient", "W/m^2/K", 5.0, 800.0, 800.0),
    Range("exterior wall conductivity", "W/m/K", 0.01, 1.0, 0.01),
    Range("exterior wall density", "kg/m^3", 1.0, 3000.0, 2748.0),
    Range("exterior wall heat capacity", "J/kg/K", 100.0, 2500.0, 2500.0),
    Range("interior wall conductivity", "W/m/K", 5.0, 800.0, 780.0),
    Range("interior wall density", "kg/m^3", 0.5, 1500.0, 0.5),
    Range("interior wall heat capacity", "J/kg/K", 500.0, 1500.0, 500.0),
    Range("shuffle probability", "1", 0.0, 1.0, 1.0),
)


@dataclass(frozen=True)
class Search:
    """What a search tried, in order."""

    points: FloatArray  # (n, 8), on the unit cube
    errors: FloatArray  # (n,) [K]

    @property
    def best(self) -> FloatArray:
        """The point of the least error."""
        return np.asarray(self.points[int(np.argmin(self.errors))])

    @property
    def on_bound(self) -> list[str]:
        """Which of the eight lie on a bound there."""
        near = np.minimum(self.best, 1.0 - self.best) < BOUND_SHARE
        return [r.name for r, n in zip(RANGES, near, strict=True) if n]


def values(point: FloatArray) -> dict[str, float]:
    """Values of the paper's parameters at a point of the unit cube, by name."""
    return {r.name: r.value(float(share)) for r, share in zip(RANGES, point, strict=True)}


def theta(network: ThermalNetwork, tried: Mapping[str, float]) -> FloatArray:
    """Map the paper's values to θ of a network; what the paper does not have keeps its start."""
    given = {
        "exterior_convection_coefficient": tried["exterior convection coefficient"],
        "shuffle_probability": max(tried["shuffle probability"], LEAST_PROBABILITY),
    }
    for wall in ("exterior", "interior"):
        given[f"{wall}_wall_conductivity"] = tried[f"{wall} wall conductivity"]
        product = tried[f"{wall} wall density"] * tried[f"{wall} wall heat capacity"]
        given[f"{wall}_wall_heat_capacity"] = product / network.nominal.get(f"{wall}_wall_density", (1.0, ""))[0]
    known = {p.name for p in network.parameters}
    return network.values({name: value for name, value in given.items() if name in known})


def sobol_points(count: int, seed: int, dimensions: int = len(RANGES)) -> FloatArray:
    """Take the first points of a scrambled Sobol sequence on the unit cube, shape (count, dimensions)."""
    power = int(np.ceil(np.log2(max(count, 2))))
    sequence = stats.qmc.Sobol(dimensions, seed=np.random.default_rng(seed))
    return np.asarray(sequence.random_base2(power)[:count])


def sobol_search(objective: Objective, count: int = EVALUATIONS, seed: int = 0) -> Search:
    """Evaluate points of a scrambled Sobol sequence."""
    points = sobol_points(count, seed)
    return Search(points, np.array([objective(p) for p in points]))


def bayesian_search(objective: Objective, count: int = EVALUATIONS, seed: int = 0) -> Search:
    """Evaluate the first points of the plain search, then where a Gaussian process expects most improvement."""
    points = sobol_points(min(FIRST_POINTS, count), seed)
    errors = np.array([objective(p) for p in points])
    rng = np.random.default_rng([seed, 1])
    process: Process | None = None
    while len(points) < count:
        process = fit_process(points, np.log(errors), process)
        point = _most_promising(process, points, errors, rng)
        points, errors = np.vstack([points, point]), np.append(errors, objective(point))
    return Search(points, errors)


@dataclass(frozen=True)
class Process:
    """A Gaussian process at given points, with its mean and variance chosen by likelihood."""

    points: FloatArray  # (n, d)
    scales: FloatArray  # (d + 1,) logarithms of the length scales and of noise over signal
    mean: float
    variance: float
    factor: FloatArray  # lower Cholesky factor of the correlation matrix
    weights: FloatArray  # (n,), inverse correlation times data

    def predict(self, at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation at points (m, d)."""
        cross = _matern(at, self.points, self.scales[:-1])
        half = linalg.solve_triangular(self.factor, cross.T, lower=True)
        spread = np.maximum(1.0 - (half**2).sum(axis=0), 1e-12)
        return self.mean + cross @ self.weights, np.sqrt(self.variance * spread)


def fit_process(points: FloatArray, data: FloatArray, last: Process | None = None) -> Process:
    """Fit a Gaussian process to data at points by posterior mode of its scales, from those of the last one."""
    d = points.shape[1]
    start = np.append(np.full(d, np.log(LENGTH_CENTRE)), np.log(1e-3)) if last is None else last.scales
    bounds = [(np.log(0.05), np.log(20.0))] * d + [(np.log(LEAST_NOISE), np.log(MOST_NOISE))]

    def loss(scales: FloatArray) -> float:
        process = _process(points, data, scales)
        prior = np.sum(((scales[:-1] - np.log(LENGTH_CENTRE)) / LENGTH_DEVIATION) ** 2)
        log_determinant = 2.0 * np.sum(np.log(np.diag(process.factor)))
        return float(0.5 * (data.size * np.log(process.variance) + log_determinant + prior))

    found = optimize.minimize(loss, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 20})
    return _process(points, data, found.x)


def _process(points: FloatArray, data: FloatArray, scales: FloatArray) -> Process:
    """Process of given scales, its mean and variance by generalised least squares."""
    correlation = _matern(points, points, scales[:-1]) + np.exp(scales[-1]) * np.eye(data.size)
    factor = np.linalg.cholesky(correlation)
    ones = linalg.cho_solve((factor, True), np.ones(data.size))
    mean = float(ones @ data / ones.sum())
    weights = linalg.cho_solve((factor, True), data - mean)
    variance = max(float((data - mean) @ weights) / data.size, 1e-12)
    return Process(points, scales, mean, variance, factor, weights)


def _matern(a: FloatArray, b: FloatArray, lengths: FloatArray) -> FloatArray:
    """Matérn 5/2 correlation of points (m, d) and (n, d) (Rasmussen and Williams 2006, eq. 4.17)."""
    scale = np.exp(-lengths)
    a, b = a * scale, b * scale
    square = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * a @ b.T
    r = np.sqrt(5.0 * np.maximum(square, 0.0))
    return np.asarray((1.0 + r + r**2 / 3.0) * np.exp(-r))


def _most_promising(process: Process, points: FloatArray, errors: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Maximise expected improvement on the cube: draws from all of it and about the best, then an ascent from two."""
    best = float(np.log(errors.min()))
    d = points.shape[1]
    incumbent = points[int(np.argmin(errors))]
    about = incumbent + rng.standard_normal((500, d)) * 10.0 ** rng.uniform(-2.5, -0.5, (500, 1))
    draws = np.vstack([rng.random((1500, d)), np.clip(about, 0.0, 1.0)])
    around = DIFFERENCE * np.vstack([np.zeros(d), np.eye(d)])

    def loss(x: FloatArray) -> tuple[float, FloatArray]:
        found = -log_improvement(process, x + around, best)
        return float(found[0]), (found[1:] - found[0]) / DIFFERENCE

    starts = draws[np.argsort(log_improvement(process, draws, best))[-2:]]
    ends = [optimize.minimize(loss, s, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * d) for s in starts]
    return np.asarray(min(ends, key=lambda e: float(e.fun)).x)


def log_improvement(process: Process, at: FloatArray, best: float) -> FloatArray:
    """Logarithm of the improvement expected on the best value at points (m, d); it has a slope where that is zero."""
    mean, deviation = process.predict(at)
    z = (best - mean) / deviation
    density = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
    return np.asarray(np.log(deviation) + np.log(np.maximum(z * special.ndtr(z) + density, 1e-300)))
