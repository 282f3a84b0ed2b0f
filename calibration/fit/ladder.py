"""Ladder of structures, from as drawn to lumped with a factor for every zone and pair; left-out tuning days choose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Protocol

from calibration.evaluation.intervals import Interval, days_of
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.fitted_case import FittedCase, fit_case, is_large, with_normalisation
from calibration.fit.least_squares import INTERRUPTED
from calibration.fit.left_out import Fitted, Known, LeftOut, begin_at, left_out
from calibration.fit.problem import tuning_problem
from calibration.fit.result import CalibrationResult, Rung
from calibration.fit.undrawn import FEW_MORE, UNDRAWN, is_another
from calibration.progress import Forward, Progress
from calibration.stages import stage
from thermal.case.building import Building, ZoneTable
from thermal.case.case import Case
from thermal.case.emitters import Unknown, unknown_heaters
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import DAILY
from thermal.model.reduce import reduced_model
from thermal.network.structure import BASELINE, Structure
from thermal.parameters import Scope

#: Share by which a structure must predict left-out days better than a simpler one [-]: a lumped model has ten times the
#: parameters of a drawn one, and on a simulated office whose drawing is true an advance of 7 % did not last.
ADVANCE = 0.1

#: What a building as drawn has one value of for all zones, though rooms differ in it: slabs and furniture.
MASSES = ("slab_heat_capacity", "slab_coupling", "furniture_heat_capacity", "furniture_coupling")

#: The same of what lies between rooms and outdoor, where a drawing is no survey: areas and layers of each room differ.
LOSSES = ("exterior_wall_conductivity_multiplier", "window_conductance_multiplier", "window_u_value")

#: What coarse telemetry of a free structure may need, readings at an instant of their step beside means of it.
CLOCK = "clock_shift"

#: Share of the drawing's error on left-out days below which a lumped model's says that more than masses is wrong [-].
_WRONG = 0.5

#: Share by which Newton steps from another structure's estimate must promise to predict left-out days better, for what
#: heat is given by to be fitted [-]: simulated houses with heated floors promise 0.1 to 0.7, those with radiators and
#: electric heaters up to 0.05 (house trials, nulls of seeds 0, 1, 8, 15 and 20).
_PROMISED = 0.05

#: Share of the progress that is left which a fit of another structure takes [-]: there are two to five.
_SHARE = 0.4

#: What heaters of which nobody says it may give their heat by beside the air, that with most parameters first.
_EMITTERS: tuple[Unknown, Unknown] = ("floor", "radiator")

#: Tuning days from which a gain that recurs from day to day is looked for [days]: it has to recur.
_WEEK = 7.0

#: Structures without a drawing.
_LUMPED = ("lumped", "lumped floor", "recurring")

#: A drawing whose people have hours of their own in each zone, and one that has what was found beside them.
PEOPLE, BESIDE = "people", "people beside"

#: Heat of people, and what its course is made of.
GAINS, _WAVE = "internal_gains", "internal_gain_wave"

#: Share of the error on left-out days of a drawing with the means of that heat below which its course counts [-].
_RECURS = 0.75


def climb(drawn: FittedCase, began: float, progress: Progress | None = None) -> CalibrationResult:
    """Fit a building in other structures too, and keep what predicts tuning days better that a fit has not seen.

    Effects or values a facade that somebody asked for are kept; so is the drawing in a building of more than 40 zones.
    Held-out intervals have no part in the choice.

    Parameters
    ----------
    drawn : FittedCase
        The building as drawn.
    began : float
        When the calibration began, by `time.perf_counter` [s].
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    CalibrationResult
        With ``rungs``, the drawing's first; empty where there was no choice, or Ctrl-C ended it.
    """
    chosen, whole = drawn.settings, Forward(progress)
    asked = chosen.effects or chosen.scopes or chosen.fixed or chosen.structure != BASELINE
    if asked or is_large(drawn.model.grid.network.zones) or chosen.objective != "multi_step":
        return drawn.result(began, progress)
    try:
        drawn.raise_if_interrupted()
        rungs, kept, left = climb_from("drawn", drawn.best, drawn, whole.part(0.6), beside=[{}])
    except KeyboardInterrupt:  # what is finished is the drawing's
        stopped = replace(drawn.best.solve, success=False, status=INTERRUPTED, interrupted=True)
        return replace(drawn, best=replace(drawn.best, solve=stopped)).result(began, whole.part(1.0))
    if kept is None:
        return replace(replace(drawn, left=left).result(began, whole.part(1.0)), rungs=rungs)
    # before is what the drawing says
    result = kept.result(began, whole.part(0.7))
    return replace(result, rungs=rungs, uncalibrated=drawn.uncalibrated(whole.part(1.0)))


def fit_emitter(
    fitted: Fitted, given: Tuned, known: Mapping[str, Sequence[str]], progress: Progress | None = None
) -> FittedCase | None:
    """Fit a building as drawn with what it is best taken to give its heat by, where the case does not say it.

    Parameters
    ----------
    fitted : Fitted
        As drawn, with all of that heat in the air.
    given : Tuned
        The case and its days.
    known : mapping of str to sequence of str
        Effects that the fitted model has, with their zones: so have all that it is weighed against.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    FittedCase or None
        With heated floors or radiators; None where all of the heat had better be in the air.
    """
    ladder = _Ladder(given, Forward(progress), replace(given.calibration, starts=1, effects=known))
    if is_large(given.case.building.zone_names) or not ladder.guesses:
        return None
    looked = [ladder.look("drawn", fitted)]
    looked += ladder.emitters(fitted, looked[0].left.mae)
    return looked[_best(looked, ADVANCE)].fit


def by_zone(building: Building) -> tuple[tuple[str, ...], ...]:
    """Name what a drawing has one value of for all zones though they may differ in it: masses, and losses of a guess.

    Parameters
    ----------
    building : Building
        Any.
    """
    if building.geometry_quality == "surveyed":
        return (MASSES,)
    table, zones = building.geometry, building.zone_names
    if isinstance(table, ZoneTable) and all(s.other in zones for s in table.surfaces if s.kind == "window"):
        return MASSES, tuple(name for name in LOSSES if not name.startswith("window"))  # between rooms, of neither
    return MASSES, LOSSES


class Tuned(Protocol):
    """A case with the days that tune, those that judge, and the settings of a fit."""

    @property
    def case(self) -> Case:
        """Building and telemetry."""

    @property
    def tuned(self) -> Sequence[Interval]:
        """Where it is fitted."""

    @property
    def judged(self) -> Sequence[Interval]:
        """Where it will be judged."""

    @property
    def calibration(self) -> CalibrationSettings:
        """Of the fit as drawn."""


def climb_from(
    name: str,
    fitted: Fitted,
    given: Tuned,
    progress: Progress | None = None,
    advance: float = ADVANCE,
    beside: Sequence[Mapping[str, Sequence[str]]] = (),
    lumped_advance: float = ADVANCE,
) -> tuple[tuple[Rung, ...], FittedCase | None, LeftOut]:
    """Fit further structures beside a fitted model; the simplest is kept that predicts left-out days about best.

    With heat that radiates, or that floors give, where the case does not say what heaters give it by; with inside films
    that follow the heat, contents that follow the air, outside films that follow the wind, and with slabs and furniture
    by zone (outer walls and windows too, where the drawing is no survey), unless a lumped model halves the drawing's
    error; lumped, where the sun is a part of it, by an estimate if irradiance is not measured; lumped, with a gain that
    recurs from day to day, which is linear, so that a few Newton steps from the lumped estimate tell whether it is
    worth a fit; as drawn with the heat of people who have hours of their own in each zone, looked at in the same way;
    lumped with floors that are heated, where the drawing has them or lumped alone is better than any drawing; and
    where one of these is kept, with heat and weather moved in time.

    Parameters
    ----------
    name : str
        Of the fitted model.
    fitted : Fitted
        It.
    given : Tuned
        The case and its days.
    progress : callable, optional
        Called with stage, done, total.
    advance : float
        Share by which another's error must be less than the fitted model's [-].
    beside : sequence of mapping of str to sequence of str
        Effects beside which the heat of people is tried, with their zones: those that are known, and all that the
        fitted model has where it has others; it is not tried by default.
    lumped_advance : float
        The same for lumped structures [-].

    Returns
    -------
    tuple
        The rungs; what is kept, or None where that is the fitted model; and the days left out by what is kept.
    """
    ladder = _Ladder(given, Forward(progress), replace(given.calibration, starts=1))
    base = ladder.base
    begun: dict[str, tuple[CalibrationSettings, Fitted]] = {}  # structures that are looked at before they are fitted
    source = telemetry_inputs(given.case)
    parameters = fitted.problem.grid.network.parameters
    plain = all(p.effect is None for p in parameters)
    looked, best = [ladder.look(name, fitted)], 0
    if plain and ladder.guesses:
        looked += ladder.emitters(fitted, looked[0].left.mae)
        best = _best(looked, advance)
        if (found := looked[best].fit) is not None:
            base, fitted = found.settings, found.best
    people = ladder.people(base, fitted, beside, (1.0 - advance) * looked[best].left.mae)
    without = Structure(lumped=True, sun=source.gives("sun"), turned=base.structure.turned)
    free = ladder.lumped(without, looked[best].left.mae)
    drawn = min(each.left.mae for each in free) >= _WRONG * looked[best].left.mae
    least = looked[best].left.mae
    for name, part in UNDRAWN.items() if plain and drawn else ():
        follows = replace(base, structure=part.put(base.structure))
        if follows.structure != base.structure and source.gives(part.signal):
            begins = _begun(given, follows, fitted)
            if not is_another(begins.problem.grid.network, fitted.problem.grid.network):
                continue
            if (seen := ladder.look(name, begins)).left.mae < (1.0 - part.better) * least:
                looked.append(seen)
                least, begun[name], base, fitted = seen.left.mae, (follows, fitted), follows, begins
    differing = set(chain(*by_zone(given.case.building)))
    scopes: dict[str, Scope] = {p.base: "zone" for p in parameters if p.base in differing}
    if scopes and plain and drawn and not base.scopes and len(fitted.model.network.zones) > 1:
        looked.append(ladder.fitted("zoned", replace(base, scopes={**base.scopes, **scopes}), fitted))
    looked += people + free
    lumped = free[_best(free, ADVANCE)].fit
    if lumped is not None and days_of(given.tuned) >= _WEEK:
        recurring = replace(lumped.settings, structure=replace(lumped.settings.structure, recurring=True))
        begun["recurring"] = recurring, lumped.best
        looked.append(ladder.look("recurring", _begun(given, *begun["recurring"])))
    best = _best(looked, advance, lumped_advance)
    if looked[best].name in begun:
        looked[best] = ladder.fitted(looked[best].name, *begun[looked[best].name])
    kept = looked[best]
    if kept.fit is not None and kept.fit.settings.structure.lumped and not kept.fit.settings.effects:
        moved = replace(kept.fit.settings, effects={CLOCK: ()})
        # fitted at once: Newton steps from heat that is not moved at all tell nothing of half an hour
        looked.append(ladder.fitted("shifted", moved, kept.fit.best))
        kept = looked[-1] if looked[-1].left.mae < (1.0 - FEW_MORE) * kept.left.mae else kept
    rungs = tuple(Rung(each.name, each.left.mae, each.parameters, each is kept) for each in looked)
    return rungs, None if kept.fit is None else replace(kept.fit, left=kept.left), kept.left


def _best(looked: Sequence[_Looked], advance: float, lumped_advance: float = ADVANCE) -> int:
    """Which of some structures, the simplest first, predicts left-out days so much better that it is kept."""
    best = 0
    for number, other in enumerate(looked):
        over_the_first = lumped_advance if other.name in _LUMPED else advance
        least = UNDRAWN[other.name].better if other.name in UNDRAWN else ADVANCE if best else over_the_first
        if other.left.mae < (1.0 - least) * looked[best].left.mae:
            best = number
    return best


@dataclass(frozen=True)
class _Looked:
    """A structure with its left-out days, and its fit where it was made here."""

    name: str
    left: LeftOut
    parameters: int
    fit: FittedCase | None


@dataclass(frozen=True)
class _Ladder:
    """What structures are fitted to and looked at with."""

    given: Tuned
    progress: Forward
    base: CalibrationSettings

    def look(self, name: str, found: Fitted, fit: FittedCase | None = None) -> _Looked:
        """Leave days out."""
        self.progress.say(f"{name} building, days left out")
        left = left_out(found, self.given.tuned, self.base.spin_up_seconds)
        return _Looked(name, left, len(found.problem.free), fit)

    def solve(self, settings: CalibrationSettings, known: Fitted | None = None) -> FittedCase:
        """Fit a structure."""
        given, part = self.given, self.progress.part(_SHARE, "another structure")

        def solved() -> FittedCase:
            found = fit_case(given.case, given.tuned, given.judged, settings, part, known)
            found.raise_if_interrupted()
            return found

        return stage("structure", solved)

    def fitted(self, name: str, settings: CalibrationSettings, known: Fitted | None = None) -> _Looked:
        """Fit a structure, and leave days out."""
        found = self.solve(settings, known)
        return self.look(name, found.best, found)

    @property
    def guesses(self) -> bool:
        """Whether there are plain heaters of which nobody says what they give their heat by."""
        case = self.given.case
        return self.base.structure.emitter == "air" and bool(unknown_heaters(case.building, case.telemetry.frame))

    def tried(self, name: str, settings: CalibrationSettings, known: Fitted, least: float, error: float) -> _Looked:
        """Look at a structure as it begins, and fit it where that promises to be better by a share.

        Where heat goes elsewhere what is known of other parameters is wrong, so such a fit begins anew: from the
        estimate with all heat in the air that of a house with heated floors ended at five times the error.
        """
        seen = self.look(name, _begun(self.given, settings, known))
        if not seen.left.mae < (1.0 - least) * error:  # nor where days are too few to leave any out
            return seen
        return self.fitted(name, settings)

    def emitters(self, fitted: Fitted, error: float) -> list[_Looked]:
        """Look at heat that floors give and radiators too, as far as it promises anything; then at radiators alone."""
        floor, radiator = (
            replace(self.base, structure=replace(self.base.structure, emitter=kind)) for kind in _EMITTERS
        )
        seen = self.tried("floor", floor, fitted, _PROMISED, error)
        if seen.fit is None:
            return []
        if not seen.left.mae < (1.0 - ADVANCE) * error:
            return [seen]
        return [self.fitted("radiator", radiator), seen]

    def people(
        self, base: CalibrationSettings, fitted: Fitted, beside: Sequence[Mapping[str, Sequence[str]]], error: float
    ) -> list[_Looked]:
        """Fit the heat of people who have hours of their own in each zone, beside some effects and beside others.

        Nothing unless left-out days are predicted better than by an error, and much better than by the means of such
        heat: a wrong drawing takes any freedom that it gets, but has no course of the day.
        """
        zones, found = self.given.case.building.zone_names, []
        waves = {f"{_WAVE}@{zone}, {wave.name}": 0.0 for zone in zones for wave in DAILY}
        for name, others in zip((PEOPLE, BESIDE), beside, strict=False):
            if GAINS in (*base.effects, *others) or days_of(self.given.tuned) < _WEEK:
                continue
            daily = replace(base, effects={**base.effects, **others, GAINS: zones})
            mean = replace(daily, fixed={**base.fixed, **waves})
            course = self.look(name, _begun(self.given, daily, fitted))
            if not course.left.mae < error:
                continue
            always = self.look(name, _begun(self.given, mean, fitted))
            if course.left.mae < _RECURS * always.left.mae:
                course, always = self.fitted(name, daily, fitted), self.fitted(name, mean, fitted)
                found += [course] if course.left.mae < _RECURS * always.left.mae else []
        return found

    def lumped(self, structure: Structure, error: float) -> list[_Looked]:
        """Fit a lumped model, and one with heated floors if the drawing has them, or if they promise anything.

        In the latter case only where no drawing is as good as the former.
        """
        own = self.base.structure.emitter
        found = self.solve(replace(self.base, structure=replace(structure, emitter="air" if own == "floor" else own)))
        looked = [self.look("lumped", found.best, found)]
        floors = replace(found.settings, structure=replace(structure, emitter="floor"))
        if own == "floor":
            looked.append(self.fitted("lumped floor", floors))
        elif self.guesses and looked[0].left.mae < error:
            looked.append(self.tried("lumped floor", floors, found.best, _PROMISED, looked[0].left.mae))
        return [each for each in looked if each.fit is not None]


def _begun(given: Tuned, settings: CalibrationSettings, known: Fitted) -> Known:
    """Take a structure with further parameters as it begins: at what is known of the others, and weighed like these."""
    settings = with_normalisation(settings, given.case, given.tuned)
    problem = begin_at(tuning_problem(given.case, given.tuned, settings), known)
    return Known(problem, reduced_model(problem.grid, [problem.start]), problem.point(problem.start))
