"""The mean of the random shuffle: an effective diffusivity, or a mixing rate, for everything that needs a gradient."""

from typing import Any, Literal, TypeVar

import casadi
import numpy as np

from thermal.errors import ModelError
from thermal.shuffle.random import disc_offsets

#: A float, an array, or a CasADi expression.
Scalar = TypeVar("Scalar", bound=Any)

#: Largest probability that the mixing rate resolves [-]: at 0.98 the factor is 0.0075, the zone is mixed in one step.
LARGEST_PROBABILITY = 0.98
#: Longer side of a zone over the reach up to which mixing is the better equivalent [-]; docs/shuffle.md has the study.
MIXING_EXTENT = 3.0


def mean_square_reach(reach: float, cell_size: float) -> float:
    """Mean squared distance of a swap in a zone without end, E|d|².

    The partner is uniform over the cells of a square grid within the reach, the cell itself among them. For a reach of
    many cells this tends to ``reach² / 2``.

    Parameters
    ----------
    reach : float
        Largest distance between the two cells of a swap [m], > 0.
    cell_size : float
        Side of a cell [m], > 0.

    Returns
    -------
    float
        E|d|² [m²], >= 0; zero where the reach is shorter than a cell.

    Raises
    ------
    ModelError
        When an argument is not positive and finite.

    Examples
    --------
    >>> round(mean_square_reach(1.0, 1.0), 12)  # itself and four neighbours
    0.8
    """
    _require_positive("reach", reach, "m")
    _require_positive("cell_size", cell_size, "m")
    offsets = disc_offsets(reach, (cell_size, cell_size))
    return float(np.square(offsets * cell_size).sum(axis=1).mean())


def effective_diffusivity(probability: Scalar, mean_square_reach: float, step: float) -> Scalar:
    """Diffusivity of air that spreads heat as the shuffle does on average, while the reach is small against the zone.

    A parcel takes part in ``2 p`` swaps a step, as decider and as partner, so that its mean squared displacement is
    ``2 p E|d|²``; in the plane that of diffusion is ``4 D Δt``. Hence ``D_eff = p E|d|² / (2 Δt)``.

    Parameters
    ----------
    probability : float, ndarray or casadi expression
        Shuffle probability of a cell in one step [-], in [0, 1].
    mean_square_reach : float
        E|d|² of a swap [m²], >= 0, see `mean_square_reach`.
    step : float
        Time between two shuffles [s], > 0.

    Returns
    -------
    float, ndarray or casadi expression
        Effective diffusivity [m²/s]; times density and heat capacity of air it is a conductivity [W/m/K].

    Raises
    ------
    ModelError
        When a numerical probability is outside [0, 1].

    Examples
    --------
    >>> effective_diffusivity(0.6, 2.0, 300.0)
    0.002
    """
    _require_probability(probability)
    diffusivity: Scalar = probability * mean_square_reach / (2.0 * step)
    return diffusivity


def mixing_factor(probability: Scalar) -> Scalar:
    """Share of a temperature's deviation from the zone mean that is left after one shuffle of a whole zone.

    When every cell of the zone is within the reach the mean of the shuffle is ``J + λ (I − J)`` with J the zone mean
    and ``λ = (1 − p) e^{−p}``: a parcel keeps its place when its cell does not decide to swap (probability ``1 − p``)
    and no other cell chooses it (a Poisson number of mean p); once moved it may be anywhere. Exact for a zone of many
    cells; with n cells λ is off by less than ``0.13 / n``.

    Parameters
    ----------
    probability : float, ndarray or casadi expression
        Shuffle probability of a cell in one step [-], in [0, 1].

    Returns
    -------
    float, ndarray or casadi expression
        Mixing factor λ [-], in [0, 1].

    Raises
    ------
    ModelError
        When a numerical probability is outside [0, 1].

    Examples
    --------
    >>> round(float(mixing_factor(0.5)), 4)
    0.3033
    """
    _require_probability(probability)
    factor: Scalar = (1.0 - probability) * _exp(-probability)
    return factor


def mixing_rate(probability: Scalar, shuffle_step: float, step: float) -> Scalar:
    """Rate at which air is exchanged with the zone's star node so that the zone mixes as the shuffle does on average.

    Each air cell of capacity C is tied with the conductance ``rate · C`` to a massless node, whose temperature is the
    zone mean. One implicit Euler step of length Δt leaves ``1 / (1 + rate Δt)`` of a deviation from the mean; with
    ``rate = (1/λ_Δt − 1) / Δt`` and ``λ_Δt = λ(p)^(Δt / shuffle_step)`` that is λ_Δt, and the step is exactly
    ``J + λ_Δt (I − J)`` in a zone whose cells exchange heat with nothing else. The rate depends on the step: compute it
    anew for every step; with ever shorter steps it tends to ``−ln λ / shuffle_step``.

    Beside walls and diffusers the conductances of one implicit step act at the same time, whereas the shuffle follows
    conduction: `exchange_rate` is then much closer to its mean at large p.

    Parameters
    ----------
    probability : float, ndarray or casadi expression
        Shuffle probability of a cell in one shuffle [-], in [0, 1]; taken as 0.98 above 0.98 (there 0.75 % of a
        deviation are left; at 1 the rate would be infinite).
    shuffle_step : float
        Time between two shuffles [s], > 0; the paper's is 300 s.
    step : float
        Step of the implicit Euler method [s], > 0.

    Returns
    -------
    float, ndarray or casadi expression
        Mixing rate [1/s], >= 0.

    Raises
    ------
    ModelError
        When a numerical probability is outside [0, 1] or a step is not positive and finite.

    Examples
    --------
    >>> round(float(mixing_rate(0.5, 300.0, 300.0)), 6)
    0.007658
    """
    _require_positive("shuffle_step", shuffle_step, "s")
    _require_positive("step", step, "s")
    _require_probability(probability)
    smaller = casadi.fmin if _is_symbolic(probability) else np.minimum
    factor = mixing_factor(smaller(probability, LARGEST_PROBABILITY)) ** (step / shuffle_step)
    rate: Scalar = (1.0 / factor - 1.0) / step
    return rate


