"""Optimal control of a site whose model is that of a calibrated building with air handlers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from mpc.control.controller.controller import MpcController
from mpc.control.controller.outlook import PlanOutlook
from mpc.control.controller.site import Action, ControllerSettings, ResetRule
from mpc.errors import LiveError
from mpc.live.site import Site
from mpc.live.site_file import BuildingModel
from mpc.loop.actuators import Actuator
from mpc.loop.make import equip
from mpc.loop.plant import Measurements
from mpc.loop.sensors import plant_devices
from mpc.model import control_model, model_settings
from mpc.scenario.forecast import Forecast
from mpc.studies.optimal_control import Site as ControlledSite
from mpc.studies.optimal_control import make_controller
from thermal.case.building import Building
from thermal.case.load import load_building
from thermal.effects.gains import has_people
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem


@dataclass(frozen=True)
class _Reached:
    """A building by what may be set in it."""

    control_step: float
    actuators: tuple[Actuator, ...]


class BuildingController:
    """Optimal control of a building, whose forecasts of heat are left out where the model has that heat itself.

    Parameters
    ----------
    controller : MpcController
        Of the building.
    gains : bool
        Whether the model has the heat of people and equipment, as after a calibration with ``internal_gains``.
    """

    def __init__(self, controller: MpcController, gains: bool) -> None:
        self.controller, self._gains = controller, gains

    @property
    def outlook(self) -> PlanOutlook | None:
        """What the plan of the last step is expected to lead to; None where it is not followed."""
        return self.controller.outlook

    @property
    def columns(self) -> tuple[str, ...]:
        """Measurements that it is asked with, ``ENTITY/POINT``."""
        return self.controller.points.columns

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Action:
        """Choose setpoints for the next control step.

        Parameters
        ----------
        measurements : Measurements
            Of the step that has ended.
        forecast : Forecast
            From now on.
        """
        if forecast is not None:
            forecast = Forecast(self._without(forecast.table))
        return self.controller.step(measurements, forecast)

    def start_up(self, telemetry: pd.DataFrame) -> pd.DataFrame:
        """Bring the state up from the time before the first step.

        Parameters
        ----------
        telemetry : DataFrame
            As of `MpcController.start_up`.

        Returns
        -------
        DataFrame, shape (n_step, n_zone)
            Heat that the model lacked, as there [W].
        """
        return self.controller.start_up(self._without(telemetry))

    @property
    def station(self) -> str:
        """Name of the weather station."""
        return self.controller.points.weather_station

    def _without(self, table: pd.DataFrame) -> pd.DataFrame:
        gains = [str(column) for column in table if str(column).endswith("/internal_gain")]
        return table.assign(**dict.fromkeys(gains, 0.0)) if self._gains else table


def building_controller(site: Site, model: BuildingModel, actuators: tuple[Actuator, ...]) -> BuildingController:
    """Make the controller of a site that has a building.

    Its HVAC system is sized from the building's loads, as in ``buildingmpc control``.

    Parameters
    ----------
    site : Site
        As read.
    model : BuildingModel
        Of its file.
    actuators : tuple of Actuator
        What may be set, in the site's ranges.

    Raises
    ------
    LiveError
        When zones of building and plant differ, or a point that the state is estimated from is none of the site's.
    """
    building, system, parameters = believed(site, model)
    devices = plant_devices(building, system)
    settings = ControllerSettings(rule=own_rule(model))
    controller = make_controller(
        control_model(building, parameters), _Reached(site.step, actuators),
        site=ControlledSite(building, devices.named(system), devices), settings=settings,
    )  # fmt: skip
    zones = {f"{name}/zone_air_temperature_sensor" for name in controller.points.terminals}
    needed = set(controller.points.columns) - zones - set(controller.points.meters)
    missing = sorted(needed - set(site.file.points))
    expected = "all that the state of a building is estimated from"
    LiveError.unless(not missing, f"{site.path.name}: points", expected, f"none of {', '.join(missing[:5])}")
    return BuildingController(controller, has_people(building, model_settings(parameters).effects))


def believed(site: Site, model: BuildingModel) -> tuple[Building, HvacSystem, Path | None]:
    """Give what a site's controller takes its building for.

    Parameters
    ----------
    site : Site
        As read.
    model : BuildingModel
        Of its file.

    Returns
    -------
    tuple
        The building with its devices, its HVAC system, sized from its loads, and its parameters.

    Raises
    ------
    LiveError
        When zones of building and plant differ.
    """
    here, where = site.path.parent, f"{site.path.name}: model.building"
    building, _ = equip(load_building(here / model.building))
    differing = sorted(set(building.zone_names) ^ set(site.plant.zones))
    expected = f"the zones of {site.plant_path.name}"
    LiveError.unless(not differing, where, expected, f"other ones: {', '.join(differing[:5])}")
    return building, size_system(building), None if model.parameters is None else here / model.parameters


def own_rule(model: BuildingModel) -> ResetRule:
    """Give the building's own control.

    Parameters
    ----------
    model : BuildingModel
        Of the site's file.
    """
    own = model.own_control
    return ResetRule(own.cold, own.warm, own.air, own.water)
