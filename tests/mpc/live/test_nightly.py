"""Nights of a site: when they are due, what they tell, and a leaking valve that is named with its day."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas as pd
import pytest

from mpc.live.nightly import Nightly, fresh
from mpc.live.page.app import site_status
from mpc.live.page.metrics import metrics
from mpc.live.state import read_state, write_state


@pytest.fixture(scope="module")
def nightly(
    script: Callable[[str], ModuleType], postgres: Any, tmp_path_factory: pytest.TempPathFactory
) -> Nightly:  # fmt: skip
    case, _ = script("_monitored_years").make_year(500, True, 32, "valve_leak", start=20)
    folder = tmp_path_factory.mktemp("nightly")
    made: Nightly = script("_nightly_site").make_site(folder, case, postgres.address, "nightly", 14)
    return made


def test_a_leaking_valve_is_named_with_its_day(nightly: Nightly) -> None:
    now = pd.Timestamp("2023-02-01 02:30", tz=nightly.zone).timestamp()
    assert nightly.due(now) == now  # there was none yet
    state = nightly.evaluate(now)
    assert state["trouble"] == "" and state == read_state(nightly.state_path) and len(state["weekly"]) == 5
    (event,) = state["events"]
    assert (event["effect"], event["since"], event["until"]) == ("valve_leak", "2023-01-22", "lasts")
    assert "F1_E01" in event["where"] and (nightly.site.folder / "nightly" / "report.html").is_file()
    assert fresh({}, state) == [f"since 2023-01-22: {event['what']} {event['where']} ({event['sure']})"]
    assert fresh(state, state) == []
    assert site_status(nightly.site)["nightly"] == state
    pytest.importorskip("prometheus_client", reason="needs the extra [live]")
    assert b"buildingmpc_nightly_changes 1.0" in metrics(nightly.site.folder, {})


def test_a_night_without_a_verdict_is_told_beside_the_last_one(nightly: Nightly) -> None:
    write_state(nightly.state_path, {"time": 0.0, "sentence": "Nothing has changed.", "events": [], "weekly": [0.2]})
    state = nightly.evaluate(pd.Timestamp("2023-01-10", tz=nightly.zone).timestamp())
    assert "14 reference days and a week" in state["trouble"] and state["sentence"] == "Nothing has changed."


def test_nights_are_due_at_their_local_time(nightly: Nightly, tmp_path: Path) -> None:
    def at(text: str) -> float:
        return pd.Timestamp(text, tz=nightly.zone).timestamp()

    for last, due in (("01-10 02:30", "01-11 02:30"), ("01-10 01:00", "01-10 02:30"), ("01-10 23:59", "01-11 02:30")):
        write_state(nightly.state_path, {"time": at(f"2023-{last}")})
        assert nightly.due(at("2023-01-15 12:00")) == at(f"2023-{due}")
    write_state(nightly.state_path, {"time": at("2024-01-01")})  # of a clock that was put back
    assert nightly.due(at("2023-01-15 12:00")) == at("2023-01-15 12:00")
