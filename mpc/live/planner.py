"""Plans of a site: what was measured and is forecast in, values of points out; the same in operation and replay."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from mpc.adapters.described.actuators import described_actuators
from mpc.baselines.plants import FullSpeed
from mpc.control.controller.site import Action
from mpc.control.identified.action import PlannedAction
from mpc.control.identified.controller import IdentifiedController
from mpc.errors import ControlError, LiveError, MpcError
from mpc.identify.machines import find_machines
from mpc.identify.model import read_model
from mpc.identify.water import sensor_of
from mpc.live.building import BuildingController, building_controller
from mpc.live.past import past_table
from mpc.live.site import Site
from mpc.live.site_file import BuildingModel
from mpc.loop.actuators import SUPPLY_WATER, Actuator
from mpc.loop.plant import Controller, Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal.case.points import OUTDOOR_TEMPERATURE


def site_actuators(site: Site) -> tuple[Actuator, ...]:
    """List what a site's controller plans for, with the ranges of the site where it has them.

    Parameters
    ----------
    site : Site
        As read.
    """
    ranges = {name: entry.range for name, entry in site.file.points.items() if entry.range is not None}
    return described_actuators(site.plant, ranges)


def site_controller(site: Site) -> Controller:
    """Make the controller that a site names.

    Parameters
    ----------
    site : Site
        As read.

    Raises
    ------
    LiveError
        When its model is of another control step.
    """
    actuators = site_actuators(site)
    entry = site.file.model
    by_rule = site.file.controller == "full_speed"
    if isinstance(entry, BuildingModel) and not by_rule:
        return building_controller(site, entry, actuators)
    if entry is None or isinstance(entry, BuildingModel):
        return FullSpeed(find_machines(actuators, tuple(site.file.points), tuple(site.plant.zones)))
    model = read_model(site.path.parent / entry)
    if by_rule:
        return FullSpeed(tuple(found.machine for found in model.bound(actuators).maps))
    LiveError.unless(
        abs(model.step - site.step) < 1e-6, f"{site.path.name}: model", f"steps of {site.step:g} s, those of the plant",
        f"{model.step:g} s", "identify the plant anew",
    )  # fmt: skip
    return IdentifiedController(model, actuators, site.plant.location)


class Planner:
    """Makes plans of recorded inputs.

    Parameters
    ----------
    site : Site
        As read.
    controller : Controller, optional
        In the place of the site's own.
    """

    def __init__(self, site: Site, controller: Controller | None = None) -> None:
        self.site = site
        self.controller = controller or site_controller(site)
        self._layout = PointLayout(tuple(site.file.points), site.plant.location.timezone)

    def start_up(self, past: Sequence[Mapping[str, Any]], begin: float) -> None:
        """Let the controller of a building know the time before its first plan.

        Parameters
        ----------
        past : sequence of mapping
            Of `mpc.live.past.recent_past`.
        begin : float
            Of the step that is to be planned [s].
        """
        if isinstance(self.controller, BuildingController) and len(past) > 1:
            place = self.site.plant.location.timezone, self.controller.station
            with contextlib.suppress(ControlError):  # without a temperature the first plan begins at what is seen
                self.controller.start_up(past_table(past, begin, self.site.step, *place))

    def plan(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Plan a step.

        Parameters
        ----------
        inputs : mapping
            ``begin`` of the step [s], ``means`` of the step that has ended by column (None is missing) [library's
            units], ``forecast`` of `forecast_to_dict`, or ``trouble``: why there is nothing to plan on.

        Returns
        -------
        dict
            ``status`` (``planned``, or why there is none), ``values`` of points that may be written, ``other`` of those
            that may not, ``reasons``, ``ahead``: what is expected, and ``expects``.
        """
        if inputs["trouble"]:
            return no_plan(inputs["trouble"])
        seen = [math.nan if inputs["means"].get(c) is None else inputs["means"][c] for c in self._layout.columns]
        measured = Measurements(self._layout, round(inputs["begin"]), np.array(seen))
        try:
            action = self.controller.step(measured, forecast_of_dict(inputs["forecast"]))
        except (MpcError, ArithmeticError, ValueError, KeyError, IndexError) as error:
            return no_plan(f"no plan: {type(error).__name__}: {error}")
        outlook = getattr(self.controller, "outlook", None)
        fallen_back = isinstance(action, Action) and outlook is None
        if fallen_back or (isinstance(action, PlannedAction) and action.solution is None):
            return no_plan("no plan: " + ", ".join(getattr(action, "reasons", ())))
        values = {name: float(value) for name, value in action.items()}
        if not all(math.isfinite(value) for value in values.values()):
            return no_plan("no plan: a value is no number")
        allowed = self.site.writable
        return {
            "status": "planned",
            "values": {name: value for name, value in values.items() if name in allowed},
            "other": {name: value for name, value in values.items() if name not in allowed},
            "reasons": list(getattr(action, "reasons", ())),
            "ahead": _expected(outlook or action),
        }


def no_plan(why: str) -> dict[str, Any]:
    """Say that there is nothing to follow.

    Parameters
    ----------
    why : str
        The reason.
    """
    return {"status": " ".join(why.split())[:200], "values": {}, "other": {}, "reasons": [], "ahead": None}


def _expected(planned: Any) -> dict[str, Any] | None:
    """Temperatures and powers that a plan expects, and what it and the rule cost by the model, for the page."""
    zone, power = getattr(planned, "zone", None), getattr(planned, "power", None)
    if zone is None or power is None or not np.isfinite(zone).all() or not np.isfinite(power).all():
        return None
    rule = getattr(planned, "rule", None)
    told = None if rule is None else {"plan": rule.plan, "rule": rule.rule, "saving": rule.saving}
    return {"step": float(planned.step), "zone": zone.tolist(), "power": power.tolist(), "rule": told}


def forecast_to_dict(forecast: Forecast) -> dict[str, Any]:
    """Give a forecast in plain types, of which `forecast_of_dict` makes the same bits.

    Parameters
    ----------
    forecast : Forecast
        Of a step.
    """
    table = forecast.to_frame()
    values = [[None if v != v else v for v in table[column].astype(float).tolist()] for column in table]
    index = pd.DatetimeIndex(table.index)
    return {
        "columns": [str(column) for column in table],
        "seconds": [stamp.timestamp() for stamp in index],
        "timezone": str(index.tz),
        "values": values,
    }


def forecast_of_dict(content: Mapping[str, Any]) -> Forecast:
    """Make of what `forecast_to_dict` gave.

    Parameters
    ----------
    content : mapping
        Plain types.
    """
    index = pd.to_datetime(np.array(content["seconds"], dtype=float), unit="s", utc=True)
    columns = {
        name: np.array([math.nan if v is None else v for v in values])
        for name, values in zip(content["columns"], content["values"], strict=True)
    }
    return Forecast(pd.DataFrame(columns, index=pd.DatetimeIndex(index).tz_convert(content["timezone"])))


def needed_columns(site: Site, controller: Controller) -> tuple[str, ...]:
    """Name the measurements that plans rest on: all but those of points that are set.

    Parameters
    ----------
    site : Site
        As read.
    controller : Controller
        Of the site.
    """
    if isinstance(controller, BuildingController):
        return tuple(name for name in controller.columns if name in site.file.points)
    zones = {f"{zone}/zone_air_temperature_sensor" for zone in site.plant.zones}
    kept = [name for name in site.file.points if name not in site.plant.actuators]
    inputs = OUTDOOR_TEMPERATURE, "power", sensor_of(SUPPLY_WATER)
    return tuple(name for name in kept if name in zones or any(point in name for point in inputs))
