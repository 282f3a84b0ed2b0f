"""The layers of a surface as a chain of nodes: as fine as half an hour asks for, or lumped to a given number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermal._types import FloatArray
from thermal.case.schema import Layer

#: Time that a sublayer must resolve [s]: its thickness is at most sqrt(diffusivity x this), a Fourier number of one.
SUBLAYER_TIME = 1800.0


@dataclass(frozen=True)
class Chain:
    """Nodes between the two faces of a layered wall, per area of it.

    Parameters
    ----------
    near, far : float
        Resistance from the first face to the first node, and from the last node to the last face [m2K/W].
    between : ndarray, shape (n - 1,)
        Resistances from node to node [m2K/W].
    capacity : ndarray, shape (n,)
        Heat capacities of the nodes [J/m2/K].
    """

    near: float
    far: float
    between: FloatArray
    capacity: FloatArray

    @classmethod
    def of(cls, layers: tuple[Layer, ...], nodes: int | None = None) -> Chain:
        """Nodes of a construction, of the resistance and the heat capacity of its layers.

        Parameters
        ----------
        layers : tuple of Layer
            From one face to the other.
        nodes : int, optional
            Their number; by default each layer is cut into sublayers thin enough for `SUBLAYER_TIME`, 12 at most.
        """
        return _fine(layers) if nodes is None else _lumped(layers, nodes)


def _fine(layers: tuple[Layer, ...]) -> Chain:
    """Sublayers with a node in the middle of each."""
    resistances: list[float] = []
    capacity: list[float] = []
    for layer in layers:
        heat = layer.density * layer.heat_capacity
        depth = np.sqrt(layer.conductivity / heat * SUBLAYER_TIME)
        n = int(np.clip(np.ceil(layer.thickness / depth), 1, 12))
        resistances += [layer.thickness / n / layer.conductivity] * n
        capacity += [layer.thickness / n * heat] * n
    resistance = np.array(resistances)
    between = 0.5 * (resistance[:-1] + resistance[1:])
    return Chain(0.5 * float(resistance[0]), 0.5 * float(resistance[-1]), between, np.array(capacity))


def _lumped(layers: tuple[Layer, ...], nodes: int) -> Chain:
    """Parts that heat takes equally long to cross, each lumped where every steady state keeps the heat it holds.

    The time is ``x**2 / diffusivity``, so its root adds up over layers. In a steady state temperature is linear in the
    resistance from a face, so the node lies at the mean resistance of its part, weighted by heat capacity.
    """
    thickness, conductivity = (np.array([getattr(p, k) for p in layers]) for k in ("thickness", "conductivity"))
    heat = np.array([p.density * p.heat_capacity for p in layers])
    edges = np.concatenate([[0.0], np.cumsum(thickness * np.sqrt(heat / conductivity))])
    cuts = np.linspace(0.0, edges[-1], nodes + 1)
    points = np.union1d(edges, cuts)
    middle = 0.5 * (points[:-1] + points[1:])
    layer = np.clip(np.searchsorted(edges, middle, side="right") - 1, 0, len(layers) - 1)
    part = np.clip(np.searchsorted(cuts, middle, side="right") - 1, 0, nodes - 1)
    length = np.diff(points) / np.sqrt(heat / conductivity)[layer]
    resistance = length / conductivity[layer]
    place = np.cumsum(resistance) - 0.5 * resistance
    stored = length * heat[layer]
    capacity = np.bincount(part, stored, minlength=nodes).astype(float)
    at = np.bincount(part, stored * place, minlength=nodes) / capacity
    return Chain(float(at[0]), float(resistance.sum() - at[-1]), np.diff(at), capacity)
