"""How results are shown: figures as files, tables in further formats, units; and what any page has."""

from __future__ import annotations

import builtins
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from calibration.results import write_results as write_whole
from mpc.errors import MpcError
from mpc.reports.display import Display, Displayed, display, showing, write_results
from mpc.reports.figures import zoom
from mpc.reports.figures.adapt import DARK, kept_points
from mpc.reports.figures.style import INK, MEASURED, Picture, lines_over_time, panel, picture, styled
from mpc.reports.glossary import words_on
from mpc.reports.means import Means
from mpc.reports.page import render
from thermal.errors import MissingExtraError

STAMPS = pd.date_range("2023-03-06", periods=48, freq="30min", tz="Etc/GMT+5", name="timestamp")


def table() -> pd.DataFrame:
    found = pd.DataFrame({"zone": "A", "simulated": np.linspace(20.0, 21.0, 48)}, index=STAMPS)
    found.attrs["units"] = {"simulated": "degC"}
    return found


@styled
def course(title: str = "zone A: 0.50 K") -> Picture:
    figure, axes = panel(7.0, 2.5, title=title, ylabel="temperature [°C]")
    x = lines_over_time(axes, STAMPS)
    axes.fill_between(x, 19.0, 22.0, color=MEASURED, alpha=0.2)
    axes.plot(x, np.linspace(20.0, 21.0, 48), color=INK, label="measured")
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return picture(figure, "Temperature of zone A: 0.50 K off", zoom=True)


def page(**more: Any) -> str:
    content = {
        "case": "<b>", "subtitle": "", "verdict": "It misses by 0.50 K.", "parameters": "none", "fine": True,
        "means": Means("The answer is 0.5 degrees C.", "Yes & no.", "Nothing."),
        "span": STAMPS[[0, -1]], "figures": {"maps": [], "zones": [course()], "zone_count": 1, "plan": True},
        "summary": {"mae": 0.5, "bias": 0.1, "steps": 48, "step_seconds": 1800.0, "parameters": "none"},
        "zones": [{"zone": "A", "mae": 0.5, "bias": -0.1, "mean_heat": 100.0}],
    }  # fmt: skip
    return render("simulation", content | more)


def svg(uri: str) -> str:
    import base64

    return base64.b64decode(uri.partition(",")[2]).decode("utf-8")


def test_the_default_shows_si_and_writes_what_there_is(tmp_path: Path) -> None:
    assert display() == Display() and display().text("0.5 K") == "0.5 K"
    write_results(tmp_path / "out", {"a.parquet": table(), "b.json": {"x": 1}})
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["a.parquet", "b.json"]


def test_tables_also_as_csv_and_as_a_workbook_with_units_in_their_heads(tmp_path: Path) -> None:
    with showing(Display(table_format="csv")):
        write_results(tmp_path / "csv", {"a.parquet": table()})
    read = pd.read_csv(tmp_path / "csv" / "a.csv", parse_dates=["timestamp"])
    assert list(read) == ["timestamp", "zone", "simulated [degC]"] and read["timestamp"][0] == STAMPS[0]
    np.testing.assert_allclose(read["simulated [degC]"], table()["simulated"], atol=1e-5)
    with showing(Display(table_format="xlsx")):
        write_results(tmp_path / "book", {"a.parquet": table()})
    book = pd.read_excel(tmp_path / "book" / "a.xlsx")
    assert list(book) == ["timestamp", "timestamp UTC", "zone", "simulated [degC]"] and len(book) == 48
    assert (book["timestamp UTC"] - book["timestamp"]).unique() == pd.Timedelta(hours=5)
    assert (tmp_path / "book" / "a.parquet").is_file()


