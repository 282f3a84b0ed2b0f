"""BOPTEST, both ways: plants of ours behind its REST API, and a plant behind that API as one of ours.

The server needs the extra ``[pages]``, the client the extra ``[boptest]``; their packages are imported when they are
first used.
"""

from mpc.plants.boptest._case import BegunPlant, BoptestCase
from mpc.plants.boptest._clock import YearClock
from mpc.plants.boptest._guard import check_host
from mpc.plants.boptest._make import case_to_serve, pilot_to_serve, with_plant
from mpc.plants.boptest._mapping import BoptestSignals
from mpc.plants.boptest._periods import Period
from mpc.plants.boptest._plant import BoptestPlant, BoptestTime
from mpc.plants.boptest._prices import MarketRate
from mpc.plants.boptest._server import BoptestServer

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
