"""Plants from a building and its weather in one call, and the pilot building as a case folder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Literal, get_args

import pandas as pd

from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.settings import ModelSettings
from mpc.errors import PlantError
from mpc.loop.building import BuildingModel, GridBuilding
from mpc.loop.noise import SensorNoise
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.run import FixedSetpoints
from mpc.loop.signals import RadiantGains, check_extras
from mpc.loop.simulated import SimulatedPlant
from mpc.model import BuildingParameters, model_settings, parameter_vector
from mpc.scenario.forecast import Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import ComfortBand, Occupancy
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import CarbonIntensity, Tariff, paper_carbon, paper_tariff
from mpc.scenario.weather import Weather
from thermal._types import FloatArray
from thermal.case.building import Building, Device
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.save import save_case
from thermal.components.registry import COMPONENTS
from thermal.effects.catalogue import chosen
from thermal.effects.effect import Chosen
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model
from thermal.model.simulator import Shuffle, Simulator
from thermal.network.build import Extension, build_network
from thermal.network.structure import BASELINE
from thermal.pilot.building import pilot_building
from thermal.pilot.weather import MOUNTAIN_VIEW, generate_weather
from thermal.system.devices import device_graph
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem

#: What steps the plant: the reduced model, its grid with the mean of the shuffle, or with the random shuffle.
PlantKind = Literal["reduced", "grid", "random"]


@dataclass(frozen=True, kw_only=True)
class SimulationSettings:
    """Building, HVAC system, prices and people of a simulated plant: what single plants and studies have in common.

    Parameters
    ----------
    parameters : str, Path, CalibrationResult or mapping of str to float, optional
        Of the building: a ``calibration.json`` or the result itself, with its effects, or values by name [parameter
        units]; starting values for the rest.
    dx : float, optional
        Distance between control volumes of a plan [m]; that of the calibration, or the plan's.
    kind : {"reduced", "grid", "random"}
        How the building steps: reduced to its modes, on the grid with the mean of the shuffle, or with the random one.
    system : HvacSystem, optional
        Its HVAC system; sized by `thermal.system.sizing.size_system` by default.
    tariff : Tariff
        Prices; those of the paper's simulator by default.
    carbon : CarbonIntensity
        Emissions; those of the paper's simulator by default.
    occupancy : Occupancy, optional
        People; an office's schedule by default.
    comfort : ComfortBand, optional
        Comfort band; BOPTEST's office by default.
    noise : SensorNoise, optional
        Errors of what is measured; none by default.
    seed : int
        Of all that is random.

    Raises
    ------
    PlantError
        When the kind is not known, with the nearest one.
    """

    parameters: BuildingParameters | None = None
    dx: float | None = None
    kind: PlantKind = "reduced"
    system: HvacSystem | None = None
    tariff: Tariff = field(default_factory=paper_tariff)
    carbon: CarbonIntensity = field(default_factory=paper_carbon)
    occupancy: Occupancy | None = None
    comfort: ComfortBand | None = None
    noise: SensorNoise | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        known = get_args(PlantKind)
        PlantError.unless_known(self.kind, known, "plant", f"one of {', '.join(known)}")

    def scenario(
        self, building: Building, grid: StepGrid, weather: Weather, gains: InternalGains | None = None
    ) -> Scenario:
        """Put weather, people, prices and emissions on a grid of steps.

        Parameters
        ----------
        building : Building
            Zones and floor areas.
        grid : StepGrid
            Steps.
        weather : Weather
            Covers the grid.
        gains : InternalGains, optional
            Heat of people, light and equipment; an office's by default.
        """
        return build_scenario(
            building, grid, weather, self.tariff, carbon=self.carbon, occupancy=self.occupancy, gains=gains,
            comfort=self.comfort,
        ).redrawn(self.seed)  # fmt: skip

    def building_model(
        self, building: Building, grid: SymbolicModel, theta: FloatArray, built: ModelSettings,
        extras: Sequence[Extension] = (), step_seconds: float = 300.0, order: int | None = None,
    ) -> BuildingModel:  # fmt: skip
        """Make what steps the building.

        Parameters
        ----------
        building : Building
            With its devices.
        grid : SymbolicModel
            Its model.
        theta : ndarray, shape (n_parameter,)
            Values of its parameters [parameter units].
        built : ModelSettings
            How the model was built.
        extras : sequence of Extension
            Effects, and what else was added to the baseline.
        step_seconds : float
            Time step [s].
        order : int, optional
            Largest number of states of a reduced building.

        Raises
        ------
        PlantError
            When the structure of the model is not that of the grid.
        """
        if self.kind == "reduced":
            return ReducedBuilding(reduced_model(grid, [theta], order=order), theta, step_seconds)
        usual, advice = built.structure == BASELINE, "take --plant reduced (kind='reduced')"
        PlantError.unless(usual, "plant on the grid", "the usual structure of the model", "another", advice)
        values = {p.name: float(v) for p, v in zip(grid.network.parameters, theta, strict=True)}
        shuffle = Shuffle("random" if self.kind == "random" else "mean", reach=built.reach, seed=self.seed)
        simulator = Simulator(
            building, values, step_seconds, built.dx, shuffle=shuffle, scopes=built.scopes, effects=extras
        )
        return GridBuilding(simulator)


@dataclass(frozen=True, kw_only=True)
class PlantSettings(SimulationSettings):
    """Choices of `simulated_plant`, beside those of `SimulationSettings`.

    Parameters
    ----------
    effects : tuple of Chosen
        What the building has and the baseline lacks, `thermal.effects.catalogue.chosen`; with a calibration they are
        its own.
    order : int, optional
        Largest number of states of a reduced building.
    gains : InternalGains, optional
        Heat of people, light and equipment; an office's, all of it into the air, by default.
    unmeasured : DisturbanceModel, optional
        Heat that nobody measures or foresees; none by default.
    step_seconds : float
        Step of the plant [s].
    control_steps : int
        Steps of the plant in a control step.
    horizon : int, optional
        Steps of the forecasts, perfect ones; none by default.
    warm_up_days : int
        How often the first day is run before the start [d].
    pressures : bool
        Whether the pressures of ducts and loop are measured; a case that has them is one of format 2.
    """

    effects: tuple[Chosen, ...] = ()
    order: int | None = None
    gains: InternalGains | None = None
    unmeasured: DisturbanceModel | None = None
    step_seconds: float = 300.0
    control_steps: int = 1
    horizon: int | None = None
    warm_up_days: int = 1
    pressures: bool = False


def simulated_plant(
    building: Building, weather: Weather, start: str, end: str, settings: PlantSettings | None = None
) -> SimulatedPlant:
    """Make a plant of a building in one call; `SimulatedPlant` has every choice.

    Parameters
    ----------
    building : Building
        Devices of an HVAC system that it lacks are assumed, `equip`.
    weather : Weather
        Covers the time.
    start, end : str
        ISO 8601; without an offset local to the building.
    settings : PlantSettings, optional
        All that has a default.

    Returns
    -------
    SimulatedPlant
        To be reset.

    Raises
    ------
    PlantError
        When the parts do not fit each other, or the building cannot have an effect.
    """
    given, (building, _) = settings or PlantSettings(), equip(building)
    grid = StepGrid.between(start, end, given.step_seconds, building)
    scenario = replace(given.scenario(building, grid, weather, given.gains), unmeasured=given.unmeasured)
    built = model_settings(given.parameters, dx=given.dx, effects=given.effects)
    effects = given.effects or chosen(built.effects)
    system = given.system or size_system(building)
    radiates = scenario.heat.radiates or "radiant_heat" in system.heating
    extras: tuple[Extension, ...] = (*effects, RadiantGains()) if radiates else effects
    network = build_network(
        building, dx=built.dx, reach=built.reach, scopes=built.scopes, structure=built.structure, effects=extras
    )
    check_extras(effects, network)
    theta, step = parameter_vector(given.parameters, network), given.step_seconds
    model = given.building_model(building, SymbolicModel(network), theta, built, extras, step, given.order)
    return SimulatedPlant(
        scenario, system, model, control_steps=given.control_steps, noise=given.noise,
        forecaster=None if given.horizon is None else Forecaster(scenario, given.horizon),
        warm_up_days=given.warm_up_days, pressures=given.pressures, seed=given.seed,
    )  # fmt: skip


def equip(building: Building) -> tuple[Building, tuple[str, ...]]:
    """Give a building the devices of an HVAC system that it lacks: a terminal a zone, an air handler, hot water.

    Parameters
    ----------
    building : Building
        With any devices.

    Returns
    -------
    tuple
        The building, and what was done, in words.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> equip(load_bundled_case().building)[1]
    ('the case names no air handler and no boiler: one of each is assumed',)
    """
    terminals = {z: [d for d in building.devices_of(z) if d.type == "vav"] for z in building.zone_names}
    spare = {d.name for found in terminals.values() for d in found[1:]}  # a plant is sized with one a zone
    graph = device_graph(building)
    bare = [zone for zone, found in terminals.items() if not found and graph.has_air]
    source = graph.water[0]
    wet = graph.has_air or any(p.quantity == "water" for kind in graph.emitters for p in COMPONENTS[kind].ports)
    names = ({"ahu": "air handler"} if graph.has_air else {}) | ({source: source.replace("_", " ")} if wet else {})
    lacking = [kind for kind in names if not any(d.type == kind for d in building.devices)]
    taken = {d.name for d in building.devices} | set(building.zone_names)
    wanted = [(f"VAV_{zone}", "vav", zone) for zone in bare] + [(kind.upper(), kind, None) for kind in lacking]
    devices = [d for d in building.devices if d.name not in spare]
    for name, kind, zone in wanted:
        while name in taken:
            name += "_"
        taken.add(name)
        devices.append(Device(name=name, type=kind, zone=zone))
    said = []
    if bare:
        said.append(f"zones without a terminal get one: {', '.join(bare[:6])}{' ...' if len(bare) > 6 else ''}")
    if spare:
        said.append(f"zones have one terminal each: left out {', '.join(sorted(spare)[:6])}")
    if lacking:
        one = " and ".join(f"no {names[kind]}" for kind in lacking)
        said.append(f"the case names {one}: one{' of each' if len(lacking) > 1 else ''} is assumed")
    if graph.unused:
        why = "; ".join(f"{name} ({reason})" for name, reason in sorted(graph.unused.items()))
        said.append(f"devices that the plant leaves out: {why}")
    return replace(building, devices=tuple(devices)), tuple(said)


def pilot_weather(seed: int, start: str, days: float, step_seconds: float = 300.0) -> Weather:
    """Make weather of the pilot building's town.

    Parameters
    ----------
    seed : int
        Same seed, same weather; 0 or more.
    start : str
        Local time of its begin, ISO 8601 without offset.
    days : float
        Length [d].
    step_seconds : float
        Step [s].

    Returns
    -------
    Weather
        Of `thermal.pilot.weather.generate_weather`.
    """
    frame = generate_weather(seed, start=start, days=days, step_seconds=step_seconds)
    return Weather(frame.rename(columns=lambda column: column.rpartition("/")[2]), MOUNTAIN_VIEW)


def save_pilot(
    path: str | PathLike[str],
    building: Building | None = None,
    settings: PlantSettings | None = None,
    *,
    start: str = "2023-01-09",
    days: int = 14,
    setpoints: Mapping[str, float] | None = None,
    overwrite: bool = False,
) -> Case:
    """Run the pilot building in closed loop and save plans, devices and telemetry as a case folder.

    Beside the zones' points the telemetry has those of air handlers, boiler and chiller: setpoints, commands, water and
    air temperatures, meters.

    Parameters
    ----------
    path : str or path-like
        Folder to make.
    building : Building, optional
        Such as `thermal.pilot.building.pilot_building` makes in any size; the pilot of the settings' seed by default.
    settings : PlantSettings, optional
        Control volumes of 0.5 m and sensors with the errors of `SensorNoise` by default; the seed is the weather's too.
    start : str
        Local day of its begin, ISO 8601.
    days : int
        Length [d].
    setpoints : mapping of str to float, optional
        By kind of action [K] or [Pa]; those of `SimulatedPlant.default_actions` by default.
    overwrite : bool
        Whether a case that is there already is replaced.

    Returns
    -------
    Case
        As it was saved and loaded again.
    """
    given = settings or PlantSettings(dx=0.5, noise=SensorNoise())
    end = (pd.Timestamp(start) + pd.Timedelta(days=days)).isoformat()
    weather = pilot_weather(given.seed, start, days)
    plant = simulated_plant(building or pilot_building(given.seed), weather, start, end, given)
    plant.reset()
    actions = plant.default_actions | FixedSetpoints(setpoints or {}, plant.actuators).at_hour(0.0)
    while not plant.finished:
        plant.step(actions)
    return load_case(save_case(plant.case(), path, overwrite=overwrite))
