"""Design of an experiment: the cheapest moves after which one of a group's effects can be named."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from calibration.experiment.days import begin_of, days_like
from calibration.experiment.emulate import Emulated, Emulator
from calibration.experiment.library import (
    AFTER,
    PRESSURES,
    Comfort,
    Lever,
    by_hand,
    moves,
    office_comfort,
    places,
    shortened,
)
from calibration.experiment.members import Member, Question, comparison, fit_members
from calibration.experiment.odds import CHANCE, ODDS, Separation, chance_of, needed, seen_before, separation
from calibration.experiment.schedule import STATIC_PRESSURE, SUPPLY_AIR, Move, Schedule
from calibration.progress import Progress
from calibration.results import plain
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.effects.catalogue import CATALOGUE

#: Longest experiment [h] and most discomfort beyond that of usual operation that a zone may have [K h].
LONGEST, DISCOMFORT = 48.0, 0.5

#: Price of heat and of cold by default [money/kWh].
PRICES = (0.10, 0.10)

#: Best single moves that are judged for every member, and combined.
_BEST = 4

#: Log odds that are enough, over those that name one [-]: a mean of 12 is over 6 with a probability of 89 %.
_ENOUGH = 2.0

#: Shares of a move's hours that are tried once a design is good enough [-].
_SHARES = (0.75, 0.5, 0.25)

#: Coldest and warmest supply air of an ordinary air handler [K]: 13 to 18 degC (ASHRAE Guideline 36-2021, 5.16.2.2).
_SUPPLY = (286.15, 291.15)


@dataclass(frozen=True)
class DesignSettings:
    """What an experiment may do.

    Parameters
    ----------
    start : Timestamp, optional
        When it begins, at the end of the telemetry or later; the first midnight after it by default.
    hours : float
        How long it lasts at most [h], 6 or more.
    discomfort : float
        Most discomfort of a zone beyond that of usual operation [K h], 0 or more.
    odds : float
        That are wanted [-], above 1.
    prices : tuple of float
        Of heat and of cold given to the zones [money/kWh], 0 or more.
    comfort : callable
        Gives the band on stamps with a step.
    horizon : str
        Of the predictions by which models are compared.
    """

    start: pd.Timestamp | None = None
    hours: float = LONGEST
    discomfort: float = DISCOMFORT
    odds: float = ODDS
    prices: tuple[float, float] = PRICES
    comfort: Callable[[pd.DatetimeIndex, float], Comfort] = office_comfort
    horizon: str = "6h"

    def __post_init__(self) -> None:
        for name, low, high in (("hours", 6.0, 24.0 * 14), ("discomfort", 0.0, np.inf), ("odds", 1.0 + 1e-9, 1e9)):
            value, advice = getattr(self, name), f"{low:g} to {high:g}"
            CalibrationError.unless(low <= value <= high, f"experiment: {name}", advice, repr(value))
        fine = all(np.isfinite(price) and price >= 0.0 for price in self.prices)
        CalibrationError.unless(fine, "experiment: prices", "numbers of 0 or more", repr(self.prices))


@dataclass(frozen=True)
class Trial:
    """A schedule and what is expected of it.

    Parameters
    ----------
    schedule : Schedule
        What is done.
    separation : Separation
        Expected log odds of all pairs.
    emulated : mapping of str to Emulated
        The building's answer were each member true, by effect.
    cost : float
        Of heat and cold beyond those of usual operation, until hours after it, the dearest of the members [money].
    energy : float
        Beyond that of usual operation [kWh].
    discomfort : ndarray, shape (n_zone,)
        Beyond that of usual operation, the largest of the members [K h].
    """

    schedule: Schedule
    separation: Separation
    emulated: Mapping[str, Emulated]
    cost: float
    energy: float
    discomfort: FloatArray


@dataclass(frozen=True)
class Experiment:
    """Outcome of `design_experiment`.

    Parameters
    ----------
    case : str
        Name of the case.
    question : Question
        What it is to answer.
    settings : DesignSettings
        What it may do.
    members : tuple of Member
        With their models.
    best : Trial
        The design.
    usual : Trial
        The same hours under usual operation.
    start : Timestamp
        When the experiment begins.
    days : Interval
        Measured days whose weather and use it was designed on.
    step : float
        Of the telemetry [s].
    tried : int
        Schedules that were weighed.
    model : ModelSettings
        Of the members' models, without effects.
    by_hand : tuple of str
        Zones, or air handlers, that it moves and whose setpoints the telemetry does not have.
    zones : tuple of str
        Names of the zones.
    """

    case: str
    question: Question
    settings: DesignSettings
    members: tuple[Member, ...]
    best: Trial
    usual: Trial
    start: pd.Timestamp
    days: Interval
    step: float
    tried: int
    model: ModelSettings = field(default_factory=ModelSettings)
    by_hand: tuple[str, ...] = ()
    zones: tuple[str, ...] = ()

    @property
    def schedule(self) -> Schedule:
        """The design at the time when it is to be carried out."""
        return Schedule(self.start, self.best.schedule.hours, self.best.schedule.moves)

    @property
    def chance(self) -> float:
        """Probability that it names one of the members, were it as the models say [-]."""
        return self.best.separation.chance(self.question.prior, self.settings.odds)

    @property
    def usual_chance(self) -> float:
        """The same of as many hours of usual operation."""
        return self.usual.separation.chance(self.question.prior, self.settings.odds)

    @property
    def verdict(self) -> str:
        """``separates``, ``may_separate`` or ``hopeless``: with a chance of 90 %, of less, of under a half."""
        return "separates" if self.chance >= CHANCE else "may_separate" if self.chance >= 0.5 else "hopeless"

    @property
    def instead(self) -> tuple[str, ...]:
        """What to measure where no experiment tells the members apart, as the catalogue says."""
        return tuple(dict.fromkeys(CATALOGUE[m.effect].separated_by for m in self.members))

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``experiment.json``."""
        pairs = [
            {"true": a, "other": b, "log_odds": v, "chance": chance_of(v, self.settings.odds),
             "swing": self.best.separation.swing[a, b], "usual_log_odds": self.usual.separation.log_odds[a, b]}
            for (a, b), v in self.best.separation.log_odds.items()
        ]  # fmt: skip
        worst = dict(zip(self.zones, self.best.discomfort.tolist(), strict=True))
        return {
            "verdict": self.verdict, "chance": self.chance,
            "usual_chance": self.usual_chance,
            "odds": self.settings.odds, "log_odds_needed": needed(self.settings.odds), "pairs": pairs,
            "members": {m.effect: {"zones": list(m.zones), "title": CATALOGUE[m.effect].title} for m in self.members},
            "prior": dict(self.question.prior),
            "known": {e: list(z) for e, z in self.question.known.items()},
            "start": self.start.isoformat(), "end": self.schedule.end.isoformat(), "hours": self.schedule.hours,
            "moves": [m.to_dict() for m in self.best.schedule.moves],
            "cost": self.best.cost, "energy_kwh": self.best.energy, "prices": list(self.settings.prices),
            "discomfort_kh": worst, "discomfort_allowed_kh": self.settings.discomfort,
            "measure_instead": list(self.instead) if self.verdict == "hopeless" else [],
            "by_hand": list(self.by_hand), "settings": self.model.to_dict(),
            "days": plain(self.days), "tried": self.tried, "case": self.case,
            "intervals": {"tuning": plain(self.question.tuned), "held_out": plain(self.question.judged)},
        }  # fmt: skip


