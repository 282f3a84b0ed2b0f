"""Films that follow the wind and the temperature difference, by textbook correlations times their fitted factors.

A film coefficient is a parameter; what it differs from its mean by acts as heat at the temperatures that a steady state
gives its faces, so that the model stays linear: ``θ ∂κ/∂θ (f(t) - 1) (T_second - T_first)`` for each face whose
conductance κ depends on it. No parameter is added.
"""

from collections.abc import Callable

import casadi as ca
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from thermal._types import FloatArray
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal
from thermal.network.graph import GraphBuilder
from thermal.network.structure import RATED_OUTSIDE_FILM, Structure

#: Outside film ``4 + 4 v`` [W/m2/K] (ISO 6946:2017, Annex C).
_STILL, _BY_WIND = 4.0, 4.0

#: Power of the temperature difference that natural convection at a wall follows, turbulent [-] (Alamdari and Hammond
#: 1983, doi:10.1177/014362448300400304; EnergyPlus' TARP), and the difference that a film's own value is for [K].
_POWER, _DIFFERENCE = 1.0 / 3.0, 10.0

#: Share of the temperature difference, and conductance [W/K], that count as none.
_LEAST = 1e-6

#: Parameters that hold a film, outside and inside, and what they change by when it grows e-fold, of their value. A
#: window's u-value holds the rated film: ``1/u = R + 1/h_e``.
_OUTSIDE: dict[str, Callable[[ca.SX], ca.SX]] = {
    "exterior_convection_coefficient": lambda film: film,
    "window_u_value": lambda u_value: u_value**2 / RATED_OUTSIDE_FILM,
}
_INSIDE: dict[str, Callable[[ca.SX], ca.SX]] = {"interior_film_coefficient": lambda film: film}


def add_films(graph: GraphBuilder, structure: Structure) -> None:
    """Let the films of a complete baseline follow the wind, the temperature difference, or both.

    Parameters
    ----------
    graph : GraphBuilder
        The baseline without effects.
    structure : Structure
        Says which films do.
    """
    share = _shares(graph)
    by_wind = Signal("wind on films", "K", _wind, ("wind", "outdoor", "usual"))
    by_difference = Signal("natural convection", "K", _convection, ("outdoor", "usual"))
    chosen = [(structure.wind_films, _OUTSIDE, by_wind), (structure.natural_films, _INSIDE, by_difference)]
    for films, signal in ((films, signal) for wanted, films, signal in chosen if wanted):
        own = [(symbol, films[p.base](symbol)) for p, symbol in graph.parameters if p.base in films]
        for key, value, first, second, weight in graph.classes():
            moved = [step * ca.jacobian(value, symbol) for symbol, step in own if ca.depends_on(value, symbol)]
            drop = share[second] - share[first]
            for node, sign in ((first, 1.0), (second, -1.0)) if moved else ():
                there = (np.abs(drop) > _LEAST) & (node >= 0)
                if there.any():
                    heat = (sign * drop * weight)[there]
                    graph.source(f"films {key} {sign:+g}", sum(moved[1:], moved[0]), node[there], signal, heat)


def _shares(graph: GraphBuilder) -> FloatArray:
    """Share of the temperature difference to outdoors that each node keeps with the zones' air at 1, outdoors last."""
    symbols, faces = ca.vertcat(*[symbol for _, symbol in graph.parameters]), graph.classes()
    values = ca.Function("values", [symbols], [ca.vertcat(*[value for _, value, *_ in faces])])
    kappa = np.array(values([p.start for p, _ in graph.parameters])).ravel()
    n, total = graph.size, graph.size + len(graph.boundaries)
    ends = [np.concatenate([face[k] for face in faces]) for k in (2, 3)]
    weight = np.concatenate([k * face[4] for k, face in zip(kappa, faces, strict=True)])
    joined = sp.csr_matrix((weight, tuple(np.where(e < 0, n - 1 - e, e) for e in ends)), shape=(total, total))
    joined = joined + joined.T
    rooms = graph.anatomy.rooms.values()
    air = np.concatenate([np.append(r.air, r.mean) if r.mean >= 0 else r.air for r in rooms])
    free = np.setdiff1d(np.arange(n), air)
    held = np.setdiff1d(np.arange(total), free)
    share = np.ones(total)
    share[n - 1 - graph.boundary("outdoor")] = 0.0
    inner = sp.diags(np.asarray(joined.sum(axis=1)).ravel()[free] + _LEAST) - joined[free][:, free]
    share[free] = sla.splu(inner.tocsc()).solve(joined[free][:, held] @ share[held])
    return np.concatenate([share[:n], share[n:][::-1]])  # codes of boundaries count from the end


def _apart(inputs: InputProvider) -> FloatArray:
    """How much warmer the building usually is than it is outdoors, shape (n_time,) [K]."""
    return np.asarray(inputs.usual.mean(axis=1) - inputs.outdoor)


def _wind(inputs: InputProvider) -> FloatArray:
    film, mean = (_STILL + _BY_WIND * v for v in (inputs.wind, inputs.normalisation.wind or 0.0))
    return np.asarray((film / mean - 1.0) * _apart(inputs))


def _convection(inputs: InputProvider) -> FloatArray:
    apart = _apart(inputs)
    return np.asarray(((np.abs(apart) / _DIFFERENCE) ** _POWER - 1.0) * apart)
