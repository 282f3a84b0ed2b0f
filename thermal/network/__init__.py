"""Control volumes and faces of a building, as one graph."""

from thermal.network.topology import UPWARD, Anatomy, OuterFaces, Outlook, Room
from thermal.network.assembly import Blueprint
from thermal.network.build import blueprint, build_network
from thermal.network.extension import Extension
from thermal.network.films import series, surface_mesh
from thermal.network.graph import GraphBuilder
from thermal.network.grid import FloorGrid, floor_grid
from thermal.network.materials import RATED_OUTSIDE_FILM, SHUFFLE_STEP
from thermal.network.network import CapacityClass, ConductanceClass, ThermalNetwork
from thermal.network.structure import BASELINE, Structure

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
