"""What adds physics to the baseline: the seam between the network's builders and the catalogue of effects."""

from __future__ import annotations

from typing import Protocol

from thermal.network.graph import GraphBuilder


class Extension(Protocol):
    """An effect, as the builders of a network see it."""

    def extend(self, graph: GraphBuilder) -> None:
        """Add its volumes, faces, sources and parameters to a graph whose baseline is complete.

        Parameters
        ----------
        graph : GraphBuilder
            With its anatomy.
        """
