"""From drawings and device lists to a case: raster, vector and coded plans; devices of CSV, Brick and Haystack.

Needs the extra ``[plan]`` (``pip install "buildingmpc[plan]"``); its packages are imported when they are first used.
"""

from thermal.plan._align import align_floors
from thermal.plan._assemble import PlanImport, assemble_plans
from thermal.plan._attach import with_telemetry
from thermal.plan._cells import ZonedFloor
from thermal.plan._codes import read_codes, survey_codes
from thermal.plan._columns import read_columns, read_matches, write_matches
from thermal.plan._devices import DeviceImport, ListedPoint, read_devices
from thermal.plan._drawing import Drawing, read_drawing
from thermal.plan._folder import building_of, save_plan_case, with_devices
from thermal.plan._kept import check_nothing_lost, held_work, save_with_labels
from thermal.plan._list import DrawingList, DrawingScale, FloorEntry, import_drawings, read_drawing_list, read_floor
from thermal.plan._match import PointMatch, match_points
from thermal.plan._picture import draw_floor, import_page
from thermal.plan._rooms import find_rooms
from thermal.plan._scale import scale_from_length, scale_from_paper, scale_from_points
from thermal.plan._survey import Door, FloorSurvey, PlanSettings, Room
from thermal.plan._vector import read_dxf
from thermal.plan._zones import propose_zones

__all__ = [
    "DeviceImport",
    "Door",
    "Drawing",
    "DrawingList",
    "DrawingScale",
    "FloorEntry",
    "FloorSurvey",
    "ListedPoint",
    "PlanImport",
    "PlanSettings",
    "PointMatch",
    "Room",
    "ZonedFloor",
    "align_floors",
    "assemble_plans",
    "building_of",
    "check_nothing_lost",
    "draw_floor",
    "find_rooms",
    "held_work",
    "import_drawings",
    "import_page",
    "match_points",
    "propose_zones",
    "read_codes",
    "read_columns",
    "read_devices",
    "read_drawing",
    "read_drawing_list",
    "read_dxf",
    "read_floor",
    "read_matches",
    "save_plan_case",
    "save_with_labels",
    "scale_from_length",
    "scale_from_paper",
    "scale_from_points",
    "survey_codes",
    "with_devices",
    "with_telemetry",
    "write_matches",
]
