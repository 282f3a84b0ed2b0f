"""Figures of the reports: each a picture that carries its own data, so that a page needs nothing else."""

from calibration._figures._diagnosis import change_panels, heat_maps, hour_bars
from calibration._figures._drift import drift_boxes, median_run
from calibration._figures._error import error_growth
from calibration._figures._field import Field, spatial_field
from calibration._figures._growth import drift_lines
from calibration._figures._heat import heat_lines
from calibration._figures._missing import Course, missing_lines
from calibration._figures._parameters import paper_values, parameter_ranges
from calibration._figures._plan import floor_maps, plan_drawings
from calibration._figures._quality import quality_timeline
from calibration._figures._series import Band, Series, error_band, series_of_runs, zone_panels
from calibration._figures._style import Picture
from calibration._figures._tiles import tile_map
from calibration._figures._whiteness import periodogram_bound, whiteness_panels

__all__ = [
    "Band",
    "Course",
    "Field",
    "Picture",
    "Series",
    "change_panels",
    "drift_boxes",
    "drift_lines",
    "error_band",
    "error_growth",
    "floor_maps",
    "heat_lines",
    "heat_maps",
    "hour_bars",
    "median_run",
    "missing_lines",
    "paper_values",
    "parameter_ranges",
    "periodogram_bound",
    "plan_drawings",
    "quality_timeline",
    "series_of_runs",
    "spatial_field",
    "tile_map",
    "whiteness_panels",
    "zone_panels",
]