def test_a_workbook_without_its_package_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    there = builtins.__import__

    def lacking(name: str, *rest: Any, **more: Any) -> Any:
        if name == "openpyxl":
            raise ImportError("No module named 'openpyxl'")
        return there(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", lacking)
    with pytest.raises(MissingExtraError, match=r'openpyxl.*pip install "buildingmpc\[reports\]"'):
        Display(table_format="xlsx")


@pytest.mark.parametrize("given", [{"units": "imperial"}, {"figures": "gif"}, {"table_format": "xls"}])
def test_an_unknown_choice_names_those_there_are(given: dict[str, str]) -> None:
    with pytest.raises(MpcError, match="expected one of"):
        Display(**given)


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_figures_are_files_too(tmp_path: Path, kind: str) -> None:
    with showing(Display(figures=kind)):
        write_results(tmp_path / "one", {"report.html": page()})
        write_results(tmp_path / "two", {"report.html": "no figure"})
    drawn = tmp_path / "one" / f"figure_01_temperature_of_zone_a.{kind}"
    assert drawn.read_bytes()[:5] in (b"<?xml", b"\x89PNG\r")
    assert [p.name for p in (tmp_path / "two").iterdir()] == ["report.html"]


def test_another_process_shows_results_alike(tmp_path: Path) -> None:
    import pickle

    made = pickle.loads(pickle.dumps(Displayed(files_of, Display(units="ip", table_format="csv"))))(1)
    assert sorted(made) == ["a.csv", "a.parquet", "said.txt"] and made["said.txt"] == "1.8 °F"
    write_whole(tmp_path / "out", made)


def files_of(size: int) -> dict[str, Any]:
    return {"a.parquet": table(), "said.txt": display().text(f"{size}.0 K")}


def test_a_figure_has_a_layout_for_phones_and_colours_for_the_dark() -> None:
    found = course()
    assert found.width == 672 and not found.is_map
    wide, narrow = svg(found.source), svg(found.narrow)
    assert 'width="504pt"' in wide and 'width="280.8pt"' in narrow
    for drawn in (wide, narrow):
        assert f'[style*="stroke: {INK.lower()}"]{{stroke:{DARK[INK.lower()]}!important}}' in drawn
        assert "#ffffff" not in drawn  # the ground is the page's
    assert styled(lambda: picture(Figure(figsize=(7.0, 2.0)), "a map", phone=False))().narrow == ""


def test_a_figure_in_inch_pound_units_has_round_ticks_of_them() -> None:
    with showing(Display(units="ip")):
        found = course()
    drawn = svg(found.source)
    assert "temperature [°F]" in drawn and "zone A: 0.90 °F" in drawn
    ticks = [float(t) for t in re.findall(r"<text [^>]*>(\d+(?:\.\d+)?)</text>", drawn)]
    assert {68.0, 70.0} <= set(ticks) and max(ticks) < 75.0
    assert found.zoom is not None
    line = found.zoom["data"][-1]
    assert line["y"][0] == pytest.approx(68.0) and found.zoom["layout"]["yaxis"]["title"]["text"] == "temperature [°F]"


def test_what_zooms_is_what_is_drawn() -> None:
    found = course().zoom
    assert found is not None
    band, line = found["data"]
    assert band["fill"] == "toself" and line["name"] == "measured" and line["line"]["color"] == INK.lower()
    assert line["x"][0] == "2023-03-06 00:00" and line["x"][-1] == "2023-03-06 23:30" and line["y"][-1] == 21.0


def drawn_y(uri: str) -> list[float]:
    """Heights of the corners of the longest line of a drawing [pt]."""
    lines = re.findall(r'<path d="(M [^"]*)"[^>]*style="fill: none', svg(uri))
    return [float(y) for y in re.findall(r"[ML] ?[-\d.]+ ([-\d.]+)", max(lines, key=len))]


@styled
def long_course(values: np.ndarray, band: bool = False) -> Picture:
    stamps = pd.date_range("2023-01-01", periods=len(values), freq="5min", tz="Etc/GMT+5")
    figure, axes = panel(7.0, 2.5, ylabel="temperature [°C]")
    x = lines_over_time(axes, stamps)
    if band:
        axes.fill_between(x, values - 1.0, values + 1.0, color=MEASURED, alpha=0.2)
    axes.plot(x, values, color=INK, label="measured")
    return picture(figure, "A quarter of a year", zoom=True)


def test_a_long_course_is_thinned_and_its_peaks_stay() -> None:
    values = 20.0 + np.random.default_rng(0).normal(0.0, 0.1, 25920)
    values[7001], values[15003], values[20000:20400] = 27.0, 12.0, np.nan
    found = long_course(values, band=True)
    assert found.zoom is not None
    *bands, line = found.zoom["data"]  # of each part between gaps
    shown = [y for y in line["y"] if y is not None]
    assert max(shown) == 27.0 and min(shown) == 12.0 and None in line["y"] and len(line["y"]) < 3000
    assert line["x"][line["y"].index(27.0)] == "2023-01-25 07:25"  # the stamp of the spike itself
    assert (line["x"][0], line["x"][-1]) == ("2023-01-01 00:00", "2023-03-31 23:55")
    assert len(bands) == 2
    assert max(max(band["y"]) for band in bands) == 28.0 and sum(len(band["y"]) for band in bands) < 6000
    for uri in (found.source, found.narrow):
        heights = drawn_y(uri)
        assert len(heights) < 2000 and np.ptp(heights) > 8.0 * np.ptp(np.percentile(heights, [5.0, 95.0]))


def test_a_short_course_keeps_every_point() -> None:
    values = 20.0 + np.random.default_rng(0).normal(0.0, 0.1, 288)
    found = long_course(values).zoom
    assert found is not None and found["data"][0]["y"] == pytest.approx(values, rel=1e-4)
    there_and_back = np.r_[np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)]
    assert len(kept_points(there_and_back, np.zeros(100), 5)) == 100


