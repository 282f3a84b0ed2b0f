"""A house with BOPTEST's overwrites by every interface of FMI: exact solutions, events, switches, means."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import expm

from mpc.adapters.fmu.plant import FmuPlant, FmuSignals, FmuTime
from mpc.adapters.fmu.stepping import ModelExchange
from mpc.errors import PlantActionError, PlantError
from thermal._types import FloatArray

pytest.importorskip("fmpy", reason="needs the extra [fmu]")
START = pd.Timestamp("2023-01-11", tz="Europe/Brussels")
SPEED, SETPOINT, ZONE = "pump/speed", "zone/zone_air_heating_temperature_setpoint", "zone/zone_air_temperature_sensor"
OUTDOOR, POWER = "station/outside_air_temperature_sensor", "pump/electrical_power_sensor"
SIGNALS = FmuSignals(
    {ZONE: "reaTZon_y", OUTDOOR: "weaSta_reaWeaTDryBul_y", POWER: "reaPHeaPum_y"},
    {SPEED: "oveHeaPumY_u", SETPOINT: "oveTSet_u"},
    {"zone": "reaTZon_y"},
    ("reaPHeaPum_y",),
)
UA, K, C_Z, C_F = 150.0, 500.0, 2e6, 1e7  # of house.c [W/K, J/K]
WITHIN = 1e-3  # K: CVODE's tolerance of 1e-6 of the nominal value, 300 K, and again of the value
WAYS = [(version, kind) for version in ("2.0", "3.0") for kind in ("co-simulation", "model exchange")]
Make = Callable[..., Path]


def exact(state: FloatArray, heat: float, seconds: float, outdoor: float = 273.15) -> FloatArray:
    """Temperatures of zone and floor after a time of constant inputs [K]."""
    matrix = np.zeros((3, 3))
    matrix[0] = [-(UA + K) / C_Z, K / C_Z, UA * outdoor / C_Z]
    matrix[1] = [K / C_F, -K / C_F, heat / C_F]
    return np.asarray((expm(matrix * seconds) @ [*state, 1.0])[:2])


@pytest.fixture(params=WAYS, ids=lambda way: " ".join(way))
def plant(make_house: Make, request: pytest.FixtureRequest) -> Iterator[FmuPlant]:
    """Two days of the house, by each interface."""
    version, interface = request.param
    with FmuPlant(make_house(version), SIGNALS, 900.0, FmuTime(START, 2 * 86_400.0), interface=interface) as made:
        yield made


def test_an_overwritten_house_is_the_exact_solution_and_its_means(plant: FmuPlant) -> None:
    plant.reset()
    state, powers = np.array([293.15, 293.15]), []
    for speed in (0.3, 1.0, 0.0, 0.5):
        seen = plant.step({SPEED: speed})
        fine = [exact(state, 8000.0 * speed, s) for s in np.linspace(0.0, 900.0, 91)]
        state = fine[-1]
        mean = np.trapezoid([t[0] for t in fine], dx=10.0) / 900.0
        assert seen[ZONE] == pytest.approx(mean, abs=WITHIN)
        assert seen[OUTDOOR] == pytest.approx(273.15)
        powers.append(8000.0 * speed / 3.0 + 100.0 * (speed > 0.0))
        assert seen[POWER] == pytest.approx(powers[-1], abs=1e-6)  # a jump at the begin of the step is no half-value
    record = plant.record()
    assert (record.step, record.n_steps) == (30.0, 120)
    assert record.zone_temperature[-1, 0] == pytest.approx(state[0], abs=WITHIN)
    assert record.electricity.mean() == pytest.approx(np.mean(powers))


def test_the_means_of_all_interfaces_agree(make_house: Make) -> None:
    """State events of the thermostat and time events of its schedule: half a day of the house's own control, a sine."""
    runs = []
    for version, interface in WAYS:
        signals = FmuSignals(SIGNALS.measurements, {}, SIGNALS.zones, SIGNALS.electricity)
        with FmuPlant(
            make_house(version), signals, 900.0, FmuTime(START, 43_200.0), interface=interface,
            parameters={"amplitude": 5.0},
        ) as house:  # fmt: skip
            house.reset()
            runs.append(np.array([house.step({}).values_array for _ in range(48)]))
    np.testing.assert_allclose(runs[3], runs[1], atol=1e-6)  # the same solver
    np.testing.assert_allclose(runs[2], runs[0], atol=1e-6)
    own, ours = runs[0], runs[1]
    assert np.ptp(own[:, 2]) > 2000.0  # it switched
    # the house's own solver sees a switching up to 5 s late, CVODE at its time
    np.testing.assert_allclose(ours[:, 0], own[:, 0], atol=1e-2)
    assert np.abs(ours[:, 2] - own[:, 2]).max() < 2800.0 * 30.0 / 900.0 + 1.0  # of one reading of thirty
    # the mean of the sine over a quarter of an hour, in closed form
    edges = 2.0 * np.pi * np.arange(49) / 96.0
    sine = 273.15 + 5.0 * -np.diff(np.cos(edges)) / np.diff(edges)
    np.testing.assert_allclose(ours[:, 1], sine, atol=1e-5)


def test_what_is_left_out_is_released(plant: FmuPlant) -> None:
    setpoint = plant.actuators[1]
    assert (setpoint.lowest, setpoint.highest, setpoint.unit) == (278.15, 308.15, "K")
    plant.reset()
    unit = plant.unit
    switches = ("oveHeaPumY_activate", "oveTSet_activate")
    plant.step({SPEED: 0.25})
    assert unit.get([*switches, "oveHeaPumY_y"]) == {switches[0]: 1.0, switches[1]: 0.0, "oveHeaPumY_y": 0.25}
    plant.step({SETPOINT: 303.15})
    assert unit.get([*switches, "oveHeaPumY_y"]) == {switches[0]: 0.0, switches[1]: 1.0, "oveHeaPumY_y": 1.0}
    plant.step({})
    assert unit.get([*switches, "oveTSet_y"]) == {switches[0]: 0.0, switches[1]: 0.0, "oveTSet_y": 291.15}
    with pytest.raises(PlantActionError, match=r"pump/speed: expected a number from 0 to 1"):
        plant.step({SPEED: 1.2})


