"""A room by co-simulation: its run has a closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpc.adapters.fmu.plant import FmuPlant, FmuSignals, FmuTime
from mpc.errors import PlantActionError, PlantError
from mpc.loop.run import FixedSetpoints, run_closed_loop

fmpy = pytest.importorskip("fmpy", reason="needs the extra [fmu]")
HERE = Path(__file__).parent
START = pd.Timestamp("2023-01-09 06:00", tz="Europe/Berlin")
HEAT, WATER = "room/heating_power", "boiler/supply_water_temperature_setpoint"
SIGNALS = FmuSignals(
    {
        "room/zone_air_temperature_sensor": "TRoo",
        "station/outside_air_temperature_sensor": "TOut",
        "boiler/electrical_power_sensor": "PHea",
    },
    {HEAT: "QHea", WATER: "TSup"},
    {"room": "TRoo"},
    electricity=("PHea",),
)


@pytest.fixture
def plant(room: Path) -> Iterator[FmuPlant]:
    """Six hours of the room, outdoors at 0 degC."""
    with FmuPlant(room, SIGNALS, 900.0, FmuTime(START, 6 * 3600.0, 3)) as made:
        yield made


def exact(temperature: float, heat: float, outdoor: float, supply: float, seconds: float, loss: float = 100.0) -> float:
    """Temperature of the room after a time of constant inputs [K]."""
    conductance = loss + 10.0
    rest = (loss * outdoor + 10.0 * supply + heat) / conductance
    return rest + (temperature - rest) * math.exp(-conductance * seconds / 1e6)


def test_a_run_is_the_closed_form(plant: FmuPlant) -> None:
    seen = plant.reset()
    assert seen["room/zone_air_temperature_sensor"] == 293.15 and seen.stamp == START
    assert seen["station/outside_air_temperature_sensor"] == 273.15  # 0 degC at the unit
    expected = 293.15
    for k in range(24):
        heat = 1000.0 + 100.0 * k
        seen = plant.step({HEAT: heat, WATER: 330.0})
        edges = [exact(expected, heat, 273.15, 330.0, 300.0 * part) for part in range(4)]
        expected = edges[-1]
        # the mean over the control step of straight lines between the communication steps
        mean = (0.5 * edges[0] + edges[1] + edges[2] + 0.5 * edges[3]) / 3.0
        assert seen["room/zone_air_temperature_sensor"] == pytest.approx(mean, abs=1e-9)
        assert seen["boiler/electrical_power_sensor"] == pytest.approx(heat / 0.9)
    assert plant.finished and seen.stamp == START + pd.Timedelta(hours=6)
    record = plant.record()
    assert (record.step, record.n_steps) == (300.0, 72)
    assert record.zone_temperature[0, 0] == 293.15 and record.zone_temperature[-1, 0] == pytest.approx(expected)
    np.testing.assert_allclose(record.electricity, np.repeat((1000.0 + 100.0 * np.arange(24)) / 0.9, 3))
    with pytest.raises(PlantError, match="make the duration longer"):
        plant.step({})


def test_what_is_left_out_stays_and_a_reset_repeats(plant: FmuPlant) -> None:
    runs = []
    for _ in range(2):
        plant.reset()
        plant.step({HEAT: 2000.0})
        runs.append([plant.step({}).values_array for _ in range(3)])
    np.testing.assert_array_equal(runs[0], runs[1])
    heated = exact(exact(293.15, 2000.0, 273.15, 313.15, 900.0), 2000.0, 273.15, 313.15, 2700.0)
    assert plant.record().zone_temperature[-1, 0] == pytest.approx(heated, abs=1e-9)


def test_parameters_drivers_and_warm_up(room: Path) -> None:
    outdoor = np.linspace(-5.0, 5.0, 3 + 8)
    with FmuPlant(
        room, SIGNALS, 600.0, FmuTime(START, 4800.0, 1, warm_up=1800.0), parameters={"UA": 200.0, "QHea": 500.0},
        drivers={"TOut": outdoor},
    ) as plant:  # fmt: skip
        seen = plant.reset()
        expected = 293.15
        for value in outdoor[:3]:
            expected = exact(expected, 500.0, value + 273.15, 313.15, 600.0, 200.0)
        assert seen["room/zone_air_temperature_sensor"] == pytest.approx(expected, abs=1e-9)
        for value in outdoor[3:]:
            seen = plant.step({})
            before, expected = expected, exact(expected, 500.0, value + 273.15, 313.15, 600.0, 200.0)
            assert seen["room/zone_air_temperature_sensor"] == pytest.approx(0.5 * (before + expected), abs=1e-9)


def test_limits_are_those_of_the_unit_in_the_librarys_units(plant: FmuPlant) -> None:
    by_name = {a.name: a for a in plant.actuators}
    assert (by_name[HEAT].lowest, by_name[HEAT].highest, by_name[HEAT].unit) == (0.0, 5000.0, "W")
    assert (by_name[WATER].lowest, by_name[WATER].highest, by_name[WATER].unit) == (303.15, 353.15, "K")
    plant.reset()
    for name, value in ((HEAT, -1.0), (WATER, 60.0), (WATER, math.nan)):
        with pytest.raises(PlantActionError, match=name):
            plant.step({name: value})


def test_it_closes_a_loop(plant: FmuPlant) -> None:
    run = run_closed_loop(plant, FixedSetpoints({}, plant.actuators, {6.0: {HEAT: 1500.0}, 9.0: {HEAT: 0.0}}))
    assert run.record.electricity[:36].tolist() == pytest.approx([1500.0 / 0.9] * 36)
    assert run.record.electricity[36:].tolist() == [0.0] * 36


def test_a_unit_that_fails_must_be_reset(plant: FmuPlant) -> None:
    with pytest.raises(PlantError, match="call reset"):
        plant.step({})
    plant.reset()
    with pytest.raises(PlantError, match=r"room.fmu: advance failed: .*DoStep.*status 3"):
        plant.step({HEAT: 4950.0})
    with pytest.raises(PlantError, match="call reset"):
        plant.step({HEAT: 0.0})
    assert plant.reset()["room/zone_air_temperature_sensor"] == 293.15
    plant.step({})
    with pytest.raises(PlantError, match="expected a plant with a forecaster, found an FMU without"):
        plant.forecast()
    plant.close()
    plant.close()


def replaced(signals: FmuSignals, **changes: Any) -> FmuSignals:
    return FmuSignals(**{**{k: getattr(signals, k) for k in signals.__dataclass_fields__}, **changes})


@pytest.mark.parametrize(
    ("changes", "options", "says"),
    [
        ({"zones": {"room": "TRooo"}}, {}, "zone: expected a variable, found 'TRooo'.*TRoo"),
        ({"zones": {"room": "mode"}}, {}, "zone 'mode': expected a real .*, found Integer output"),
        ({"zones": {"room": "PHea"}}, {}, "PHea"),
        ({"actuators": {HEAT: "PHea"}}, {}, "actuator 'PHea': expected a real or whole or boolean input or parameter"),
        ({"electricity": ("TRoo",)}, {}, "power TRoo: expected watts, found 'K'"),
        ({"measurements": {"boiler/electrical_power_sensor": "TRoo"}}, {}, "TRoo"),
        ({}, {"parameters": {"PHea": 1.0}}, "parameter 'PHea': expected a real or whole or boolean parameter or input"),
        ({}, {"drivers": {"TOut": np.zeros(3)}}, "driver TOut: expected 720 finite values"),
    ],
)
def test_signals_that_do_not_fit(room: Path, changes: Mapping[str, Any], options: Mapping[str, Any], says: str) -> None:
    with pytest.raises(PlantError, match=says):
        FmuPlant(room, replaced(SIGNALS, **changes), 900.0, FmuTime(START, 6 * 3600.0), **options)


def test_signals_that_make_no_sense() -> None:
    with pytest.raises(PlantError, match="temperature of a zone"):
        FmuSignals({}, {}, {})
    with pytest.raises(PlantError, match="nearest valid"):
        FmuSignals({"room/temperature": "TRoo"}, {}, {"room": "TRoo"})
    with pytest.raises(PlantError, match="limits: .*room/heating_power"):
        FmuSignals({}, {HEAT: "QHea"}, {"room": "TRoo"}, limits={"room/heat": (0.0, 1.0)})


def test_files_that_are_no_such_unit(room: Path, tmp_path: Path, packed: Callable[..., Path]) -> None:
    text = (HERE / "modelDescription.xml").read_text()
    scheduled = text.replace("CoSimulation", "ScheduledExecution")
    nonsense = tmp_path / "nonsense.fmu"
    nonsense.write_text("no zip")
    library = tmp_path / f"room{fmpy.sharedLibraryExtension}"
    library.write_text("no library")
    for path, says in (
        (tmp_path / "none.fmu", "expected a file, found none"),
        (nonsense, "expected a model description of FMI"),
        (packed(tmp_path / "scheduled.fmu", scheduled, None), "found scheduled execution of FMI 2.0"),
        (packed(tmp_path / "other.fmu", text, library, "other99"), f"expected a library for {fmpy.platform}"),
    ):
        with pytest.raises(PlantError, match=says):
            FmuPlant(path, SIGNALS, 900.0, FmuTime(START, 3600.0))
    broken = FmuPlant(packed(tmp_path / "broken.fmu", text, library), SIGNALS, 900.0, FmuTime(START, 3600.0))
    here = Path.cwd()
    with pytest.raises(PlantError, match="cannot be started"):
        broken.reset()
    assert Path.cwd() == here
    broken.close()
    with pytest.raises(PlantError, match="a time with a time zone"):
        FmuPlant(room, SIGNALS, 900.0, FmuTime(pd.Timestamp("2023-01-09"), 3600.0))
    with pytest.raises(PlantError, match="expected model exchange of FMI 2.0 or 3.0, found co-simulation of FMI 2.0"):
        FmuPlant(room, SIGNALS, 900.0, FmuTime(START, 3600.0), interface="model exchange")
    with pytest.raises(PlantError, match="a positive control step"):
        FmuPlant(room, SIGNALS, 900.0, FmuTime(START, 600.0))


def test_a_closed_plant_leaves_no_files(room: Path) -> None:
    plant = FmuPlant(room, SIGNALS, 900.0, FmuTime(START, 3600.0))
    folder = plant.unit._folder
    assert folder.is_dir()
    plant.close()
    assert not folder.exists()
    with pytest.raises(PlantError, match="was closed, or never started"):
        plant.unit.get(["TRoo"])
