"""What a diagnosis leaves behind: files that others read, words that follow the verdict, a page that loads nothing."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration import CalibrationError, evaluate_case
from calibration.diagnosis.diagnosis import Diagnosis, diagnose
from mpc.cli.calibrate import _show_diagnosis
from mpc.reports.diagnosis import write_diagnosis
from mpc.reports.diagnosis_words import diagnosis_verdict, where_sentence
from thermal import Case, Telemetry, load_bundled_case
from thermal.effects.catalogue import CATALOGUE


@cache
def case() -> Case:
    """The bundled case in quarters of an hour, which are diagnosed sooner."""
    found = load_bundled_case()
    frame = found.telemetry.frame.resample("15min", closed="right", label="right").mean()
    return replace(found, telemetry=Telemetry.from_frame(frame), judged=None)


@cache
def diagnosed() -> Diagnosis:
    return diagnose(case(), dx=2.0)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_diagnosis(diagnosed(), case(), tmp_path_factory.mktemp("gap") / "results").parent


def named(name: str) -> Diagnosis:
    """The same diagnosis with another verdict."""
    return replace(diagnosed(), verdict=replace(diagnosed().verdict, name=name))


def nothing_found() -> Diagnosis:
    """What the first round leaves when it accepts nothing."""
    rounds = (replace(diagnosed().rounds[0], accepted=None),)
    verdict = replace(diagnosed().verdict, name="no_gap", set90=())
    return replace(diagnosed(), rounds=rounds, steps=(), verdict=verdict)


def test_the_numbers_are_those_of_the_contract(written: Path) -> None:
    content = json.loads((written / "diagnosis.json").read_text(encoding="utf-8"))
    assert {"verdict", "gap", "where", "which", "set90", "combinations", "how_far", "seconds", "case", "version",
            "seed"} <= set(content)  # fmt: skip
    assert {s["effect"] for s in content["which"]} == set(CATALOGUE)
    assert len(content["where"]["hours"]) == 24
    step = content["how_far"][-1]
    if step["share_closed"] is not None:
        share = (step["held_out_mae_before"] - step["held_out_mae_after"]) / (
            step["held_out_mae_before"] - step["floor"]
        )
        assert step["share_closed"] == pytest.approx(share)
    assert "NaN" not in (written / "diagnosis.json").read_text(encoding="utf-8")


def test_the_final_model_predicts_elsewhere_what_it_did_here(written: Path) -> None:
    result, content = diagnosed(), json.loads((written / "calibration.json").read_text(encoding="utf-8"))
    found = evaluate_case(case(), result.judged, parameters=written / "calibration.json")
    assert content["calibrated"]["held_out"]["mae"] == pytest.approx(result.steps[-1].after, abs=1e-9)
    assert found.metrics.mae == pytest.approx(result.steps[-1].after, abs=5e-3)
    assert [e["effect"] for e in content["effects"]] == list(result.final.effects)
    assert content["uncalibrated"]["held_out"]["mae"] > content["calibrated"]["held_out"]["mae"]


def test_series_are_those_of_both_models(written: Path) -> None:
    result = diagnosed()
    heat = pd.read_parquet(written / "missing_watts.parquet")
    for zone, watts in result.where.missing.by_zone.items():
        own = heat.loc[heat["zone"] == zone, "baseline"].to_numpy()
        assert np.sqrt(np.nanmean(own**2)) == pytest.approx(watts)
    runs = pd.read_parquet(written / "predictions.parquet")
    last = runs[(runs.index - runs["run_start"]) == pd.Timedelta("6h")]
    for column, mae in (("baseline", result.gap), ("with_effects", result.steps[-1].after)):
        assert (last[column] - last["measured"]).abs().groupby(last.index).mean().mean() == pytest.approx(mae)


def test_the_page_loads_nothing_and_says_what_pictures_show(written: Path) -> None:
    page = (written / "report.html").read_text(encoding="utf-8")
    assert not re.search(r'(?:src|href)="(?!data:)', page) and "<script" not in re.sub(r'<script( type="text/plain" id="\w+")?>', "", page)
    pictures = re.findall(r"<img [^>]*>", page)
    assert pictures and all(re.search(r'alt="[^"]{10,}"', p) for p in pictures)
    assert diagnosis_verdict(diagnosed()) in page
    for title in ("Where the model is wrong", "What it leaves out", "How far it closes the gap",
                  "What to measure next", "What these data cannot test", "<details>"):  # fmt: skip
        assert title in page
    for s in diagnosed().verdict.candidates:
        assert s.effect in page and (s.testable or s.reason.split(":")[0] in page)


def test_the_terminal_has_verdict_candidates_and_how_far(capsys: pytest.CaptureFixture[str]) -> None:
    result = diagnosed()
    _show_diagnosis(result)
    text = capsys.readouterr().out
    assert text.startswith(diagnosis_verdict(result)) and where_sentence(result.where) in text
    for s in result.verdict.candidates[:5]:
        assert s.effect in text
    assert f"{result.gap:.3f}" in text and f"{result.floor:.3f}" in text


def test_a_named_effect_comes_with_its_probability_and_the_fall_of_the_error() -> None:
    text = diagnosis_verdict(named("named"))
    assert "leaves out sun through the windows" in text and "% sure" in text and "falls from" in text


def test_no_share_is_told_where_there_is_none() -> None:
    step = replace(diagnosed().steps[-1], share_closed=None, interval=None)
    text = diagnosis_verdict(replace(named("named"), steps=(step,)))
    assert "too small" in text and "% of what the model" not in text


def test_an_error_that_does_not_fall_is_said_to_be_no_help() -> None:
    step = replace(diagnosed().steps[-1], after=2.0 * diagnosed().gap)
    assert "does not fall" in diagnosis_verdict(replace(named("named"), steps=(step,)))


def test_an_error_with_windows_seen_open_is_no_forecast() -> None:
    step = replace(diagnosed().steps[-1], effects=("window_opening",))
    told = "which no forecast knows, falls from"
    assert told in diagnosis_verdict(replace(named("named"), steps=(step,)))
    assert told not in diagnosis_verdict(named("named"))


def test_how_far_rooms_differ_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    result = diagnosed()
    assert "Rooms differ" not in diagnosis_verdict(result)
    structure = replace(result.settings.structure, uneven=("solar_gain",))
    result = replace(result, settings=replace(result.settings, structure=structure))
    for room, share in (("F1_N", 0.5), ("F1_S", 1.25)):
        monkeypatch.setitem(result.final.values, f"solar_room_share@{room}", share)
    assert "they have 0.500 to 1.25 times what is usual in this building" in diagnosis_verdict(result)


def test_other_verdicts_name_nothing() -> None:
    assert "explains" in diagnosis_verdict(named("unexplained"))
    assert "explains too little" in diagnosis_verdict(named("no_gap"))
    nothing = diagnosis_verdict(nothing_found())
    assert nothing.startswith("These data show nothing") and " W on" in nothing
    other = replace(nothing_found(), verdict=replace(nothing_found().verdict, name="unexplained"))
    assert "not enough to name it" in diagnosis_verdict(other)


def grouped(*probabilities: float) -> Diagnosis:
    """A group of solar gain and of effects whose signatures are made the same, with these probabilities."""
    first = diagnosed().rounds[0]
    assert first.accepted is not None
    effect = first.accepted.screened.effect
    others = [g.effect for g in first.gains if g.effect != effect][: len(probabilities) - 1]
    given = dict(zip([effect, *others], probabilities, strict=True))
    found = next(r.gain for r in first.refits if r is first.accepted)
    gains = tuple(replace(g, gain=found if g.effect in others else -1.0) for g in first.gains)
    refits = tuple(r for r in first.refits if r is first.accepted)
    rounds = (replace(first, gains=gains, refits=refits), *diagnosed().rounds[1:])
    candidates = tuple(
        replace(s, probability=given.get(s.effect, 0.0)) for s in diagnosed().verdict.candidates
    )  # fmt: skip
    return replace(
        diagnosed(), rounds=rounds, verdict=replace(diagnosed().verdict, name="group", candidates=candidates)
    )  # fmt: skip


def test_a_choice_is_told_only_where_both_are_likely() -> None:
    text = diagnosis_verdict(grouped(0.6, 0.35))
    assert "leaves out either sun through the windows (60 %) or" in text and "(35 %): these data cannot tell" in text
    assert CATALOGUE["solar_gain"].separated_by in text and "With the likeliest" in text
    alone = diagnosis_verdict(grouped(0.99, 0.005))
    assert "leaves out sun through the windows (99 % sure)" in alone and "either" not in alone
    assert "far less likely" in alone and "(under 1 %)" in alone
    three = diagnosis_verdict(grouped(0.5, 0.3, 0.15))
    assert "either" not in three and "(30 %) or" in three


def test_combinations_are_those_of_the_rounds_and_one_of_them_is_true() -> None:
    combinations = diagnosed().to_dict()["combinations"]
    assert [c["effects"] for c in combinations] == [[], ["solar_gain"]]
    assert sum(c["probability"] for c in combinations) == pytest.approx(1.0)
    assert combinations[-1]["probability"] > 0.8  # 0.9 of all five minutes, of which these are a third


def test_missing_heat_has_a_band_before_and_after_calibration(written: Path) -> None:
    heat = pd.read_parquet(written / "missing_watts.parquet")
    for model in ("uncalibrated", "baseline", "with_effects"):
        known = heat[model].notna()
        assert known.any() and (heat[f"{model}_low"] < heat[model])[known].all()
        assert (heat[model] < heat[f"{model}_high"])[known].all()
    zones = json.loads((written / "diagnosis.json").read_text(encoding="utf-8"))["where"]["zones"]
    assert all(z["missing_watts_rms_at_start"] > 0.0 for z in zones)
    assert heat.attrs["units"]["uncalibrated_low"] == "W"


def test_growth_of_the_error_is_told_before_and_after(written: Path) -> None:
    drift = json.loads((written / "diagnosis.json").read_text(encoding="utf-8"))["where"]["drift"]
    assert len(drift["seconds"]) == len(drift["rms"]) and drift["seconds"][-1] == 86400.0
    assert drift["kind"] in ("sensors", "random", "persistent", "hump")
    page = (written / "report.html").read_text(encoding="utf-8")
    assert "How the error grows" in page and "Left to itself" in page and "found it" in page


def test_a_diagnosis_without_effects_is_written_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mpc.reports.diagnosis.case_warnings", lambda case: ["The building has no windows."])
    report = write_diagnosis(nothing_found(), case(), tmp_path / "none")
    assert '<p class="warning" role="alert">The building has no windows.</p>' in report.read_text(encoding="utf-8")
    assert "in the model</span>" not in report.read_text(encoding="utf-8")
    assert json.loads((tmp_path / "none" / "calibration.json").read_text(encoding="utf-8"))["effects"] == []
    assert "with_effects" not in pd.read_parquet(tmp_path / "none" / "predictions.parquet")


def test_results_are_not_overwritten(written: Path) -> None:
    before = (written / "diagnosis.json").read_bytes()
    with pytest.raises(CalibrationError, match="force=True"):
        write_diagnosis(diagnosed(), case(), written)
    assert (written / "diagnosis.json").read_bytes() == before
