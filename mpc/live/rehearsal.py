"""What acting would have saved on recorded days: optimal control and the building's own, each run on the site's model.

A plan says what it costs beside the rule from the same state on, over its horizon. Added up over a day that is no
saving: a plan leaves out what the building needs once its horizon is over, and is never followed to its end. So both
controls are run through the days in closed loop, with the weather that was measured and the forecasts that there were.
And with the heat that the model lacked: what was measured in the zones tells it, whoever was in control then.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration.progress import Progress
from calibration.results import Axes, Result, plain
from mpc.adapters.boptest.scenario import DAY
from mpc.adapters.described.conditions import SeriesGains
from mpc.baselines.rules import OutdoorReset
from mpc.errors import LiveError
from mpc.kpi.daily import by_day
from mpc.live.building import BuildingController, believed, building_controller, own_rule
from mpc.live.past import past_table, plans_on_record
from mpc.live.planner import Planner, forecast_of_dict, site_actuators
from mpc.live.site import Site
from mpc.live.site_file import BuildingModel
from mpc.loop.noise import SensorNoise
from mpc.loop.plant import Controller
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.model import control_model, model_settings
from mpc.scenario.forecast import Forecast
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import ScheduledOccupancy
from mpc.scenario.scenario import OCCUPANCY_POINT, Scenario, zone_areas
from mpc.scenario.weather import WEATHER_POINTS, Weather
from mpc.studies.optimal_control import MODEL_STEP
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.effects.gains import has_people

#: Days that come before the first, all under the building's own control, as walls forget how they began and a Monday
#: makes up for a weekend: those recorded before it, or of a week [d] the week itself, and how often the first of them.
_WEEK, _FIRST_DAY = 7, 3

#: Least share of a day's steps that must be on record for it to count [-]; what is missing stays as it was before.
_ON_RECORD = 0.9

#: Seed of the sensors' noise; share of the dearest day's cost below which a day costs nothing [-].
_SEED, _ROUND_OFF = 0, 1e-6


@dataclass(frozen=True, repr=False)
class Rehearsal(Result):
    """What two controls would have cost on the same days, by the model.

    Parameters
    ----------
    site : str
        Name.
    days : DataFrame, shape (n_day, 7)
        By local midnight: ``cost`` [currency], ``energy`` [kWh] and ``discomfort`` [K h] of optimal control,
        ``own_cost``, ``own_energy`` and ``own_discomfort`` of the building's own, and ``promised``, the share of the
        cost that the plans of the day had expected to save by themselves [-].
    currency : str
        Of the costs.
    steps, lost : int
        Control steps of these days, and those of them without a forecast.
    """

    site: str
    days: pd.DataFrame
    currency: str
    steps: int
    lost: int = field(default=0)

    @property
    def saving(self) -> float:
        """Share of the cost of the building's own control that acting saves [-]; NaN where that costs nothing."""
        own = float(self.days["own_cost"].sum())
        return 1.0 - float(self.days["cost"].sum()) / own if own > 0.0 else math.nan

    @property
    def promised(self) -> float:
        """The same by the plans themselves, weighted by what the rule costs [-]."""
        known = self.days.dropna(subset="promised")
        weight = known["own_cost"].sum()
        return float((known["own_cost"] * known["promised"]).sum() / weight) if weight > 0.0 else math.nan

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the days, as `days` with ``saving`` [-], NaN where own control costs nothing."""
        own = self.days["own_cost"]
        return self.days.assign(saving=1.0 - self.days["cost"] / own.where(own > _ROUND_OFF * own.max()))

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``rehearsal.json``."""
        days = [{"day": str(day.date()), **row} for day, row in zip(
            pd.DatetimeIndex(self.days.index), self.to_frame().to_dict("records"), strict=True)]  # fmt: skip
        content: dict[str, Any] = plain({
            "site": self.site, "saving": self.saving, "promised": self.promised, "currency": self.currency,
            "steps": self.steps, "lost": self.lost, "days": days,
        })  # fmt: skip
        return content

    def _summary(self) -> str:
        return f"{self.site}, {len(self.days)} days: {self.saving:.1%} saved"

    def _draw(self, axes: Axes) -> None:
        shown = self.days[["own_cost", "cost"]].rename(columns={"own_cost": "own control", "cost": "optimal control"})
        shown.index = pd.DatetimeIndex(shown.index).strftime("%a %d %b")
        shown.plot.bar(ax=axes, ylabel=f"cost of a day [{self.currency}]", rot=0)


