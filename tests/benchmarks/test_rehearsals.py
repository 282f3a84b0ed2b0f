"""Rehearsals: a recorded day in closed loop with the site's model, under its weather, people, prices and forecasts."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from typer.testing import CliRunner

from calibration.evaluation.settings import ModelSettings
from mpc.cli.app import app
from mpc.errors import LiveError
from mpc.live.audit import AuditLog
from mpc.live.planner import forecast_to_dict
from mpc.live.rehearsal import rehearse
from mpc.live.site import Site
from mpc.loop.run import FixedSetpoints
from thermal.case.load import load_building


def record(site: Site, plant: Any, days: int = 1) -> None:
    """Log plans of days under the building's own control, with what they rest on."""
    log, each = AuditLog(site.folder, "controller", dict), round(site.step / plant.control_step)
    seen, columns = [plant.reset()], plant.columns
    for _ in range(96 * days):
        means = dict(zip(columns, np.mean([s.values_array for s in seen], axis=0).tolist(), strict=True))
        inputs = {"begin": seen[-1].seconds, "means": means, "forecast": forecast_to_dict(plant.forecast())}
        log.append("plan", {"inputs": inputs, "plan": {"ahead": {"rule": {"rule": 2.0, "plan": 1.0, "saving": 0.25}}}})
        seen = [plant.step({}) for _ in range(each)]
    log.close()


@pytest.mark.long
def test_a_recorded_day_is_run_through_anew(office_site: Callable[[float], Any], tmp_path: Path) -> None:
    """The own control costs by the model what it did in the building, as the heat that the model lacks is found."""
    device, plant, path = office_site(1.0)
    device.stop()
    site, out = Site(path), tmp_path / "rehearsed"
    record(site, plant)
    other = AuditLog(site.folder, "controller", dict)  # a plan of another control step counts for nothing
    at = pd.Timestamp("2023-01-09T03:10", tz="Etc/GMT+8").timestamp()
    other.append("plan", {"inputs": {"begin": at, "means": {}, "forecast": forecast_to_dict(plant.forecast())}, "plan": {}})
    other.close()
    made = CliRunner().invoke(app, ["rehearse", str(site.path), "--out", str(out), "--json"])
    assert made.exit_code == 0, made.output
    told, done = json.loads(made.stdout), plant.bought().iloc[0]
    (day,) = told["days"]
    assert (told["steps"], told["lost"], told["promised"], day["day"]) == (96, 0, 0.25, "2023-01-09")
    assert day["own_cost"] == pytest.approx(done["cost"], rel=0.05)
    assert day["own_energy"] == pytest.approx(done["energy"], rel=0.05)
    assert 0.0 < told["saving"] == pytest.approx(1.0 - day["cost"] / day["own_cost"])
    assert "On this day acting would have saved" in (out / "report.html").read_text(encoding="utf-8")
    assert pd.read_parquet(out / "days.parquet")["cost"].iloc[0] == day["cost"]
    begin = pd.Timestamp("2023-01-09T12:00", tz="Etc/GMT+8")
    with pytest.raises(LiveError, match="a day of the controller's plans with their forecasts, found 48 steps"):
        rehearse(site, begin)
    with pytest.raises(LiveError, match="found no steps of what is logged, 2023-01-09 00:00:00-08:00 to 2023-01-09 23:45"):
        rehearse(site, begin + pd.DateOffset(years=1))
    with pytest.raises(LiveError, match="end: expected a time after 2023-01-09 12:00"):
        rehearse(site, begin, begin)
    log = site.folder / "controller-000000.jsonl"
    log.write_text(log.read_text().replace("/supply_air_flowrate_sensor", "/another_sensor"))
    with pytest.raises(LiveError, match="expected nine tenths of what zones and terminals showed .* found 7"):
        rehearse(site)


def own_cost(site: Site, gain: float) -> float:
    """Rehearse with a model that has people's heat [W/m2] as an effect; cost of the building's own control."""
    effects = {"internal_gains": ()}
    building = load_building(site.path.parent / "../case")
    values = {p.name: p.start for p in ModelSettings(effects=effects).network(building).parameters}
    content = {"parameters": values | {"internal_gain": gain}, "settings": {"effects": {"internal_gains": []}}}
    (site.path.parent / "model.json").write_text(json.dumps(content))
    told = yaml.safe_load(site.path.read_text())
    other = site.path.with_name("other.yaml")
    other.write_text(yaml.safe_dump(told | {"model": told["model"] | {"parameters": "model.json"}}))
    return float(rehearse(Site(other), controller=FixedSetpoints({}, ())).days["own_cost"].sum())


@pytest.mark.long
def test_own_control_costs_what_it_did_whatever_the_model_takes_people_for(office_site: Callable[[float], Any]) -> None:
    """Heat that the model has is not found to be lacking as well, and heat that it has too much of is taken away."""
    device, plant, path = office_site(1.0)
    device.stop()
    site = Site(path)
    record(site, plant)
    for gain in (0.0, 25.0):
        assert own_cost(site, gain) == pytest.approx(plant.bought()["cost"].iloc[0], rel=0.05)


@pytest.mark.long
def test_a_monday_makes_up_for_the_weekend(office_site: Callable[[float], Any]) -> None:
    """Of a week the building has a week behind it; a day by itself has itself behind it."""
    device, plant, path = office_site(7.0)
    device.stop()
    site = Site(path)
    record(site, plant, 7)
    idle, monday = FixedSetpoints({}, ()), pd.Timestamp("2023-01-09", tz="Etc/GMT+8")
    told: list[tuple[int, int]] = []
    week = rehearse(site, controller=idle, progress=lambda _, done, total: told.append((done, total)))
    assert (len(week.days), week.steps, week.days.index[0]) == (7, 7 * 96, monday)
    assert told == [(k + 1, 2 * 17 * 96) for k in range(2 * 17 * 96)]  # two weeks, and a Monday thrice
    days = rehearse(site, monday + pd.Timedelta(hours=14), monday + pd.Timedelta(days=2.5), controller=idle)
    assert (list(days.days.index), days.steps, days.lost) == ([monday + pd.Timedelta(days=1)], 96, 0)  # the whole one
    alone = rehearse(site, end=monday + pd.Timedelta(days=1), controller=idle)
    assert len(alone.days) == 1
    assert np.isnan(week.to_frame()["saving"].iloc[5:]).all()  # a weekend costs nothing but round-off
    friday = rehearse(site, monday + pd.Timedelta(days=4), monday + pd.Timedelta(days=5), controller=idle)
    assert (friday.steps, friday.lost) == (96, 0)  # four days, which were recorded before, are behind it
    assert friday.days["own_energy"].iloc[0] == pytest.approx(week.days["own_energy"].iloc[4], rel=0.05)
    paid = plant.bought()["energy"]  # of a Monday that had Mondays before it, as a plant of ours begins
    np.testing.assert_allclose(week.days["own_energy"].iloc[1:], paid.iloc[1:], rtol=0.03, atol=1.0)
    assert alone.days["own_energy"].iloc[0] == pytest.approx(paid.iloc[0], rel=0.03)
    assert week.days["own_energy"].iloc[0] > 1.05 * alone.days["own_energy"].iloc[0]
    np.testing.assert_allclose(week.days["energy"], week.days["own_energy"], rtol=1e-9)
