"""What the EnergyPlus inputs (epJSON) of the bundled case and of the trials have in common."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import Any

STEPS_PER_HOUR = 12
SITE_OUTPUTS = {
    "outside_air_temperature_sensor": "Site Outdoor Air Drybulb Temperature",
    "wind_speed_sensor": "Site Wind Speed",
    "wind_direction_sensor": "Site Wind Direction",
    "horizontal_infrared_irradiance_sensor": "Site Horizontal Infrared Radiation Rate per Area",
    "direct_normal_irradiance_sensor": "Site Direct Solar Radiation Rate per Area",
    "diffuse_horizontal_irradiance_sensor": "Site Diffuse Solar Radiation Rate per Area",
}

Objects = dict[str, dict[str, dict[str, Any]]]


def frame(run_period: str, first: date, last: date) -> Objects:
    """Return version, steps, run period and rules of geometry, by EnergyPlus class and object name.

    Parameters
    ----------
    run_period : str
        Its name.
    first, last : date
        First and last day of the run.
    """
    return {
        "Version": {"Version 1": {"version_identifier": "25.2"}},
        "Timestep": {"Timestep 1": {"number_of_timesteps_per_hour": STEPS_PER_HOUR}},
        # No system step shorter than a zone step: what is reported over a step is then what the heat balance used.
        "ConvergenceLimits": {"ConvergenceLimits 1": {"minimum_system_timestep": 60 // STEPS_PER_HOUR}},
        "SimulationControl": {
            "SimulationControl 1": {
                "do_zone_sizing_calculation": "No",
                "do_system_sizing_calculation": "No",
                "do_plant_sizing_calculation": "No",
                "run_simulation_for_sizing_periods": "No",
                "run_simulation_for_weather_file_run_periods": "Yes",
            }
        },
        "RunPeriod": {
            run_period: {
                "begin_month": first.month,
                "begin_day_of_month": first.day,
                "begin_year": first.year,
                "end_month": last.month,
                "end_day_of_month": last.day,
                "end_year": last.year,
                "use_weather_file_daylight_saving_period": "No",
                "use_weather_file_holidays_and_special_days": "No",
            }
        },
        "GlobalGeometryRules": {
            "rules": {
                "starting_vertex_position": "UpperLeftCorner",
                "vertex_entry_direction": "Counterclockwise",
                "coordinate_system": "Relative",  # in world coordinates EnergyPlus ignores the north axis
            }
        },
    }


def merge(objects: Objects, part: Objects) -> None:
    """Add objects, class by class.

    Parameters
    ----------
    objects : dict
        By class and name; changed.
    part : dict
        What to add.
    """
    for kind, content in part.items():
        objects.setdefault(kind, {}).update(content)


def constant(value: float) -> dict[str, Any]:
    """Return a schedule that stays at a value unless the run drives it.

    Parameters
    ----------
    value : float
        Any unit.
    """
    return {"schedule_type_limits_name": "any", "hourly_value": value}


def polygon(points: Sequence[Sequence[float]]) -> dict[str, Any]:
    """Return the vertices of a surface.

    Parameters
    ----------
    points : sequence of (x, y, z)
        Corners [m].
    """
    names = ("vertex_x_coordinate", "vertex_y_coordinate", "vertex_z_coordinate")
    return {"vertices": [dict(zip(names, point, strict=True)) for point in points]}
