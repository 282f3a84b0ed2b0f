"""A building as a thermal system: cases, control volumes and faces, the symbolic model and what steps it."""

from thermal.case.building import Building, FloorPlan, FloorPlans, ZoneTable
from thermal.case.case import Case, local_timestamp
from thermal.case.load import load_case
from thermal.case.save import save_case
from thermal.case.telemetry import Telemetry
from thermal.data import load_bundled_case
from thermal.errors import CaseError, ModelError, PlanError, ThermalError
from thermal.model.case_replay import Inputs, free_runs, replay_inputs, spin_up
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model
from thermal.model.simulation import simulate
from thermal.model.simulator import Simulator
from thermal.network.build import build_network
from thermal.network.network import ThermalNetwork
from thermal.network.structure import Structure
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
