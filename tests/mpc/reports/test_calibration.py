"""Reports: the numbers are in them, nothing is loaded from elsewhere, and odd cases do not break them."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from calibration import CalibrationResult, CalibrationSettings, Evaluation, Interval, calibrate
from calibration.errors import ResultsExistError
from calibration.evaluation.n_step import Predictions
from mpc.reports.calibration import calibration_verdict, write_calibration
from mpc.reports.case import write_check, write_simulation
from mpc.reports.evaluation import evaluation_verdict, write_evaluation
from mpc.reports.figures.calibration import paper_values, parameter_ranges
from mpc.reports.figures.errors import error_band, median_run, series_of_runs, zone_panels
from mpc.reports.figures.field import spatial_field
from mpc.reports.page import estimated_sentences, significant
from thermal import (
    Building,
    Case,
    SymbolicModel,
    Telemetry,
    ZoneTable,
    build_network,
    load_bundled_case,
    local_timestamp,
)
from thermal.case.building import Location, ZoneEntry
from thermal.case.check import describe_case
from thermal.case.estimated import Estimated
from thermal.model.simulation import simulate

LARGEST_PAGE = 5e6  # bytes


class Page(HTMLParser):
    """What a page shows and what it would load."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.html = path.read_text(encoding="utf-8")
        self.words: list[str] = []
        self.links: list[str] = []
        self.pictures: list[str] = []
        self.alts: list[str] = []
        self.tags: set[str] = set()
        self.images = 0
        self._hidden = False
        self.feed(self.html)
        self.text = re.sub(r"\s+", " ", " ".join(self.words))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self._hidden = tag in ("style", "script")
        self.images += tag == "img"
        for name, value in attrs:
            if name in {"src", "href", "srcset", "data", "action"} and value is not None:
                (self.pictures if value.startswith("data:image/svg+xml;base64,") else self.links).append(value)
            if name == "alt":
                self.alts.append(value or "")

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.words.append(data)

    def svgs(self) -> list[str]:
        return [base64.b64decode(p.partition(",")[2]).decode("utf-8") for p in self.pictures]


def assert_self_contained(page: Page) -> None:
    assert page.links == []
    assert not page.tags & {"link", "iframe", "object", "embed"}  # scripts have no address: links is empty
    assert "http://" not in page.html and "https://" not in page.html
    assert "@import" not in page.html and "url(" not in page.html
    assert len(page.html) < LARGEST_PAGE
    assert len(page.alts) == page.images <= len(page.pictures) and all(page.alts)
    for svg in page.svgs():
        for element in ElementTree.fromstring(svg).iter():
            target = element.get("{http://www.w3.org/1999/xlink}href", "#")
            assert target.startswith(("#", "data:image/png;base64,"))
        assert "DOCTYPE" not in svg


@pytest.fixture(scope="module")
def case() -> Case:
    return load_bundled_case()


@pytest.fixture(scope="module")
def result(case: Case) -> CalibrationResult:
    return calibrate(case, settings=CalibrationSettings(dx=1.0, starts=1))


