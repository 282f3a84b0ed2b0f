"""Run length and delay of the detector on days whose law is known, and the course from a change to its end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.errors import NotEnoughDataError
from calibration.monitoring.course import NAMING_DAYS, follow
from calibration.monitoring.days import ONSET, Column, Days
from calibration.monitoring.dispersion import Dispersion
from calibration.monitoring.filter import DayFilter, Found, Innovation, State, noise_of
from calibration.monitoring.watch import Alarm, Watch, sought
from thermal._types import FloatArray

N_ERROR, REFERENCE = 6, 30


def column(name: str, effect: str | None, changes: bool, zones: tuple[str, ...] = ()) -> Column:
    """Make a column whose prior is one unit wide."""
    return Column(name, "1", effect, zones, 1.0, 0.3, 0.0, 0.0, changes, False, (-np.inf, np.inf))


def made(seed: int, n_day: int, shift: float = 0.0, start: int = 0, end: int = 10**6, over: int = 0) -> Days:
    """Make white days about what is expected, with a change of the first of two strengths, at once or over days."""
    rng = np.random.default_rng(seed)
    slopes = np.zeros((n_day, N_ERROR, 3))
    slopes[:, :3, 0] = slopes[:, 3:, 1] = 1.0
    slopes[:, :, 2] = rng.standard_normal((n_day, N_ERROR))
    columns = (column("valve_leak@A", "valve_leak", True, ("A",)), column("flow_gain@B", "flow_gain", True, ("B",)),
               column("window_u_value", None, False))  # fmt: skip
    errors = 0.5 * rng.standard_normal((n_day, N_ERROR))
    lasts = np.clip((np.arange(n_day) - start + 0.5) / max(over, 0.5), 0.0, 1.0) * (np.arange(n_day) < end)
    # errors are simulated minus measured: what the model lacks takes the sign of its derivative the other way
    errors -= shift * lasts[:, None] * slopes[:, :, 0]
    dates = pd.date_range("2023-01-02", periods=n_day, freq="D", tz="UTC")
    return Days(dates, errors, slopes, columns, np.zeros((ONSET, N_ERROR, 3)), np.repeat([0, 1], 3), ("A", "B"))


def cut(days: Days, n_day: int) -> Days:
    """Leave the first days."""
    return replace(days, dates=days.dates[:n_day], errors=days.errors[:n_day], slopes=days.slopes[:n_day])


def watched(days: Days, filtered: DayFilter, dispersion: Dispersion, state: State,
            begin: int = 0) -> tuple[Watch, Alarm, Innovation]:  # fmt: skip
    """Watch days from one on; the last day's alarm and innovation."""
    watch = Watch(sought(days), state.mean.size, dispersion)
    for day in range(len(days)):
        before, (state, innovation) = state, filtered.step(state, day)
        assert innovation is not None
        if day >= begin:
            alarm = watch.take(day, days, innovation, (before, state))
    return watch, alarm, innovation


def first_alarms(threshold: float, seeds: range, n_day: int) -> list[float]:
    """First days on which the evidence exceeds a threshold while nothing changes; infinite where it never does."""
    found = []
    for seed in seeds:
        days = made(seed, n_day)
        filtered, what = DayFilter(days, 0.25 * np.eye(N_ERROR)), sought(days)
        state, dispersion = filtered.start(), Dispersion(n_day, what.which.size)
        watch, first = Watch(what, state.mean.size, dispersion), np.inf
        for day in range(n_day):
            before, (state, innovation) = state, filtered.step(state, day)
            assert innovation is not None
            if watch.take(day, days, innovation, (before, state)).log_evidence > threshold:
                first = float(day)
                break
        found.append(first)
    return found


def test_mean_run_length_is_at_least_the_stated_one() -> None:
    """ARL >= A for the Shiryaev-Roberts sum (Shin, Ramdas and Rinaldo 2024), here with A = 20 days."""
    stated = 20.0
    runs = np.minimum(first_alarms(np.log(stated), range(12), 60), 60.0)
    assert runs.mean() > stated


def test_filter_innovations_are_white_where_days_are() -> None:
    days = made(1, 120)
    filtered = DayFilter(days, 0.25 * np.eye(N_ERROR))
    state, white = filtered.start(), []
    for day in range(len(days)):
        state, innovation = filtered.step(state, day)
        assert innovation is not None
        white.append(innovation.white)
    squared = np.mean(np.array(white[20:]) ** 2)
    assert squared == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / (100 * N_ERROR)))


