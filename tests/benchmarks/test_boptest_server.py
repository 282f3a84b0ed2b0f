"""The benchmark of the BOPTEST server, on a small building and a handful of steps."""

from __future__ import annotations

import os
from collections.abc import Callable
from types import ModuleType

import pytest

from mpc.adapters.boptest.make import pilot_to_serve
from mpc.adapters.boptest.server import BoptestServer


@pytest.fixture(scope="module")
def benchmark(script: Callable[[str], ModuleType]) -> ModuleType:
    script("_table")
    return script("boptest_server")


def test_a_few_steps_are_measured(benchmark: ModuleType) -> None:
    case = pilot_to_serve(1, floor_area=200.0, zones=4, floors=1, dx=1.0, days=6.0, name="tiny")
    with BoptestServer([case]) as server:
        found = benchmark.measure(server.url, os.getpid(), ["tiny"], clients=3, steps=5)
        assert len(server.tests) == 0
    many = found["tiny"]["many"]
    assert many["steps"] == 3 and many["rate"] > 0.0 and many["most"] >= many["median"] > 0.0
    text = benchmark.report(found)
    assert "| tiny |" in text and "3 clients: steps a second" in text
