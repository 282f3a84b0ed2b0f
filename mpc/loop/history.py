"""What a plant did, step by step: the telemetry, the record for indicators and the balance of a run."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from mpc.loop.building import BuildingFlows
from thermal._types import FloatArray
from thermal.components.component import Conditions
from thermal.components.energy_balance import EnergyBalance
from thermal.system.step import HvacStep


class PlantStep(NamedTuple):
    """A step of a plant.

    Parameters
    ----------
    number : int
        Step of the scenario.
    conditions : Conditions
        Of the plant.
    actions : mapping of str to float
        For it, by ``ENTITY/point`` [unit of the actuator].
    done : HvacStep
        What its devices did.
    mean : ndarray, shape (n_zone,)
        What the zones' sensors read, mean over the step [K].
    end : ndarray, shape (n_zone,)
        Air of the zones at its end [K].
    """

    number: int
    conditions: Conditions
    actions: Mapping[str, float]
    done: HvacStep
    mean: FloatArray
    end: FloatArray


class RecentSteps(NamedTuple):
    """The last steps of a plant's record, for rewards.

    Parameters
    ----------
    step : float
        Step of the plant [s].
    zone_temperature : sequence of ndarray, shape (n_zone,)
        At the edges of the steps [K].
    electricity, gas : sequence of float
        Powers, means over the steps, one fewer than the edges [W].
    """

    step: float
    zone_temperature: Sequence[FloatArray]
    electricity: Sequence[float]
    gas: Sequence[float]


class SystemBalance(NamedTuple):
    """Where the energy of a step of the whole system went, building and plant; means over the step.

    Parameters
    ----------
    plant : EnergyBalance
        Of air handlers, terminals and hot water [W].
    gains : float
        Heat of people, light and equipment into the zones [W].
    flows : BuildingFlows
        Of the building [W].
    """

    plant: EnergyBalance
    gains: float
    flows: BuildingFlows

    @property
    def residual(self) -> float:
        """What goes in and neither comes out nor stays [W]; heat into zones, internal to the system, has no part."""
        plant, flows = self.plant, self.flows
        inside = plant.electricity + plant.fuel + self.gains + flows.effects
        lost = plant.moisture + plant.exhaust + plant.condenser + plant.flue + plant.plant_room + flows.envelope
        return float(inside - lost - plant.storage - flows.storage)

    @property
    def turnover(self) -> float:
        """Sum of all terms' sizes [W], which a residual is to be compared with."""
        return float(self.plant.turnover + abs(self.gains) + sum(abs(part) for part in self.flows))
