"""The labelling page: floor plans and a list of devices become a case in a browser.

Needs the extra ``[pages]`` (``pip install "buildingmpc[pages]"``) beside ``[plan]``.
"""

from thermal.plan.page.app import LabelDesk, create_app
from thermal.plan.page.convert import building_of_draft, draft_of
from thermal.plan.page.draft import Draft, DraftDevice, DraftFloor, Picture, Site
from thermal.plan.page.findings import DraftFinding, find_faults
from thermal.plan.page.reports import ReportMaker
from thermal.plan.page.serve import serve_page
from thermal.plan.page.start import import_list, import_sheet
from thermal.plan.page.store import CaseStore

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
