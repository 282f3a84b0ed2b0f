"""``identify``, then ``control`` and ``compare`` by commands alone, on a unit with BOPTEST's overwrites."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from typer.testing import CliRunner

from mpc.cli.app import app
from mpc.identify.model import read_model

pytest.importorskip("fmpy", reason="needs the extra [fmu]")
pytestmark = pytest.mark.usefixtures("blank_pictures")
SPEED = "heat_pump/compressor_speed"
DESCRIPTION = """
format: 1
name: heated_floor
location: {latitude: 50.8, longitude: 4.35, elevation: 100.0, timezone: Etc/GMT-1}
plant: {kind: fmu, file: house.fmu, communication_step: 300.0, parameters: {amplitude: 4.0, mean: 278.15}}
control_step: 900.0
period: {start: 2023-01-16 00:00, days: 1, warm_up_days: 1}
zones:
  living:
    temperature: reaTZon_y
    floor_area: 120.0
    comfort: {occupied: [20 degC, 24 degC], unoccupied: [18 degC, 26 degC], weekday: [7, 22], saturday: [7, 22], sunday: [7, 22]}
    people: 2.0
measurements:
  living/zone_air_temperature_sensor: reaTZon_y
  heat_pump/electrical_power_sensor: {signal: reaPHeaPum_y, unit: W}
  heat_pump/heating_power_sensor: reaQFloHea_y
  weather_station/outside_air_temperature_sensor: weaSta_reaWeaTDryBul_y
actuators:
  heat_pump/compressor_speed: {signal: oveHeaPumY_u, range: [0.0, 1.0], kind: modulating, minimum: 0.25}
energy: {electricity: [reaPHeaPum_y]}
prices: {electricity: 0.3, currency: EUR}
series: [outputs]
weather: {outside_air_temperature_sensor: weaSta_reaWeaTDryBul_y}
forecast: {hours: 12.0}
"""


def run(*arguments: str | Path) -> Any:
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.mark.long
def test_identify_then_control(tmp_path: Path, make_house: Callable[..., Path]) -> None:
    plant, model = tmp_path / "plant.yaml", tmp_path / "model"
    plant.write_text(DESCRIPTION)
    (tmp_path / "house.fmu").write_bytes(make_house(kinds=("CoSimulation",)).read_bytes())
    answer = run("identify", plant, "--days", "3", "--out", model, "--json")
    assert answer.exit_code == 0, answer.output
    told = json.loads(answer.stdout)
    assert told == json.loads((model / "identify.json").read_text()) and told["start"] == "2023-01-13T00:15:00+01:00"
    assert sorted(p.name for p in model.iterdir()) == [
        "identify.json",
        "model.json",
        "report.html",
        "telemetry.parquet",
    ]
    assert told["machines"][SPEED]["standing_power"] == pytest.approx(100.0, rel=0.01)
    assert told["machines"][SPEED]["efficiency"]["full"] == pytest.approx(8000.0 / (8000.0 / 3.0 + 100.0), rel=0.01)
    (found,) = read_model(model).maps
    assert found.operation == "duty" and told["experiment"]["kpis"]["tdis_tot"] < 1.0
    assert (
        "<h2>Machines</h2>" in (model / "report.html").read_text()
        and run("identify", plant, "--out", model).exit_code == 2
    )

    span = ("--start", "2023-01-16 06:00", "--end", "2023-01-16 12:00")
    out = tmp_path / "control"
    answer = run("control", plant, "--model", model, *span, "--violations", "5%", "--out", out)
    assert answer.exit_code == 0, answer.output
    text = " ".join(answer.stdout.split())
    assert "All 24 actions followed a plan" in text and "0.05 of the occupied steps may lie below the band" in text
    speed = pd.read_parquet(out / "trajectory.parquet")[f"set/{SPEED}"]
    assert len(speed) == 24 and set(speed) <= {0.0, 1.0}
    again = run("identify", plant, "--telemetry", out / "trajectory.parquet", "--out", tmp_path / "again")
    assert again.exit_code == 2 and "3 days of telemetry at least, found 0.25" in again.stderr

    both = run("compare", plant, *span, "--controllers", "own,full_speed", "--out", tmp_path / "both")
    assert both.exit_code == 0 and "the plant's own control" in both.stdout, both.output


def test_what_commands_refuse(tmp_path: Path, make_house: Callable[..., Path]) -> None:
    plant = tmp_path / "plant.yaml"
    plant.write_text(DESCRIPTION)
    (tmp_path / "house.fmu").write_bytes(make_house(kinds=("CoSimulation",)).read_bytes())
    for arguments, word in (
        (("control", plant), "pass --model, from: buildingmpc identify"),
        (("control", plant, "--controller", "reset"), "expected one of mpc, own, full_speed"),
        (("control", plant, "--model", tmp_path), "a folder with model.json"),
        (("control", plant, "--violations", "much"), "--violations: expected a share such as 5%"),
        (("control", plant, "--start", "2023-01-16"), "--start and --end, or neither"),
        (("control", tmp_path), "expected the description of the building, found no such file"),
        (("identify", plant, "--actuators", "pump/on"), "actuators: expected one of the plant, found 'pump/on'"),
        (("identify", plant, "--cooling"), "actuators: expected a zone_air_cooling_temperature_setpoint"),
        (("identify", plant, "--start", "soon"), "--start: expected a local time"),
        (("identify", plant, "--telemetry", plant), "expected a .parquet or .csv file"),
    ):
        answer = run(*arguments, "--out", tmp_path / "none")
        assert answer.exit_code == 2 and word in " ".join(answer.stderr.split()), (arguments, answer.output)
        assert not (tmp_path / "none").exists()
