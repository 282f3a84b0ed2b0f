"""The comparison's statistics against closed forms, and a smoke run of it and of the training."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs the extra [rl]")

from mpc.environment.policy import ActorNetwork


@pytest.fixture(scope="module")
def case(script: Callable[[str], ModuleType]) -> ModuleType:
    script("_site")
    return script("_office_site")


@pytest.fixture(scope="module")
def tables(script: Callable[[str], ModuleType], case: ModuleType) -> ModuleType:
    script("_table")
    return script("_comparison_tables")


@pytest.fixture(scope="module")
def comparison(script: Callable[[str], ModuleType], tables: ModuleType) -> ModuleType:
    for name in (
        "_energyplus_offices",
        "_energyplus_control",
        "_modelled_office",
        "_medium_office_site",
        "_sites",
        "_comparison",
    ):
        script(name)
    script("_threads")
    return script("mpc_vs_rl")


@pytest.fixture(scope="module")
def training(script: Callable[[str], ModuleType], comparison: ModuleType) -> ModuleType:
    pytest.importorskip("torch", reason="needs the extra [rl]")
    pytest.importorskip("stable_baselines3", reason="needs the extra [rl]")
    script("_training")
    return script("train_rl")


def run(controller: str, week: str, days: list[float], price: float = 1.0, discomfort: float = 0.0) -> dict[str, Any]:
    return {"entry": {"controller": controller, "price": price}, "week": week, "days": days, "cost": sum(days),
            "discomfort": discomfort, "about": {}}  # fmt: skip


def test_a_constant_difference_has_an_interval_of_no_width(tables: ModuleType) -> None:
    one = [run("mpc_after", week, [1.0, 5.0, 2.0]) for week in ("winter", "summer")]
    other = [run("schedule", week, [1.5, 5.5, 2.5]) for week in ("winter", "summer")]
    assert tables.bootstrap(other, one) == pytest.approx((1.5, 1.5, 1.5))
    mean, low, high = tables.bootstrap(other)
    assert mean == pytest.approx(9.5) and low < mean < high


def test_an_interval_is_that_of_the_mean_of_days(tables: ModuleType) -> None:
    rng = np.random.default_rng(1)
    days = rng.normal(10.0, 2.0, 60)
    mean, low, high = tables.bootstrap([run("reset", "winter", days.tolist())])
    width = 2.0 * 1.96 * days.std() / np.sqrt(60.0) * 60.0
    assert mean == pytest.approx(days.sum())
    assert high - low == pytest.approx(width, rel=0.1)


def test_seeds_of_a_policy_are_one_line(tables: ModuleType) -> None:
    runs = [run(f"ppo_plant_{k}", "winter", [k + 1.0]) for k in range(3)] + [run("mpc_after", "winter", [1.0], 3.0)]
    found = tables.lines(runs)
    assert list(found) == ["ppo_plant"] and len(tables.by_seed(found["ppo_plant"])) == 3


def test_cost_at_equal_comfort_is_read_off_the_front(tables: ModuleType) -> None:
    runs = [run("mpc_after", "winter", [cost], price, discomfort)
            for cost, price, discomfort in ((30.0, 3.0, 0.0), (20.0, 1.0, 1.0), (18.0, 0.3, 3.0))]  # fmt: skip
    points = tables.front(runs, "mpc_after")
    assert points == [(0.0, 30.0), (1.0, 20.0), (3.0, 18.0)]
    assert [tables.cost_at(points, d) for d in (0.0, 0.5, 2.0, 9.0)] == [30.0, 25.0, 19.0, 18.0]


def test_test_weeks_are_not_those_of_the_training(case: ModuleType) -> None:
    site = case.OfficeSite()
    seeds = [{seed for _, seed in of.values()} for of in (site.test_weeks, site.validation_weeks, site.training_weeks)]
    assert sum(map(len, seeds)) == len(set.union(*seeds))


def test_weeks_of_energyplus_do_not_overlap(script: Callable[[str], ModuleType], comparison: ModuleType) -> None:
    site = script("_sites").SITES["medium_office"]
    weeks = (site.test_weeks, site.validation_weeks, site.training_weeks)
    days = [date.fromisoformat(day) for of in weeks for day, _ in of.values()]
    assert len(days) == len(set(days)) and all(day.weekday() == 0 for day in days)


def test_the_models_of_the_comparison_are_those_of_the_commands(case: ModuleType) -> None:
    known = {world: json.loads(case.model_file(world).read_text()) for world in ("before", "after")}
    assert [entry["effect"] for entry in known["after"]["effects"]] == list(case.EFFECTS)
    assert not known["before"]["effects"]


@pytest.mark.energyplus
@pytest.mark.skipif(find_spec("pyenergyplus") is None, reason="needs EnergyPlus: pip install -e .[energyplus]")
def test_a_model_in_the_place_of_energyplus_shows_what_it_shows(
    script: Callable[[str], ModuleType], comparison: ModuleType
) -> None:
    """Same observation and actions, so that a policy can move; flows of air handlers are those of their terminals."""
    site = script("_medium_office_site").MediumOfficeSite(1)
    week = site.test_weeks["winter"]
    both = [site.plant(week, world) for world in ("plant", "before")]
    worlds = [site.world_of(plant) for plant in both]
    assert worlds[0].layout.features == worlds[1].layout.features
    assert worlds[0].action_space == worlds[1].action_space
    seen = both[1].reset(1)
    for _ in range(20):  # until ten
        seen = both[1].step(dict.fromkeys(site.actions, 290.0))
    terminals = [seen[c] for c in seen if c.endswith("Box Component/supply_air_flowrate_sensor")]
    handlers = [seen[f"VAV_{k}/supply_air_flowrate_sensor"] for k in (1, 2, 3)]
    assert len(terminals) == 15 and sum(handlers) == pytest.approx(sum(terminals)) and min(handlers) > 0.5
    assert seen["VAV_1/supply_air_temperature_setpoint"] == 290.0
    with pytest.raises(ValueError, match="no bound"):
        site.plant(week, bound=True)


def test_do_mpc_stands_beside_ours_on_its_days_only(tables: ModuleType) -> None:
    runs = [run("mpc_after", "winter", [2.0, 3.0]), run("do_mpc", "winter", [2.5])]
    for row, plans in zip(runs, ({"optimal plan": 192}, {"optimal plan": 95, "previous plan": 1}), strict=True):
        row |= {"sources": plans, "step_seconds": {"median": 0.1, "largest": 0.2}}
    text = tables.peers(runs)
    assert "| ours | 2.000 | 0.10 | 0.20 | 192 of 192 |" in text
    assert "| do-mpc | 2.500 | 0.10 | 0.20 | 95 of 96 |" in text
    assert tables.peers(runs[:1]) == ""


@pytest.mark.long
def test_do_mpc_predicts_as_ours_does(
    script: Callable[[str], ModuleType], case: ModuleType, comparison: ModuleType
) -> None:
    """Its own equations at its own plan, against the predictor's roll-out of it; and it stays near our cost."""
    pytest.importorskip("do_mpc", reason="do-mpc comes with the extra [benchmarks]", exc_type=Exception)
    script("_do_mpc_loop")
    site = case.OfficeSite(case.SMOKE)
    plant = site.plant(site.test_weeks["winter"])
    both = [site.peer(name, 1.0, plant, hours=3.0) for name in site.peers]
    # no time for a second start: what do-mpc tells of its zones is of its last solve
    both[0].settings = replace(both[0].settings, time_limit=1e-3)
    seen = plant.reset(1)
    rule = site.controller("schedule", 1.0, plant)
    for _ in range(22):  # until half past five, when heating begins
        seen = plant.step(rule.step(seen, None))
    forecast = plant.forecast()
    peer, ours = (controller.step(seen, forecast).solution for controller in both)
    assert peer is not None and ours is not None and peer.solver == "do-mpc" and peer.usable
    zone = both[0].solver.zones()
    assert np.abs(zone - peer.rollout.zone[1:]).max() < 0.02
    assert peer.terms.total == pytest.approx(ours.terms.total, rel=0.01)


