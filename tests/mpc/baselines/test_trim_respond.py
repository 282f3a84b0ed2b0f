"""Trim and respond beside sequences worked out by hand."""

from __future__ import annotations

import pytest

from mpc.baselines.guideline36 import TrimRespond, TrimRespondLoop
from mpc.errors import ControlError

AIR = TrimRespond(291.15, 285.15, 291.15, 0.1, -0.2, -0.6)
WATER = TrimRespond(353.15, 305.37, 353.15, -1.1, 1.7, 3.9, time_step=300.0)


def test_the_guideline_by_hand() -> None:
    """On at 0: nothing for 10 minutes, then a change at minutes 10, 12, ...: trim, and -0.2 K a request above two."""
    loop, found = TrimRespondLoop(AIR), []
    for requests in (5, 5, 5, 5, 5, 5, 2, 3, 4, 9):  # minutes 2, 4, ... 20
        found.append(round(loop.advance(True, requests, 120.0) - 291.15, 9))
    # five at minute 10: +0.1 - 0.6; again at 12; two are ignored: +0.1; three: -0.1; four: -0.3; nine: -0.5 at most
    assert found == [0.0, 0.0, 0.0, 0.0, -0.5, -1.0, -0.9, -1.0, -1.3, -1.8]


def test_steps_of_a_controller_hold_several_of_the_loop() -> None:
    loop = TrimRespondLoop(AIR)
    assert loop.advance(True, 3, 300.0) == 291.15
    assert loop.advance(True, 3, 300.0) == pytest.approx(291.15 - 0.1)  # minute 10
    assert loop.advance(True, 3, 300.0) == pytest.approx(291.15 - 0.3)  # 12 and 14
    assert loop.advance(True, 3, 300.0) == pytest.approx(291.15 - 0.6)  # 16, 18 and 20


def test_water_falls_until_valves_ask_and_stays_within_its_ends() -> None:
    loop = TrimRespondLoop(WATER)
    fell = [loop.advance(True, 0, 300.0) for _ in range(5)]
    assert fell == pytest.approx([353.15, 352.05, 350.95, 349.85, 348.75])
    assert loop.advance(True, 4, 300.0) == pytest.approx(348.75 - 1.1 + 3.4)
    for _ in range(60):
        loop.advance(True, 0, 300.0)
    assert loop.setpoint == 305.37
    assert loop.advance(False, 0, 300.0) == 353.15
    assert loop.advance(True, 0, 300.0) == 353.15  # the delay begins anew


def test_signs_and_ranges_are_checked() -> None:
    with pytest.raises(ControlError, match="a response against the trim"):
        TrimRespond(291.15, 285.15, 291.15, 0.1, 0.2, 0.6)
    with pytest.raises(ControlError, match="lowest <= initial <= highest"):
        TrimRespond(300.0, 285.15, 291.15, 0.1, -0.2, -0.6)
    with pytest.raises(ControlError, match="a positive time step"):
        TrimRespond(291.15, 285.15, 291.15, 0.1, -0.2, -0.6, time_step=0.0)
