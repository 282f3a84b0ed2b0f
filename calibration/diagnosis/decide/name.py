"""The name of a verdict, of a few numbers that a search ends with: so that other levels can be tried on old answers."""

from dataclasses import dataclass
from typing import Literal

from calibration.diagnosis.decide.levels import LARGEST_GROUP, LEVELS, Levels
from calibration.results import Plain

VerdictName = Literal["no_gap", "named", "group", "unexplained"]


@dataclass(frozen=True)
class Summary(Plain):
    """What the name of a verdict follows from.

    Parameters
    ----------
    accepted : bool
        Whether any effect was accepted.
    group : int
        Effects that the first accepted one cannot be told from, itself included; 0 without one.
    tuning, held_out : float
        Share of the squared error that accepted effects explain where they were fitted, and of the held-out error [-].
    left : float
        Root mean square of the tuning errors that the last model leaves [K].
    change : float
        Root mean square of how far zone temperatures change over the horizon [K].
    peak : float
        Largest mean squared error of a zone over the mean of all [-].
    generic, generic_level : float
        Gain of heat of any shape, and what the case's own nulls show of it [-].
    comes_back : bool, optional
        Whether what is left comes back from day to day, where that was judged instead of its size.
    found : float, optional
        Share of what comes back that accepted effects explain [-], there.
    """

    accepted: bool
    group: int
    tuning: float
    held_out: float
    left: float
    change: float
    peak: float
    generic: float
    generic_level: float
    comes_back: bool | None = None
    found: float | None = None

    def much(self, levels: Levels = LEVELS) -> bool:
        """Whether more is left than cases without a missing effect keep.

        Parameters
        ----------
        levels : Levels
            Those to judge by.
        """
        if self.comes_back is not None:
            return self.comes_back
        return self._large(levels.left_over, levels) or self._in_a_zone(levels)

    def _in_a_zone(self, levels: Levels) -> bool:
        return self._large(levels.left_in_a_zone, levels) and self.peak > levels.concentrated

    def _large(self, least: float, levels: Levels) -> bool:
        return self.left > max(least, levels.left_of_change * self.change)

    def _shows(self, levels: Levels) -> bool:
        return self.generic > max(levels.generic, self.generic_level)

    def by_size_alone(self, levels: Levels = LEVELS) -> bool:
        """Whether nothing says that something is missing but errors that are large all over the building.

        So are those of people who come and go, and of heaters that cycle between rough sensors.

        Parameters
        ----------
        levels : Levels
            Those to judge by.
        """
        return not (self.accepted or self._shows(levels) or self._in_a_zone(levels))

    def explained(self, levels: Levels = LEVELS) -> float:
        """Share of the squared error that is explained [-]: where it was fitted, or held out unless much is left over.

        Where it is known what comes back of the rest, the share of that and of what was explained.

        Parameters
        ----------
        levels : Levels
            Those to judge by.
        """
        if self.found is not None:
            return self.found
        return self.tuning if self.much(levels) else max(self.tuning, self.held_out)

    def name(self, levels: Levels = LEVELS) -> VerdictName:
        """Name the verdict.

        Parameters
        ----------
        levels : Levels
            Those to judge by.
        """
        much = self.much(levels)
        if self.accepted and self.explained(levels) >= (levels.explained_of_much if much else levels.explained):
            if self.group > LARGEST_GROUP:
                return "unexplained"
            return "named" if self.group == 1 else "group"
        shows = self.comes_back is None and self._shows(levels)
        return "unexplained" if self.accepted or shows or much else "no_gap"