def random_policy(case: ModuleType, folder: Path) -> None:
    """A policy of the small office that nobody has trained."""
    site = case.OfficeSite(case.SMOKE)
    inputs = len(site.world_of(site.plant(site.test_weeks["winter"])).layout)
    rng = np.random.default_rng(0)
    weights = (0.1 * rng.standard_normal((2, inputs)),)
    about = {"steps": 0, "seed": 0, "hours_a_step": 0.25, "cpu_seconds": 0.0, "curve": [[1, 40.0], [2, 30.0]]}
    ActorNetwork(weights, (np.zeros(2),), "tanh", True, about).save(folder / "sac_plant_0.npz")


@pytest.mark.long
def test_smoke_of_the_comparison(case: ModuleType, comparison: ModuleType, tmp_path: Path) -> None:
    random_policy(case, tmp_path)
    asked = ["--out", str(tmp_path / "out"), "--policies", str(tmp_path), "--weeks", "winter", "--smoke",
             "--prices", "1", "--controllers", "reset", "guideline36", "mpc_after", "mpc_sampling",
             "sac_plant_0"]  # fmt: skip
    first = comparison.main(asked)
    by = {row["entry"]["controller"]: row for row in first}
    assert set(by) == {"reset", "guideline36", "mpc_after", "mpc_sampling", "sac_plant_0"}
    assert by["mpc_after"]["sources"] == by["mpc_sampling"]["sources"] == {"optimal plan": 96}
    assert by["mpc_sampling"]["cost"] < 1.3 * by["mpc_after"]["cost"]
    site = case.OfficeSite(case.SMOKE)
    price, zones = site.discomfort_price, site.size.zones
    for row in first:
        assert sum(row["days"]) == pytest.approx(row["cost"] + price * zones * row["discomfort"], rel=1e-9)
    text = (tmp_path / "out" / "mpc_vs_rl.md").read_text()
    assert "SAC, trained on the plant | 1 |" in text
    rows = comparison.short(site, first).splitlines()
    assert len(rows) == 7 and rows[4].startswith("| MPC, model after diagnosis |") and rows[4].endswith("|  |")
    stamps = {file: file.stat().st_mtime_ns for file in (tmp_path / "out" / "office").iterdir()}
    assert comparison.main(asked) == first
    assert stamps == {file: file.stat().st_mtime_ns for file in (tmp_path / "out" / "office").iterdir()}
    assert all((tmp_path / "out" / f"mpc_vs_rl_{what}_office.svg").exists() for what in ("front", "learning"))


