"""Replay of one interval of a case."""

from __future__ import annotations

from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

from thermal import (
    Case,
    SymbolicModel,
    Telemetry,
    build_network,
    free_runs,
    load_bundled_case,
    replay_inputs,
    simulate,
    spin_up,
)
from thermal.errors import ModelError
from thermal.model.step import TR_BDF2


@cache
def setting() -> tuple[Case, SymbolicModel]:
    case = load_bundled_case()
    return case, SymbolicModel(build_network(case.building, dx=1.5))


def test_replay_is_the_free_run_from_the_same_spin_up() -> None:
    case, model = setting()
    stamps, theta = case.stamps, model.network.start()
    found = simulate(case, model, theta, stamps[900], stamps[960], scheme=TR_BDF2)
    inputs = replay_inputs(case, model.network)
    matrices = model.matrices(theta)
    states, _ = spin_up(matrices, inputs, 900 - 864, np.array([900]))
    wanted, _ = free_runs(matrices, inputs, np.array([900]), 60, states, scheme=TR_BDF2)
    np.testing.assert_allclose(found.simulated.to_numpy(), wanted[0], rtol=0, atol=1e-9)
    assert found.start == stamps[900]
    for table in (found.simulated, found.measured, found.heat):
        assert table.index.equals(stamps[901:961])
        assert tuple(table.columns) == case.building.zone_names
    np.testing.assert_allclose(found.measured, case.zone_temperatures().iloc[901:961])
    np.testing.assert_allclose(found.heat, case.zone_heat().iloc[901:961])


def test_start_between_stamps_is_the_next_stamp() -> None:
    case, model = setting()
    stamps = case.stamps
    found = simulate(case, model, model.network.start(), stamps[300] - pd.Timedelta("2min"), stamps[310])
    assert found.start == stamps[300]
    assert len(found.simulated) == 10


def test_telemetry_after_the_start_reaches_the_replay_as_inputs_only() -> None:
    """Measured zone temperatures of the interval itself change nothing but the metered heat that they enter."""
    case, model = setting()
    frame = case.telemetry.frame.copy()
    zones = [c for c in frame if c.endswith("/zone_air_temperature_sensor")]
    frame.iloc[951:, [frame.columns.get_loc(c) for c in zones]] += 0.5
    spoilt = Case(case.building, Telemetry.from_frame(frame))
    stamps, theta = case.stamps, model.network.start()
    a, b = (simulate(c, model, theta, stamps[900], stamps[950]) for c in (case, spoilt))
    np.testing.assert_array_equal(a.simulated, b.simulated)


def test_spin_up_of_less_than_twelve_hours_is_refused_with_the_earliest_start() -> None:
    case, model = setting()
    stamps, theta = case.stamps, model.network.start()
    with pytest.raises(ModelError, match="12 h.*earliest is 2023-03-01 12:05"):
        simulate(case, model, theta, stamps[143], stamps[200])
    assert len(simulate(case, model, theta, stamps[144], stamps[150]).simulated) == 6


@pytest.mark.parametrize(("first", "last"), [(950, 900), (900, 900), (-10, 900), (900, 3000)])
def test_intervals_that_are_not_in_the_telemetry_are_refused(first: int, last: int) -> None:
    case, model = setting()
    begin = case.stamps[0]
    times = [begin + k * pd.Timedelta("5min") for k in (first, last)]
    with pytest.raises(ModelError, match="interval"):
        simulate(case, model, model.network.start(), *times)


def test_missing_inputs_are_refused_with_their_first_stamp() -> None:
    case, model = setting()
    frame = case.telemetry.frame.copy()
    column = frame.columns.get_loc("weather_station/outside_air_temperature_sensor")
    frame.iloc[920:930, column] = np.nan
    spoilt = Case(case.building, Telemetry.from_frame(frame))
    stamps = case.stamps
    with pytest.raises(ModelError, match="30 minutes"):
        simulate(spoilt, model, model.network.start(), stamps[900], stamps[950])
    assert len(simulate(spoilt, model, model.network.start(), stamps[900], stamps[919]).simulated) == 19


def test_results_become_tables_and_pictures() -> None:
    case = load_bundled_case()
    model = SymbolicModel(build_network(case.building, dx=1.5))
    inputs = replay_inputs(case, model.network)
    assert "5 zones" in repr(inputs) and "100% complete" in repr(inputs)
    table = inputs.to_frame()
    assert list(dict.fromkeys(table.columns.get_level_values(0))) == ["boundary", "heat", "zone"]
    assert np.array_equal(table["heat"].to_numpy(), inputs.heat)
    found = simulate(case, model, model.network.start(), case.stamps[500], case.stamps[600])
    assert repr(found).startswith("Simulation(") and "mean absolute error" in repr(found)
    assert found.to_frame()["simulated"].equals(found.simulated)
    assert found.error.equals(found.simulated - found.measured)
    for figure in (inputs.plot(), found.plot()):
        assert figure.axes
        plt.close(figure)
