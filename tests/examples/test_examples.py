"""Every example runs, and gives the number it is about."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_example_is_tested_here() -> None:
    assert {p.stem for p in EXAMPLES.glob("*.py")} == {
        "step_a_building",
        "calibrate_a_case",
        "case_to_controller",
        "close_the_loop",
        "make_the_pilot",
        "linear_response",
        "draw_an_office",
    }


def test_step_a_building() -> None:
    example = load("step_a_building")
    path = example.night()
    assert path.shape == (144, 5)
    core = 2
    last_set_back, end = np.delete(path[107], core), path[-1]
    assert (last_set_back < example.COMFORT - 2.0).all()
    assert path[107, core] > last_set_back.max() + 1.0  # no facade of its own
    assert (end > path[107]).all()
    assert np.abs(end - example.COMFORT).max() < 1.5


def test_linear_response(tmp_path: Path) -> None:
    example = load("linear_response")
    office = example.linear_office()
    assert 1.0 / np.abs(office.poles().real).min() / 86400.0 == pytest.approx(8.2, abs=0.1)
    example.draw(office, tmp_path / "linear.png")
    assert (tmp_path / "linear.png").stat().st_size > 10_000


@pytest.mark.long
def test_calibrate_a_case() -> None:
    result = load("calibrate_a_case").run(dx=1.0)
    assert result.solver.success
    assert result.calibrated["held_out"].metrics.mae < 0.7 * result.uncalibrated["held_out"].metrics.mae


@pytest.mark.long
def test_case_to_controller() -> None:
    """Three hours of a mild March morning take little, and no zone leaves its band."""
    kpis = load("case_to_controller").run()
    assert kpis.hours == 3.0 and kpis.tdis_tot < 0.02
    assert kpis.ener_tot == pytest.approx(0.0125, rel=0.2)  # the last digits of the fit move it by 8 %


def test_make_the_pilot(tmp_path: Path) -> None:
    case = load("make_the_pilot").small(str(tmp_path / "office"))
    assert len(case.building.zone_names) == 12
    assert case.zone_temperatures().to_numpy().mean() == pytest.approx(294.0, abs=2.0)


def test_close_the_loop() -> None:
    """Water too cold for the coils saves gas and costs comfort."""
    example = load("close_the_loop")
    cold, usual = example.run(311.0), example.run()
    assert cold.tdis_tot > usual.tdis_tot + 0.05
    assert 0.1 < usual.ener_tot < 1.0


def test_draw_an_office(tmp_path: Path) -> None:
    """Its drawings are read as the rooms that were drawn, its export as their telemetry."""
    from PIL import Image

    load("draw_an_office").draw(tmp_path, days=1)
    assert {p.name for p in tmp_path.iterdir()} == {"F1.png", "F2.png", "devices.csv", "export.csv", "plans.yaml", "windows.yaml"}
    with Image.open(tmp_path / "F1.png") as image:
        assert image.size[0] == 2 * 40 + 16.0 / 0.05  # paper, and 16 m of wall
    table = (tmp_path / "export.csv").read_text().splitlines()
    assert len(table) == 289 and "VAV-F1-C01 ZAT" in table[0]
