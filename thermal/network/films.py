"""Films that follow the wind and the heat of a zone, by textbook correlations times their fitted factors.

A film coefficient is a parameter; what the film differs from it by acts as heat, so that the model stays linear, and no
parameter is added. Outside, it does so at the temperatures that a steady state gives the faces: ``θ ∂κ/∂θ (f(t) - 1)
(T_second - T_first)`` for each face whose conductance κ depends on the film. Inside, natural convection grows with the
difference that the zone's heat itself makes between its air and its surfaces, and takes more of strong heat to them.
"""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from thermal._types import FloatArray
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal
from thermal.network.graph import GraphBuilder
from thermal.network.structure import RATED_OUTSIDE_FILM
from thermal.network.topology import NATURAL, NaturalConvection

#: Outside film ``4 + 4 v`` [W/m2/K] (ISO 6946:2017, Annex C).
_STILL, _BY_WIND = 4.0, 4.0

#: Natural convection at a wall, turbulent: ``1.31 |ΔT|^(1/3)`` [W/m2/K] (ASHRAE Fundamentals 2017, ch. 4; EnergyPlus'
#: TARP), so that heat grows with the power 4/3 of the difference.
_AT_ONE_KELVIN = 1.31

#: Difference between a zone's air and its surfaces that the film coefficient is estimated for [K]: natural convection
#: is then 2.1 W/m2/K. On nulls of EnergyPlus (practice cases, offices of two makers, reference buildings) it hardly
#: matters: at 3 and 5.3 K the evidence is that of 4 K within 4 for 15 of 16.
_DIFFERENCE = 4.0

#: Share of the temperature difference, and conductance [W/K], that count as none.
_LEAST = 1e-6

#: Parameters that hold an outside film, and what they change by when it grows e-fold, of their value. A window's
#: u-value holds the rated film: ``1/u = R + 1/h_e``.
_OUTSIDE: dict[str, Callable[[ca.SX], ca.SX]] = {
    "exterior_convection_coefficient": lambda film: film,
    "window_u_value": lambda u_value: u_value**2 / RATED_OUTSIDE_FILM,
}


def add_wind(graph: GraphBuilder) -> None:
    """Let the outside films of a complete baseline follow the wind.

    Parameters
    ----------
    graph : GraphBuilder
        The baseline without effects.
    """
    share = _shares(graph)
    signal = Signal("wind on films", "K", _wind, ("wind", "outdoor", "usual"))
    own = [(symbol, _OUTSIDE[p.base](symbol)) for p, symbol in graph.parameters if p.base in _OUTSIDE]
    for key, value, first, second, weight in graph.classes():
        moved = [step * ca.jacobian(value, symbol) for symbol, step in own if ca.depends_on(value, symbol)]
        drop = share[second] - share[first]
        for node, sign in ((first, 1.0), (second, -1.0)) if moved else ():
            there = (np.abs(drop) > _LEAST) & (node >= 0)
            if there.any():
                heat = (sign * drop * weight)[there]
                graph.source(f"films {key} {sign:+g}", sum(moved[1:], moved[0]), node[there], signal, heat)


def add_natural_convection(graph: GraphBuilder) -> None:
    """Let the inside films of a complete baseline follow the heat that devices give to the air of each zone.

    Heat q of a zone's air goes on to its surfaces within minutes. Through films of one coefficient h it makes a
    difference of ``q / (h A)`` between the two, by natural convection one of ``(q / q_h)^(3/4)`` of that at the heat
    q_h for which h is the film. So ``q - q_h^(1/4) |q|^(3/4)`` of it passes to the surfaces at once. Where devices give
    their heat to surfaces too, the films stay as they are.

    Parameters
    ----------
    graph : GraphBuilder
        The baseline without effects, with its emitters.
    """
    for room in list(graph.anatomy.rooms.values()):
        if room.radiant < 0 or room.emitted:
            continue
        air = np.append(room.air, room.mean)
        touching = graph.touching(np.array([room.radiant]))
        surface = sum(weight[np.isin(far, air) & (far >= 0)].sum() for _, _, far, weight in touching)
        own = float(_AT_ONE_KELVIN * _DIFFERENCE**NATURAL * surface)
        convection = NaturalConvection(room.name, own)
        graph.anatomy.rooms[room.name] = replace(room, convection=convection)
        signal = convection.signal
        graph.source(f"natural convection from the air of {room.name}", -1.0, room.air, signal, room.share)
        graph.source(f"natural convection to surfaces of {room.name}", 1.0, room.radiant, signal, 1.0)


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
