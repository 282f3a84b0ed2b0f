"""A small building served over real HTTP: uvicorn in a thread, on a free port."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest

from mpc.adapters.boptest.case import BoptestCase
from mpc.adapters.boptest.make import pilot_to_serve
from mpc.adapters.boptest.plant import BoptestPlant, BoptestSettings, BoptestTime
from mpc.adapters.boptest.server import BoptestServer

DAY = 86_400.0


@pytest.fixture(scope="session")
def served() -> BoptestCase:
    """Six zones on a floor, with twelve days of winter."""
    return pilot_to_serve(1, floor_area=300.0, zones=6, floors=1, dx=1.0, days=12.0, name="small")


@pytest.fixture(scope="session")
def server(served: BoptestCase) -> Iterator[BoptestServer]:
    """The building behind a port."""
    with BoptestServer([served], most=80) as running:
        yield running


@pytest.fixture
def http(server: BoptestServer) -> Iterator[httpx.Client]:
    """A client that checks nothing."""
    with httpx.Client(base_url=server.url, timeout=60.0, trust_env=False) as client:
        yield client


@pytest.fixture
def testid(http: httpx.Client) -> Iterator[str]:
    """A test that was not initialized."""
    chosen = http.post("/testcases/small/select").json()["testid"]
    yield chosen
    http.put(f"/stop/{chosen}")


@pytest.fixture
def connect(server: BoptestServer) -> Iterator[Callable[..., BoptestPlant]]:
    """Make plants of the served building: by default the tenth of January with a day of warm-up."""
    made: list[BoptestPlant] = []

    def make(period: Any = None, control_step: float = 300.0, **options: Any) -> BoptestPlant:
        when = BoptestTime(9 * DAY, DAY, DAY) if period is None else period
        made.append(BoptestPlant(server.url, "small", when, control_step, BoptestSettings(**options)))
        return made[-1]

    yield make
    for plant in made:
        plant.close()
