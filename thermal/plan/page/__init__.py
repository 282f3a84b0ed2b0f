"""The labelling page: floor plans and a list of devices become a case in a browser.

Needs the extra ``[pages]`` (``pip install "buildingmpc[pages]"``) beside ``[plan]``.
"""

from thermal.plan.page._app import LabelDesk, create_app
from thermal.plan.page._convert import building_of_draft, draft_of
from thermal.plan.page._draft import Draft, DraftDevice, DraftFloor, Picture, Site
from thermal.plan.page._findings import DraftFinding, find_faults
from thermal.plan.page._reports import ReportMaker
from thermal.plan.page._serve import serve_page
from thermal.plan.page._start import import_list, import_sheet
from thermal.plan.page._store import CaseStore

__all__ = [
    "CaseStore",
    "Draft",
    "DraftDevice",
    "DraftFinding",
    "DraftFloor",
    "LabelDesk",
    "Picture",
    "ReportMaker",
    "Site",
    "building_of_draft",
    "create_app",
    "draft_of",
    "find_faults",
    "import_list",
    "import_sheet",
    "serve_page",
]
