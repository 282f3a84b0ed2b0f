"""Figures of the reports: each a picture that carries its own data, so that a page needs nothing else."""

from calibration._figures._drift import drift_boxes, median_run
from calibration._figures._error import error_growth
from calibration._figures._field import Field, spatial_field
from calibration._figures._parameters import parameter_ranges
from calibration._figures._plan import floor_maps, plan_drawings
from calibration._figures._quality import quality_timeline
from calibration._figures._series import Series, series_of_runs, zone_panels
from calibration._figures._style import Picture
from calibration._figures._tiles import tile_map

__all__ = [
    "Field",
    "Picture",
    "Series",
    "drift_boxes",
    "error_growth",
    "floor_maps",
    "median_run",
    "parameter_ranges",
    "plan_drawings",
    "quality_timeline",
    "series_of_runs",
    "spatial_field",
    "tile_map",
    "zone_panels",
]
