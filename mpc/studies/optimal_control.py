"""Optimal control for a plant in one call: model, predictor, problem, observer and controller put together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.kalman import KalmanFilter
from calibration.estimation.state_space import StateSpace, state_space
from mpc.batch.rollouts import HorizonRollouts
from mpc.control.controller.controller import MpcController
from mpc.control.controller.observer import Observer
from mpc.control.controller.site import ControllerSettings, SitePoints
from mpc.control.predictor.forecast_signals import ForecastSignals
from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import Horizon
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.sampling import CrossEntropy, SamplingSolver
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.uncertainty import Margin
from mpc.errors import ControlError
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER, Actuator, need_actuator
from mpc.loop.plant import Actuated
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.sensors import PlantDevices
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.scenario import zone_areas
from thermal.case.building import Building
from thermal.model.modal import ModalModel, modal_model
from thermal.model.reduce import ReducedModel
from thermal.model.step import IMPLICIT_EULER
from thermal.system.smooth import SmoothHvac
from thermal.system.system import HvacSystem

#: Step of a controller's model [s]: that of telemetry in most cases.
MODEL_STEP = 300.0

#: Unmeasured heat per floor area [W/m2], how long it lasts [s], and noise of a mean over a control step [K]: half of an
#: office's lights come and go, over a morning.
UNMEASURED, LASTING, SENSOR_NOISE = 5.0, 6 * 3600.0, 0.05

#: Smoothing width of the plant in the predictor [-]: at 0.02, the plant's default, coils and fans that stand still take
#: a seventh of a small building's electricity; at 0.005 costs fall by 0.6 %, below that by nothing, and solves take
#: a tenth longer.
SMOOTHING = 0.005

#: Comfort counts from so far inside of its band [K], as predictions of an hour miss by 0.12 K in the mean (a deviation
#: of 0.15): half a softness, so that what is optimised is the discomfort to be expected. Against bands that count from
#: their edge on a week of August costs 0.9 % less with its discomfort, days of February the same.
MARGIN = 0.2


def default_horizon(control_step: float = 900.0, hours: float = 12.0) -> Horizon:
    """Look half a day ahead: steps of 5 minutes for an hour, of a quarter of an hour from there on, 10 blocks.

    Parameters
    ----------
    control_step : float
        Time between two actions [s], up to half an hour.
    hours : float
        Length [h], from 3 on.

    Examples
    --------
    >>> ahead = default_horizon()
    >>> len(ahead), ahead.n_block, float(ahead.edges[-1]) / 3600.0
    (56, 10, 12.0)
    """
    fits, found = 0.0 < control_step <= 1800.0 and hours >= 3.0, f"{control_step:g} s and {hours:g} h"
    ControlError.unless(fits, "horizon", "a control step of up to 1800 s, 3 hours or more", found)
    fine = MODEL_STEP if control_step % MODEL_STEP == 0.0 else control_step
    early = [0.5, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 2.0, 2.0]
    late = [4.0] * int(max(hours - sum(early) - 3.0, 1.0) / 4.0)
    return Horizon.growing([(1.0, fine), (hours - 1.0, 900.0)], [*early, *late, 3.0], control_step)


def sampled_horizon(control_step: float = 900.0, hours: float = 12.0) -> Horizon:
    """Look half a day ahead in equal steps, a control step each, in few blocks: each is two decisions to be sampled.

    Parameters
    ----------
    control_step : float
        Time between two actions [s], that half an hour is whole multiples of.
    hours : float
        Length [h], from 3 on.
    """
    fits = hours >= 3.0 and control_step > 0.0 and 1800.0 % control_step == 0.0
    ControlError.unless(fits, "horizon", "steps that divide half an hour, 3 hours or more", f"{control_step:g} s")
    blocks = [0.5, 0.5, 1.0, 2.0, 2.0, *[3.0] * int((hours - 6.0) // 3.0)]
    return Horizon.growing([(hours, control_step)], blocks, control_step)


def make_sampling_controller(
    model: ReducedModel,
    plant: SimulatedPlant,
    *,
    settings: ControllerSettings | None = None,
    observer: Observer | DisturbanceModel | None = None,
    hours: float = 12.0,
    method: CrossEntropy | None = None,
    seed: int = 0,
) -> MpcController:
    """Make a controller that tries many plans at once on a batched plant, in the place of derivatives.

    Parameters
    ----------
    model : ReducedModel
        Of the building, as in `make_controller`.
    plant : SimulatedPlant
        Whose setpoints are to be chosen; its HVAC system is taken for known.
    settings : ControllerSettings, optional
        As in `make_controller`.
    observer : Observer or DisturbanceModel, optional
        As in `make_controller`.
    hours : float
        How far it looks ahead [h].
    method : CrossEntropy, optional
        How plans are sampled.
    seed : int
        Of the samples.

    Returns
    -------
    MpcController
        With the observer, the forecasts, the fall-backs and the costs of optimal control; the solver is another.
    """
    like = make_controller(
        model, plant, settings=settings, observer=observer, horizon=sampled_horizon(plant.control_step, hours)
    )
    chosen, building = method or CrossEntropy(), ReducedBuilding(model, step_seconds=plant.control_step)
    trials = HorizonRollouts(like.problem, building, plant.system, plant.scenario, like.points, chosen.samples)
    return replace(like, solver=SamplingSolver(like.problem, trials, chosen, seed))


def site_points(building: Building, devices: PlantDevices) -> SitePoints:
    """Name the points of a building whose devices are known.

    Parameters
    ----------
    building : Building
        Its zones and weather station.
    devices : PlantDevices
        Such as `SimulatedPlant.devices`.
    """
    chiller = () if devices.chiller is None else (devices.chiller,)
    meters = [f"{name}/electrical_power_sensor" for name in (*devices.air_handlers, *chiller)]
    return SitePoints(
        building.zone_names, devices.terminals, devices.air_handlers, devices.boiler, building.weather_station,
        (*meters, f"{devices.boiler}/{devices.meter}"),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Site:
    """What a controller knows of a plant beside the model of its building.

    Parameters
    ----------
    building : Building
        Zones, floor areas and weather station.
    system : HvacSystem
        Air handlers, terminals and hot water as the controller believes them to be.
    devices : PlantDevices
        Their names.
    """

    building: Building
    system: HvacSystem
    devices: PlantDevices

    @property
    def points(self) -> SitePoints:
        """Names of zones and devices."""
        return site_points(self.building, self.devices)


def make_controller(
    model: ReducedModel,
    plant: Actuated,
    *,
    site: Site | None = None,
    settings: ControllerSettings | None = None,
    horizon: Horizon | None = None,
    channels: Sequence[Channel] | None = None,
    observer: Observer | DisturbanceModel | None = None,
    boundaries: Mapping[str, float] | None = None,
) -> MpcController:
    """Make an optimal controller of a plant, with sensible values for all that is not given.

    Parameters
    ----------
    model : ReducedModel
        Of the building, `control_model`; it may have effects.
    plant : Plant, or an object with its `control_step` and `actuators`
        Whose setpoints are to be chosen.
    site : Site, optional
        Building and HVAC system; those of a `SimulatedPlant` by default.
    settings : ControllerSettings, optional
        Prices of comfort and carbon, schedules, rule of the first guess; without a back-off of its own, bands are
        narrowed by `MARGIN`.
    horizon : Horizon, optional
        `default_horizon` by default.
    channels : sequence of Channel, optional
        What is decided; by default the supply air, common to all air handlers, and the supply water, where the plant
        has an actuator for them, in its ranges.
    observer : Observer or DisturbanceModel, optional
        In the place of the filter that is made here, or the unmeasured heat and noise of the sensors that it expects;
        by default 5 W/m2 that last for six hours and 0.05 K.
    boundaries : mapping of str to float, optional
        Temperatures of boundaries beside outdoor, taken to stay [K].

    Returns
    -------
    MpcController
        To be asked with measurements and a forecast as long as its horizon.

    Raises
    ------
    ControlError
        When the plant is none of ours and no site is given, its forecasts are too short, or it lacks an actuator that
        is to be set.

    Examples
    --------
    >>> model = control_model(case.building, "calibration.json")  # doctest: +SKIP
    >>> controller = make_controller(model, plant)  # doctest: +SKIP
    >>> run = run_closed_loop(plant, controller, forecasts=True)  # doctest: +SKIP
    """
    ours = plant if isinstance(plant, SimulatedPlant) else None
    if ours is not None:
        site = site or Site(ours.scenario.building, ours.system, ours.devices)
    if site is None:
        found = "none; they are known of a SimulatedPlant only"
        raise ControlError("controller", "`system` and `points` of this plant in a `site`", found)
    ahead, points = horizon or default_horizon(plant.control_step), site.points
    if ours is not None:
        _check_forecasts(ours, ahead)
    modes = modal_model(model.matrices(model.theta))
    decided = tuple(channels) if channels is not None else _channels(plant.actuators, points)
    unmeasured = DisturbanceModel(UNMEASURED * zone_areas(site.building), LASTING, SENSOR_NOISE)
    if isinstance(observer, DisturbanceModel):
        unmeasured, observer = observer, None
    if observer is None:
        observer = Observer(KalmanFilter(held_space(modes, ahead.control_step), unmeasured), modes)
    pressures = any(c.unit == "Pa" for c in decided)
    hvac = SmoothHvac(site.system, SMOOTHING, pressures)
    set_by_it = points.setpoints(decided, np.zeros(len(decided)), hvac)
    need_actuator("controller", set_by_it, plant.actuators, every=True)
    predictor = Predictor(modes, hvac, ahead, decided, unmeasured.time_constant)
    solver = SequentialSolver(ControlProblem(predictor, 2.0 * MARGIN), iterations=25)
    signals = None
    if model.network.signals or len(model.network.boundaries) > 1:
        people = 0.0 if ours is None else float(ours.scenario.expected_occupancy.sum(axis=1).max())
        signals = ForecastSignals(model.network, site.building, people, boundaries)
    chosen = settings or ControllerSettings()
    if chosen.back_off is None:
        chosen = replace(chosen, back_off=Margin(MARGIN))
    return MpcController(solver, observer, points, chosen, signals)


def held_space(modes: ModalModel, control_step: float) -> StateSpace:
    """State space over a control step that is several steps of the model, its inputs constant meanwhile.

    Parameters
    ----------
    modes : ModalModel
        Of a reduced model.
    control_step : float
        [s]; where it is no multiple of `MODEL_STEP` it is one step.

    Returns
    -------
    StateSpace
        The same as that many steps, one after the other.
    """
    count = round(control_step / MODEL_STEP)
    if count < 2 or abs(count * MODEL_STEP - control_step) > 1e-6:
        return state_space(modes, control_step)
    one = state_space(modes, MODEL_STEP, IMPLICIT_EULER)
    keep = one.transition
    powers = keep[None, :] ** np.arange(count)[:, None]
    reached = np.vstack([np.zeros(keep.size), np.cumsum(powers, axis=0)])[:count]  # of a drive, before each step
    return StateSpace(
        step=control_step, transition=keep**count, drive=powers.sum(axis=0)[:, None] * one.drive,
        observation=one.observation * powers.mean(axis=0),
        feedthrough=one.feedthrough + (one.observation * reached.mean(axis=0)) @ one.drive,
        zone_means=one.zone_means, uniform=one.uniform, coordinates=one.coordinates,
    )  # fmt: skip


def _channels(actuators: Sequence[Actuator], points: SitePoints) -> tuple[Channel, ...]:
    """Channels of what the plant lets be set, each in the range that all of its actuators share."""
    found = []
    for quantity, entities in ((SUPPLY_AIR, points.air_handlers), (SUPPLY_WATER, (points.boiler,))):
        named = [a for a in actuators if a.name in {f"{entity}/{quantity}" for entity in entities}]
        if named:
            found.append(Channel(quantity, max(a.lowest for a in named), min(a.highest for a in named)))
    if not found:
        wanted = [*(f"{name}/{SUPPLY_AIR}" for name in points.air_handlers), f"{points.boiler}/{SUPPLY_WATER}"]
        need_actuator("controller", wanted, actuators)
    return tuple(found)


def _check_forecasts(plant: SimulatedPlant, ahead: Horizon) -> None:
    needed = float(ahead.edges[-1])
    known = 0.0 if plant.forecaster is None else plant.forecaster.horizon * plant.scenario.grid.step
    expected, found = f"{needed / 3600.0:g} h, the horizon", f"{known / 3600.0:g} h"
    advice = "make the plant with a longer horizon, or the controller with a shorter one"
    ControlError.unless(known + 1e-6 >= needed, "forecasts of the plant", expected, found, advice)
