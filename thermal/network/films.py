"""Conductances of faces as expressions of the parameters: series resistances and the star-mesh of a surface."""

from __future__ import annotations

from typing import Any


def series(*conductances: Any) -> Any:
    """Conductance of conductances in series, ``1 / Σ 1/g``.

    Parameters
    ----------
    *conductances : float or casadi.SX
        Conductances per area [W/m2/K], positive.

    Returns
    -------
    float or casadi.SX
        Conductance per area [W/m2/K].
    """
    return 1.0 / sum(1.0 / g for g in conductances)


def surface_mesh(film: Any, radiant: Any, solid: Any) -> tuple[Any, Any, Any]:
    """Eliminate the massless surface where film, radiation and solid meet (star-mesh transform).

    A surface at ``T_s`` exchanges ``h_c (T_air - T_s)`` with the air, ``h_r (T_rad - T_s)`` with the zone's radiant
    node and
    ``g (T_solid - T_s)`` with the solid behind it. Without its own mass the three become three direct conductances,
    exactly
    (Kirchhoff; e.g. Desoer & Kuh, Basic Circuit Theory, 1969, ch. 2):
    ``g_ij = g_i g_j / (h_c + h_r + g)``.

    Parameters
    ----------
    film, radiant, solid : float or casadi.SX
        ``h_c``, ``h_r`` and ``g`` [W/m2/K], positive.

    Returns
    -------
    tuple
        Conductances air-solid, radiant-solid, air-radiant per area [W/m2/K].
    """
    total = film + radiant + solid
    return film * solid / total, radiant * solid / total, film * radiant / total
