"""A system's signals under the point names of the case format, as its components declare and read them."""

from collections.abc import Mapping
from typing import Any

from thermal.case.points import POINT_TYPES
from thermal.components.component import Calls, Component, Conditions
from thermal.components.energy_balance import EnergyBalance
from thermal.components.operations import Operations, StepOperations, Value
from thermal.system.exchange import givens
from thermal.system.step import HvacStep
from thermal.system.system import HvacSystem

_NO_CALLS = Calls(None, None)


class HvacPoints:
    """Reads the components of a system as telemetry does, without noise.

    Parameters
    ----------
    system : HvacSystem
        The system, whose components have the names of the devices.
    pressures : bool
        Whether the pressures of ducts and loop are read too, their drives holding the setpoints while they run.
    """

    def __init__(self, system: HvacSystem, pressures: bool = False) -> None:
        self.system, self._ops = system, StepOperations()
        kinds: dict[type[Component], list[str]] = {}
        for name in (*system.groups, *system.singles):
            kinds.setdefault(type(system.components[name]), []).append(name)
        columns, self._read = list[str](), list[tuple[slice, str, int]]()
        for of_pressure in (False, True)[: 1 + pressures]:
            for kind, names in kinds.items():
                for k, point in enumerate(kind.sensors):
                    for name in names if (POINT_TYPES[point].quantity == "pressure") == of_pressure else ():
                        begin = len(columns)
                        columns += [f"{entity}/{point}" for entity in system.entities(name)]
                        self._read.append((slice(begin, len(columns)), name, k))
        #: Columns ``ENTITY/POINT`` in the order of `read`, point by point.
        self.columns = tuple(columns)

    def read(
        self,
        conditions: Conditions,
        actions: Mapping[str, Value],
        step: HvacStep,
        ops: Operations | None = None,
        out: Value = None,
    ) -> Any:
        """Read all points after a step.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        actions : mapping of str to float
            For the step, by ``ENTITY/point`` [unit of the actuator].
        step : HvacStep
            What happened.
        ops : Operations, optional
            Arithmetic; that of one step of a plant by default.
        out : Value, optional
            Array to be filled from its beginning.

        Returns
        -------
        numpy.ndarray, shape (n_column,)
            In the library's units: kelvin, kg/s, W, shares.
        """
        system, ops = self.system, ops or self._ops
        given = givens(system, _NO_CALLS, conditions, actions, step.state, 0.0, _nowhere)
        values = {
            name: component.read(ops, given[name], step.results[name])
            for name, component in system.components.items()
        }
        found = ops.empty(len(self.columns)) if out is None else out
        for place, name, k in self._read:
            found[place] = values[name][k]
        return found


def energy_balance(system: HvacSystem, conditions: Conditions, step: HvacStep) -> EnergyBalance:
    """Add up where the energy of a step went, from its flows and temperatures.

    Parameters
    ----------
    system : HvacSystem
        The system.
    conditions : Conditions
        That it met.
    step : HvacStep
        What it did.

    Returns
    -------
    EnergyBalance
        Closes to round-off.
    """
    parts = [c.energy(conditions, step.results[name]) for name, c in system.components.items()]
    return EnergyBalance(*(sum(terms) for terms in zip(*parts, strict=True)))


def _nowhere(name: str) -> Any:
    return None
