"""One entry for both kinds of geometry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from thermal.case.building import Building, ZoneTable
from thermal.network.assembly import Blueprint
from thermal.network.extension import Extension
from thermal.network.network import ThermalNetwork
from thermal.network.plan import plan_blueprint
from thermal.network.structure import BASELINE, Structure
from thermal.network.table import table_blueprint
from thermal.parameters import Scope


def build_network(
    building: Building,
    dx: float | None = None,
    reach: float | None = None,
    scopes: Mapping[str, Scope] | None = None,
    diffusers: Mapping[str, NDArray[np.bool_]] | None = None,
    mean_shuffle: bool = True,
    structure: Structure = BASELINE,
    effects: Sequence[Extension] = (),
) -> ThermalNetwork:
    """Build the control volumes and faces of a building, from floor plans or from a zone table.

    Parameters
    ----------
    building : Building
        What the case folder describes.
    dx : float, optional
        Distance between control volumes of a plan [m]; its cell size by default. A zone table has none and ignores it.
    reach : float, optional
        Reach of the shuffle [m]; None is the whole zone.
    scopes : mapping of str to {"global", "facade", "zone"}, optional
        Parameters with one value a facade or a zone; the others are global. Facades are the plan's sides, in a zone
        table the direction nearest to a surface's azimuth, and ``roof`` and ``floor`` where those look outdoors.
    diffusers : mapping of str to ndarray of bool, optional
        Cells with a diffuser, per zone, at the plan's resolution; all air cells by default.
    mean_shuffle : bool
        Whether the mean of the shuffle is a term of K; off for a simulator that shuffles at random.
    structure : Structure
        What the model is made of beside its geometry: furniture, slabs, nodes of a wall, radiant node.
    effects : sequence of Extension
        What is added to the baseline: effects of the catalogue, `thermal.effects.chosen`.

    Returns
    -------
    ThermalNetwork
        The baseline of the architecture (no sun, sky, leakage, gains, exchange between floors, ground or roof) and
        the effects.

    Raises
    ------
    ModelError
        When a cell size, a scope, a mask of diffusers or the structure does not fit the building.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.network.structure import Structure
    >>> building = load_bundled_case().building
    >>> network = build_network(building, dx=1.0, scopes={"window_u_value": "facade"}, structure=Structure.paper())
    >>> [p.member for p in network.parameters if p.base == "window_u_value"]
    ['north', 'south', 'west', 'east']
    """
    return blueprint(building, dx, reach, scopes, diffusers, mean_shuffle, structure).network(effects)


def blueprint(
    building: Building,
    dx: float | None = None,
    reach: float | None = None,
    scopes: Mapping[str, Scope] | None = None,
    diffusers: Mapping[str, NDArray[np.bool_]] | None = None,
    mean_shuffle: bool = True,
    structure: Structure = BASELINE,
) -> Blueprint:
    """Build the baseline of a building once, for networks with many sets of effects.

    Parameters
    ----------
    building : Building
        What the case folder describes.
    dx, reach : float, optional
        Distance between control volumes, and reach of the shuffle [m]; see `build_network`.
    scopes, diffusers, mean_shuffle, structure
        As in `build_network`.

    Returns
    -------
    Blueprint
        Its `network` is that of `build_network`.

    Raises
    ------
    ModelError
        When a cell size, a scope, a mask of diffusers or the structure does not fit the building.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.effects.catalogue import chosen
    >>> baseline = blueprint(load_bundled_case().building, dx=1.0)
    >>> len(baseline.network().signals), len(baseline.network(chosen({"solar_gain": ()})).signals) > 0
    (0, True)
    """
    geometry = building.geometry
    if isinstance(geometry, ZoneTable):
        return table_blueprint(building, geometry, scopes, structure)
    return plan_blueprint(building, geometry, dx, reach, scopes, diffusers, mean_shuffle, structure)
