"""Settings of a run, and schedules."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ideal_air_trials.fabric import Objects
from ideal_air_trials.specification import STEPS_PER_DAY, STEPS_PER_HOUR, Spec

ALWAYS, DUAL = "always", "dual"  # schedules
_DUAL = 4.0  # control type of thermostats with two set points

Series = NDArray[np.float64]


def settings(spec: Spec) -> Objects:
    """Return all but the building: steps, days, algorithms, files.

    Parameters
    ----------
    spec : Spec
        Of a trial.
    """
    made, days = spec.fabric, spec.starts.normalize()
    first, last = days[0], days[-1]
    return {
        "Version": {"version": {"version_identifier": "25.2"}},
        "Building": {
            "office": {
                "north_axis": spec.layout.orientation, "terrain": made.terrain, "solar_distribution": "FullExterior",
                "loads_convergence_tolerance_value": 0.04, "temperature_convergence_tolerance_value": 0.1,
                "minimum_number_of_warmup_days": 6, "maximum_number_of_warmup_days": 25,
            }
        },
        "Timestep": {"step": {"number_of_timesteps_per_hour": STEPS_PER_HOUR}},
        "SimulationControl": {
            "control": {
                "do_zone_sizing_calculation": "No", "do_system_sizing_calculation": "No",
                "do_plant_sizing_calculation": "No", "run_simulation_for_sizing_periods": "No",
                "run_simulation_for_weather_file_run_periods": "Yes",
            }
        },
        "GlobalGeometryRules": {
            "rules": {
                "starting_vertex_position": "UpperLeftCorner", "vertex_entry_direction": "Counterclockwise",
                "coordinate_system": "Relative",
            }
        },
        "SurfaceConvectionAlgorithm:Inside": {"inside": {"algorithm": made.inside_convection}},
        "SurfaceConvectionAlgorithm:Outside": {"outside": {"algorithm": made.outside_convection}},
        "HeatBalanceAlgorithm": {"conduction": {"algorithm": "ConductionTransferFunction"}},
        "RunPeriod": {
            "run": {
                "begin_month": int(first.month), "begin_day_of_month": int(first.day), "begin_year": int(first.year),
                "end_month": int(last.month), "end_day_of_month": int(last.day), "end_year": int(last.year),
                "use_weather_file_holidays_and_special_days": "No",
                "use_weather_file_daylight_saving_period": "No", "apply_weekend_holiday_rule": "No",
                "use_weather_file_rain_indicators": "Yes", "use_weather_file_snow_indicators": "Yes",
            }
        },
        "ScheduleTypeLimits": {"any": {}},
        "Schedule:Constant": {ALWAYS: _constant(1.0), DUAL: _constant(_DUAL)},
        "ZoneCapacitanceMultiplier:ResearchSpecial": {
            "contents": {"temperature_capacity_multiplier": round(made.air_multiplier, 4)}
        },
        "Output:Constructions": {"constructions": {"details_type_1": "Constructions"}},
        "OutputControl:Files": {"files": {"output_csv": "Yes"}},
    }  # fmt: skip


def _constant(value: float) -> dict[str, Any]:
    return {"schedule_type_limits_name": "any", "hourly_value": value}


def schedule(values: Series, starts: pd.DatetimeIndex) -> dict[str, Any]:
    """Return a schedule of values that change at the steps of a run; before and after it they stay.

    Parameters
    ----------
    values : ndarray, shape (n_time,)
        Its values, of whole days.
    starts : DatetimeIndex, shape (n_time,)
        When steps begin.
    """
    days = starts[::STEPS_PER_DAY]
    before = days[0] - pd.Timedelta(days=1)
    fields: list[Any] = []
    if before.year == days[0].year:
        fields += _day(before, values[:1])
    for day, of_day in zip(days, values.reshape(-1, STEPS_PER_DAY), strict=True):
        fields += _day(day, of_day)
    if (days[-1].month, days[-1].day) != (12, 31):
        fields += _day(pd.Timestamp(days[-1].year, 12, 31), values[-1:])
    return {"schedule_type_limits_name": "any", "data": [{"field": field} for field in fields]}


def _day(last: pd.Timestamp, values: Series) -> list[Any]:
    """Fields of the days up to one that are alike, each with values for equal parts of it."""
    ends = [*np.flatnonzero(np.diff(values)).tolist(), len(values) - 1]
    fields: list[Any] = [f"Through: {last.month}/{last.day}", "For: AllDays"]
    for end in ends:
        minutes = (end + 1) * 24 * 60 // len(values)
        fields += [f"Until: {minutes // 60:02d}:{minutes % 60:02d}", round(float(values[end]), 4)]
    return fields
