"""Figures of the reports: each a picture that carries its own data, so that a page needs nothing else."""

from mpc.reports.figures.diagnosis import change_panels, heat_maps, hour_bars
from mpc.reports.figures.drift import drift_boxes, median_run
from mpc.reports.figures.error import error_growth
from mpc.reports.figures.field import Field, spatial_field
from mpc.reports.figures.growth import drift_lines
from mpc.reports.figures.heat import heat_lines
from mpc.reports.figures.missing import Course, missing_lines
from mpc.reports.figures.parameters import paper_values, parameter_ranges
from mpc.reports.figures.plan import floor_maps, plan_drawings
from mpc.reports.figures.quality import quality_timeline
from mpc.reports.figures.series import Band, Series, error_band, series_of_runs, zone_panels
from mpc.reports.figures.style import Picture
from mpc.reports.figures.tiles import tile_map
from mpc.reports.figures.whiteness import periodogram_bound, whiteness_panels

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
