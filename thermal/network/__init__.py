"""Control volumes and faces of a building, as one graph."""

from thermal.network._anatomy import Anatomy, OuterFaces, Room
from thermal.network._build import build_network
from thermal.network._extension import Extension
from thermal.network._films import series, surface_mesh
from thermal.network._graph import GraphBuilder
from thermal.network._grid import FloorGrid, floor_grid
from thermal.network._materials import SHUFFLE_STEP
from thermal.network._network import CapacityClass, ConductanceClass, ThermalNetwork
from thermal.network._structure import BASELINE, Structure

__all__ = [
    "BASELINE",
    "Anatomy",
    "SHUFFLE_STEP",
    "CapacityClass",
    "ConductanceClass",
    "Extension",
    "FloorGrid",
    "GraphBuilder",
    "OuterFaces",
    "Room",
    "Structure",
    "ThermalNetwork",
    "build_network",
    "floor_grid",
    "series",
    "surface_mesh",
]
