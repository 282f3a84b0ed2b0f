"""Control volumes and faces of a building, as one graph."""

from thermal.network._build import build_network
from thermal.network._films import series, surface_mesh
from thermal.network._graph import GraphBuilder
from thermal.network._grid import FloorGrid, floor_grid
from thermal.network._materials import SHUFFLE_STEP
from thermal.network._network import CapacityClass, ConductanceClass, ThermalNetwork
from thermal.network._structure import BASELINE, Structure

__all__ = [
    "BASELINE",
    "SHUFFLE_STEP",
    "CapacityClass",
    "ConductanceClass",
    "FloorGrid",
    "GraphBuilder",
    "Structure",
    "ThermalNetwork",
    "build_network",
    "floor_grid",
    "series",
    "surface_mesh",
]