@pytest.mark.long
def test_smoke_of_the_training(tmp_path: Path) -> None:
    """As a command: torch shares no process with the solvers of other tests."""
    pytest.importorskip("stable_baselines3", reason="the extra [rl] is not installed")
    script = Path(__file__).parents[2] / "benchmarks" / "train_rl.py"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", str(script), "--out", str(tmp_path), "--smoke"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    policies = sorted(tmp_path.glob("*/policy.npz"))
    assert len(policies) == 2
    for path in policies:
        network = ActorNetwork.load(path)
        assert network.about["steps"] == 96 and path.stat().st_size < 100_000


@pytest.mark.long
def test_training_goes_on_where_it_was_interrupted(case: ModuleType, training: ModuleType, tmp_path: Path) -> None:
    site = case.OfficeSite(case.SMOKE)
    weeks, validation = ({"week": next(iter(of.values()))} for of in (site.training_weeks, site.validation_weeks))
    options = training.RECIPES["ppo"].options | {"n_steps": 24, "batch_size": 24, "n_epochs": 1}
    recipe, said = replace(training.RECIPES["ppo"], evaluate_every=24, options=options), list[str]()
    run = training.Training(site, "ppo", "plant", 1)
    given: dict[str, Any] = {"weeks": weeks, "validation": validation}

    def interrupt(line: str) -> None:
        raise KeyboardInterrupt

    assert not training.train(run, tmp_path, recipe, 48, until=0.0, **given)
    with pytest.raises(KeyboardInterrupt):
        training.train(run, tmp_path, recipe, 48, say=interrupt, **given)
    assert not (tmp_path / "policy.npz").exists()
    assert training.train(run, tmp_path, recipe, 48, say=said.append, **given) and len(said) == 1
    about = ActorNetwork.load(tmp_path / "policy.npz").about
    assert [row[0] for row in about["curve"]] == [24, 48] and about["steps"] == 48
