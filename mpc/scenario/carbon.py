"""What a kilowatt-hour emits."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from mpc.errors import ScenarioError
from mpc.scenario.rates import ConstantRate, Rate
from thermal.errors import describe

#: Carbon dioxide of natural gas by its upper heating value [kg/kWh]: 53.06 kg/mmBtu (40 CFR 98, table C-1).
GAS_CARBON = 53.06 / 293.0711


@dataclass(frozen=True, eq=False)
class CarbonIntensity:
    """Emissions of a kilowatt-hour of electricity and of gas.

    Average intensity (all emissions of the grid over all generation) is what inventories count; marginal intensity
    (of the plants that follow a change of demand) is what a shift of load changes. They may differ in sign of their
    slope over a day, so that there is no default.

    Parameters
    ----------
    electricity : Rate
        Constant, by the local hour or a published series [kg/kWh].
    kind : str
        ``average`` or ``marginal``: which of the two `electricity` is.
    gas : Rate
        By the upper heating value [kg/kWh]; default `GAS_CARBON`, burnt on site.

    Raises
    ------
    ScenarioError
        When the kind is none of the two.
    """

    electricity: Rate
    kind: Literal["average", "marginal"]
    gas: Rate = field(default_factory=lambda: ConstantRate(GAS_CARBON))

    def __post_init__(self) -> None:
        if self.kind not in ("average", "marginal"):
            raise ScenarioError(describe("carbon: kind", "'average' or 'marginal'", repr(self.kind)))
