"""Experiments on a simulated site: what the plant is set to, and which sites are refused."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration.experiment.schedule import COOLING, HEATING, Move, Schedule
from mpc.errors import PlantError
from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.plant import Plant
from mpc.loop.run import FixedSetpoints
from mpc.studies.experiment import Site, carry_out, made_by, open_site
from thermal.case.case import Case
from thermal.data import load_bundled_case
from thermal.pilot.weather import MOUNTAIN_VIEW

BUILDING = replace(load_bundled_case().building, location=MOUNTAIN_VIEW)


def site(dx: float = 3.0, insulated: float = 1.0) -> Site:
    """Give a site whose runs begin with the 9th of January."""

    def made(case: Case | None, end: pd.Timestamp) -> tuple[Plant, Mapping[str, float]]:
        weather, settings = pilot_weather(1, "2023-01-09", 3, 600.0), {"window_u_value": 2.0 * insulated}
        plant = simulated_plant(
            BUILDING, weather, "2023-01-09", end.tz_localize(None).isoformat(),
            PlantSettings(dx=dx, step_seconds=600.0, parameters=settings),
        )  # fmt: skip
        return plant, plant.default_actions

    return made


@pytest.fixture(scope="module")
def case() -> Case:
    """Give a day of telemetry of the site."""
    plant, usual = site()(None, pd.Timestamp("2023-01-10", tz=MOUNTAIN_VIEW.timezone))  # type: ignore[arg-type]
    plant.reset()
    while not plant.finished:
        plant.step(FixedSetpoints(usual, plant.actuators).at_hour(0.0))
    return plant.case()  # type: ignore[attr-defined, no-any-return]


def test_the_plant_is_set_to_the_schedule_and_the_telemetry_goes_on(case: Case) -> None:
    start = case.stamps[-1]
    warm = Move("warm", ("F1_N",), ((297.0, 297.5),), 1e4, ((2.0, 6.0),))
    longer = carry_out(case, Schedule(start, 8.0, (warm,)), site())
    frame = longer.telemetry.frame
    pd.testing.assert_frame_equal(frame.loc[:start], case.telemetry.frame, check_freq=False)
    assert frame.index[-1] == start + pd.Timedelta(hours=8)
    hours = (frame.index - start) / pd.Timedelta(hours=1)
    held = (hours > 2.0) & (hours <= 6.0)
    for point, value in ((HEATING, 297.0), (COOLING, 297.5)):
        told = frame[f"VAV_F1_N/{point}"]
        assert np.allclose(told[held], value) and not np.isclose(told[~held & (hours > 0)], value).any()
        assert not np.isclose(frame.loc[start:, f"VAV_F1_S/{point}"], value).any()
    usual = carry_out(case, Schedule(start, 8.0), site()).zone_temperatures()
    assert (longer.zone_temperatures()["F1_N"] - usual["F1_N"])[held].max() > 0.5


def test_another_site_and_other_actuators_are_refused(case: Case) -> None:
    start = case.stamps[-1]
    with pytest.raises(PlantError, match="K from it"):
        carry_out(case, Schedule(start, 1.0), site(insulated=0.2))
    there = Move("warm", ("F9_N",), ((297.0, 297.5),), 1e4, ((0.0, 1.0),))
    with pytest.raises(PlantError, match="points that the site can set"):
        carry_out(case, Schedule(start, 1.0, (there,)), site())


@pytest.mark.parametrize("name", ["nothing", "no.such.module:site", "nowhere.py:site", "math:no_such", "math:pi"])
def test_sites_that_are_none(name: str) -> None:
    with pytest.raises(PlantError, match="site"):
        open_site(name)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ("'plant'", "'plant'"), ("('plant', {})", "without actuators"), ("('plant', 1)", "setpoints"),
        ("1 / 0", "ZeroDivisionError"),
    ],
)  # fmt: skip
def test_sites_that_give_no_plant(tmp_path: Path, case: Case, given: str, error: str) -> None:
    (tmp_path / "mine.py").write_text(f"def site(case, end):\n    return {given}\n", encoding="utf-8")
    with pytest.raises(PlantError, match=error):
        made_by(open_site(f"{tmp_path / 'mine.py'}:site"), case, case.stamps[-1])


def test_a_file_that_is_no_python(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def site(case, end:\n", encoding="utf-8")
    with pytest.raises(PlantError, match="SyntaxError"):
        open_site(f"{tmp_path / 'mine.py'}:site")


def test_a_site_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def site(case, end):\n    return 'plant', {}\n", encoding="utf-8")
    found = open_site(f"{tmp_path / 'mine.py'}:site")
    assert found(None, None) == ("plant", {})  # type: ignore[arg-type]
