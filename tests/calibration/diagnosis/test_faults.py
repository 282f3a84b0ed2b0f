"""Faults of the telemetry that it shows itself: mended where certain, or where left-out days are predicted better."""

from dataclasses import dataclass, replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pandas as pd
import pytest

from calibration.diagnosis.decide.verdict import Candidate, Verdict
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.faults import Errors, Fault, mend, suspected, with_faults
from mpc.reports.correction_words import faults_sentence
from thermal import Case
from thermal.case.plausibility.anomaly import Certainty
from thermal.data import load_bundled_case

SETTINGS = {"dx": 2.0, "horizon": "6h"}


def changed(frame: pd.DataFrame) -> Case:
    case = load_bundled_case()
    return Case(case.building, replace(case.telemetry, frame=frame))


@cache
def late() -> Case:
    """The bundled case with a weather station whose clock is two hours behind."""
    case = load_bundled_case()
    frame = case.telemetry.frame.copy()
    weather = [str(c) for c in frame if str(c).startswith(f"{case.building.weather_station}/")]
    frame[weather] = frame[weather].shift(24).bfill()
    return changed(frame)


@cache
def swapped() -> tuple[Case, tuple[str, str]]:
    """The bundled case with the sensors of two zones exchanged."""
    case = load_bundled_case()
    frame, zones = case.telemetry.frame.copy(), ("F1_N", "F1_S")
    columns = [c for zone in zones for c in frame if str(c).endswith("/zone_air_temperature_sensor")
               and str(c).partition("/")[0] in {zone, *(d.name for d in case.building.devices_of(zone))}]  # fmt: skip
    assert len(columns) == 2
    frame[columns] = frame[columns[::-1]].to_numpy()
    return changed(frame), zones


@pytest.mark.long
def test_a_clock_that_is_late_is_put_right_and_the_error_falls() -> None:
    (fault,) = mend(late(), (), (), SETTINGS)
    assert (fault.effect, fault.hours, fault.zones) == ("clock_shift", -2.0, ())
    assert fault.after.left_out < 0.95 * fault.before.left_out and fault.to_dict()["hours"] == -2.0
    frames = [case.telemetry.frame.iloc[:-48] for case in (fault.mended, load_bundled_case())]
    pd.testing.assert_frame_equal(*frames)


def test_exchanged_sensors_are_put_back() -> None:
    case, zones = swapped()
    found = [f for f in suspected(case) if f.effect == "swapped_sensors"]
    assert [set(f.zones) for f in found] == [set(zones)]
    pd.testing.assert_frame_equal(found[0].mended.telemetry.frame, load_bundled_case().telemetry.frame)


def test_nothing_is_mended_where_nothing_is_wrong() -> None:
    assert mend(load_bundled_case(), (), (), SETTINGS) == ()


@dataclass(frozen=True)
class _Fit:
    """Stands for a `FittedCase`."""

    of: str
    left_out_mae: float
    tuned: tuple[()] = ()
    judged: tuple[()] = ()
    settings: str = ""
    best: None = None
    left: None = None


@pytest.mark.parametrize(
    ("certainty", "drawn", "kept", "mended"),
    [
        ("certain", (1.0, 1.2), (1.0, 1.1), True),
        ("likely", (1.0, 0.97), (1.0, 0.97), False),
        ("likely", (1.0, 1.01), (1.0, 0.9), False),  # it is not asked in other structures
        ("likely", (1.0, 0.97), (1.0, 0.9), True),
        ("likely", (np.nan, np.nan), (np.nan, np.nan), False),  # too few days to leave any out
        ("certain", (np.nan, np.nan), (1.0, np.nan), True),
    ],
)
def test_what_is_likely_only_must_predict_better_as_drawn_and_in_the_structure_that_is_kept(
    monkeypatch: pytest.MonkeyPatch,
    certainty: Certainty,
    drawn: tuple[float, float],
    kept: tuple[float, float],
    mended: bool,
) -> None:
    (seen,) = (replace(f, seen=replace(f.seen, certainty=certainty)) for f in suspected(late()))
    fits = {
        (of, structure): _Fit(of, error, settings=structure)
        for structure, errors in (("drawn", drawn), ("lumped", kept))
        for of, error in zip(("late", "mended"), errors, strict=True)
    }
    monkeypatch.setattr(
        "calibration.diagnosis.faults.fit_case",
        lambda of, *given: fits["mended" if of is seen.mended else "late", "lumped" if "lumped" in given else "drawn"],
    )
    monkeypatch.setattr("calibration.diagnosis.faults._climbed", lambda drawn, _: fits[drawn.of, "lumped"])
    monkeypatch.setattr("calibration.diagnosis.faults.left_out", lambda *_: None)
    monkeypatch.setattr("calibration.diagnosis.faults._errors", lambda fit: Errors(fit.left_out_mae, 1.0))
    monkeypatch.setattr("calibration.diagnosis.faults.suspected", lambda case: [seen])
    found = mend(late(), (), (), SETTINGS)
    assert [(f.before.left_out, f.after.left_out) for f in found] == [pytest.approx(kept, nan_ok=True)] * mended


def test_a_fault_comes_first_and_is_named() -> None:
    (fault,) = [replace(f, before=Errors(0.8, 0.6), after=Errors(0.4, 0.3)) for f in suspected(late())]
    other = Candidate("solar_gain", 0.1, 1.0, ("solar_gain",), (), {}, 1.0, "")
    own = replace(other, effect="clock_shift")
    verdict = with_faults(Verdict("no_gap", (other, own), (), {}), [fault])
    assert verdict.name == "named" and [c.effect for c in verdict.candidates] == ["clock_shift", "solar_gain"]
    first = verdict.candidates[0]
    assert first.probability > 0.9 and first.parameters["weather_moved"].value == -2.0
    assert with_faults(replace(verdict, name="unexplained"), [fault]).name == "unexplained"
    assert with_faults(verdict, []) is verdict
    assert fault.how_far(0.1)["share_closed"] == pytest.approx(0.6)
    text = faults_sentence(cast(Diagnosis, SimpleNamespace(faults=(fault,))))
    assert "-2 h" in text and "0.40 K instead of 0.80 K" in text
    assert np.isnan(Fault("clock_shift", (), "weather", 1.0, fault.seen, late()).before.held_out)
