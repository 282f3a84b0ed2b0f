"""Baseline structures to choose between: what a zone holds, and how many masses stand in a row."""

from __future__ import annotations

from dataclasses import dataclass

from thermal.errors import ModelError

#: Most nodes of a chain: through 0.2 m of concrete 100 of them resolve seconds, more than any telemetry.
MOST_NODES = 100


@dataclass(frozen=True)
class Structure:
    """What a model of the baseline is made of, beside its geometry; equations (24) to (28) of the model's page.

    Parameters
    ----------
    furniture : bool
        Interior mass of furniture, one node a zone.
    slab_nodes : int
        Nodes of a plan's floor and ceiling slabs, 0 to 100; 0 leaves them out. The floors and ceilings of a zone
        table are surfaces that it declares, so they stay, with `wall_nodes`.
    wall_nodes : int or None
        Mass nodes through an exterior wall of a plan, at least, and through each layered surface of a zone table,
        exactly; 1 to 100. None is one in a plan's cell, and as many in a zone table as resolve half an hour.
    radiant : bool
        A radiant node a zone, with convection and radiation apart; else one combined film between air and surface.

    Raises
    ------
    ModelError
        When a field is of another type or outside its range.

    Examples
    --------
    >>> Structure.paper()
    Structure(furniture=False, slab_nodes=0, wall_nodes=1, radiant=False)
    """

    furniture: bool = True
    slab_nodes: int = 2
    wall_nodes: int | None = None
    radiant: bool = True

    def __post_init__(self) -> None:
        for name in ("furniture", "radiant"):
            if not isinstance(getattr(self, name), bool):
                raise ModelError(f"structure.{name}: expected true or false, came {getattr(self, name)!r}")
        for name, least in (("slab_nodes", 0), ("wall_nodes", 1)):
            value = getattr(self, name)
            if name == "wall_nodes" and value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= MOST_NODES:
                raise ModelError(
                    f"structure.{name}: expected a whole number from {least} to {MOST_NODES}, came {value!r}"
                )

    @classmethod
    def paper(cls) -> Structure:
        """Structure of the paper: air and walls only, one node through a wall, one film between the two."""
        return cls(furniture=False, slab_nodes=0, wall_nodes=1, radiant=False)


#: Structure of the baseline, unless another is asked for.
BASELINE = Structure()