@dataclass(frozen=True)
class _Recorded:
    """What the controller was asked with, by the begin of the step: means before it, what was forecast, and savings.

    Beside that the first and last begin of all that is logged.
    """

    past: list[dict[str, Any]]
    now: dict[float, dict[str, float | None]]
    forecasts: dict[float, Forecast]
    rules: dict[float, tuple[float, float]]
    ends: list[float]

    def reach(self, site: Site) -> str:
        """Say what is logged."""
        return f" of what is logged, {' to '.join(map(str, _local(self.ends, site)))}" if self.ends else ""


def rehearse(
    site: Site,
    begin: pd.Timestamp | None = None,
    end: pd.Timestamp | None = None,
    *,
    controller: Controller | None = None,
    progress: Progress | None = None,
) -> Rehearsal:
    """Run optimal control and the building's own through recorded days, each in closed loop with the site's model.

    Both meet the weather that was measured, prices and bands that were in force, and the forecasts that there were. The
    building is the controller's own model, with the heat that its observer found to be lacking on these days, in both
    runs and foreseen in none.

    Parameters
    ----------
    site : Site
        As read, with a building as its model; its controller has logged plans, in whatever mode.
    begin, end : Timestamp, optional
        Local; the first and last recorded step by default.
    controller : Controller, optional
        In the place of the site's own.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    LiveError
        When the site has no building, or no local day was recorded then as a whole; days in part are not counted.
    """
    entry, where = site.file.model, f"{site.path.name}: model"
    expected = "a building, whose control and own control can be run"
    if not isinstance(entry, BuildingModel):
        raise LiveError(where, expected, "none", "calibrate the building, and name it under `model`")
    if begin is not None and end is not None:
        LiveError.unless(end > begin, "end", f"a time after {begin}", end)
    recorded = _recorded(site, begin, end)
    low = -math.inf if begin is None else begin.timestamp()
    before, times = sorted(t for t in recorded.now if t < low), sorted(t for t in recorded.now if t >= low)
    whole = _whole_days(times, site)
    expected, found = "a day of the controller's plans with their forecasts", f"{len(times) or 'no'} steps"
    LiveError.unless(whole.size, f"{site.folder}", expected, f"{found}{recorded.reach(site)}", "let it run in shadow")
    first = times[0]
    steps = round((times[-1] - first) / site.step) + 1
    taken = _taken(round((first - before[0]) / site.step) if before else 0, steps, site)
    lead = taken.size - steps
    building, system, parameters = believed(site, entry)
    step = MODEL_STEP if site.step % MODEL_STEP == 0.0 else site.step
    gains = not has_people(building, model_settings(parameters).effects)  # which the model has itself otherwise
    now, table = _as_recorded(site, building, recorded, first, taken, gains)
    observed = building_controller(site, entry, site_actuators(site))
    points = [name for name in observed.columns if name in site.file.points]
    known = float(table.reindex(columns=points).iloc[lead:].notna().to_numpy().mean())
    advice = "let it run in shadow with this model: the heat that it lacks is told by these points"
    expected = "nine tenths of what zones and terminals showed on these days"
    LiveError.unless(known >= _ON_RECORD, f"{site.folder}", expected, f"{known:.0%}", advice)
    scenario = _scenario(site, building, now, table, observed.start_up(table), step)
    plant = SimulatedPlant(
        scenario, system, ReducedBuilding(control_model(building, parameters), step_seconds=step),
        control_steps=round(site.step / step), noise=SensorNoise(), warm_up_days=0, seed=_SEED,
    )  # fmt: skip
    own = OutdoorReset([a for a in plant.actuators if a.required], building.weather_station, own_rule(entry))
    usual = {f"{building.weather_station}/{OUTDOOR_TEMPERATURE}": float(scenario.outdoor.mean())}
    plant.default_actions = plant.default_actions | own.step(usual, None)
    tell = progress or (lambda stage, done, total: None)
    runs = []
    for number, acts in enumerate((False, True)):
        chosen = Planner(site, controller).controller if acts else None
        if isinstance(chosen, BuildingController):
            chosen.start_up(table.iloc[:lead])
        seen = plant.reset()  # without a seed, which would draw other people than those on record
        for k in range(-lead, steps):
            actions = own.step(seen, None)
            if chosen is not None and k >= 0:
                planned = chosen.step(seen, recorded.forecasts.get(first + k * site.step))
                actions |= {name: value for name, value in planned.items() if name in site.writable}
            seen = plant.step(actions)
            tell("rehearse", number * (lead + steps) + lead + k + 1, 2 * (lead + steps))
        runs.append(by_day(plant.record(), scenario, since=lead * round(site.step / step)))
    days = runs[1].join(runs[0].add_prefix("own_"))
    rules = {time: rule for time, rule in recorded.rules.items() if time >= first}
    days = days.assign(promised=_promised(rules, site)).loc[whole]
    counted = round(len(whole) * DAY / site.step)
    lost = max(counted - sum(t.normalize() in whole for t in _local(times, site)), 0)
    return Rehearsal(site.file.name, days, _currency(site), counted, lost)


