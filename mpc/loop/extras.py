"""What a plant's building has beyond the baseline: effects of the catalogue, and gains that radiate."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from mpc.errors import PlantError
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.effects.effect import Chosen
from thermal.errors import EffectError, describe
from thermal.inputs.drivers import Drivers, Signal
from thermal.network.extension import Extension
from thermal.network.graph import GraphBuilder
from thermal.network.network import ThermalNetwork

#: What the signals of heat that radiates in a zone are called, before the name of the zone.
RADIANT = "radiant gains of "


class ScenarioDrivers(Drivers):
    """What a scenario says of sun, sky, wind and people, before the plant runs.

    Parameters
    ----------
    case : Case
        Of `Scenario.driving_case`.
    scenario : Scenario
        The scenario.
    """

    def __init__(self, case: Case, scenario: Scenario) -> None:
        super().__init__(case)
        self.radiant = scenario.radiant_gains


def _radiant(drivers: Drivers, zone: str) -> FloatArray:
    if not isinstance(drivers, ScenarioDrivers):
        found = "telemetry, which knows presence only"
        raise EffectError(describe(RADIANT + zone, "those of a plant's scenario", found, "use `internal_gains`"))
    return np.asarray(drivers.radiant[:, drivers.zones.index(zone)])


class RadiantGains:
    """Lets the radiant part of a scenario's gains fall on the surfaces of the zones, and not into their air.

    An extension of a network, `thermal.build_network`; a zone without radiant node keeps it in its air. For each zone
    there is a signal, the heat that radiates: it goes to the radiant node and is taken from the air, so that the gains
    as a whole are those of the scenario.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.network.build import build_network
    >>> building = load_bundled_case().building
    >>> [s.name for s in build_network(building, dx=1.0, effects=(RadiantGains(),)).signals][:1]
    ['radiant gains of F1_N']
    """

    def extend(self, graph: GraphBuilder) -> None:
        """Add the signals and what they move.

        Parameters
        ----------
        graph : GraphBuilder
            With its anatomy.
        """
        for room in graph.anatomy.rooms.values():
            if room.radiant < 0:
                continue
            signal = Signal(RADIANT + room.name, "W", partial(_radiant, zone=room.name))
            node, share = np.append(room.air, room.radiant), np.append(-room.share, 1.0)
            graph.source("radiant gains", 1.0, node, signal, share)


def check_extras(effects: Sequence[Extension], network: ThermalNetwork) -> None:
    """Refuse effects that a building cannot have: they would change nothing, unseen.

    Parameters
    ----------
    effects : sequence of Extension
        Of the plant's building.
    network : ThermalNetwork
        The building.

    Raises
    ------
    PlantError
        Which effect, and why.
    """
    for chosen in effects:
        if isinstance(chosen, Chosen) and chosen.effect.applies is not None:
            why = chosen.effect.applies(network.anatomy)
            if why is not None:
                expected = "one that the building can have"
                raise PlantError(describe(f"effect {chosen.effect.id}", expected, why, "leave that effect out"))


def check_radiant(network: ThermalNetwork, scenario: Scenario) -> None:
    """Refuse a scenario whose gains radiate for a building that takes them into its air.

    Parameters
    ----------
    network : ThermalNetwork
        The building.
    scenario : Scenario
        With its gains.

    Raises
    ------
    PlantError
        When there are no signals for the part that radiates.
    """
    takes = any(signal.name.startswith(RADIANT) for signal in network.signals)
    if scenario.heat.radiates and not takes and (network.kind == "radiant").any():
        advice = "build it with effects=(RadiantGains(),)"
        raise PlantError(describe("building model", "one that takes gains that radiate", "gains to air only", advice))
