"""Which pairs of zones look exchanged, by what each zone's heat explains of each temperature."""

import numpy as np

from thermal.case.plausibility.exchanged import _followers

#: A hall without heat of its own, living room, bath, and the outdoors, which have none either.
HALL, LIVING, BATH, OUTDOORS = range(4)
BARE, NONE = frozenset({HALL}), frozenset[int]()


def gains(*explained: tuple[int, int, float]) -> np.ndarray:
    found = np.zeros((4, 4))
    for row, column, gain in explained:
        found[row, column] = gain
    return found


def test_of_pairs_that_share_a_place_the_clearest_is_told() -> None:
    spilt = gains((LIVING, BATH, 1500.0), (BATH, LIVING, 900.0), (HALL, LIVING, 300.0))
    assert [pair[:2] for pair in _followers(spilt, 30.0, NONE)] == [(LIVING, BATH)]


def test_a_zone_without_heat_can_be_exchanged_though_it_warms_with_its_neighbour() -> None:
    exchanged = gains((HALL, LIVING, 3200.0), (LIVING, LIVING, 320.0))
    assert list(_followers(exchanged, 30.0, BARE)) == [(HALL, LIVING, 320.0, 3200.0)]
    assert not list(_followers(exchanged, 30.0, NONE))
    as_they_are = gains((HALL, LIVING, 320.0), (LIVING, LIVING, 3200.0))
    assert not list(_followers(as_they_are, 30.0, BARE))
    by_the_door = gains((HALL, LIVING, 3200.0), (LIVING, LIVING, 1700.0))
    assert not list(_followers(by_the_door, 30.0, BARE))


def test_a_zone_with_heat_must_not_follow_its_own() -> None:
    own = gains((LIVING, LIVING, 300.0), (BATH, LIVING, 3000.0), (LIVING, BATH, 20.0))
    assert not list(_followers(own, 30.0, NONE))


def test_the_outdoors_are_no_zone_without_heat() -> None:
    warm = gains((OUTDOORS, LIVING, 3200.0), (LIVING, LIVING, 320.0))
    assert not list(_followers(warm, 30.0, BARE))
