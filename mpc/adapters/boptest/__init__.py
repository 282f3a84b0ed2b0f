"""BOPTEST, both ways: plants of ours behind its REST API, and a plant behind that API as one of ours.

The server needs the extra ``[pages]``, the client the extra ``[boptest]``; their packages are imported when they are
first used.
"""

from mpc.adapters.boptest.case import BegunPlant, BoptestCase
from mpc.adapters.boptest.clock import YearClock
from mpc.adapters.boptest.guard import check_host
from mpc.adapters.boptest.make import case_to_serve, pilot_to_serve, with_plant
from mpc.adapters.boptest.mapping import BoptestSignals
from mpc.adapters.boptest.periods import Period
from mpc.adapters.boptest.plant import BoptestPlant, BoptestTime
from mpc.adapters.boptest.prices import MarketRate
from mpc.adapters.boptest.server import BoptestServer

__all__ = [
    "BegunPlant",
    "BoptestCase",
    "BoptestPlant",
    "BoptestServer",
    "BoptestSignals",
    "BoptestTime",
    "MarketRate",
    "Period",
    "YearClock",
    "case_to_serve",
    "check_host",
    "pilot_to_serve",
    "with_plant",
]
