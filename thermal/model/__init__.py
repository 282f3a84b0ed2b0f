"""The symbolic model and what runs it."""

from thermal.model._certificate import Certificate
from thermal.model._modal import ModalModel, Propagator, divided_differences, modal_model, propagator_functions
from thermal.model._modal_runs import ModalRuns
from thermal.model._reduction import FEW_SHIFTS, SHIFTS, ReducedModel, krylov_basis, reduced_model
from thermal.model._replay import LEAST_SPIN_UP, SPIN_UP, Inputs, free_runs, replay_inputs, spin_up
from thermal.model._rollout import RolloutData, SparseRollout, rollout, symbolic_step
from thermal.model._scheme import EXACT, IMPLICIT_EULER, SCHEMES, TR_BDF2, Scheme, Stage
from thermal.model._simulate import Simulation, simulate
from thermal.model._simulator import Simulator
from thermal.model._stepper import Stepper, factorise
from thermal.model._symbolic import Matrices, SymbolicModel

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
