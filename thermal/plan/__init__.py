"""From drawings and device lists to a case: raster, vector and coded plans; devices of CSV, Brick and Haystack.

Needs the extra ``[plan]`` (``pip install "buildingmpc[plan]"``); its packages are imported when they are first used.
"""

from thermal.plan.align import align_floors
from thermal.plan.assemble import PlanImport, assemble_plans
from thermal.plan.attach import with_telemetry
from thermal.plan.cells import ZonedFloor
from thermal.plan.codes import read_codes, survey_codes
from thermal.plan.columns import read_columns, read_matches, write_matches
from thermal.plan.devices import DeviceImport, ListedPoint, read_devices
from thermal.plan.drawing import Drawing, read_drawing
from thermal.plan.folder import building_of, save_plan_case, with_devices
from thermal.plan.kept import check_nothing_lost, held_work, save_with_labels
from thermal.plan.list import DrawingList, DrawingScale, FloorEntry, import_drawings, read_drawing_list, read_floor
from thermal.plan.match import PointMatch, match_points
from thermal.plan.picture import draw_floor, import_page
from thermal.plan.rooms import find_rooms
from thermal.plan.scale import scale_from_length, scale_from_paper, scale_from_points
from thermal.plan.survey import Door, FloorSurvey, PlanSettings, Room
from thermal.plan.vector import read_dxf
from thermal.plan.zones import propose_zones

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
