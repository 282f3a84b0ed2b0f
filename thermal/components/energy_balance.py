"""Where the energy of a step goes, component by component."""

from typing import NamedTuple

from thermal.components.operations import Value


class EnergyBalance(NamedTuple):
    """Energy into components and out of them; means over a step.

    Parameters
    ----------
    electricity, fuel : Value
        Taken up [W].
    zones : Value
        Heat into the zones [W].
    moisture : Value
        Latent heat of the water vapour that the supply air brings into the zones; negative where it is dried [W].
    exhaust : Value
        What the exhaust carries away beyond what the outdoor air brought in, with the heat of its fan [W].
    condenser : Value
        Rejected by the refrigeration outdoors [W].
    flue : Value
        Up the chimneys of boiler and gas coils [W].
    plant_room : Value
        From pipes, jacket and motors into the plant room [W].
    storage : Value
        Kept in the water of the loop [W].
    """

    electricity: Value = 0.0
    fuel: Value = 0.0
    zones: Value = 0.0
    moisture: Value = 0.0
    exhaust: Value = 0.0
    condenser: Value = 0.0
    flue: Value = 0.0
    plant_room: Value = 0.0
    storage: Value = 0.0

    @property
    def residual(self) -> Value:
        """What goes in and neither comes out nor stays [W]."""
        return self.electricity + self.fuel - sum(self[2:])

    @property
    def turnover(self) -> Value:
        """Sum of all terms' sizes [W], which a residual is to be compared with."""
        return sum(abs(term) for term in self)
