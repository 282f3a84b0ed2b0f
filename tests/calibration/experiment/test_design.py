"""Designs on the bundled case: what they keep to, what they promise, and pairs that nothing separates."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from calibration.experiment import design as design_module
from calibration.experiment.design import DesignSettings, Experiment, Trial, design_experiment
from calibration.experiment.emulate import Emulated, Emulator
from calibration.experiment.library import LEAD, by_hand, office_comfort
from calibration.experiment.members import Question, comparison, fit_members, question_of, read_experiment, without
from calibration.experiment.odds import separation
from calibration.experiment.schedule import HEATING, SUPPLY_AIR, Move, Schedule
from thermal.case.case import Case
from thermal.case.telemetry import Telemetry
from thermal.data import load_bundled_case
from thermal.network.structure import Structure

MODEL = ModelSettings(dx=3.0)
WARM = Move("warm by night", ("F1_N", "F1_S"), ((297.0, 297.5),), 1e4, ((0.0, 3.0), (19.0, 24.0)))


@pytest.fixture(scope="module")
def case() -> Case:
    """Give the bundled case by the half hour."""
    found = load_bundled_case()
    frame = found.telemetry.frame.resample("30min", closed="right", label="right").mean()
    return Case(found.building, Telemetry.from_frame(frame.iloc[:-1]))


def asked(case: Case, **members: tuple[str, ...]) -> Question:
    """Ask which of some effects it is."""
    stamps = case.stamps
    parts = (Interval(stamps[0], stamps[6 * 48]),), (Interval(stamps[6 * 48 + 1], stamps[-1]),)
    return Question(members, {}, *parts, dict.fromkeys(members, 1.0 / len(members)))


def designed(case: Case, monkeypatch: pytest.MonkeyPatch, question: Question, **given: Any) -> Experiment:
    """Design with one move to choose."""
    own = design_module.moves
    monkeypatch.setattr(design_module, "moves", lambda *a: own(*a)[:1])
    return design_experiment(case, question, DesignSettings(hours=12.0, **given), MODEL)


def test_a_pair_that_acts_alike_is_said_to_be_hopeless(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    # a bridge and a constant exchange of air are one regressor: cold times a constant
    found = designed(case, monkeypatch, asked(case, infiltration=(), thermal_bridge=()))
    assert found.verdict == "hopeless" and found.chance < 0.5
    content = json.loads(json.dumps(found.to_dict()))
    assert len(content["measure_instead"]) == 2 and content["hours"] == 12.0


def test_a_design_keeps_to_what_it_may(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    found = designed(case, monkeypatch, asked(case, flow_gain=("F1_N",), sensor_bias=("F1_N",)), discomfort=0.1)
    assert found.best.discomfort.max() <= 0.1
    stamps = pd.date_range(found.start, found.schedule.end, freq="30min")[1:]
    comfort = office_comfort(stamps, 1800.0)
    values = found.schedule.setpoints(stamps, 1800.0, found.zones).mean(axis=2)
    known = np.isfinite(values)
    assert (np.where(known, values, comfort.lower[:, None]) >= comfort.lower[:, None]).all()
    assert (np.where(known, values, comfort.upper[:, None]) <= comfort.upper[:, None]).all()
    # its energy is heat and cold beyond usual operation, of the member that needs most, and its cost their prices
    kwh, heats = (
        case.step / 3.6e6,
        [[t.emulated[e].heat for t in (found.best, found.usual)] for e in found.best.emulated],
    )
    more = max(float((np.abs(now) - np.abs(before)).sum()) * kwh for now, before in heats)
    assert found.best.energy == pytest.approx(more) and found.best.cost == pytest.approx(0.1 * more)


@pytest.mark.parametrize(
    ("start", "hours"),
    [
        ("2023-03-13T13:00", 120.0),  # too long for a day of the same week before it: days are those from a Sunday on
        ("2023-03-13T00:00", 30.0),  # people come as it ends
    ],
)
def test_nobody_is_in_by_the_clock_of_the_experiment(case: Case, start: str, hours: float) -> None:
    begin = pd.Timestamp(start, tz=case.stamps.tz)
    models = comparison(case, asked(case, flow_gain=(), valve_leak=()), MODEL)
    search = design_module._Search(models, (), {}, DesignSettings(hours=hours), begin, None)
    assert (search.days.hour, search.days.minute) == (begin.hour, begin.minute)
    found = [m for m in search._library() if "nobody" in m.title]
    stamps = pd.date_range(begin, begin + pd.Timedelta(hours=hours + LEAD), freq="30min")[1:]
    people = office_comfort(stamps, 1800.0).upper < 300.0
    soon = np.array([people[k : k + 1 + int(2 * LEAD)].any() for k in range(len(people))])
    assert found and people.any() and not people.all()
    for move in found:
        acts, _ = move.pair_at(np.asarray((stamps - begin) / pd.Timedelta(hours=1) - 0.25))
        assert acts.any() and not (acts & soon).any()


def test_discomfort_counts_after_the_end_too(case: Case) -> None:
    begin = pd.Timestamp("2023-03-13T00:00", tz=case.stamps.tz)
    models = comparison(case, asked(case, flow_gain=(), valve_leak=()), MODEL)
    search = design_module._Search(models, (), {}, DesignSettings(hours=6.0), begin, None)
    assert search.comfort.upper.min() < 300.0 and search.interval.end == search.days + pd.Timedelta(hours=6)
    zone = np.full((len(search.comfort.lower), 1), 296.0)
    zone[12:] += 3.0  # too warm from the end on, when people come
    made = Emulated(None, zone, zone)  # type: ignore[arg-type]
    search.usual = Trial(None, None, {"a": replace(made, zone=zone * 0 + 296.0)}, 0.0, 0.0, zone[0])  # type: ignore[arg-type]
    assert search._discomfort("a", made).max() == pytest.approx((299.0 - 297.15) * 6.0)


def test_what_is_measured_is_not_experimented_on(case: Case) -> None:
    start = case.stamps[-1] - pd.Timedelta(minutes=30)
    with pytest.raises(CalibrationError, match="end of the telemetry"):
        design_experiment(case, asked(case, flow_gain=(), valve_leak=()), DesignSettings(start=start), MODEL)
    for prices in ((1.0, float("nan")), (float("inf"), 1.0), (-1.0, 1.0)):
        with pytest.raises(CalibrationError, match="prices"):
            DesignSettings(prices=prices)


def test_what_a_member_emulates_it_predicts(case: Case) -> None:
    question = asked(case, flow_gain=("F1_N",), valve_leak=("F1_N",))
    models = comparison(case, question, MODEL)
    members = fit_members(models, question)
    start = case.stamps[47].normalize() + pd.Timedelta(days=2)
    emulator, window = Emulator(models, start, 24.0), Interval(start, start + pd.Timedelta(hours=24))
    usual = emulator.run(members[0], Schedule(start, 24.0))
    assert np.allclose(usual.zone, emulator.measured[emulator.first :])
    moved = {m.effect: emulator.run(m, Schedule(start, 24.0, (WARM,))) for m in members}
    for made in moved.values():
        assert (made.zone.mean(axis=0) - usual.zone.mean(axis=0))[0] > 0.2
        assert made.heat.sum() > usual.heat.sum()
    found = separation(emulator, moved, usual, members, window, "6h")
    assert set(found.log_odds) == {("flow_gain", "valve_leak"), ("valve_leak", "flow_gain")}
    assert all(v > 0.0 for v in found.log_odds.values())
    same = separation(emulator, {"flow_gain": usual}, usual, members, window, "6h")
    assert same.log_odds["flow_gain", "valve_leak"] == pytest.approx(0.0, abs=1e-9)
    jumped = moved["flow_gain"].zone + 8.0 * (np.arange(48) == 20)[:, None]  # too sudden a step: its errors do not count
    sudden = separation(emulator, {"flow_gain": replace(moved["flow_gain"], zone=jumped)}, usual, members, window, "6h")
    assert 0.0 < sudden.log_odds["flow_gain", "valve_leak"] < np.inf


def told(case: Case) -> dict[str, Any]:
    """Give a diagnosis that cannot tell two effects apart."""
    ends = {"start": case.stamps[0].isoformat(), "end": case.stamps[-1].isoformat()}
    group = ["flow_gain", "valve_leak"]
    which = [
        {"effect": e, "probability": p, "group": group if e in group else [e], "zones": z, "testable": True}
        for e, p, z in (("flow_gain", 0.6, ["F1_N"]), ("valve_leak", 0.3, ["F1_N"]), ("solar_gain", 0.02, []))
    ]
    return {
        "case": "bundled_case", "verdict": "group", "which": which, "how_far": [{"effects": ["solar_gain"]}],
        "intervals": {"tuning": [ends], "held_out": [ends]},
    }  # fmt: skip


def test_a_question_keeps_what_is_known(case: Case) -> None:
    found = question_of(case, told(case), (), {"flow_gain": ["F1_N"], "sensor_bias": ["F1_S"], "infiltration": []})
    assert found.members == {"flow_gain": ("F1_N",), "valve_leak": ("F1_N",)}
    assert found.known == {"sensor_bias": ("F1_S",), "infiltration": (), "solar_gain": ()}
    assert found.prior == pytest.approx({"flow_gain": 2.0 / 3.0, "valve_leak": 1.0 / 3.0})
    more = replace(found, members={**found.members, "duct_loss": ()}, prior={**found.prior, "duct_loss": 1.0 / 3.0})
    left = without(more, ["roof_exchange"], ["flow_gain", "sensor_bias"])
    assert left.members == {"valve_leak": ("F1_N",), "duct_loss": ()} and sum(left.prior.values()) == pytest.approx(1.0)
    assert left.known == {"roof_exchange": (), "infiltration": (), "solar_gain": ()}
    with pytest.raises(CalibrationError, match="neither known nor ruled out"):
        without(found, (), ["flow_gain"])


@pytest.mark.parametrize(
    ("where", "value", "error"),
    [
        (("which", 0, "probability"), None, "the probability None"),
        (("which", 0, "probability"), float("nan"), "probability nan"),
        (("which", 0, "zones"), None, "list of names"),
        (("which", 0, "zones"), ["F9_N"], "zones of flow_gain"),
        (("which", 0, "group"), ["flow_gain", "nonsense"], "'nonsense'"),
        (("which", 0, "group"), ["flow_gain", "duct_loss"], "'duct_loss'"),
        (("which",), [], "what `buildingmpc diagnose` writes"),
        (("which", 0), {}, "no 'effect'"),
        (("how_far",), None, "what `buildingmpc diagnose` writes"),
        (("intervals", "tuning"), [], "intervals: tuning"),
        (("intervals", "held_out"), [{"start": "2020-01-01", "end": "2020-01-02"}], "intervals: held_out"),
        (("case",), "another", "one of the case"),
        (("verdict",), "no_gap", "found a gap"),
    ],
)
def test_bad_diagnoses_are_refused(case: Case, where: tuple[Any, ...], value: object, error: str) -> None:
    content = json.loads(json.dumps(told(case)))
    at: Any = content
    for key in where[:-1]:
        at = at[key]
    at[where[-1]] = value
    with pytest.raises(CalibrationError, match=error):
        question_of(case, content)
    if value == "no_gap":
        assert set(question_of(case, content, ["flow_gain", "valve_leak"]).members) == {"flow_gain", "valve_leak"}


def test_bad_questions_and_settings_are_refused(case: Case) -> None:
    content = told(case)
    alone = [{**content["which"][0], "group": ["flow_gain"]}]
    with pytest.raises(CalibrationError, match="two effects or more"):
        question_of(case, content | {"which": alone})
    with pytest.raises(CalibrationError, match="flow_gain"):
        question_of(case, content, ["solar_gain", "flow_gin"])
    with pytest.raises(CalibrationError, match="two different effects"):
        question_of(case, content, ["flow_gain", "flow_gain"])
    with pytest.raises(CalibrationError, match="hours"):
        DesignSettings(hours=1.0)


def test_what_an_experiment_was_designed_with_is_read_again(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    question = asked(case, flow_gain=("F1_N",), sensor_bias=("F1_N",))
    own = design_module.moves
    monkeypatch.setattr(design_module, "moves", lambda *a: own(*a)[:1])
    model = replace(MODEL, scopes={"window_u_value": "facade"}, structure=Structure(wall_nodes=2))
    found = design_experiment(case, question, DesignSettings(hours=6.0), model)
    path = tmp_path / "experiment.json"
    content = json.loads(json.dumps(found.to_dict()))
    path.write_text(json.dumps(content), encoding="utf-8")
    plan = read_experiment(path, case)
    assert plan.model == model and plan.odds == 20.0 and plan.question == question
    assert plan.interval == Interval(found.start, found.schedule.end)
    bad: list[tuple[dict[str, Any], str]] = [
        ({"members": {"flow_gain": {"zones": []}}}, "two effects or more"),
        ({"members": {"flow_gain": {"zones": ["F9"]}, "sensor_bias": {"zones": []}}}, "zones of flow_gain"),
        ({"known": {"nonsense": []}}, "effects of the catalogue"), ({"odds": None}, "experiment.json"),
        ({"prior": {}}, "no 'flow_gain'"), ({"settings": None}, "experiment.json"), ({"case": "another"}, "another"),
    ]  # fmt: skip
    for wrong, error in bad:
        path.write_text(json.dumps(content | wrong), encoding="utf-8")
        with pytest.raises(CalibrationError, match=error):
            read_experiment(path, case)
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(CalibrationError, match="buildingmpc experiment"):
        read_experiment(path, case)


def test_what_no_telemetry_sets_is_set_by_hand(case: Case) -> None:
    supply = Move("supply", ("AHU",), ((286.0, 286.0),), 3.0, ((0.0, 6.0),), "supply_air_temperature_setpoint")
    assert by_hand(case, (WARM, supply)) == ("F1_N", "F1_S", "AHU")
    frame = case.telemetry.frame.assign(**{
        f"{case.building.devices_of('F1_N')[0].name}/{HEATING}": 294.0, f"AHU/{SUPPLY_AIR}": 287.0,
    })  # fmt: skip
    told = Case(case.building, Telemetry.from_frame(frame))
    assert by_hand(told, (WARM, supply)) == ("F1_S",)
