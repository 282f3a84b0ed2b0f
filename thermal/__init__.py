"""A building as a thermal system: cases, control volumes and faces, the symbolic model and what steps it."""

from thermal.case import (
    Building,
    Case,
    FloorPlan,
    FloorPlans,
    Telemetry,
    ZoneTable,
    load_case,
    local_timestamp,
    save_case,
)
from thermal.data import load_bundled_case
from thermal.errors import CaseError, ModelError, PlanError, ThermalError
from thermal.model import Inputs, Simulator, SymbolicModel, free_runs, reduced_model, replay_inputs, simulate, spin_up
from thermal.network import Structure, ThermalNetwork, build_network
from thermal.parameters import PARAMETERS, Parameter

__all__ = [
    "PARAMETERS",
    "Building",
    "Case",
    "CaseError",
    "FloorPlan",
    "FloorPlans",
    "Inputs",
    "ModelError",
    "Parameter",
    "PlanError",
    "Simulator",
    "Structure",
    "SymbolicModel",
    "Telemetry",
    "ThermalError",
    "ThermalNetwork",
    "ZoneTable",
    "build_network",
    "free_runs",
    "load_bundled_case",
    "load_case",
    "local_timestamp",
    "reduced_model",
    "replay_inputs",
    "save_case",
    "simulate",
    "spin_up",
]
