"""A few nodes a zone: air, floor, walls and envelope, joined by conductances, as a discrete state space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, Self

import numpy as np

from calibration.errors import CalibrationError
from calibration.estimation.disturbance import DisturbanceModel, DisturbedSpace
from calibration.estimation.state_space import REFERENCE, StateSpace
from thermal._types import BoolArray, FloatArray

#: Nodes of a zone, in the order of the states: all air nodes first.
NODES = ("air", "floor", "wall", "envelope")

#: Start of a fit by floor area: capacities [kJ/K/m2] and conductances [W/K/m2]; an insulated house with a screed of
#: 5 cm, from densities and U-values of ISO 13790 and 6946. They only start the fit: see `SPREAD`.
CAPACITIES = {"air": 15.0, "floor": 100.0, "wall": 100.0, "envelope": 150.0}
LINKS = {"air floor": 8.0, "air wall": 6.0, "air envelope": 3.0, "envelope out": 1.0, "air out": 0.5}

#: Conductance between the air of two zones at the start [W/K/m2].
_PAIR = 1.0

#: Sunlit aperture at the start [m2/m2]: a tenth of the floor in windows that let half of the sun in.
_APERTURE = 0.05

#: Nodes that heat may go into; the envelope is heated through the others.
_HEATED = 3

#: Temperature by which the coefficient of performance of a source whose heat nobody measures is told [K], and change of
#: temperature that its slope is for [K].
COP_AT, COP_PER = 280.15, 10.0

#: Unmeasured heat at the start of its tuning: per floor area [W/m2], how long it lasts [s], and sensors' noise [K]; the
#: controller of the pilot has the same but for the time, which is longer as houses change more slowly than offices.
UNMEASURED, LASTING, NOISE = 5.0, 12 * 3600.0, 0.05


@dataclass(frozen=True, eq=False)
class GreyBox:
    """Zones of four nodes each, by the logarithms and weights that a fit finds.

    Per zone ``C dT/dt = -Σ G (T - T_j) + heat``: air is joined to floor, walls, envelope, outdoor air and the air of
    other zones; the envelope to outdoor air too. Sun enters through an aperture for each irradiance, a share of it into
    air and the rest into walls; people heat air; each source of heat gives its heat to zones and nodes by fitted shares
    (Bacher and Madsen 2011, doi:10.1016/j.enbuild.2011.02.005, for such networks).

    Parameters
    ----------
    zones : tuple of str
        Names.
    areas : ndarray, shape (n_zone,)
        Floor areas [m2].
    suns : tuple of str
        Irradiances.
    sources : tuple of str
        Sources of heat.
    serves : ndarray of bool, shape (n_source, n_zone)
        Zones that a source may heat.
    metered : tuple of bool
        Of each source, whether its heat is measured; where it is not, what it buys is given instead, and heat is that
        times ``1 + slope (T_out - 7 degC) / 10 K``: watts of heat are then counted in watts of what is bought.
    point : ndarray, shape (n_parameter,)
        Parameters in the order of `names` [-]: logarithms of J/K and W/K, m2, W, shares.
    disturbance : DisturbanceModel
        Unmeasured heat into air, and noise of the sensors.
    """

    zones: tuple[str, ...]
    areas: FloatArray
    suns: tuple[str, ...]
    sources: tuple[str, ...]
    serves: BoolArray
    metered: tuple[bool, ...]
    point: FloatArray
    disturbance: DisturbanceModel

    @classmethod
    def start(
        cls,
        areas: Mapping[str, float],
        suns: tuple[str, ...],
        sources: Mapping[str, tuple[str, ...]],
        metered: tuple[bool, ...],
    ) -> Self:
        """Make the network that a fit starts from.

        Parameters
        ----------
        areas : mapping of str to float
            Floor area of each zone [m2].
        suns : tuple of str
            Irradiances.
        sources : mapping of str to tuple of str
            Zones that each source of heat may serve.
        metered : tuple of bool
            Of each source, whether its heat is measured.

        Raises
        ------
        CalibrationError
            When there is no zone, or a source serves none.
        """
        zones, sizes = tuple(areas), np.array([*areas.values()], dtype=float)
        CalibrationError.unless(len(zones) and (sizes > 0).all(), "grey box", "zones with a floor area", dict(areas))
        serves = np.array([[zone in served for zone in zones] for served in sources.values()], dtype=bool)
        serves = serves.reshape(len(sources), len(zones))
        CalibrationError.unless(serves.any(axis=1).all(), "grey box", "a zone for each source of heat", dict(sources))
        common = DisturbanceModel(UNMEASURED * sizes, LASTING, NOISE)
        bare = cls(zones, sizes, suns, tuple(sources), serves, metered, np.empty(0), common)
        return replace(bare, point=bare.centre)

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Number of parameters of each kind, in their order."""
        nz, nm = len(self.zones), len(self.sources)
        return {
            **{f"capacity of {node}": nz for node in NODES},
            **{f"conductance {link}": nz for link in LINKS},
            "conductance between zones": len(self.pairs),
            "aperture": nz * len(self.suns),
            "sun into air": nz if self.suns else 0,
            "share of nodes": nm * (_HEATED - 1),
            "share of zones": int(self.serves.sum()) if nz > 1 else 0,
            "slope of heat": sum(not m for m in self.metered),
            "constant gain": nz,
        }

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Zones whose air is joined: all of them."""
        return [*combinations(range(len(self.zones)), 2)]

    @cached_property
    def centre(self) -> FloatArray:
        """Point that a fit starts from and is drawn to, shape (n_parameter,)."""
        mean = float(self.areas.mean())
        values = [np.log(1e3 * CAPACITIES[node] * self.areas) for node in NODES]
        values += [np.log(size * self.areas) for size in LINKS.values()]
        values += [np.full(len(self.pairs), np.log(_PAIR * mean))]
        values += [np.repeat(_APERTURE * self.areas, len(self.suns)) / max(len(self.suns), 1)]
        rest = [*self.sizes.values()][len(values) :]
        return np.concatenate([*values, *(np.zeros(count) for count in rest)])

    @cached_property
    def scale(self) -> FloatArray:
        """How far parameters may be from `centre` without a reason [as the parameters], shape (n_parameter,)."""
        mean = float(self.areas.mean())
        spreads = {"aperture": 2.0 * _APERTURE * mean, "slope of heat": 0.3, "constant gain": UNMEASURED * mean}
        return np.concatenate([np.full(count, spreads.get(kind, 1.5)) for kind, count in self.sizes.items()])

    @cached_property
    def lowest(self) -> FloatArray:
        """Lower ends of the parameters [as the parameters], shape (n_parameter,): apertures are not negative."""
        return np.concatenate(
            [np.full(n, 0.0) if kind == "aperture" else np.full(n, -np.inf) for kind, n in self.sizes.items()]
        )

    @cached_property
    def parts(self) -> dict[str, FloatArray]:
        """Parameters by kind."""
        edges = np.cumsum([*self.sizes.values()])[:-1]
        return dict(zip(self.sizes, np.split(self.point, edges), strict=True))

    @cached_property
    def capacity(self) -> FloatArray:
        """Capacity of each node, shape (4 n_zone,) [J/K]."""
        return np.asarray(np.exp(np.concatenate([self.parts[f"capacity of {node}"] for node in NODES])))

    @cached_property
    def _conductance(self) -> tuple[FloatArray, FloatArray]:
        """Matrix K [W/K], shape (4 n_zone, 4 n_zone), and what joins each node to outdoor air, shape (4 n_zone,)."""
        nz, parts = len(self.zones), self.parts
        size, each = 4 * nz, np.arange(nz)
        matrix, out = np.zeros((size, size)), np.zeros(size)

        def join(a: Any, b: Any, value: FloatArray) -> None:
            np.add.at(matrix, (a, a), value)
            np.add.at(matrix, (b, b), value)
            np.add.at(matrix, (a, b), -value)
            np.add.at(matrix, (b, a), -value)

        for k, node in enumerate(NODES[1:], 1):
            join(each, k * nz + each, np.exp(parts[f"conductance air {node}"]))
        if self.pairs:
            a, b = np.array(self.pairs).T
            join(a, b, np.exp(parts["conductance between zones"]))
        out[:nz] = np.exp(parts["conductance air out"])
        out[3 * nz :] = np.exp(parts["conductance envelope out"])
        return matrix + np.diag(out), out

    @cached_property
    def shares(self) -> FloatArray:
        """Share of each source's heat that each node gets, shape (4 n_zone, n_source) [-]; columns sum up to 1."""
        nz, nm = len(self.zones), len(self.sources)
        logits = np.hstack([self.parts["share of nodes"].reshape(nm, -1), np.zeros((nm, 1))])
        nodes = np.exp(logits - logits.max(axis=1, keepdims=True))
        nodes /= nodes.sum(axis=1, keepdims=True)
        weights = np.zeros((nm, nz))
        weights[self.serves] = np.exp(self.parts["share of zones"]) if nz > 1 else 1.0
        weights *= self.areas
        weights /= weights.sum(axis=1, keepdims=True)
        whole = np.zeros((4 * nz, nm))
        whole[: _HEATED * nz] = np.einsum("mk,mz->kzm", nodes, weights).reshape(_HEATED * nz, nm)
        return np.asarray(whole)

    @cached_property
    def emitter_weights(self) -> FloatArray:
        """Weights of the nodes in what each source heats, shape (4 n_zone, n_source) [-]: floors, by what zones get."""
        nz, by_zone = len(self.zones), self.shares.reshape(4, len(self.zones), -1).sum(axis=0)
        weights = np.zeros(self.shares.shape)
        weights[nz : 2 * nz] = by_zone / by_zone.sum(axis=0)
        return np.asarray(weights)

    def emitter(self, states: FloatArray) -> FloatArray:
        """Temperature of what each source heats, shape (..., n_source) [K].

        Parameters
        ----------
        states : ndarray, shape (..., n)
            Nodes less the reference first [K]; what follows them is passed over.
        """
        return np.asarray(REFERENCE + states[..., : self.capacity.size] @ self.emitter_weights)

    @cached_property
    def input_matrix(self) -> FloatArray:
        """Heat of each node by outdoor air [W/K], irradiances [m2], sources [-] and heat of the zones [-]."""
        nz, parts = len(self.zones), self.parts
        sun = np.zeros((4 * nz, len(self.suns)))
        if self.suns:
            aperture = parts["aperture"].reshape(nz, -1)
            into = 1.0 / (1.0 + np.exp(-parts["sun into air"]))[:, None]
            sun[:nz], sun[2 * nz : 3 * nz] = into * aperture, (1.0 - into) * aperture
        air = np.vstack([np.eye(nz), np.zeros((3 * nz, nz))])
        return np.hstack([self._conductance[1][:, None], sun, self.shares, air])

    def space(self, step: float) -> StateSpace:
        """Step exactly with inputs that hold, states the temperatures of the nodes.

        Parameters
        ----------
        step : float
            Length of a step [s].
        """
        nz = len(self.zones)
        matrix, push = self._conductance[0], self.input_matrix
        root = 1.0 / np.sqrt(self.capacity)
        rate, modes = np.linalg.eigh(root[:, None] * matrix * root)
        rate = np.maximum(rate, 1e-12)
        into, back = modes.T / root, root[:, None] * modes
        decay = np.exp(-rate * step)
        mean = -np.expm1(-rate * step) / (rate * step)
        pushed = modes.T @ (root[:, None] * push)
        transition, drive = (back * decay) @ into, back @ ((mean * step)[:, None] * pushed)
        seen, through = (back * mean)[:nz] @ into, back[:nz] @ (((1.0 - mean) / rate)[:, None] * pushed)
        return StateSpace(step, transition, drive, seen, through, np.eye(nz, 4 * nz), np.ones(4 * nz), np.eye(4 * nz))

    def disturbed(self, step: float) -> DisturbedSpace:
        """Give the state space with the unmeasured heat of each zone as a further state.

        Parameters
        ----------
        step : float
            Length of a step [s].
        """
        return DisturbedSpace(self.space(step), self.disturbance)

    def delivered(self, heat: FloatArray, outdoor: FloatArray) -> FloatArray:
        """Heat of the sources, shape (..., n_source) [W]: as measured, or of what is bought.

        Parameters
        ----------
        heat : ndarray, shape (..., n_source)
            As measured, or what is bought [W].
        outdoor : ndarray, shape (...)
            Temperature of outdoor air [K].
        """
        return np.asarray(heat * (1.0 + self.slopes * (np.asarray(outdoor)[..., None] - COP_AT) / COP_PER))

    @cached_property
    def slopes(self) -> FloatArray:
        """Slope of heat over what is bought, shape (n_source,) [-]; 0 where heat is measured."""
        slopes = np.zeros(len(self.sources))
        slopes[~np.array(self.metered, dtype=bool)] = self.parts["slope of heat"]
        return slopes

    @cached_property
    def heat_loss(self) -> FloatArray:
        """Steady heat that each zone loses to outdoor air, shape (n_zone,) [W/K]: of air, and through its envelope."""
        parts = self.parts
        inner, outer = (np.exp(parts[f"conductance {link}"]) for link in ("air envelope", "envelope out"))
        return np.asarray(np.exp(parts["conductance air out"]) + inner * outer / (inner + outer))

    @cached_property
    def time_constants(self) -> FloatArray:
        """Time constants, the slowest first, shape (4 n_zone,) [s]."""
        root = 1.0 / np.sqrt(self.capacity)
        return np.asarray(1.0 / np.maximum(np.linalg.eigvalsh(root[:, None] * self._conductance[0] * root), 1e-12))

    def to_dict(self) -> dict[str, Any]:
        """Values for a file, from which `from_dict` makes the same network."""
        return {
            "zones": list(self.zones), "areas": self.areas.tolist(), "suns": list(self.suns),
            "sources": list(self.sources), "serves": self.serves.tolist(), "metered": list(self.metered),
            "point": self.point.tolist(), "disturbance": self.disturbance.to_dict(),
        }  # fmt: skip

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Make a network of what `to_dict` wrote.

        Parameters
        ----------
        content : mapping
            Of a file.

        Raises
        ------
        CalibrationError
            When something is missing, or does not fit.
        """
        try:
            zones, sources = tuple(content["zones"]), tuple(content["sources"])
            made = cls(
                zones, np.array(content["areas"], dtype=float), tuple(content["suns"]), sources,
                np.array(content["serves"], dtype=bool).reshape(len(sources), len(zones)), tuple(content["metered"]),
                np.array(content["point"], dtype=float), DisturbanceModel(**content["disturbance"]),
            )  # fmt: skip
            fits = made.point.shape == (sum(made.sizes.values()),) and bool(np.isfinite(made.point).all())
        except (KeyError, TypeError, ValueError) as error:
            raise CalibrationError("grey box", "what `buildingmpc identify` writes", repr(error)) from error
        CalibrationError.unless(fits, "grey box: point", f"{sum(made.sizes.values())} numbers", made.point.shape)
        return made
