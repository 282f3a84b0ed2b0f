"""Controllers by rule, which optimal control is compared with: schedule, outdoor reset, ASHRAE Guideline 36."""

from mpc.baselines.guideline36 import Guideline36, Guideline36Settings
from mpc.baselines.requests import HysteresisRequests, SuppressedRequests
from mpc.baselines.reset import OutdoorReset
from mpc.baselines.schedule import day_schedule
from mpc.baselines.trim_respond import TrimRespond, TrimRespondLoop

__all__ = [
    "Guideline36",
    "Guideline36Settings",
    "HysteresisRequests",
    "OutdoorReset",
    "SuppressedRequests",
    "TrimRespond",
    "TrimRespondLoop",
    "day_schedule",
]
