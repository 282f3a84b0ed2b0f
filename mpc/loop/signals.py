"""What drives a plant's building: boundaries, and signals of its effects, in advance or as the loop runs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from mpc.errors import PlantError
from mpc.loop.building import BuildingModel
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.emitters import is_heater
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.effects.effect import Chosen
from thermal.inputs.live import LiveInputs
from thermal.inputs.normalisation import WIND, Normalisation, usual_temperatures
from thermal.inputs.provider import HVAC_INPUTS, InputProvider
from thermal.inputs.signals import Signal, zone_signal
from thermal.network.build import Extension
from thermal.network.graph import GraphBuilder
from thermal.network.network import ThermalNetwork
from thermal.system.component_replay import replay_reheat
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY

#: Zone, supply air and supply water that design capacities of terminals are counted at [K], those of `Terminals.sized`.
_ROOM, _SUPPLY, _WATER = 294.15, 285.95, 355.35

#: What the signals of heat that radiates in a zone are called, before the name of the zone.
RADIANT = "radiant gains of "


def scenario_inputs(scenario: Scenario, normalisation: Normalisation | None = None) -> InputProvider:
    """Make inputs as a scenario knows them before the plant runs: all but what its HVAC system does.

    Parameters
    ----------
    scenario : Scenario
        Weather, people and comfort bands.
    normalisation : Normalisation, optional
        Of the calibration that the building's model belongs to; what it does not know is the scenario's: the middle of
        the comfort band as usual temperature of the hour, the mean wind, and the most people at a time.
    """
    stamps, weather = pd.DatetimeIndex(scenario.grid.stamps), scenario.weather.frame.interpolate(limit_direction="both")
    series = {str(name): weather[name].to_numpy(dtype=float) for name in weather if weather[name].notna().any()}
    people = scenario.occupancy.sum(axis=1)
    series |= {"outdoor": series[OUTDOOR_TEMPERATURE], "people": people, "radiant_gains": scenario.radiant_gains}
    known = normalisation or Normalisation()
    middle = pd.DataFrame(0.5 * (scenario.lower + scenario.upper), index=stamps, columns=list(scenario.zones))
    wind = float(np.maximum(series[WIND], 0.0).mean()) if WIND in series else None
    counted = replace(
        known,
        usual=known.usual or usual_temperatures(middle),
        people=float(people.max()) if known.people is None else known.people,
        wind=wind if known.wind is None else known.wind,
    )
    return InputProvider(scenario.building, stamps, scenario.grid.step, series, counted, "scenario")


def _most_heat(system: HvacSystem) -> FloatArray:
    """Heat that the terminals can bring to their zones at design, shape (n_terminal,) [W]."""
    terminals, flow = system.terminals, system.terminals.heating_flow
    entering, wanted = np.full((1, len(flow)), _SUPPLY), np.full((1, len(flow)), terminals.discharge_limit)
    reached = replay_reheat(terminals, flow[np.newaxis], entering, wanted, np.array([_WATER])).discharge[0]
    return np.asarray(AIR_HEAT_CAPACITY * flow * np.maximum(reached - _ROOM, 0.0))


def _devices_of_zones(building: Building) -> FloatArray:
    """Part of the heat of a zone's heaters that each gives, in equal parts, shape (n_zone, n_device) [-]."""
    parts = np.zeros((len(building.zone_names), len(building.devices)))
    for number, device in enumerate(building.devices):
        if is_heater(device):
            parts[building.zone_names.index(str(device.zone)), number] = 1.0
    return np.asarray(parts / np.maximum(parts.sum(axis=1, keepdims=True), 1.0))