def exchange_rate(probability: Scalar, shuffle_step: float) -> Scalar:
    """Rate at which air is exchanged with the zone's star node so that heat reaches walls as it does in the shuffle.

    The star node is that of `mixing_rate`, the rate is ``(1 − λ) / Δt_shuffle``. In the shuffle a cell that gives heat
    to a wall or takes it from a diffuser does so first, and is replaced by the zone's air with the share ``1 − λ``
    afterwards. Both resistances are then in series, as they are in one implicit Euler step with this rate. With
    `mixing_rate` fresh air arrives while the cell is losing heat, more than a step's shuffle can bring when p is large.

    The rate depends neither on the step of the time integration nor on a cap of p: at p = 1 it is ``1 / Δt_shuffle``.
    Zone means agree with the random shuffle within about 2 %, for implicit Euler steps of the shuffle's length and a
    zone within the reach; what an isolated zone keeps of a deviation after one step is ``1 / (2 − λ)``, not λ.

    Parameters
    ----------
    probability : float, ndarray or casadi expression
        Shuffle probability of a cell in one shuffle [-], in [0, 1].
    shuffle_step : float
        Time between two shuffles [s], > 0; the paper's is 300 s.

    Returns
    -------
    float, ndarray or casadi expression
        Exchange rate [1/s], in [0, 1 / shuffle_step].

    Raises
    ------
    ModelError
        When a numerical probability is outside [0, 1] or the step is not positive and finite.

    Examples
    --------
    >>> round(float(exchange_rate(0.5, 300.0)), 6)
    0.002322
    """
    _require_positive("shuffle_step", shuffle_step, "s")
    factor: Any = mixing_factor(probability)
    rate: Scalar = (1.0 - factor) / shuffle_step
    return rate


def choose_equivalent(zone_extent: tuple[float, float], reach: float | None) -> Literal["mixing", "diffusivity"]:
    """Choose the equivalent of the shuffle that is closer to its mean in a zone of a given size.

    Mixing is the mean itself when the zone fits inside the reach, diffusion when the reach is small against the zone.
    In between neither is: the error of the zone mean of either is largest, up to some 20 %, where they are equal, at a
    longer side of about three reaches (1.5 to 5 over the cases of docs/shuffle.md). The longer side decides
    since the slowest temperature difference lies along it.

    Parameters
    ----------
    zone_extent : tuple of float
        Width and depth of the zone's bounding box [m], > 0.
    reach : float or None
        Largest distance between the two cells of a swap [m], > 0; None for the whole zone.

    Returns
    -------
    {"mixing", "diffusivity"}
        ``"mixing"`` for a star node with `exchange_rate` (or `mixing_rate`), ``"diffusivity"`` for
        `effective_diffusivity` on the air-air faces.

    Raises
    ------
    ModelError
        When an extent or the reach is not positive and finite.

    Examples
    --------
    >>> choose_equivalent((6.0, 4.0), None), choose_equivalent((6.0, 4.0), 3.0), choose_equivalent((6.0, 4.0), 0.5)
    ('mixing', 'mixing', 'diffusivity')
    """
    for extent in zone_extent:
        _require_positive("zone_extent", extent, "m")
    if reach is None:
        return "mixing"
    _require_positive("reach", reach, "m")
    return "mixing" if max(zone_extent) <= MIXING_EXTENT * reach else "diffusivity"


def _is_symbolic(value: object) -> bool:
    return isinstance(value, casadi.SX | casadi.MX | casadi.DM)


def _exp(value: Any) -> Any:
    return casadi.exp(value) if _is_symbolic(value) else np.exp(value)


def _require_probability(value: Any) -> None:
    if not _is_symbolic(value) and not np.all((np.asarray(value) >= 0.0) & (np.asarray(value) <= 1.0)):
        raise ModelError(f"expected a shuffle probability in [0, 1], got {value}")


def _require_positive(name: str, value: float, unit: str) -> None:
    if not (0.0 < value < np.inf):
        raise ModelError(f"expected {name} > 0 and finite [{unit}], got {value}")
