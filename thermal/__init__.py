"""A building as a thermal system: cases, control volumes and faces, the symbolic model and what steps it.

Names are looked up when they are first used, so that what needs one module does not wait for all.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

#: Module of each name; it is imported when the name is first used.
_MODULES = {
    "Building": "case.building", "Case": "case.case", "CaseError": "errors", "FloorPlan": "case.building",
    "FloorPlans": "case.building", "Inputs": "model.case_replay", "ModelError": "errors",
    "PARAMETERS": "parameters", "Parameter": "parameters", "PlanError": "errors", "Simulator": "model.simulator",
    "Structure": "network.structure", "SymbolicModel": "model.matrices", "Telemetry": "case.telemetry",
    "ThermalError": "errors", "ThermalNetwork": "network.network", "ZoneTable": "case.building",
    "build_network": "network.build", "free_runs": "model.case_replay", "load_bundled_case": "data",
    "load_case": "case.load", "local_timestamp": "case.case", "reduced_model": "model.reduce",
    "replay_inputs": "model.case_replay", "save_case": "case.save", "simulate": "model.simulation",
    "spin_up": "model.case_replay",
}  # fmt: skip

__all__ = [
    "PARAMETERS", "Building", "Case", "CaseError", "FloorPlan", "FloorPlans", "Inputs", "ModelError",
    "Parameter", "PlanError", "Simulator", "Structure", "SymbolicModel", "Telemetry", "ThermalError",
    "ThermalNetwork", "ZoneTable", "build_network", "free_runs", "load_bundled_case", "load_case",
    "local_timestamp", "reduced_model", "replay_inputs", "save_case", "simulate", "spin_up",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