def test_an_overwrite_that_reaches_nothing(make_house: Make) -> None:
    house, time = make_house(), FmuTime(START, 3600.0)
    with FmuPlant(house, SIGNALS, 900.0, time, parameters={"deaf": 1.0}) as plant:
        plant.reset()
        with pytest.raises(PlantError, match=r"pump/speed: oveHeaPumY_u = 0.5: expected the same used, found 0; the over"):
            plant.step({SPEED: 0.5})
    lame = make_house(dropped=("oveHeaPumY_activate",))
    with pytest.raises(PlantError, match=r"pump/speed: 'oveHeaPumY_u': expected a switch 'oveHeaPumY_activate', without "
                       r"which it reaches nothing, found the switches oveTSet_activate; map another"):  # fmt: skip
        FmuPlant(lame, SIGNALS, 900.0, time)
    switch = FmuSignals({}, {SPEED: "oveHeaPumY_activate"}, {"zone": "reaTZon_y"})
    with pytest.raises(PlantError, match="expected an input that carries a value, found the switch of one"):
        FmuPlant(house, switch, 900.0, time)
    with pytest.raises(PlantError, match="expected a real or whole or boolean input or parameter, found Real output"):
        FmuPlant(house, FmuSignals({}, {SPEED: "oveHeaPumY_y"}, {"zone": "reaTZon_y"}), 900.0, time)
    other = FmuSignals({}, {SPEED: "oveHeaPumY_u"}, {"zone": "reaTZon_y"}, releases={SPEED: "oveHeaPum_activate"})
    with pytest.raises(PlantError, match="expected a switch 'oveHeaPum_activate'"):
        FmuPlant(house, other, 900.0, time)


def test_booleans_are_on_off_and_kinds_are_kept(make_house: Make) -> None:
    lame = make_house(dropped=("oveHeaPumY_u",))
    signals = FmuSignals({}, {"pump/on": "oveHeaPumY_activate"}, {"zone": "reaTZon_y"})
    with FmuPlant(lame, signals, 900.0, FmuTime(START, 3600.0)) as plant:
        assert plant.actuators[0].kind == "on_off"
        plant.reset()
        plant.step({"pump/on": 1.0})
        assert plant.unit.get(["oveHeaPumY_activate"]) == {"oveHeaPumY_activate": 1.0}
        with pytest.raises(PlantActionError, match=r"pump/on: expected 0 \(off\) or 1 \(on\), found 0.5"):
            plant.step({"pump/on": 0.5})
    least = FmuSignals(
        {}, {SPEED: "oveHeaPumY_u"}, {"zone": "reaTZon_y"}, kinds={SPEED: "modulating"}, minimums={SPEED: 0.3}
    )
    with FmuPlant(make_house(), least, 900.0, FmuTime(START, 3600.0)) as plant:
        plant.reset()
        plant.step({SPEED: 0.3})
        plant.step({SPEED: 0.0})
        with pytest.raises(PlantActionError, match=r"expected 0 \(off\) or a number from 0.3 to 1, found 0.1"):
            plant.step({SPEED: 0.1})


def test_a_unit_whose_derivatives_fail(make_house: Make) -> None:
    for interface, says in (("co-simulation", "DoStep"), ("model exchange", "CVODE: .*Derivatives")):
        with FmuPlant(
            make_house(), SIGNALS, 900.0, FmuTime(START, 86_400.0), interface=interface, parameters={"TFlo": 330.0}
        ) as plant:
            plant.reset()
            with pytest.raises(PlantError, match=f"wrapped.fmu: advance failed: .*{says}"):
                for _ in range(96):
                    plant.step({SPEED: 1.0})
            with pytest.raises(PlantError, match="call reset"):
                plant.step({})


def test_one_interface_only(make_house: Make) -> None:
    both = ("CoSimulation", "ModelExchange")
    for kinds, interface in ((both[:1], "co-simulation"), (both[1:], "model exchange"), (both, "model exchange")):
        with FmuPlant(make_house(kinds=kinds), SIGNALS, 900.0, FmuTime(START, 3600.0)) as plant:
            assert plant.unit.interface == interface


@pytest.mark.parametrize(("pause", "most"), [(0.0, 100), (1e-4, 500)], ids=["at once", "one after another"])
def test_events_without_end_are_an_error(monkeypatch: pytest.MonkeyPatch, pause: float, most: int) -> None:
    """A unit whose next event is always now, and one whose next is always soon."""
    monkeypatch.setattr("mpc.adapters.fmu.stepping._MOST_EVENTS", 500)
    unit = MagicMock()
    made = SimpleNamespace(
        modelExchange=SimpleNamespace(needsCompletedIntegratorStep=False), numberOfContinuousStates=0,
        numberOfEventIndicators=0,
    )  # fmt: skip
    stepping = ModelExchange(unit, False, made, 30.0)
    unit.newDiscreteStates.side_effect = lambda: (False, False, False, False, True, stepping._time + pause)
    stepping._time = stepping._next = 0.0
    stepping._solver = SimpleNamespace(reset=lambda time: None, solve=lambda time, until: (False, None, until))
    with pytest.raises(PlantError, match=f"events without end: {most + 1} from 0 to"):
        stepping.advance(0.0, 30.0)
