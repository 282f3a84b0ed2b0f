"""What a spin-up leaves unknown of walls, slabs and furniture: the covariance that a filter starts with."""

from __future__ import annotations

import numpy as np

from thermal._types import BoolArray, FloatArray
from thermal.model.modal import ModalModel

#: How far the mean temperatures of the weeks before the telemetry may be from those of its first day [K], standard
#: deviation. Daily means of the shared cases vary by 1.5 to 8 K outdoors and by 0.4 to 0.6 K in occupied zones (4 K in
#: a house that is heated for a test): rather wide than narrow, since measurements make it smaller and nothing larger.
ZONE_SPREAD, BOUNDARY_SPREAD = 1.5, 5.0


def start_spread(modes: ModalModel, step: float, steps: int, held: BoolArray) -> FloatArray:
    """Columns whose outer products are the covariance of the state after a spin-up, shape (r, n_column).

    A spin-up begins from the steady state of one day's mean temperatures and then holds the zones at what was measured
    (`thermal.spin_up`). The building came from other days: its state then was off by steady states of other zone and
    boundary temperatures, and what is left of them decays while the zones are held.

    Parameters
    ----------
    modes : ModalModel
        The building.
    step : float
        Step [s].
    steps : int
        Steps that the zones were held.
    held : ndarray of bool, shape (n_zone,)
        Zones that were held: those with a sensor.

    Notes
    -----
    Steady, ``k ξ = B u + H λ`` with ``O ξ = T``; held, ``(c + Δt k) ξ' = c ξ + Δt H λ`` with ``O ξ' = 0``, as in
    `thermal.spin_up`.
    """
    observe, heat, k = modes.observation[held], modes.heating[:, held], modes.conductance[:, None]
    unit = heat / k
    by_zone = unit @ np.linalg.inv(observe @ unit)
    by_boundary = modes.boundary[:, : modes.boundary.shape[1] - modes.n_signal] / k
    by_boundary = by_boundary - by_zone @ (observe @ by_boundary)
    columns = np.hstack([ZONE_SPREAD * by_zone, BOUNDARY_SPREAD * by_boundary])
    system = modes.capacity[:, None] + step * k
    stay, push = modes.capacity[:, None] / system, step * heat / system
    back = np.linalg.inv(observe @ push)
    for _ in range(steps):
        columns = stay * columns
        columns = columns - push @ (back @ (observe @ columns))
    return columns
