"""Control volumes and faces of a building, as one graph."""

from thermal.network._anatomy import UPWARD, Anatomy, OuterFaces, Outlook, Room
from thermal.network._blueprint import Blueprint
from thermal.network._build import blueprint, build_network
from thermal.network._extension import Extension
from thermal.network._films import series, surface_mesh
from thermal.network._graph import GraphBuilder
from thermal.network._grid import FloorGrid, floor_grid
from thermal.network._materials import RATED_OUTSIDE_FILM, SHUFFLE_STEP
from thermal.network._network import CapacityClass, ConductanceClass, ThermalNetwork
from thermal.network._structure import BASELINE, Structure

__all__ = [
    "BASELINE",
    "RATED_OUTSIDE_FILM",
    "SHUFFLE_STEP",
    "UPWARD",
    "Anatomy",
    "Blueprint",
    "CapacityClass",
    "ConductanceClass",
    "Extension",
    "FloorGrid",
    "GraphBuilder",
    "OuterFaces",
    "Outlook",
    "Room",
    "Structure",
    "ThermalNetwork",
    "blueprint",
    "build_network",
    "floor_grid",
    "series",
    "surface_mesh",
]
