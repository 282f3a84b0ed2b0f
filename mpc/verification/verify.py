"""Verification of a saving: every design that the days allow, its checks, and what shadow operation had expected."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import pandas as pd

from calibration.results import Axes, Result, plain
from mpc.errors import VerificationError
from mpc.verification.baseline import KINDS, Fitness, describe
from mpc.verification.before_after import BeforeAfter, before_after
from mpc.verification.inference import Estimate
from mpc.verification.metered import Metered
from mpc.verification.switchback import Switchback, switchback
from mpc.verification.validity import AT_CONFIDENCE, Check, check_before_after, check_switchback, predicted_share

#: Level of intervals where none is asked for [-].
CONFIDENCE = 0.9

Period = tuple[pd.Timestamp, pd.Timestamp]


@dataclass(frozen=True)
class VerificationSettings:
    """How a saving is verified.

    Parameters
    ----------
    baseline, reporting : tuple of Timestamp, optional
        Local days before and after; without them alternate days are taken, which need ``acts``.
    model : str
        Of the baseline: ``change-point`` by day or ``time-of-week`` by hour.
    adjust : sequence of str
        Columns by which the baseline is adjusted: ``occupancy``.
    confidence : float
        Level of intervals, between 0.5 and 1 [-].
    seed : int
        Of the permutation test.
    """

    baseline: Period | None = None
    reporting: Period | None = None
    model: str = KINDS[0]
    adjust: Sequence[str] = ()
    confidence: float = CONFIDENCE
    seed: int = 0


@dataclass(frozen=True)
class Saving:
    """A saving by one design.

    Parameters
    ----------
    design : str
        ``before and after`` or ``alternate days``.
    share : Estimate
        Of the energy without the new control [-].
    daily_energy : Estimate
        Saved a day [J].
    found : BeforeAfter or Switchback
        All of it.
    checks : tuple of Check
        What would make it invalid.
    """

    design: str
    share: Estimate
    daily_energy: Estimate
    found: BeforeAfter | Switchback
    checks: tuple[Check, ...]

    @property
    def fitness(self) -> Fitness:
        """Of the model."""
        return self.found.fitness

    @property
    def doubts(self) -> tuple[Check, ...]:
        """Checks that did not pass."""
        return tuple(c for c in self.checks if c.passed is False)


@dataclass(frozen=True, repr=False)
class Verification(Result):
    """Savings of a building.

    Parameters
    ----------
    source : str
        Where its energy is from.
    savings : tuple of Saving
        One a design.
    predicted : Estimate or None
        Share that shadow operation expected to save [-].
    settings : VerificationSettings
        How it was done.
    version : str
        Of the library.
    """

    source: str
    savings: tuple[Saving, ...]
    predicted: Estimate | None
    settings: VerificationSettings
    version: str = field(default_factory=lambda: version("buildingmpc"))

    @property
    def shortfall(self) -> Estimate | None:
        """Share realised by the last design less the share predicted [-]; None where none was predicted."""
        return None if self.predicted is None else self.savings[-1].share.less(self.predicted)

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``verification.json``."""
        level = self.settings.confidence
        content: dict[str, Any] = plain({
            "source": self.source, "confidence": level,
            "savings": [self._saving(s) for s in self.savings],
            "predicted": None if self.predicted is None else _estimate(self.predicted, level),
            "realised_less_predicted": None if self.shortfall is None else _estimate(self.shortfall, level),
            "settings": vars(self.settings), "version": self.version,
        })  # fmt: skip
        return content

    def _saving(self, saving: Saving) -> dict[str, Any]:
        level, found = self.settings.confidence, saving.found
        more: dict[str, Any] = {}
        if isinstance(found, BeforeAfter):
            more = {"total_energy": _estimate(found.saving, level), "baseline_energy": found.baseline_energy,
                    "fractional_savings_uncertainty_68": found.fractional_uncertainty(AT_CONFIDENCE)}  # fmt: skip
        else:
            carried = None if found.carried is None else _estimate(found.carried, level)
            more = {"carried_over_power": carried, "direct_power": _estimate(found.direct, level),
                    "permutation_p_value": found.p_value, "days_needed": found.days_needed(level)}  # fmt: skip
        return {
            "design": saving.design, "share": _estimate(saving.share, level), "days": len(found.days),
            "daily_energy": _estimate(saving.daily_energy, level), **more, "model": describe(found.model),
            "fitness": vars(found.fitness), "checks": [vars(c) for c in saving.checks],
        }  # fmt: skip

    def days(self) -> pd.DataFrame:
        """Days of all designs: ``design``, ``power``, ``baseline`` [W], ``outdoor`` [K], ``acts`` or ``reporting``."""
        return pd.concat([s.found.days.assign(design=s.design) for s in self.savings])

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the savings, one a row."""
        level = self.settings.confidence
        rows = [(s.design, s.share.value, *s.share.interval(level), len(s.doubts)) for s in self.savings]
        return pd.DataFrame(rows, columns=["design", "share", "lower", "upper", "doubts"])

    def _summary(self) -> str:
        told = [
            f"{s.design} {s.share.value:.1%} ± {s.share.half_width(self.settings.confidence):.1%}" for s in self.savings
        ]
        return f"{self.source}: {', '.join(told)}"

    def _draw(self, axes: Axes) -> None:
        for number, saving in enumerate(self.savings):
            axes.errorbar(number, saving.share.value, saving.share.half_width(self.settings.confidence), fmt="o")
        axes.set(xticks=range(len(self.savings)), xticklabels=[s.design for s in self.savings], ylabel="saving (-)")


def _estimate(found: Estimate, level: float) -> dict[str, Any]:
    return {"value": found.value, "interval": list(found.interval(level)), "standard_error": found.error,
            "degrees_of_freedom": found.freedom, "p_value": found.p_value}  # fmt: skip


def verify(metered: Metered, settings: VerificationSettings | None = None, source: str = "table") -> Verification:
    """Say what a new control has saved, by every design that the days allow.

    Parameters
    ----------
    metered : Metered
        Energy, outdoor temperature and what else is known.
    settings : VerificationSettings, optional
        How it is done.
    source : str
        Where the energy is from, for messages and pages.

    Returns
    -------
    Verification
        Savings with their intervals and checks.

    Raises
    ------
    VerificationError
        No design is possible, days are too few, or a setting is out of range.
    """
    chosen = settings or VerificationSettings()
    _check_settings(chosen, metered)
    days, savings = metered.days(), list[Saving]()
    extra = tuple(chosen.adjust)
    if chosen.baseline is not None and chosen.reporting is not None:
        first, second = (days[_within(days, p)] for p in (chosen.baseline, chosen.reporting))
        if "acts" in days:
            first, second = first[first["acts"] == 0.0], second[second["acts"] == 1.0]
        tables = (first, second)
        if chosen.model == "time-of-week":
            tables = tuple(_hours_of(metered, part) for part in tables)  # type: ignore[assignment]
        found = before_after(*tables, chosen.model, extra)
        daily = found.saving.scaled(1.0 / found.days["reporting"].sum())
        checks = check_before_after(found, first, second)
        savings.append(Saving("before and after", found.share, daily, found, checks))
    if "acts" in days and days["acts"].nunique() == 2 and (chosen.baseline is None or _alternates(days)):
        tested = days[days["acts"].first_valid_index() : days["acts"].last_valid_index()]
        by_days = switchback(_from_first_switch(tested), extra, chosen.seed)
        checks = check_switchback(by_days, _from_first_switch(tested), chosen.confidence)
        savings.append(Saving("alternate days", by_days.share, by_days.saving.scaled(86400.0), by_days, checks))
    advice = "give --baseline and --reporting, or a column --acts with days of both controls"
    VerificationError.unless(savings, source, "days before and after, or alternate days", "neither", advice)
    return Verification(source, tuple(savings), predicted_share(days), chosen)


def _check_settings(chosen: VerificationSettings, metered: Metered) -> None:
    VerificationError.unless(0.5 <= chosen.confidence < 1.0, "confidence", "0.5 or more, below 1", chosen.confidence)
    both = (chosen.baseline is None) == (chosen.reporting is None)
    VerificationError.unless(both, "periods", "a baseline and a reporting period, or neither", "one of them")
    for name in chosen.adjust:
        known = [c for c in metered.hours if c == "occupancy"]
        VerificationError.unless_known(name, known, "adjust", "a column that is measured")
    by_hour = chosen.model == "time-of-week" and chosen.adjust
    VerificationError.unless(not by_hour, "adjust", "a change-point model", chosen.model, "leave out one of the two")


def _within(days: pd.DataFrame, period: Period) -> Any:
    return (days.index >= period[0]) & (days.index < period[1])


def _hours_of(metered: Metered, days: pd.DataFrame) -> pd.DataFrame:
    """Hours of whole days."""
    hours = metered.hours[["power", "outdoor"]].dropna()
    begins = (pd.DatetimeIndex(hours.index) - pd.Timedelta(hours=1)).normalize()
    return hours[begins.isin(days.dropna(subset=["power", "outdoor"]).index)]


def _alternates(days: pd.DataFrame) -> bool:
    """Whether the control went back and forth, rather than over once."""
    acts = days["acts"].dropna()
    return int((acts.diff().abs() > 0.0).sum()) > 2


def _from_first_switch(days: pd.DataFrame) -> pd.DataFrame:
    """Leave out shadow weeks before the alternation, but for as many days as its longest run."""
    acts = days["acts"].dropna()
    runs = (acts.diff().abs() > 0.0).cumsum()
    lengths = runs.value_counts().sort_index()
    if len(lengths) < 3 or lengths.iloc[0] <= lengths.iloc[1:].max():
        return days
    first = acts.index[runs == 1][0]
    kept: pd.DataFrame = days[days.index >= first - pd.Timedelta(days=int(lengths.iloc[1:].max()))]
    return kept