def _taken(before: int, steps: int, site: Site) -> NDArray[np.int64]:
    """List the control steps that are run through, in their order; the first that counts is number 0."""
    day, week = round(DAY / site.step), round(_WEEK * DAY / site.step)
    taken = np.r_[0:week, 0:steps] if before < week <= steps else np.arange(-before, steps)
    return np.asarray(np.r_[np.tile(np.resize(taken[:day], day), _FIRST_DAY), taken], dtype=np.int64)


def _local(times: Sequence[float], site: Site) -> pd.DatetimeIndex:
    return pd.to_datetime(times, unit="s", utc=True).tz_convert(site.plant.location.timezone)


def _whole_days(times: Sequence[float], site: Site) -> pd.DatetimeIndex:
    """Local midnights of the days of which next to all steps are on record; of others too much would be invented."""
    each = pd.Series(1.0, index=_local(times, site)).resample("1D").sum()
    return pd.DatetimeIndex(each.index[each.to_numpy() * site.step >= _ON_RECORD * DAY])


def _recorded(site: Site, begin: pd.Timestamp | None, end: pd.Timestamp | None) -> _Recorded:
    """Read the controller's logs, of a week before too; a line that cannot be read is left out, and not judged here.

    So are steps of other lengths: the control step may have been another one.
    """
    low = -math.inf if begin is None else begin.timestamp() - _WEEK * DAY
    high = math.inf if end is None else end.timestamp()
    past, found = dict[float, dict[str, Any]](), _Recorded([], {}, {}, {}, [])
    for at, inputs, plan, row in plans_on_record(site.folder):
        found.ends[:] = [min([at, *found.ends]), max([at, *found.ends])]
        if not low <= at < high or not row or at % site.step:
            continue
        try:
            found.forecasts[at] = forecast_of_dict(inputs["forecast"])
        except (ValueError, KeyError, TypeError):
            continue
        found.now[at] = row
        weather = {name: row[name] for name in WEATHER_POINTS if name in row}
        past[at] = {"begin": at, "means": inputs.get("means") or {}, "ahead": weather}
        rule = (plan.get("ahead") or {}).get("rule")
        if rule is not None:
            found.rules[at] = float(rule["rule"]), float(rule["saving"])
    found.past.extend(past[at] for at in sorted(past))
    return found


