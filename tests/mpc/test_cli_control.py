"""``buildingmpc control`` and ``compare``: what they print and write, and with which code they leave."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from mpc.cli.app import app
from thermal.data import bundled_case_path

CASE = str(bundled_case_path())
SPAN = ("--start", "2023-03-06T06:00", "--end", "2023-03-06T07:00", "--dx", "1.0")

pytestmark = pytest.mark.usefixtures("blank_pictures")


def run(*arguments: str | Path) -> Any:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_control_writes_and_prints_the_same(tmp_path: Path) -> None:
    out = tmp_path / "one"
    answer = run("control", CASE, *SPAN, "--controller", "reset", "--out", out, "--json")
    assert answer.exit_code == 0, answer.stderr
    assert json.loads(answer.stdout) == json.loads((out / "control.json").read_text(encoding="utf-8"))
    assert sorted(p.name for p in out.iterdir()) == ["control.json", "report.html", "trajectory.parquet"]
    again = run("control", CASE, *SPAN, "--controller", "reset", "--out", out)
    assert again.exit_code == 2 and "--force" in again.stderr


@pytest.mark.long
def test_compare_prints_a_table_and_what_was_assumed(tmp_path: Path) -> None:
    answer = run("compare", CASE, *SPAN, "--controllers", "schedule,mpc", "--out", tmp_path / "two")
    assert answer.exit_code == 0, answer.stderr
    text = " ".join(answer.stdout.split())
    assert "Optimal control spent" in text and "fixed schedule" in text and "no air handler and no boiler" in text
    assert "[USD]" in text and "21 to 24 °C when occupied" in text and "Simulated, not the real" in text
    assert (tmp_path / "two" / "trajectory_schedule.parquet").exists()


def test_prices_comfort_and_display_are_options(tmp_path: Path) -> None:
    out = tmp_path / "own"
    answer = run(
        "compare", CASE, *SPAN, "--controllers", "reset", "--tariff", "0.3", "--gas-price", "1/therm", "--currency", "EUR",
        "--comfort", "66F,78F", "--units", "ip", "--format", "csv", "--out", out,
    )  # fmt: skip
    assert answer.exit_code == 0, answer.stderr
    text = " ".join(answer.stdout.split())
    assert "[EUR]" in text and "[°F h]" in text and "66.00 to 78.01 °F" in text
    assert "0.3 EUR per kWh" in text and "0.03412 EUR per kWh" in text
    page = (out / "report.html").read_text(encoding="utf-8")
    for told in ("What these costs rest on", "energy cost [EUR]", "discomfort, mean zone [°F h]", "nothing is converted", "66.00 to 78.01 °F", "0.3 EUR per kWh"):
        assert told in page
    assert "/zone_air_temperature_sensor [degC]" in (out / "trajectory_reset.csv").read_text(encoding="utf-8")
    assert ("outside of the band" in page) == ("left the comfort band" in page)


def test_bad_input_leaves_nothing_behind(tmp_path: Path) -> None:
    for more, word in (
        (("--controller", "mcp"), "'mpc'"),
        (("--plant", "grids"), "reduced, grid, random"),
        (("--end", "2024-01-01"), "weather"),
        (("--weather", "none.epw"), "none.epw"),
        (("--currency", "EUR"), "nothing is converted"),
        (("--comfort", "24,21"), "each LOW is below"),
        (("--units", "imperial"), "si, ip"),
    ):
        answer = run("control", CASE, *SPAN, "--out", tmp_path / "none", *more)
        assert answer.exit_code == 2 and word in answer.stderr and not (tmp_path / "none").exists()