class EffectSignals:
    """Signals of a network's effects, step by step.

    Parameters
    ----------
    network : ThermalNetwork
        With effects, or without; its normalisation goes before that of the scenario.
    scenario : Scenario
        Weather and people.
    system : HvacSystem
        Whose terminals say what the most of air and heat is: their design flows, and what their coils give at design.

    Raises
    ------
    PlantError
        When an effect is one of a meter's clock, which means nothing in a closed loop.
    EffectError
        When the weather lacks what an effect needs.
    """

    def __init__(self, network: ThermalNetwork, scenario: Scenario, system: HvacSystem) -> None:
        self._network, self._values = network, np.zeros((scenario.grid.n_steps, len(network.signals)))
        self._live: list[tuple[int, Signal]] = []
        if not network.signals:
            return
        self._system, self._ahead = system, scenario_inputs(scenario, network.normalisation)
        most = (system.by_zone(value) for value in (system.terminals.design_flow, _most_heat(system)))
        flow, heat = (dict(zip(network.zones, value.tolist(), strict=True)) for value in most)
        counted = self._ahead.normalisation
        if not counted.flow:
            counted = replace(counted, flow=flow, heat=heat, peak_flow=flow)
        self._now = LiveInputs(scenario.building, scenario.grid.step, counted)
        self._by_device = _devices_of_zones(scenario.building)
        nothing = np.zeros(len(network.zones))
        self._put(0, nothing, nothing, nothing)
        for k, signal in enumerate(network.signals):
            if HVAC_INPUTS.isdisjoint(signal.inputs):
                self._ahead.need(*signal.inputs)
                self._values[:, k] = signal.of(self._ahead)
            else:
                lacking, expected = self._now.lacks(signal.inputs), "signals of a step, its air and its heat"
                found = f"{signal.name!r}, which is made of {', '.join(lacking)}"
                PlantError.unless(not lacking, "effects of the plant", expected, found, "leave that effect out")
                self._live.append((k, signal))

    def _put(self, k: int, flow: FloatArray, heat: FloatArray, by_heaters: FloatArray) -> None:
        """Set what is known of a step while the loop runs."""
        row = {name: values[k : k + 1] for name, values in self._ahead.series.items()}
        brought = heat[None]
        row |= {"supply_flow": flow[None], "supply_heat": brought, "heat": brought}
        row["emitted"] = by_heaters[None] @ self._by_device
        row["commanded"] = np.zeros((1, len(self._now.building.commanded)))  # all heat is the plant's own
        self._now.put(self._ahead.stamps[k : k + 1], row)

    def in_advance(self) -> FloatArray:
        """Give all signals, shape (n_steps, n_signal) [signal unit]; none of natural convection, which follows heat.

        Raises
        ------
        PlantError
            When one of them is known only while the plant runs.
        """
        rooms = self._network.anatomy.rooms.values()
        convective = {room.convection.signal.name for room in rooms if room.convection is not None}
        live = [s.name for _, s in self._live if s.name not in convective]
        expected, found = "signals that are known in advance", ", ".join(live)
        PlantError.unless(not live, "effects of batched plants", expected, found, "leave that effect out")
        return self._values

    def known(self, k: int) -> FloatArray:
        """Give the signals of a step as far as they are known before it, shape (n_signal,) [signal unit].

        Parameters
        ----------
        k : int
            Number of the step.
        """
        row: FloatArray = self._values[k]
        return row

    def at(self, k: int, airflow: FloatArray, heat: FloatArray, by_heaters: FloatArray) -> FloatArray:
        """Give the signals of a step, shape (n_signal,) [signal unit].

        Parameters
        ----------
        k : int
            Number of the step.
        airflow : ndarray, shape (n_terminal,)
            Supply air of the terminals [kg/s].
        heat, by_heaters : ndarray, shape (n_zone,)
            That it brings to the zones, and the part of it that does not come with air [W].
        """
        row: FloatArray = self._values[k]
        if self._live:
            row = row.copy()
            self._put(k, self._system.by_zone(airflow), heat, by_heaters)
            for position, signal in self._live:
                row[position] = signal.of(self._now)[0]
        return row


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
            signal = zone_signal(RADIANT + room.name, "W", "radiant_gains", room.name)
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
            why, expected = chosen.effect.applies(network.anatomy), "one that the building can have"
            PlantError.unless(why is None, f"effect {chosen.effect.id}", expected, why, "leave that effect out")


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
        raise PlantError("building model", "one that takes gains that radiate", "gains to air only", advice)


def check_parts(scenario: Scenario, model: BuildingModel, control_steps: int, warm_up_days: int, seed: int) -> None:
    """Refuse parts of a plant that do not fit each other.

    Parameters
    ----------
    scenario : Scenario
        Whose zones and step count.
    model : BuildingModel
        Of the building.
    control_steps, warm_up_days, seed : int
        Of the plant.

    Raises
    ------
    PlantError
        Which part does not fit.
    """
    network, grid, counts = model.network, scenario.grid, (control_steps, warm_up_days, seed)
    own, step = f"the scenario's {len(scenario.zones)} zones", f"the scenario's step of {grid.step:g} s"
    PlantError.unless(network.zones == scenario.zones, "building model", own, f"{len(network.zones)} others")
    PlantError.unless(model.step_seconds == grid.step, "building model", step, f"{model.step_seconds:g} s")
    PlantError.unless(not network.airflows, "building", "one without airflows from zone to zone", "some")
    check_radiant(network, scenario)
    valid = isinstance(control_steps, int) and control_steps >= 1 and warm_up_days >= 0 and seed >= 0
    expected = "control_steps from 1, warm_up_days and seed from 0 on"
    PlantError.unless(valid, "plant", expected, "{}, {} and {}".format(*counts))


def boundary_series(scenario: Scenario, model: BuildingModel, given: Mapping[str, float | FloatArray]) -> FloatArray:
    """Lay out boundary temperatures, shape (n_steps, n_boundary) [K].

    Parameters
    ----------
    scenario : Scenario
        Knows the outdoor temperature.
    model : BuildingModel
        Knows which boundaries there are.
    given : mapping of str to float or ndarray
        Temperatures of the others [K].
    """
    names, n_steps = model.network.boundaries, scenario.grid.n_steps
    columns = [scenario.outdoor]
    for name in names[1:]:
        PlantError.unless(name in given, f"boundary {name!r}", "its temperature", "none", "pass it in `boundaries`")
        columns.append(np.broadcast_to(np.asarray(given[name], dtype=float), (n_steps,)))
    strange = sorted(set(given) - set(names[1:]))
    if strange:
        raise PlantError("boundaries", f"those of the building, {list(names[1:])}", repr(strange[0]))
    return np.ascontiguousarray(np.column_stack(columns))


def sensor_offset(model: BuildingModel) -> FloatArray:
    """Tell what the zones' sensors say too much, where the effect `sensor_bias` is in the model [K].

    Parameters
    ----------
    model : BuildingModel
        At its parameter values.
    """
    zones = model.network.zones
    offset = np.zeros(len(zones))
    for parameter, value in zip(model.network.parameters, model.theta, strict=True):
        if parameter.base == "sensor_bias" and parameter.member in zones:
            offset[zones.index(parameter.member)] = value
    return offset