def test_names_beside_lines_zoom_with_them() -> None:
    @styled
    def named() -> Picture:
        figure, axes = panel(7.0, 2.5, ylabel="temperature [°C]")
        x = lines_over_time(axes, STAMPS)
        axes.plot(x, np.full(48, 20.0))
        axes.text(x[2], 20.0, "valve leaks", ha="right")
        return picture(figure, "Named", zoom=True)

    with showing(Display(units="ip")):
        found = named().zoom
    assert found is not None
    (told,) = found["layout"]["annotations"]
    assert (told["text"], told["x"], told["y"], told["xanchor"]) == ("valve leaks", "2023-03-06 01:00", 68.0, "right")


def test_a_page_says_what_it_means_and_explains_its_words() -> None:
    found = page()
    assert "What is the answer?" in found and "Yes &amp; no." in found and "&lt;b&gt;" in found
    words = dict(words_on(found))
    assert "bias" in words and "mean absolute error" in words and "Kalman filter" not in words
    assert all(f"<dt>{word}</dt>" in found for word in words)
    assert "prefers-color-scheme: dark" in found and "<!-- " not in found


def test_a_page_in_inch_pound_units() -> None:
    with showing(Display(units="ip")):
        found = page()
    text = re.sub(r"<[^>]*>", " ", found.partition("<style>")[0] + found.partition("</style>")[2])
    assert "0.90 °F" in text and "0.90 degrees F" in text and "MAE [°F]" in text and "340" in text
    assert " K" not in text.partition("The words on this page")[0]


def test_figures_zoom_with_plotly_and_stand_still_without(monkeypatch: pytest.MonkeyPatch) -> None:
    with_it = page()
    assert 'data-zoom="0"' in with_it and 'id="plotly"' in with_it and len(with_it) < 3e6
    assert not re.search(r'(?:src|href)="(?!data:)', with_it)
    monkeypatch.setattr(zoom, "_library", lambda: None)
    without = page()
    assert 'id="plotly"' not in without and "application/json" not in without and len(without) < 0.2e6