def test_noise_is_found() -> None:
    assert np.diag(noise_of(made(2, 200), 200)) == pytest.approx(np.full(N_ERROR, 0.25), rel=0.4)


def test_noise_is_found_where_no_day_shows_all_errors() -> None:
    """What the parameters explain is no noise, whichever sensor is silent."""
    days = made(2, 200)
    days.errors[:] -= 0.9 * days.slopes[:, :, 2]
    days.errors[::2, -1] = days.errors[1::2, -2] = np.nan
    found = np.diag(noise_of(days, 200))
    assert found == pytest.approx(np.full(N_ERROR, 0.25), rel=0.4)
    assert np.nanvar(days.errors, axis=0).min() > 2.0 * found.max()


def test_information_of_a_new_change_is_that_of_least_squares() -> None:
    """On the day of a change score and information are jᵀ V⁻¹ ν and jᵀ V⁻¹ j."""
    days = made(3, 4)
    filtered, what = DayFilter(days, 0.25 * np.eye(N_ERROR)), sought(days)
    watch, _, innovation = watched(days, filtered, Dispersion(4, what.which.size), filtered.start())
    own = what.shown(days, 3, innovation) * what.shares[0]
    expected = np.linalg.solve(innovation.root @ innovation.root.T, own)
    assert watch._information[-1] == pytest.approx(np.sum(own * expected, axis=0))
    assert watch._score[-1] == pytest.approx(expected.T @ innovation.left)
    white = np.linalg.solve(innovation.root, own)
    for number, column in enumerate(white.T):  # what the likeliest size of each leaves
        left = np.linalg.lstsq(column[:, None], innovation.white, rcond=None)[1]
        assert watch._left_by(np.arange(2))[-1, number] == pytest.approx(left[0] / N_ERROR)


@pytest.mark.parametrize(("least", "most"), [(0.0, np.inf), (0.0, 0.6), (-0.2, np.inf)])
@pytest.mark.parametrize(("left", "value"), [(-0.3, 0.4), (-0.05, 0.4), (0.2, 0.4), (0.3, 0.0), (-0.3, 0.0), (0.9, 0.0)])
def test_a_strength_stays_within_its_limits(left: float, value: float, least: float, most: float) -> None:
    """The ratio is that of the likelihoods of all days, by quadrature over strength and change that leave something.

    What is absent is 0 and can only grow; what is a share stays one.
    """
    begin, deviation, n_day, present = 4, 0.5, 8, value > 0.0
    days = made(6, n_day)
    days.slopes[:, :, 2] = 0.0
    own = replace(days.columns[0], value=value, present=present, limits=(least, most))
    days = replace(days, columns=(own, *days.columns[1:]))
    days.errors[begin:] -= (left - value) * days.slopes[begin:, :, 0]
    filtered, what = DayFilter(days, deviation**2 * np.eye(N_ERROR), walk=0.0), sought(days)
    spread = np.diag([own.spread**2, *np.full(len(filtered.start().mean) - 1, 1e-12)])
    state = State(np.zeros(len(spread)), spread)
    watch, *_ = watched(days, filtered, Dispersion(n_day, what.which.size), state)
    p, v = np.meshgrid(np.linspace(-5.0, 5.0, 2001), np.linspace(-1.6, 1.6, 2001))  # v from the value on
    # errors are simulated minus measured: a strength beyond the model's takes the sign of its derivative the other way
    left_of = [(days.errors[d, :3, None, None] + v + p * (d >= begin)) for d in range(n_day)]
    log_likelihood = -0.5 * sum((e**2).sum(axis=0) for e in left_of) / deviation**2
    prior = np.exp(-0.5 * (v / own.spread) ** 2)
    none = np.sum(prior[:, :1] * np.exp(-0.5 * sum(((days.errors[d, :3, None] + v[:, 0]) ** 2).sum(axis=0)
                                                   for d in range(n_day)) / deviation**2)[:, None])  # fmt: skip
    seen = np.exp(-0.5 * sum(((days.errors[d, :3, None] + v[:, 0]) ** 2).sum(axis=0) for d in range(begin))
                  / deviation**2)[:, None] * prior  # fmt: skip
    means = []
    for size in (1.0, 0.3, 0.1, 0.03):
        change = np.exp(-0.5 * (p / size) ** 2) * (value + present * v + p > least) * (value + present * v + p < most)
        chance = np.sum(seen * change) / np.sum(seen * np.exp(-0.5 * (p / size) ** 2))
        density = np.exp(-0.5 * (p[0] / size) ** 2).sum()
        means.append(np.sum(prior * change * np.exp(log_likelihood)) / density / chance / none)
    assert watch._ratios(np.array([0]), np.ones(1))[begin, 0] == pytest.approx(np.log(np.mean(means)), abs=0.05 if least == 0.0 else 0.08)