@pytest.fixture(scope="module")
def written(case: Case, result: CalibrationResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_calibration(result, case, tmp_path_factory.mktemp("results") / "calibration").parent


def test_a_calibration_writes_four_files(written: Path) -> None:
    names = ["calibration.json", "evaluation.json", "predictions.parquet", "report.html"]
    assert sorted(p.name for p in written.iterdir()) == names


def test_evaluation_json_follows_the_contract(written: Path, result: CalibrationResult) -> None:
    content = json.loads((written / "evaluation.json").read_text(encoding="utf-8"))
    keys = {"steps", "step_seconds", "intervals", "mae", "median", "bias", "by_zone", "by_horizon", "carried"}
    assert set(content) == keys
    assert (content["steps"], content["step_seconds"]) == (72, 300.0)
    assert list(content["by_horizon"]) == ["5min", "1h", "3h", "6h", "24h"]
    assert content["by_horizon"]["6h"] == content["mae"] == result.calibrated["held_out"].metrics.mae
    assert content["by_horizon"]["5min"] < content["by_horizon"]["6h"]
    assert set(content["by_zone"]["F1_N"]) == {"mae", "bias"}


def test_predictions_hold_what_the_error_is_made_of(written: Path, result: CalibrationResult) -> None:
    table = pd.read_parquet(written / "predictions.parquet")
    assert list(table.columns) == ["run_start", "zone", "simulated", "measured"]
    assert str(table.index.tz) == "Etc/GMT+5" and table.attrs["units"]["simulated"] == "degC"
    assert table["measured"].between(10.0, 30.0).all()
    last = table[table.index - table["run_start"] == pd.Timedelta("6h")]
    by_run = (last["simulated"] - last["measured"]).abs().groupby(last["run_start"]).mean()
    evaluation = result.calibrated["held_out"]
    assert len(by_run) == len(evaluation.predictions[0].start)
    assert by_run.mean() == pytest.approx(evaluation.metrics.mae, abs=1e-9)


def test_the_page_holds_the_numbers_and_nothing_else_is_loaded(written: Path, result: CalibrationResult) -> None:
    page = Page(written / "report.html")
    assert_self_contained(page)
    before, after = result.uncalibrated["held_out"].metrics, result.calibrated["held_out"].metrics
    for number in (before.mae, after.mae, result.calibrated["tuning"].metrics.mae):
        assert f"{number:.3f}" in page.text
    for text in (calibration_verdict(result), "Solve_Succeeded", "--seed 0", result.version, "--dx 1"):
        assert text in page.text
    for p in result.parameters:
        assert p.name.replace("_", " ").replace("u value", "U-value") in page.text and p.source in page.text
    drawn = "".join(page.svgs())
    for text in (
        "held out",
        "before calibration",
        "after calibration",
        "zone temperature [°C]",
        "floor F1",
        "mean absolute error [K]",
    ):
        assert text in drawn
    for zone in result.zones:
        assert zone in drawn


def test_the_page_says_what_the_model_leaves(written: Path, result: CalibrationResult) -> None:
    page = Page(written / "report.html")
    for text in ("Unmeasured heat of about", "With the predictor-corrector", "NMBE [%]", "whole building",
                 "metered minus needed", f"{result.solver.evaluations} evaluations", "rounds of weighing"):  # fmt: skip
        assert text in page.text
    drawn = "".join(page.svgs())
    for text in ("cumulated periodogram", "needed by the model", "the paper's value"):
        assert text in drawn
    for p in result.parameters:
        if p.interval90 is not None:
            low, high = p.interval90
            assert p.lower is not None and p.lower <= low < high and f"{significant(low)} to " in page.text
    # ratios to a mean are for energy, and no temperature has one
    tables = re.findall(r"<table>.*?</table>", page.html, flags=re.S)
    assert not any("RMSE" in t and "[K]" in t for t in tables)


def test_the_band_is_that_of_the_tuning_errors(result: CalibrationResult, written: Path) -> None:
    tuning, held_out = result.calibrated["tuning"], result.calibrated["held_out"]
    band = error_band(tuning)
    errors = np.concatenate([p.measured - p.simulated for p in tuning.predictions])
    np.testing.assert_allclose(band.high[10, 2], np.quantile(errors[:, 10, 2], 0.95))
    assert band.low.shape == (72, 5) and band.coverage(tuning) == pytest.approx(0.9, abs=0.02)
    p = held_out.predictions[0]
    inside = (p.measured >= p.simulated + band.low) & (p.measured <= p.simulated + band.high)
    share = inside[np.isfinite(p.measured)].mean()
    assert len(held_out.predictions) == 1 and band.coverage(held_out) == pytest.approx(share, abs=1e-3)
    assert f"held-out measurements {100 * share:.0f} % lie inside" in Page(written / "report.html").text
    series = series_of_runs(held_out, band)
    assert series.low is not None and series.low.shape == series.measured.shape
    np.testing.assert_allclose(series.low[1:73] - series.simulated[1:73], band.low)
    np.testing.assert_array_equal(series.low[0], series.measured[0])  # a run starts where it was measured


def test_few_errors_make_no_band() -> None:
    evaluation = odd_evaluation(odd_case(2), runs=12)
    band = error_band(evaluation)
    assert np.isnan(band.low).all() and np.isnan(band.coverage(evaluation))
    assert zone_panels(series_of_runs(evaluation, band), evaluation.zones, {"Büro <b>& [1]": 0.3})
    many = odd_evaluation(odd_case(2), runs=21)
    band = error_band(many)
    assert np.isfinite(band.low[0, 0]) and np.isnan(band.low[:, 1]).all()  # the other zone is not measured


def test_the_papers_values_are_ours_where_they_correspond(result: CalibrationResult) -> None:
    paper = paper_values(result.parameters)
    density = {p.name: p.value for p in result.parameters}["exterior_wall_density"]
    assert paper["exterior_convection_coefficient"] == 800.0 and paper["exterior_wall_conductivity"] == 0.01
    assert paper["exterior_wall_heat_capacity"] * density == pytest.approx(2748.0 * 2500.0)
    assert "window_u_value" not in paper
    table = [p for p in result.parameters if not p.name.endswith("_density")]
    assert not any("wall" in name for name in paper_values(table))
    facade = replace(result.parameters[0], name="exterior_convection_coefficient@facade:south")
    assert paper_values([facade]) == {facade.name: 800.0}


def test_parameters_without_an_interval_are_drawn(result: CalibrationResult) -> None:
    bare = [replace(p, interval90=None) for p in result.parameters]
    assert parameter_ranges(bare)


@pytest.mark.long
def test_the_page_is_the_same_twice(case: Case, result: CalibrationResult, written: Path, tmp_path: Path) -> None:
    again = write_calibration(result, case, tmp_path / "again")
    assert again.read_bytes() == (written / "report.html").read_bytes()


def test_the_map_of_the_grid_agrees_with_the_reduced_model(case: Case, result: CalibrationResult) -> None:
    from thermal import replay_inputs

    network = build_network(case.building, dx=1.0)
    held_out = result.calibrated["held_out"]
    which, run = median_run(held_out)
    p = held_out.predictions[which]
    field = spatial_field(SymbolicModel(network), result.theta, replay_inputs(case, network), p.start[run], 72, 1.0)
    zones = network.observation @ field.temperatures
    assert np.abs(zones - p.simulated[run, -1]).max() < 0.05
    errors = np.nanmean(np.abs(np.concatenate([q.error for q in held_out.predictions])), axis=1)
    assert abs(np.nanmean(np.abs(p.error[run])) - np.median(errors)) < 0.05


def test_results_are_refused_before_anything_is_done(case: Case, result: CalibrationResult, written: Path) -> None:
    with pytest.raises(ResultsExistError, match=r"calibration\.json"):
        write_calibration(result, case, written)


def test_the_verdict_is_honest(result: CalibrationResult) -> None:
    before, after = result.uncalibrated["held_out"].metrics.mae, result.calibrated["held_out"].metrics.mae
    assert f"{100 * (1 - after / before):.0f} %" in calibration_verdict(result)
    worse = replace(result, uncalibrated=result.calibrated, calibrated=result.uncalibrated)
    assert "did not help" in calibration_verdict(worse)
    stopped = replace(result, solver=replace(result.solver, success=False, status="Maximum_Iterations_Exceeded"))
    assert calibration_verdict(stopped).startswith(
        "The solver stopped before it converged (Maximum_Iterations_Exceeded)"
    )
    bound = replace(result, parameters=(replace(result.parameters[0], at_bound=True, identifiable=False),))
    assert f"1 lies on a bound ({result.parameters[0].name.replace('_', ' ')})" in calibration_verdict(bound)


def test_check_page(case: Case, tmp_path: Path) -> None:
    check = describe_case(case)
    page = Page(write_check(check, tmp_path / "check"))
    assert_self_contained(page)
    assert "5 zones" in page.text and "VAV_F1_N/zone_air_temperature_sensor" in page.text
    assert "F1_C" in "".join(page.svgs())
    assert json.loads((tmp_path / "check" / "check.json").read_text(encoding="utf-8")) == check.to_dict()


def test_simulation_page(case: Case, tmp_path: Path) -> None:
    model = SymbolicModel(build_network(case.building, dx=2.0))
    times = [local_timestamp(t, case.building) for t in ("2023-03-04", "2023-03-05")]
    simulation = simulate(case, model, model.network.start(), *times)
    page = Page(write_simulation(simulation, case, tmp_path / "replay", parameters="start values"))
    assert_self_contained(page)
    content = json.loads((tmp_path / "replay" / "simulation.json").read_text(encoding="utf-8"))
    error = simulation.simulated - simulation.measured
    assert content["mae"] == pytest.approx(float(error.abs().mean().mean()), rel=1e-3)
    assert content["steps"] == 288 and content["parameters"] == "start values"
    table = pd.read_parquet(tmp_path / "replay" / "simulation.parquet")
    assert len(table) == 288 * 5 and table["simulated"].between(5.0, 35.0).all()
    assert "1 day" in page.text


def odd_case(zones: int) -> Case:
    """A zone table in a time zone with summer time; its names are full of traps."""
    names = ["Büro <b>& [1]", "$x_1$ 会议室", *(f"room {i}" for i in range(2, zones))][:zones]
    entries = tuple(ZoneEntry(name=n, volume=30.0 + 10 * i, floor_area=10.0 + i) for i, n in enumerate(names))
    site = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Europe/Berlin")
    index = pd.date_range("2023-10-28T00:00", periods=72, freq="h", tz="Europe/Berlin", name="timestamp")
    frame = pd.DataFrame({"weather_station/outside_air_temperature_sensor": 280.0}, index=index)
    building = Building("odd <script>", site, 0.0, ZoneTable(entries))
    return Case(building, Telemetry.from_frame(frame.astype(float)))


def odd_evaluation(case: Case, runs: int = 12) -> Evaluation:
    rng = np.random.default_rng(1)
    zones = case.building.zone_names
    start = pd.DatetimeIndex(case.stamps[20 : 20 + runs])
    measured = 293.15 + rng.normal(size=(runs, 6, len(zones)))
    measured[2, 3] = np.nan
    initial = measured[:, 0] + 0.1
    if len(zones) > 1:
        measured[:, :, 1] = initial[:, 1] = np.nan
    simulated = np.nan_to_num(measured, nan=293.15) + rng.normal(scale=0.3, size=measured.shape)
    p = Predictions(Interval(start[0], start[-1]), start, simulated, measured, np.arange(1, 7), initial, 3)
    return Evaluation(6, 3600.0, (p,), zones)


@pytest.mark.parametrize("zones", [1, 2, 40])
def test_odd_cases_make_whole_pages(tmp_path: Path, zones: int) -> None:
    case = odd_case(zones)
    evaluation = odd_evaluation(case)
    page = Page(write_evaluation(evaluation, case, tmp_path / "errors", parameters="<b>none</b>"))
    assert_self_contained(page)
    shown = page.html.partition("</main>")[0]
    assert "<script>" not in shown and "&lt;script&gt;" in page.html and "&lt;b&gt;none&lt;/b&gt;" in page.html
    assert evaluation_verdict(evaluation) in page.text and "3" in page.text
    drawn = "".join(page.svgs())
    assert "Büro &lt;b&gt;&amp; [1]" in drawn or zones == 40
    assert "Büro <b>& [1]" in page.text
    assert ("not measured" in drawn) == (zones > 1)
    assert "no plan" in page.text
    panels = [alt for alt in page.alts if alt.startswith("Measured and simulated temperature of zone")]
    assert len(panels) == min(12, zones - (zones > 1))
    assert ("of 39 zones with the largest error" in page.text) == (zones == 40)


def test_many_parameters_are_folded_by_kind_and_a_warning_is_at_the_top(
    result: CalibrationResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mpc.reports.calibration.case_warnings", lambda case: ["The building has no windows."])
    first = result.parameters[0]
    many = tuple(replace(first, name=f"{kind}@Z{k}") for kind in ("air_film", "gain") for k in range(30))
    page = Page(write_calibration(replace(result, parameters=many), load_bundled_case(), tmp_path / "many"))
    assert "air film: 30 values" in page.text and "gain of Z29" in page.text
    assert "Drawn are 40 of 60" in page.text
    assert '<p class="warning" role="alert">The building has no windows.</p>' in page.html


def test_a_sentence_says_what_was_estimated() -> None:
    stamp = pd.Timestamp("2024-01-01", tz="UTC")
    found = [Estimated(f"Z{k}", f"VAV_{k}/flow", stamp, stamp + pd.Timedelta(hours=5)) for k in range(6)]
    assert estimated_sentences([]) == []
    (sentence,) = estimated_sentences([*found, *found[:1]])
    assert sentence.startswith("Sensors failed in Z0 (10 h), Z1 (5 h), Z2 (5 h), Z3 (5 h) and 2 more: ")
