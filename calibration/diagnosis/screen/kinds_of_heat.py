"""Kinds of heat of unknown cause that may be missing: what it answers to, in which zones, how large it may be."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calibration.diagnosis.screen.unknown_heat import DailyErrors
from thermal._types import FloatArray
from thermal.effects.effect import Chosen
from thermal.effects.unknown import OUTER, PLANES, SUN, UNKNOWN, tied
from thermal.network.topology import VERTICAL, Anatomy, direction_of


@dataclass(frozen=True)
class Kind:
    """Heat of one kind in some zones, one strength a signal for all of them, as large as the evidence has it.

    Parameters
    ----------
    effect : str
        Key of `UNKNOWN`.
    weights : mapping of str to ndarray, shape (n_signal,)
        Its heat by the floor area in every zone, over that of the strengths [-].
    how : str
        By floor area or by outer area.
    joined : bool
        Whether all signals share one strength, as the sun on all facades does.
    tightness : float
        Plausible heat over that of `UNKNOWN` [-].
    """

    effect: str
    weights: Mapping[str, FloatArray]
    how: str = "floor"
    joined: bool = False
    tightness: float = 1.0

    @property
    def name(self) -> str:
        """What its parameters are called by."""
        return f"{self.effect} by the {self.how} of {', '.join(self.weights)}"

    @property
    def chosen(self) -> Chosen:
        """The effect, with strengths that its zones share."""
        return Chosen(tied(self.effect, self.name, self.weights, self.tightness, self.joined))


def candidates(table: DailyErrors, anatomy: Anatomy) -> list[Kind]:
    """Every kind of heat in every group of zones by the floor area, and what comes from outdoors by the outer area.

    Parameters
    ----------
    table : DailyErrors
        With the kinds that the case can tell.
    anatomy : Anatomy
        Of the building.
    """
    found: list[Kind] = []
    for effect in table.kinds:
        count = len(UNKNOWN[effect].parameters)
        found.extend(Kind(effect, dict.fromkeys(zones, np.ones(count))) for zones in _groups(anatomy))
        if effect == SUN:
            found.extend(_sunlit(anatomy))
        elif effect in OUTER:
            walls = {zone: np.array([sum(areas)]) for zone, areas in _outer(anatomy).items() if any(areas)}
            found.extend([Kind(effect, _by_floor(anatomy, walls), "outer area")] if walls else [])
    return found


def _sunlit(anatomy: Anatomy) -> list[Kind]:
    """Sun on the outer area with a strength a plane, and with one for all of it, for all facades, for all windows."""
    outer, windows = _outer(anatomy), {zone: [0.0] * len(PLANES) for zone in anatomy.rooms}
    for pane in anatomy.panes:
        for k, (azimuth, tilt) in enumerate(PLANES):
            if tilt > 0.0 and direction_of(pane.azimuth) == direction_of(azimuth):
                windows[pane.zone][k] += pane.area
    walls = {
        zone: [a * (tilt > 0.0) for a, (_, tilt) in zip(areas, PLANES, strict=True)] for zone, areas in outer.items()
    }
    kinds = (
        ("outer area", outer, False),
        ("outer area", outer, True),
        ("facades", walls, True),
        ("windows", windows, True),
    )
    found = []
    for how, areas, joined in kinds:
        there = {zone: np.array(area) for zone, area in areas.items() if any(area)}
        if there:
            found.append(Kind(SUN, _by_floor(anatomy, there), f"{how}{' at once' if joined else ''}", joined))
    return found


def _outer(anatomy: Anatomy) -> dict[str, list[float]]:
    """Outer area of every zone on each plane of the sun [m2]."""
    found = {zone: [0.0] * len(PLANES) for zone in anatomy.rooms}
    for k, (azimuth, tilt) in enumerate(PLANES):
        if tilt < VERTICAL / 2.0:
            for zone, area in anatomy.under_roof.items():
                found[zone][k] += area
        else:
            for (zone, side), area in anatomy.facades.items():
                found[zone][k] += area * (direction_of(side) == direction_of(azimuth))
    return found


def _by_floor(anatomy: Anatomy, areas: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Areas over the floor's, over the mean of that over these zones [-]."""
    found = {zone: area / anatomy.rooms[zone].floor_area for zone, area in areas.items()}
    mean = float(np.mean([a.sum() for a in found.values()]))
    return {zone: ratio / mean for zone, ratio in found.items()}


def _groups(anatomy: Anatomy) -> list[tuple[str, ...]]:
    """Zones that may have something in common: every one, all, those outside, inside, on the ground, under the roof."""
    zones = tuple(anatomy.rooms)
    outside = {zone for zone, _ in anatomy.facades}
    parts = [
        zones, [z for z in zones if z in outside], [z for z in zones if z not in outside],
        [z for z in zones if z in anatomy.on_ground], [z for z in zones if z in anatomy.under_roof],
    ]  # fmt: skip
    return list(dict.fromkeys([*((z,) for z in zones), *(tuple(part) for part in parts if part)]))


def evidence(table: DailyErrors, kind: Kind, left: FloatArray, pull: FloatArray) -> float:
    """Logarithm of the Bayes factor of some heat, where errors are normal and of known size [-].

    Parameters
    ----------
    table : DailyErrors
        Whose parameters are meant.
    kind : Kind
        The heat.
    left : ndarray, shape (n_parameter, n_parameter)
        Products of the derivatives that the model's own parameters cannot imitate, over the errors' size [-].
    pull : ndarray, shape (n_parameter,)
        Products of these and of the errors, with the sign by which these fall [-].
    """
    names = [p.name for p in UNKNOWN[kind.effect].parameters]
    basis = np.zeros((len(table.parameters), len(names)))
    for i, p in enumerate(table.parameters):
        if p.effect == kind.effect and (zone := str(p.member)) in kind.weights:
            signal = names.index(p.base)
            basis[i, signal] = kind.tightness * p.prior_deviation * kind.weights[zone][signal]
    if kind.joined:
        basis = basis.sum(axis=1, keepdims=True)
    hessian, score = basis.T @ left @ basis + np.eye(basis.shape[1]), pull @ basis
    inside = np.ones(basis.shape[1], dtype=bool)
    while kind.effect == SUN and inside.any():  # the sun takes no heat away
        below = np.flatnonzero(inside)[np.linalg.solve(hessian[np.ix_(inside, inside)], score[inside]) < 0.0]
        if not below.size:
            break
        inside[below] = False
    hessian, score = hessian[np.ix_(inside, inside)], score[inside]
    return float(0.5 * score @ np.linalg.solve(hessian, score) - 0.5 * np.linalg.slogdet(hessian)[1])
