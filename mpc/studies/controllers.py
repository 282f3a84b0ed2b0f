"""Controllers by name: three rules, optimal control, the perfect bound, and those that others register."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mpc.baselines.guideline36 import Guideline36
from mpc.baselines.rules import OutdoorReset, day_schedule
from mpc.errors import ControlError
from mpc.loop.actuators import Actuator
from mpc.loop.plant import Controller
from mpc.loop.simulated import SimulatedPlant
from mpc.studies.bound import knowing_observer
from mpc.studies.controller import default_horizon, make_controller, site_points
from mpc.studies.study import HORIZON_HOURS, Study
from thermal.errors import describe, nearest

#: Makes a controller for a plant of a study.
ControllerFactory = Callable[[Study, SimulatedPlant], Controller]


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
    """

    name: str
    make: ControllerFactory
    title: str
    about: str
    predictive: bool = False
    perfect: bool = False


#: Controllers by name.
REGISTERED: dict[str, RegisteredController] = {}


def register_controller(
    name: str, *, title: str = "", about: str = "", predictive: bool = False, perfect: bool = False
) -> Callable[[ControllerFactory], ControllerFactory]:
    """Register a function that makes a controller, as a decorator; a name that is taken gets the new one.

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

    Examples
    --------
    >>> @register_controller("still", title="setpoints that stand still")
    ... def still(study, plant):
    ...     return day_schedule(required_actuators(plant))
    >>> find_controller("still").title
    'setpoints that stand still'
    >>> del REGISTERED["still"]
    """

    def register(make: ControllerFactory) -> ControllerFactory:
        REGISTERED[name] = RegisteredController(name, make, title or name, about, predictive, perfect)
        return make

    return register


def find_controller(name: str) -> RegisteredController:
    """Find a controller by name.

    Parameters
    ----------
    name : str
        ``mpc``, ``schedule``, ``reset``, ``guideline36``, ``bound``, or one that was registered.

    Raises
    ------
    ControlError
        When there is none of this name; with the nearest one.
    """
    if name not in REGISTERED:
        expected = f"one of {', '.join(REGISTERED)}"
        raise ControlError(describe("controller", expected, repr(name), nearest(name, REGISTERED)))
    return REGISTERED[name]


def required_actuators(plant: SimulatedPlant) -> tuple[Actuator, ...]:
    """Give the setpoints that every action must have.

    Parameters
    ----------
    plant : SimulatedPlant
        To be controlled.
    """
    return tuple(a for a in plant.actuators if a.required)


@register_controller(
    "mpc", title="optimal control", predictive=True,
    about="Every {step} minutes supply air and water are chosen so that energy and discomfort cost least over the "
    "next {hours:g} hours, according to the model of the building, the forecast and the prices.",
)  # fmt: skip
def _optimal(study: Study, plant: SimulatedPlant) -> Controller:
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