def _as_recorded(
    site: Site, building: Building, recorded: _Recorded, first: float, taken: NDArray[np.int64], gains: bool
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Lay out what was forecast for the control steps and what was measured in them, by their ends.

    `taken` are the steps, of `_taken`. What was not forecast stays as it was the step before, weather that was not
    measured lies between; of the rest NaN is left.
    """
    zone, steps, low = site.plant.location.timezone, int(taken[-1]) + 1, int(taken.min())
    end, length = first + steps * site.step, pd.Timedelta(seconds=site.step)
    stamps = pd.date_range(end=pd.Timestamp(end, unit="s", tz=zone), periods=taken.size, freq=length)
    times = first + site.step * np.arange(low, steps)
    now = pd.DataFrame.from_dict(recorded.now, orient="index", dtype=float).reindex(times).ffill().bfill()
    table = past_table(recorded.past, end + site.step, site.step, zone, building.weather_station)
    weather = table.columns.str.startswith(f"{building.weather_station}/")
    table.loc[:, weather] = table.loc[:, weather].interpolate(limit_direction="both")
    now, table = now.take(taken - low).set_index(stamps), table.iloc[low - steps :].take(taken - low).set_index(stamps)
    expected = [OCCUPANCY_POINT, "internal_gain"] if gains else [OCCUPANCY_POINT]
    names = [f"{name}/{point}" for point in expected for name in building.zone_names]
    foreseen = now.filter(names)
    return now, pd.concat([table.drop(columns=list(foreseen), errors="ignore"), foreseen], axis=1)


def _scenario(
    site: Site, building: Building, now: pd.DataFrame, table: pd.DataFrame, lacked: pd.DataFrame, step: float
) -> Scenario:
    """Lay out what drove the days, on the model's steps."""
    zones, each, station = building.zone_names, round(site.step / step), building.weather_station
    grid = StepGrid(table.index[0] - pd.Timedelta(seconds=site.step), step, len(table) * each)

    def rows(*names: str) -> FloatArray:
        missing = [name for name in names if name not in now or now[name].isna().any()]
        LiveError.unless(not missing, f"{site.folder}: forecasts", ", ".join(names[:3]), f"no {', '.join(missing[:3])}")
        return np.repeat(now[list(names)].to_numpy(), each, axis=0)

    def of_zones(kind: str) -> FloatArray:
        return rows(*(f"{name}/{kind}" for name in zones))

    def price(of: str) -> FloatArray:
        return rows(f"{of}_price")[:, 0] if f"{of}_price" in now else np.zeros(grid.n_steps)

    named = {f"{station}/{point}": point for point in WEATHER_POINTS if f"{station}/{point}" in table}
    weather = Weather(table[list(named)].rename(columns=named), building.location, step=site.step).on(grid)
    nothing, carbon = np.zeros((grid.n_steps, len(zones))), np.zeros(grid.n_steps)
    heat = of_zones("internal_gain") if f"{zones[0]}/internal_gain" in table else nothing
    people = of_zones(OCCUPANCY_POINT) if f"{zones[0]}/{OCCUPANCY_POINT}" in now else nothing
    return Scenario(
        building, grid, zone_areas(building), np.zeros(len(zones)), weather, occupancy=people,
        expected_occupancy=people, lower=of_zones("comfort_lower_temperature"),
        upper=of_zones("comfort_upper_temperature"), electricity_price=price("electricity"), gas_price=price("gas"),
        electricity_carbon=carbon, gas_carbon=carbon, demand=(), currency=_currency(site), carbon_kind="",
        people=ScheduledOccupancy(dict.fromkeys(zones, 0.0)), heat=SeriesGains(sensible=0.0, latent=0.0, others=heat),
        unmeasured=np.repeat(lacked[list(zones)].to_numpy(), each, axis=0),
        district_price=price("district_heating") if "district_heating_price" in now else None,
    )  # fmt: skip


def _currency(site: Site) -> str:
    return "" if site.plant.prices is None else site.plant.prices.currency


def _promised(rules: Mapping[float, tuple[float, float]], site: Site) -> pd.Series:
    """Share that the plans of a day expect to save, weighted by what the rule costs over their horizons [-]."""
    table = pd.DataFrame(list(rules.values()), index=_local(list(rules), site), columns=["rule", "saving"])
    table["saved"] = table["rule"] * table["saving"]
    daily = table.resample("1D").sum()
    return daily["saved"] / daily["rule"].where(daily["rule"] > 0.0)