def design_experiment(
    case: Case, question: Question, settings: DesignSettings | None = None, model: ModelSettings | None = None,
    progress: Progress | None = None,
) -> Experiment:  # fmt: skip
    """Design the cheapest experiment after which one of a group's effects can be named.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    question : Question
        Members of the group, `question_of`.
    settings : DesignSettings, optional
        What it may do.
    model : ModelSettings, optional
        Of the baseline.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    CalibrationError
        When the telemetry has no days to design on, or no zone can be moved.
    """
    given = settings or DesignSettings()
    start = begin_of(case, given.start)
    models = comparison(case, question, model or ModelSettings())
    members = fit_members(models, question)
    search = _Search(models, members, question.prior, given, start, progress)
    best, usual = search.run()
    return Experiment(
        case.building.name, question, given, tuple(members), best, usual, start, search.interval, case.step,
        search.tried, replace(models.settings, effects={}, normalisation=None),
        by_hand(case, best.schedule.moves), case.building.zone_names,
    )  # fmt: skip


class _Search:
    """Greedy search over moves, then shorter ones."""

    def __init__(
        self, models: ModelComparison, members: Sequence[Member], prior: Mapping[str, float], given: DesignSettings,
        start: pd.Timestamp, progress: Progress | None,
    ) -> None:  # fmt: skip
        days = days_like(models.case, start, given.hours)
        self.models, self.members, self.given, self.days, self.progress = models, members, given, days, progress
        self.start, self.prior, self.emulator = start, prior, Emulator(models, days, given.hours + AFTER)
        self.step = models.case.step
        self.interval = Interval(days, days + pd.Timedelta(hours=given.hours))
        # weather and use are those of the measured days; people come by the clock and the week of the real ones
        self.comfort = given.comfort(self.emulator.stamps + (start - days), self.step)
        self.tried, self.total = 0, 1
        movable = self.emulator.movable
        CalibrationError.unless(movable, "experiment", "a zone with a terminal whose heat is metered", "none")
        self.usual: Trial | None = None

    def run(self) -> tuple[Trial, Trial]:
        """Give the best trial, and that of usual operation."""
        self.usual = self.trial(())
        past = sum((i.end - i.start).total_seconds() for i in self.models.tuned)
        told = seen_before(self.members, 3600.0 * self.given.hours / past)
        self.usual = usual = replace(self.usual, separation=replace(self.usual.separation, log_odds=told))
        single = self._library()
        self.total = len(single) + 3 * _BEST
        first = self.members[:1]
        rough = [(t, m) for m in single if self.admissible(t := self.trial((m,), first))]
        rough.sort(key=lambda pair: (-self.worth(pair[0]), pair[0].cost))
        top = [m for _, m in rough[:_BEST]]
        trials = [usual, *(self.trial((m,)) for m in top)]
        best = self._first(trials)
        if not self.enough(best):
            own = best.schedule.moves
            for move in (m for m in self._partners(own, rough) if m not in own):
                trials.append(self.trial((*own, move)))
            best = self._first(trials)
        return (self._shorter(best) if self.enough(best) else best), usual

    def _partners(self, own: Sequence[Move], rough: Sequence[tuple[Trial, Move]]) -> list[Move]:
        """Give moves of other zones, or of other points, the best first."""
        taken = {(z, m.point) for m in own for z in m.zones}
        apart = [m for _, m in rough if not taken & {(z, m.point) for z in m.zones}]
        return (apart or [m for _, m in rough])[:_BEST]

    def _library(self) -> list[Move]:
        building, frame = self.models.case.building, self.models.case.telemetry.frame
        where = places(building, self.models.anatomy, self.emulator.movable, [m.zones for m in self.members])
        count = int((self.emulator.stamps <= self.interval.end).sum())
        hours = np.asarray((np.arange(count) + 0.5) * self.step / 3600.0, dtype=np.float64)
        levers = {}
        for point in (SUPPLY_AIR, STATIC_PRESSURE):
            names = tuple(d.name for d in building.devices if d.type == "ahu" and f"{d.name}/{point}" in frame)
            if names and point == SUPPLY_AIR:
                levers[point] = Lever("supply air cold and warm", names, _SUPPLY)
            elif names:
                usual = float(frame[[f"{n}/{point}" for n in names]].median().median())
                levers[point] = Lever("duct at full and low pressure", names, tuple(r * usual for r in PRESSURES))
        week = pd.date_range(self.start, periods=7 * 24, freq="h")
        return moves(where, self.comfort, self.given.comfort(week, 3600.0).narrowest, hours, levers)

    def trial(self, moves: tuple[Move, ...], true: Sequence[Member] | None = None) -> Trial:
        """Weigh a schedule, were each of some members true."""
        schedule = Schedule(self.days, self.given.hours, moves)
        emulated = {m.effect: self.emulator.run(m, schedule) for m in (true or self.members)}
        usual = next(iter(emulated.values())) if self.usual is None else next(iter(self.usual.emulated.values()))
        found = separation(self.emulator, emulated, usual, self.members, self.interval, self.given.horizon)
        spent = [self._spent(effect, made) for effect, made in emulated.items()]
        cost, energy = max(spent) if spent else (0.0, 0.0)
        off = np.max([self._discomfort(effect, made) for effect, made in emulated.items()], axis=0)
        self.tried += 1
        if self.progress is not None:
            self.progress("design", min(self.tried, self.total), self.total)
        return Trial(schedule, found, emulated, cost, energy, off)

    def _usual(self, effect: str, own: Emulated) -> Emulated:
        return own if self.usual is None else self.usual.emulated[effect]

    def _spent(self, effect: str, made: Emulated) -> tuple[float, float]:
        """Cost and energy beyond usual operation."""
        kwh = self.step / 3.6e6
        before = self._usual(effect, made).heat
        heat = (np.maximum(made.heat, 0.0) - np.maximum(before, 0.0)).sum() * kwh
        cold = (np.maximum(-made.heat, 0.0) - np.maximum(-before, 0.0)).sum() * kwh
        return float(self.given.prices[0] * heat + self.given.prices[1] * cold), float(heat + cold)

    def _discomfort(self, effect: str, made: Emulated) -> FloatArray:
        before, after = (self.comfort.discomfort(m.zone, self.step) for m in (self._usual(effect, made), made))
        return np.maximum(after - before, 0.0)

    def admissible(self, trial: Trial) -> bool:
        """Whether a schedule spares people."""
        return bool(trial.discomfort.max() <= self.given.discomfort)

    def worth(self, trial: Trial) -> float:
        """Give what a schedule says, up to what is enough [-]."""
        return trial.separation.worth(self.prior, _ENOUGH * needed(self.given.odds))

    def enough(self, trial: Trial) -> bool:
        """Whether a schedule is likely to name one of the members."""
        return trial.separation.chance(self.prior, self.given.odds) >= CHANCE

    def _first(self, trials: Sequence[Trial]) -> Trial:
        """Of those that are enough the cheapest, else the one that says most."""
        allowed = [t for t in trials if self.admissible(t)]
        good = [t for t in allowed if self.enough(t)]
        return min(good, key=lambda t: t.cost) if good else max(allowed, key=self.worth)

    def _shorter(self, best: Trial) -> Trial:
        """Shorten moves as long as the design is enough and gets no dearer; fewer hours at the same cost are better."""
        for number, whole in enumerate(best.schedule.moves):
            for share in _SHARES:
                own = list(best.schedule.moves)
                own[number] = shortened(whole, share)
                trial = self.trial(tuple(own))
                if not (self.admissible(trial) and self.enough(trial)):
                    break
                best = trial if trial.cost <= best.cost + 1e-9 else best
        return best
