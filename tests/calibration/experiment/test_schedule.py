"""Schedules as they are written, against the setpoints that they stand for."""

import numpy as np
import pandas as pd

from calibration.experiment.library import Comfort, moves, office_comfort, shortened
from calibration.experiment.schedule import COOLING, HEATING, Move, Schedule

START = pd.Timestamp("2023-01-23", tz="America/Los_Angeles")
STAMPS = pd.date_range(START, periods=48 * 6 + 1, freq="10min")[1:]


def test_rows_say_what_the_setpoints_are_and_give_them_back() -> None:
    move = Move("to and fro", ("a",), ((293.0, 293.5), (295.0, 295.5)), 1.0, ((0.0, 3.0), (20.0, 22.0)))
    schedule = Schedule(START, 48.0, (move,))
    rows, values = schedule.rows(600.0), schedule.setpoints(STAMPS, 600.0, ["a", "b"])
    assert np.isnan(values[:, 1]).all() and np.isfinite(values[:, 0]).sum() == 2 * 5 * 6
    for k, point in enumerate((HEATING, COOLING)):
        mine = rows[rows["point"] == f"a/{point}"].set_index("time")["value"]
        held = [mine.loc[: stamp - pd.Timedelta(minutes=10)] for stamp in STAMPS]
        told = np.array([h.iloc[-1] if len(h) else np.nan for h in held])
        assert np.array_equal(told, values[:, 0, k], equal_nan=True)
        assert np.isnan(mine.iloc[-1]) and mine.index[-1] == START + pd.Timedelta(hours=22)


def test_moves_of_the_library_spare_people() -> None:
    comfort, hours = office_comfort(STAMPS, 600.0), (np.arange(len(STAMPS)) + 0.5) / 6.0
    found = moves({"all zones": ("a", "b")}, comfort, (294.15, 297.15), hours, {})
    assert len({m.title for m in found}) == len(found) > 5
    for move in found:
        values = Schedule(START, 48.0, (move,)).setpoints(STAMPS, 600.0, ["a"])[:, 0]
        set_ = np.isfinite(values[:, 0])
        middle = values[set_].mean(axis=1)
        assert set_.any() and (middle >= comfort.lower[set_]).all() and (middle <= comfort.upper[set_]).all()


def test_the_last_part_of_a_move() -> None:
    move = Move("warm", ("a",), ((295.0, 295.5),), 1e4, ((0.0, 4.0), (10.0, 14.0)))
    half, most = shortened(move, 0.5), shortened(move, 0.75)
    assert half.spans == ((10.0, 14.0),) and most.spans == ((2.0, 4.0), (10.0, 14.0)) and most.hours == 6.0


def test_discomfort_is_distance_over_time() -> None:
    comfort = Comfort(np.full(6, 294.0), np.full(6, 297.0))
    zone = np.column_stack([np.full(6, 293.0), np.full(6, 298.5), np.full(6, 295.0)])
    assert comfort.discomfort(zone, 1800.0).tolist() == [3.0, 4.5, 0.0]
