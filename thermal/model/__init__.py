"""The symbolic model and what runs it."""

from thermal.model.certificate import Certificate
from thermal.model.modal import ModalModel, Propagator, divided_differences, modal_model, propagator_functions
from thermal.model.modal_runs import ModalRuns
from thermal.model.reduce import FEW_SHIFTS, SHIFTS, ReducedModel, krylov_basis, reduced_model
from thermal.model.replay import LEAST_SPIN_UP, SPIN_UP, Inputs, free_runs, replay_inputs, spin_up
from thermal.model.rollouts import RolloutData, SparseRollout, rollout, symbolic_step
from thermal.model.scheme import EXACT, IMPLICIT_EULER, SCHEMES, TR_BDF2, Scheme, Stage
from thermal.model.simulation import Simulation, simulate
from thermal.model.simulator import Simulator
from thermal.model.stepper import Stepper, factorise
from thermal.model.symbolic import Matrices, SymbolicModel

__all__ = [
    "EXACT",
    "FEW_SHIFTS",
    "IMPLICIT_EULER",
    "LEAST_SPIN_UP",
    "SCHEMES",
    "SHIFTS",
    "SPIN_UP",
    "TR_BDF2",
    "Certificate",
    "Inputs",
    "Matrices",
    "ModalModel",
    "ModalRuns",
    "Propagator",
    "ReducedModel",
    "RolloutData",
    "Scheme",
    "Simulation",
    "Simulator",
    "SparseRollout",
    "Stage",
    "Stepper",
    "SymbolicModel",
    "divided_differences",
    "factorise",
    "free_runs",
    "krylov_basis",
    "modal_model",
    "propagator_functions",
    "reduced_model",
    "replay_inputs",
    "rollout",
    "simulate",
    "spin_up",
    "symbolic_step",
]