def test_starts_stay_while_an_alarm_waits_for_its_name() -> None:
    """A change three weeks before its alarm would otherwise be forgotten before it is named."""
    days = made(0, 40)
    noise, what = noise_of(days, 10), sought(days)
    kept = {}
    for waits in (False, True):
        tracked = DayFilter(days, noise)
        state = tracked.start()
        watch = Watch(what, state.mean.size, Dispersion(40, what.which.size))
        for day in range(30):
            before, (state, innovation) = state, tracked.step(tracked.grown(state), day)
            assert innovation is not None
            watch.take(day, days, innovation, (before, state), 23 if waits and day > 23 else None)
        kept[waits] = set(watch.starts.tolist())
    assert 3 in kept[True] and min(kept[False]) > 8
    assert kept[False] < kept[True]


@pytest.mark.parametrize("lasts", [0, 3])
def test_delay_is_near_lordens_bound(lasts: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """No detector of mean run length A is sooner than log A / I on average, I the divergence a day (Lorden 1971)."""
    monkeypatch.setattr("calibration.monitoring.course.LASTS", lasts)
    threshold, shift = 14.0, 1.2
    delays = []
    for seed in range(4):
        course = follow(made(seed, 120, shift, start=70), REFERENCE, threshold=threshold)
        hits = [e for e in course.events if e.alarm >= 70]
        assert hits
        delays.append(hits[0].alarm - 69)
    bound = threshold / (0.5 * shift**2 * 3 / 0.25)
    assert bound + lasts < np.mean(delays) < 4.0 * bound + lasts


def test_a_change_is_dated_named_sized_and_closed() -> None:
    course = follow(made(7, 160, 1.5, start=70, end=110), REFERENCE)
    assert len(course.events) == 1
    event = course.events[0]
    assert (event.effect, event.zones) == ("valve_leak", ("A",)) and abs(event.since - 70) <= 1
    assert event.alarm - 70 <= 8
    assert event.size == pytest.approx(1.5, abs=4.0 * event.deviation)
    assert event.end is not None and abs(event.end - 110) <= 2


def test_a_change_that_comes_over_days_is_dated_and_sized_by_its_course() -> None:
    drift, jump = (made(7, 100, 2.5, start=70, over=over) for over in (12, 0))
    sensor = (column("sensor_bias@A", "sensor_bias", True, ("A",)), *drift.columns[1:])
    event, at_once = (follow(replace(days, columns=sensor), REFERENCE).events[0] for days in (drift, jump))
    assert (event.effect, event.zones) == ("sensor_bias", ("A",)) and abs(event.since - 70) <= 4
    assert event.size == pytest.approx(2.5, abs=4.0 * event.deviation)
    assert event.over > 0 == at_once.over


def test_a_slow_change_is_the_sum_of_its_parts() -> None:
    """Over two days, a quarter of it has come by the middle of the first; each part has its own first days."""
    days = made(6, 30)
    days.onset[:, :, 0] = np.arange(ONSET, 0, -1)[:, None]
    parts = [Found(0, 10 + day, None, 0, 1.0) for day in range(3)]
    slow = Found(0, 10, None, 2, 1.0)
    for day in (9, 10, 11, 12, 14, 17, 25):
        by_part = [part.shown(days, day) for part in parts]
        assert slow.shown(days, day) == pytest.approx(0.25 * by_part[0] + 0.5 * by_part[1] + 0.25 * by_part[2])
    assert np.all(slow.shown(days, 25) == days.slopes[25, :, 0])
    assert np.all(Found(0, 10, 20, 0, 1.0).shown(days, 29) == 0.0)


def test_quiet_days_are_quiet() -> None:
    course = follow(made(8, 160), REFERENCE)
    assert (course.events, course.withdrawn) == ((), ())
    assert np.isfinite(course.evidence[REFERENCE:]).all()
    assert np.isnan(course.evidence[:REFERENCE]).all()


@pytest.mark.parametrize("over", [5, 6])
def test_a_few_days_unlike_others_are_no_alarm_or_withdrawn(over: int) -> None:
    """The evidence is 13.3 on day 63, 17.6 and 20.6 on the next two, and 12 no longer on day 66 where the fifth was the last."""
    course = follow(made(3, 120, 1.0, start=60, end=60 + over), REFERENCE)
    assert (course.events, course.withdrawn) == ((), () if over < 6 else (66,))
    assert np.nanmax(course.evidence) > course.threshold


def test_evidence_of_twice_the_threshold_does_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is 23.6 on day 68 and 27.2 on day 69."""
    monkeypatch.setattr("calibration.monitoring.course.LASTS", 1000)
    (event,) = follow(made(3, 120, 1.0, start=60), REFERENCE).events
    assert (event.since, event.alarm) == (60, 69)


def dipping(n_day: int) -> Days:
    """Make a change on day 60 with three days that say the opposite: 22.5 on day 66, 4.4, 5.4, 7.5, 8.9, 10.9 on 69 to 73."""
    days, quiet = made(3, n_day, 1.0, start=60), made(3, n_day)
    days.errors[67:70] = 2.0 * quiet.errors[67:70] - days.errors[67:70]
    return days


def test_an_alarm_waits_while_its_evidence_is_neither_enough_nor_gone() -> None:
    course = follow(dipping(120), REFERENCE)
    event = course.events[0]
    assert (event.effect, event.since, event.alarm, event.named) == ("valve_leak", 60, 66, 74)
    assert (course.withdrawn, course.waiting) == ((), None)


@pytest.mark.parametrize("longest", [21, 7])
def test_an_alarm_waits_for_three_weeks_at_most(longest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a night does not decide the next one does: it is neither told nor withdrawn where the telemetry ends."""
    monkeypatch.setattr("calibration.monitoring.course._LONGEST_WAIT", longest)
    course = follow(cut(dipping(120), 74), REFERENCE)
    assert (course.events, course.withdrawn, course.waiting) == ((), *(((), 66) if longest == 21 else ((66,), None)))


def test_what_shows_nothing_is_no_name() -> None:
    """A change whose days had a large noise once and have had no signal since is no likelier than nothing."""
    days = made(4, 40, 2.0, start=20)
    days.slopes[1:, :, 1] = 0.0
    filtered, noisy = DayFilter(days, 0.25 * np.eye(N_ERROR)), Noisy(len(days), sought(days).which.size)
    _, alarm, _ = watched(cut(days, 25), filtered, noisy, filtered.start(), begin=2)
    assert alarm.share[0] > 0.999


class Noisy(Dispersion):
    """The days before varied so much in the direction of the second change that nothing is left of any evidence."""

    def at(self, day: int) -> FloatArray:
        """Ratio of the variances."""
        return np.array([1.0, 1e6])


def test_a_further_secant_is_no_further_strength() -> None:
    """It names the same effect in the same zone, may become an event, and leaves one parameter of the name."""
    days = made(5, 120)
    course_of_day = np.where(np.arange(120) % 2 == 0, 2.0, 0.2)[:, None]
    further = replace(days.columns[0], spread=0.0)
    slopes = np.concatenate([days.slopes, (days.slopes[:, :, 0] * course_of_day)[..., None]], axis=2)
    errors = days.errors.copy()
    errors[60:] -= 1.2 * slopes[60:, :, 3]
    days = replace(days, columns=(*days.columns, further), slopes=slopes, errors=errors,
                   onset=np.zeros((ONSET, N_ERROR, 4)))  # fmt: skip
    course = follow(days, REFERENCE)
    event = course.events[0]
    assert (event.effect, event.zones) == ("valve_leak", ("A",))
    assert event.since in (59, 60)  # the day before shows a tenth of the others
    assert event.size == pytest.approx(1.2, abs=0.1)
    assert set(course.parameters) == {"valve_leak@A", "flow_gain@B", "window_u_value"}
    assert abs(course.parameters["valve_leak@A"]["moved"]) < 0.1
    assert sought(days).weight == pytest.approx([0.25, 0.5, 0.25])


def test_a_single_day_raises_no_alarm() -> None:
    days = made(9, 100)
    days.errors[70] += 20.0
    assert follow(days, REFERENCE).events == ()


def test_what_is_ruled_out_is_not_named() -> None:
    events = follow(made(7, 110, 1.5, start=70), REFERENCE, ruled_out=["valve_leak"]).events
    assert all(e.effect != "valve_leak" for e in events)


def test_days_without_telemetry_are_passed_over() -> None:
    days = made(7, 110, 1.5, start=70)
    days.errors[60:66] = np.nan
    days.errors[80, :2] = np.nan
    assert follow(days, REFERENCE).events[0].effect == "valve_leak"


def test_an_alarm_is_named_where_the_telemetry_ends_without_a_run() -> None:
    """Telemetry that is cut off in the small hours, or in a gap, leaves no run on its last days."""
    whole, cut = (made(8, 81, 2.5, start=70) for _ in range(2))
    cut.errors[-1] = np.nan
    expected, event = follow(whole, REFERENCE).events[0], follow(cut, REFERENCE).events[0]
    assert len(whole) - NAMING_DAYS < event.alarm < len(whole) - 1  # it waits for its name when the telemetry ends
    assert (event.effect, event.since, event.alarm) == (expected.effect, expected.since, expected.alarm)
    assert event.named == len(whole) - 1
    assert event.size == pytest.approx(expected.size, abs=4.0 * event.deviation)


@pytest.mark.parametrize("until", [REFERENCE, 110])
def test_a_zone_that_the_reference_days_do_not_show_is_not_watched(until: int) -> None:
    """The sensor is dead, or comes once the reference is over."""
    days = made(7, 110, 1.5, start=70)
    days.errors[:until, 3:] = np.nan
    course = follow(days, REFERENCE)
    assert course.told.tolist() == [True] * 3 + [False] * 3
    assert [(e.effect, e.zones) for e in course.events] == [("valve_leak", ("A",))]
    assert course.daily(days)["mae"].notna().all()


def test_days_that_show_nothing_are_refused() -> None:
    days = made(7, 60)
    days.errors[REFERENCE:] = np.nan
    with pytest.raises(NotEnoughDataError, match="none of 30"):
        follow(days, REFERENCE)
    days = made(7, 60)
    days.errors[5:REFERENCE] = np.nan
    with pytest.raises(NotEnoughDataError, match="30 reference days"):
        follow(days, REFERENCE)


class Uneven(Dispersion):
    """The days before varied three times as much in the direction of the second change."""

    def at(self, day: int) -> FloatArray:
        """Ratio of the variances."""
        return np.array([1.0, 3.0])


def test_names_are_told_apart_by_one_noise() -> None:
    """Two changes that do the same to the errors are as likely, whatever the days before were like."""
    days = made(4, 12, 2.0, start=6)
    days.slopes[:, :, 1] = days.slopes[:, :, 0]
    filtered, what = DayFilter(days, 0.25 * np.eye(N_ERROR)), sought(days)
    watch, alarm, _ = watched(days, filtered, Uneven(len(days), what.which.size), filtered.start())
    assert watch.log_ratio[6, 0] > watch.log_ratio[6, 1] + 1.0
    assert alarm.share == pytest.approx([0.5, 0.5], abs=1e-3)


def test_where_no_change_is_as_the_model_says_evidence_names_less() -> None:
    """Days that vary more once something has changed, whatever it is, are a worse judge between two names."""
    shares = []
    for noise in (0.0, 1.0):
        days = made(4, 12, 1.0, start=6)
        days.slopes[:, :3, 1] = days.slopes[:, :3, 0]
        days.slopes[:, 3:, 1] = 0.3
        days.errors[6:] += noise * np.array([[0.0, 0.0, 0.0, 1.0, -1.0, 0.0]])
        filtered = DayFilter(days, 0.25 * np.eye(N_ERROR))
        shares.append(watched(days, filtered, Dispersion(12, 2), filtered.start())[1].share[0])
    assert 0.5 < shares[1] < shares[0] - 0.05


def test_what_may_jump_does_not_age() -> None:
    """Its changes are sought; a filter that lets it age takes a well-seen one for age within days."""
    days = made(5, 40)
    days.errors[1:] = np.nan
    filtered = DayFilter(days, 0.25 * np.eye(N_ERROR))
    state = filtered.step(filtered.start(), 0)[0]
    first = np.diag(state.covariance)[:3]
    for day in range(1, 40):
        state = filtered.step(state, day)[0]
    grown = np.diag(state.covariance)[:3] - first
    assert grown == pytest.approx([0.0, 0.0, 39 * (0.1 * 0.3) ** 2 / 365.0])
