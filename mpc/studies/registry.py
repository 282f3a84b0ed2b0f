"""Controllers by name: rules, optimal control with and without derivatives, the perfect bound, those of others."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.kalman import KalmanFilter
from mpc.baselines.guideline36 import Guideline36
from mpc.baselines.plants import OwnControl
from mpc.baselines.rules import OutdoorReset, day_schedule
from mpc.control.controller.observer import Observer
from mpc.errors import ControlError
from mpc.loop.actuators import Actuator
from mpc.loop.plant import Controller
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.studies.described import PlantStudy
from mpc.studies.optimal_control import (
    LASTING,
    SENSOR_NOISE,
    UNMEASURED,
    default_horizon,
    held_space,
    make_controller,
    make_sampling_controller,
    site_points,
)
from mpc.studies.study import HORIZON_HOURS, Study
from thermal._types import FloatArray
from thermal.model.modal import modal_model
from thermal.model.reduce import ReducedModel

#: Makes a controller for a plant of a study.
ControllerFactory = Callable[[Any, Any], Controller]

#: What a controller runs on: buildings of cases, described plants, or both.
Subject = Literal["case", "plant", "any"]


@dataclass(frozen=True)
class RegisteredController:
    """A controller that studies, reports and commands know by name.

    Parameters
    ----------
    name : str
        Name in commands and files.
    make : callable
        Makes it for a study and its plant.
    title, about : str
        Name in words, and what it does, for reports.
    predictive : bool
        Whether it acts every control step of the study and gets forecasts; others act every step of the plant.
    perfect : bool
        Whether its sensors are exact and its forecasts know weather and people.
    subject : str
        ``case`` for a `Study` of a case's building, ``plant`` for a `PlantStudy` of a described plant, or ``any``.
    """

    name: str
    make: ControllerFactory
    title: str
    about: str
    predictive: bool = False
    perfect: bool = False
    subject: Subject = "case"


#: Controllers by name.
REGISTERED: dict[str, RegisteredController] = {}


def register_controller(
    name: str,
    *,
    title: str = "",
    about: str = "",
    predictive: bool = False,
    perfect: bool = False,
    subject: Subject = "case",
) -> Callable[[ControllerFactory], ControllerFactory]:
    """Register a function that makes a controller, as a decorator with a name.

    Parameters
    ----------
    name : str
        Name in commands and files.
    title, about : str
        Name in words, the name itself by default, and what it does, for reports.
    predictive : bool
        Whether it acts every control step of the study and gets forecasts.
    perfect : bool
        Whether its sensors are exact and its forecasts know weather and people.
    subject : str
        What it runs on: ``case``, ``plant`` or ``any``.

    Raises
    ------
    ControlError
        When the name is none, or another function has it; the same function may be registered again.

    Examples
    --------
    >>> @register_controller("still", title="setpoints that stand still")
    ... def still(study, plant):
    ...     return day_schedule(required_actuators(plant))
    >>> find_controller("still").title
    'setpoints that stand still'
    >>> del REGISTERED["still"]
    """
    ControlError.unless(str(name).isidentifier(), "controller", "@register_controller('name')", repr(name))

    def register(make: ControllerFactory) -> ControllerFactory:
        taken = name in REGISTERED and REGISTERED[name].make.__qualname__ != make.__qualname__
        ControlError.unless(not taken, "controller", f"a name beside {', '.join(REGISTERED)}", repr(name))
        REGISTERED[name] = RegisteredController(name, make, title or name, about, predictive, perfect, subject)
        return make

    return register


def find_controller(name: str, subject: Subject = "any") -> RegisteredController:
    """Find a controller by name.

    Parameters
    ----------
    name : str
        ``mpc``, ``schedule``, ``reset``, ``guideline36``, ``bound``, ``sampling``, or one that was registered; of
        described plants ``mpc``, ``full_speed`` or ``own``.
    subject : str
        What it shall run on.

    Raises
    ------
    ControlError
        When there is none of this name; with the nearest one.
    """
    known = {n: e for n, e in REGISTERED.items() if "any" in (subject, e.subject) or e.subject == subject}
    ControlError.unless_known(name, known, "controller", f"one of {', '.join(known)}")
    return known[name]


def required_actuators(plant: SimulatedPlant) -> tuple[Actuator, ...]:
    """Give the setpoints that every action must have.

    Parameters
    ----------
    plant : SimulatedPlant
        To be controlled.
    """
    return tuple(a for a in plant.actuators if a.required)


@register_controller(
    "mpc", title="optimal control", predictive=True, subject="any",
    about="Every {step} minutes {decided} are chosen so that energy and discomfort cost least over the "
    "next {hours:g} hours, according to the model of the building, the forecast and the prices.",
)  # fmt: skip
def _optimal(study: Study | PlantStudy, plant: Any) -> Controller:
    if isinstance(study, PlantStudy):
        return study.optimal(plant)
    ahead = default_horizon(study.settings.control_step, HORIZON_HOURS)
    return make_controller(study.model, plant, settings=study.controller_settings, horizon=ahead)


@register_controller(
    "schedule", title="fixed schedule",
    about="Supply air stands at its design value; supply water is hot by day and cooler by night.",
)  # fmt: skip
def _schedule(study: Study, plant: SimulatedPlant) -> Controller:
    return day_schedule(required_actuators(plant))


@register_controller("reset", title="outdoor reset", about="Supply air and water follow the outdoor temperature.")
def _reset(study: Study, plant: SimulatedPlant) -> Controller:
    return OutdoorReset(required_actuators(plant), study.building.weather_station)


@register_controller(
    "guideline36", title="Guideline 36",
    about="Supply air and water drift to where they cost least until zones or valves ask for more "
    "(ASHRAE Guideline 36, trim and respond).",
)  # fmt: skip
def _guideline36(study: Study, plant: SimulatedPlant) -> Controller:
    served_by = plant.system.terminals.air_handler.tolist()
    return Guideline36(site_points(study.building, plant.devices), served_by, required_actuators(plant))


@register_controller(
    "bound", title="perfect bound", predictive=True, perfect=True,
    about="As optimal control, but on a plant that is its own model, with exact sensors, and with weather and "
    "people known in advance: what perfect knowledge would reach.",
)  # fmt: skip
def _bound(study: Study, plant: SimulatedPlant) -> Controller:
    return make_controller(
        study.truth, plant, settings=study.controller_settings, observer=knowing_observer(study.truth, plant),
        horizon=default_horizon(study.settings.control_step, HORIZON_HOURS),
    )  # fmt: skip


@register_controller(
    "sampling", title="optimal control by sampling", predictive=True,
    about="As optimal control, but plans are tried, many at once, on a simulated plant without smoothing, and the best "
    "teach where to try next: no derivatives are needed.",
)  # fmt: skip
def _sampling(study: Study, plant: SimulatedPlant) -> Controller:
    return make_sampling_controller(
        study.model, plant, settings=study.controller_settings, hours=HORIZON_HOURS, seed=study.seed
    )


@register_controller(
    "own", title="the plant's own control", subject="plant", about="Nothing is set: the plant is left to itself."
)
def _own(study: PlantStudy, plant: Any) -> Controller:
    return OwnControl()


@register_controller(
    "full_speed", title="full speed with lead", subject="plant",
    about="Machines run at full speed from the lower edge of the comfort band to half a kelvin above it, and not at "
    "all otherwise; the edge is the highest of the next three hours, so that zones are set back in between. Setpoints, "
    "of cooling too, are at that edge.",
)  # fmt: skip
def _full_speed(study: PlantStudy, plant: Any) -> Controller:
    return study.full_speed(plant)


#: Unmeasured heat of a plant that is known, but for the random shuffle of its air [W/m2].
SHUFFLED = 1.0


def knowing_observer(model: ReducedModel, plant: SimulatedPlant) -> Observer | DisturbanceModel:
    """Make the observer of a controller that has the plant's own parameters.

    Parameters
    ----------
    model : ReducedModel
        With the parameters of the plant's building.
    plant : SimulatedPlant
        To be controlled.

    Returns
    -------
    Observer or DisturbanceModel
        `KnownState` where the plant's building is such a model; else hardly any unmeasured heat is expected.
    """
    if isinstance(plant.model, ReducedBuilding):
        return KnownState(model, plant)
    return DisturbanceModel(SHUFFLED * plant.scenario.areas, LASTING, SENSOR_NOISE)


class KnownState(Observer):
    """Reads the state off the plant's building in the place of estimating it; there is no unmeasured heat.

    Parameters
    ----------
    model : ReducedModel
        That the plant's building was made of.
    plant : SimulatedPlant
        Whose building is a `ReducedBuilding` of that model.
    """

    def __init__(self, model: ReducedModel, plant: SimulatedPlant) -> None:
        modes = modal_model(model.matrices(model.theta))
        expected = DisturbanceModel(UNMEASURED * plant.scenario.areas, LASTING, SENSOR_NOISE)
        super().__init__(KalmanFilter(held_space(modes, plant.control_step), expected), modes)
        self._plant = plant

    def start(self, zone: FloatArray, boundary: FloatArray) -> None:
        """Take the state.

        Parameters
        ----------
        zone, boundary : ndarray
            Without effect [K].
        """
        building = self._plant.model
        if isinstance(building, ReducedBuilding):
            self.state[: self.order] = building.modal_state

    def update(self, zone: FloatArray, heat: FloatArray, boundary: FloatArray) -> FloatArray:
        """Take the state.

        Parameters
        ----------
        zone, heat, boundary : ndarray
            Without effect [K], [W], [K].

        Returns
        -------
        ndarray, shape (n_zone,)
            Innovations: none [K].
        """
        self.start(zone, boundary)
        return np.zeros(len(zone))
