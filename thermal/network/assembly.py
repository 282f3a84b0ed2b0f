"""Joining of a graph and what effects extend it by into a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import scipy.sparse as sp

from thermal._types import FloatArray, IntArray
from thermal.network.graph import GraphBuilder
from thermal.network.network import ThermalNetwork


class Extension(Protocol):
    """An effect, as the builders of a network see it."""

    def extend(self, graph: GraphBuilder) -> None:
        """Add its volumes, faces, sources and parameters to a graph whose baseline is complete.

        Parameters
        ----------
        graph : GraphBuilder
            With its anatomy.
        """


@dataclass(frozen=True)
class Blueprint:
    """A building's baseline, from which its networks with one set of effects after another are made.

    Parameters
    ----------
    graph : GraphBuilder
        Complete but for effects.
    air, zone : ndarray of int, shape (n_air,)
        Air volumes and the numbers of their zones.
    mean, share : ndarray, shape (n_air,)
        Weight of each volume in the mean of its zone, and share of the zone's heat that it gets [-].
    spacing : float, optional
        Distance between the volumes of a plan [m].
    floor_shapes : tuple of (int, int)
        Rows and columns of each floor's grid.
    """

    graph: GraphBuilder
    air: IntArray
    zone: IntArray
    mean: FloatArray
    share: FloatArray
    spacing: float | None = None
    floor_shapes: tuple[tuple[int, int], ...] = ()

    def network(self, effects: Sequence[Extension] = ()) -> ThermalNetwork:
        """Make the network with effects.

        Parameters
        ----------
        effects : sequence of Extension
            What is added to the baseline.
        """
        graph = self.graph.copy()
        for effect in effects:
            effect.extend(graph)
        shape = (graph.size, len(graph.zones))
        heating = sp.csr_matrix((self.share, (self.air, self.zone)), shape=shape)
        observation = sp.csr_matrix((self.mean, (self.zone, self.air)), shape=shape[::-1])
        return graph.finish(observation, heating, graph.anatomy.airflows, self.spacing, self.floor_shapes)
