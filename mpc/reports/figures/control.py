"""Figures of closed loops: what was done, what it was done for, and what was realised."""

from collections.abc import Sequence
from itertools import count

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpc.kpi.bought import Fuel, costs_of, fuel_of
from mpc.reports.figures import style
from mpc.reports.figures.style import CELSIUS, MEASURED, MUTED, SIMULATED, Picture, picture, styled
from mpc.reports.means import NOTICED
from mpc.studies.described import RecordedPlant
from mpc.studies.run import AHEAD, ControlRun, compared_decisions
from thermal._types import FloatArray

_KILO = 1000.0
_FELT = 0.1  # K h outside of the band: bars of less are to look like little
_GREEN, _PINK, _YELLOW, _SKY = "#009E73", "#CC79A7", "#E69F00", "#56B4E9"

#: Colour of each controller, from a palette that the colour-blind can tell apart, and those of one's own controllers.
_COLOURS = {"mpc": SIMULATED, "bound": style.INK, "schedule": _YELLOW, "reset": _PINK, "guideline36": MEASURED}
_OWN = (_GREEN, _SKY, MUTED, "#999933")

_SUPPLY_AIR, _SUPPLY_WATER = "supply_air_temperature_setpoint", "supply_water_temperature_setpoint"


@styled
def course(run: ControlRun) -> list[Picture]:
    """Draw a run: prices, weather and people, zone temperatures in their bands, setpoints, power.

    Parameters
    ----------
    run : ControlRun
        Of a study.
    """
    scenario, n, record = run.study.scenario, run.study.steps, run.loop.record
    figure = Figure(figsize=(10.0, 10.5))
    prices, weather, zones, setpoints, power = axes = figure.subplots(
        5, 1, sharex=True, gridspec_kw={"height_ratios": [1.0, 1.0, 1.7, 1.3, 1.3]}
    )
    x = style.lines_over_time(power, run.study.stamps, ticks=9)
    prices.step(x, scenario.electricity_price[:n], where="pre", color=MEASURED, label="electricity")
    fuel = _fuel(run)
    burns = bool(np.any(fuel.power))
    if burns:
        prices.step(x, fuel.price[:n], where="pre", color=SIMULATED, label=fuel.name)
    prices.set(title="Prices", ylabel=f"[{scenario.currency}/kWh]")
    prices.set_ylim(bottom=0.0)
    weather.plot(x, scenario.outdoor[:n] - CELSIUS, color=MEASURED, label="outdoor air")
    weather.set(title="What was to come: outdoor air, and heat of people, light and equipment", ylabel="[°C]")
    right = _right(weather, "[kW]", MUTED, "heat of people ...")
    right.step(x, scenario.gains[:n].sum(axis=1) / _KILO, where="pre", color=MUTED)
    right.set_ylim(bottom=0.0)
    _zones(zones, run, x)
    _setpoints(setpoints, run)
    bought = {"electricity": record.electricity[:n] / _KILO} | ({fuel.name: fuel.power / _KILO} if burns else {})
    power.stackplot(
        x, *bought.values(), labels=list(bought), colors=[MEASURED, SIMULATED], alpha=0.75, step="pre",
    )  # fmt: skip
    power.set(title="What it took", ylabel="power [kW]")
    for one in axes:
        _legend(one, 1.06)
    alt = f"{run.entry.title.capitalize()}: prices, weather, zone temperatures, setpoints and power over time"
    return [picture(figure, alt, zoom=True)]


def _legend(axes: Axes, beside: float = 1.01) -> None:
    if axes.get_legend_handles_labels()[0]:  # a controller may have set nothing
        axes.legend(loc="upper left", bbox_to_anchor=(beside, 1.0), fontsize=8)


def _right(axes: Axes, ylabel: str, colour: str, label: str) -> Axes:
    """Add an axis on the right, whose lines have an entry in the legend of the left one."""
    axes.plot([], [], color=colour, label=label)
    right = axes.twinx()
    right.set_ylabel(ylabel)
    right.grid(visible=False)
    return right


def _comfort_band(axes: Axes, run: ControlRun, x: FloatArray) -> None:
    scenario, n = run.study.scenario, run.study.steps
    low, high = scenario.lower[:n].max(axis=1) - CELSIUS, scenario.upper[:n].min(axis=1) - CELSIUS
    axes.fill_between(x, low, high, step="pre", color=_GREEN, alpha=0.13, linewidth=0, label="comfort band")


def _zones(axes: Axes, run: ControlRun, x: FloatArray) -> None:
    zone = run.loop.record.zone_temperature[1 : run.study.steps + 1] - CELSIUS
    _comfort_band(axes, run, x)
    zones = run.study.scenario.zones
    spread = (([0, 100], 0.35, "all zones"), ([10, 90], 0.45, "80 % of the zones"))
    for ends, alpha, label in spread if len(zones) > 1 else ():
        low, high = np.percentile(zone, ends, axis=1)
        axes.fill_between(x, low, high, color=MUTED, alpha=alpha, linewidth=0, label=label)
    middle = "median zone" if len(zones) > 1 else zones[0]
    axes.plot(x, np.median(zone, axis=1), color=style.INK, linewidth=1.2, label=middle)
    axes.set(title="Zone temperatures", ylabel="[°C]")


def _setpoints(axes: Axes, run: ControlRun) -> None:
    x = style.day_numbers(pd.DatetimeIndex(run.loop.actions.index))
    if isinstance(run.plant, RecordedPlant):
        _values_set(axes, run, x)
        return
    air, water = _actions(run, _SUPPLY_AIR), _actions(run, _SUPPLY_WATER)
    for column, colour in zip(air, (MEASURED, _GREEN, _PINK, _YELLOW), strict=False):
        label = "supply air" if len(air.columns) == 1 else str(column).partition("/")[0]
        axes.step(x, air[column], where="pre", color=colour, linewidth=1.2, label=label)
    axes.set(title="What was set", ylabel="supply air [°C]")
    right = _right(axes, "supply water [°C]", SIMULATED, "supply water")
    for column in water:
        right.step(x, water[column], where="pre", color=SIMULATED, linewidth=1.2)


def _values_set(axes: Axes, run: ControlRun, x: FloatArray) -> None:
    """Draw whatever was set of a described plant: setpoints on the left, commands or supply water on the right."""
    wet = [name for name in run.loop.actions if str(name).endswith(_SUPPLY_WATER)]
    warm = [name for name in run.loop.actions if str(name).endswith("setpoint") and name not in wet]
    others = [name for name in run.loop.actions if name not in warm and name not in wet]
    for column, colour in zip(warm, (MEASURED, _GREEN, _PINK, _YELLOW), strict=False):
        axes.step(x, run.loop.actions[column] - CELSIUS, where="pre", color=colour, linewidth=1.2, label=column)
    axes.set(title="What was set", ylabel="[°C]" if warm else "")
    drawn = _right(axes, "command [-]", MUTED, "commands") if warm and others else axes
    for column, colour in zip(others, (SIMULATED, _SKY, MUTED, _GREEN), strict=False):
        drawn.step(x, run.loop.actions[column], where="pre", color=colour, linewidth=1.2, label=column)
    if others and not warm:
        axes.set_ylabel("command [-]")
    if wet and not others:
        drawn = _right(axes, "supply water [°C]", SIMULATED, "supply water")
        for column in wet:
            drawn.step(x, run.loop.actions[column] - CELSIUS, where="pre", color=SIMULATED, linewidth=1.2)


def _actions(run: ControlRun, kind: str) -> pd.DataFrame:
    """Actions of a kind [degC]."""
    return run.loop.actions.filter(regex=f"{kind}$") - CELSIUS


def _fuel(run: ControlRun) -> Fuel:
    return fuel_of(run.loop.record, run.study.scenario)


@styled
def expectations(run: ControlRun) -> list[Picture]:
    """Draw what optimal control expected after an hour, and what was realised.

    Parameters
    ----------
    run : ControlRun
        With decisions; without any there is nothing to draw.
    """
    rows = compared_decisions(run)
    if len(rows) < 2:  # a point is no course
        return []
    record, ahead = run.loop.record, round(AHEAD / run.loop.record.step)
    fuel = _fuel(run)
    took = record.electricity + fuel.power
    zone = [float(record.zone_temperature[first + ahead].mean()) - CELSIUS for first, _ in rows]
    power = [float(took[first : first + ahead].mean()) / _KILO for first, _ in rows]
    figure = Figure(figsize=(10.0, 5.4))
    upper, lower = figure.subplots(2, 1, sharex=True)
    x = style.lines_over_time(lower, run.study.stamps[[first + ahead - 1 for first, _ in rows]], ticks=9)
    for axes, realised, expected, when in (
        (upper, zone, [float(d.zone.mean()) - CELSIUS for _, d in rows], "expected an hour before"),
        (lower, power, [sum(d.power) / _KILO for _, d in rows], "expected"),
    ):
        axes.plot(x, realised, color=MEASURED, label="realised")
        axes.plot(x, expected, color=SIMULATED, linewidth=1.0, label=when)
        _legend(axes)
    upper.set(title="Mean temperature of the zones", ylabel="[°C]")
    what = f"Electricity and {fuel.name}" if np.any(fuel.power) else "Electricity"
    lower.set(title=f"{what}, mean of the hour", ylabel="[kW]")
    return [picture(figure, "Expected and realised zone temperatures and power", zoom=True)]


@styled
def side_by_side(runs: Sequence[ControlRun]) -> list[Picture]:
    """Draw cost, the coldest and warmest zone, and setpoints or power of several controllers.

    Parameters
    ----------
    runs : sequence of ControlRun
        Of one study.
    """
    study, own = runs[0].study, count()
    figure = Figure(figsize=(10.0, 9.5))
    cost, zones, air, water = figure.subplots(4, 1, sharex=True)
    x = style.lines_over_time(water, study.stamps, ticks=9)
    described = isinstance(runs[0].plant, RecordedPlant)
    _comfort_band(zones, runs[0], x)
    for run in runs:
        colour = _COLOURS.get(run.controller) or _OWN[next(own) % len(_OWN)]
        line = {"color": colour, "linewidth": 1.2, "linestyle": "--" if run.controller == "bound" else "-"}
        each = costs_of(run.loop.record, run.study.scenario)
        cost.plot(x, np.cumsum(np.sum(each, axis=0)), label=run.entry.title, **line)
        zone = run.loop.record.zone_temperature[1 : study.steps + 1] - CELSIUS
        zones.plot(x, zone.min(axis=1), **line)
        zones.plot(x, zone.max(axis=1), **line)
        if described:
            air.step(x, run.loop.record.electricity[: study.steps] / _KILO, where="pre", **line)
            water.plot(x, _outside_so_far(run), **line)
            continue
        acted = style.day_numbers(pd.DatetimeIndex(run.loop.actions.index))
        for axes, kind in ((air, _SUPPLY_AIR), (water, _SUPPLY_WATER)):
            if not (actions := _actions(run, kind)).empty:
                axes.step(acted, actions.mean(axis=1), where="pre", **line)
    cost.set(title="Energy cost so far", ylabel=f"[{study.scenario.currency}]")
    zones.set(title="Coldest and warmest zone", ylabel="[°C]")
    if described:
        air.set(title="Electricity", ylabel="[kW]")
        water.set(title="Outside of the comfort band so far, mean zone", ylabel="[K h]")
    else:
        air.set(title="Supply air setpoint", ylabel="[°C]")
        water.set(title="Supply water setpoint", ylabel="[°C]")
    _legend(cost)
    return [picture(figure, "Cost, zone temperatures and setpoints or power of the controllers over time", zoom=True)]


@styled
def cost_bars(runs: Sequence[ControlRun]) -> list[Picture]:
    """Draw the energy cost of each controller, electricity and gas, and its discomfort beside it.

    Parameters
    ----------
    runs : sequence of ControlRun
        Of one study.
    """
    figure = Figure(figsize=(10.0, 0.9 + 0.42 * len(runs)))
    discomfort = [run.kpis.tdis_tot for run in runs]
    some = any(z.below + z.above >= NOTICED for run in runs for z in run.kpis.zones)
    left, *others = np.atleast_1d(
        figure.subplots(1, 1 + some, sharey=True, gridspec_kw={"width_ratios": [2.0, 1.0][: 1 + some]})
    )
    place = np.arange(len(runs))
    costs = [costs_of(run.loop.record, run.study.scenario) for run in runs]
    electricity, other = np.array([[part.sum() for part in parts] for parts in costs]).T
    left.barh(place, electricity, color=MEASURED, alpha=0.8, label="electricity")
    if other.any():
        left.barh(place, other, left=electricity, color=SIMULATED, alpha=0.8, label=_fuel(runs[0]).name)
    left.set_yticks(place, [run.entry.title for run in runs])
    left.invert_yaxis()
    left.set_xlabel(f"energy cost [{runs[0].study.scenario.currency}]")
    left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=8)  # above: bars fill the axes
    for right in others:
        bars = right.barh(place, discomfort, color=style.WARNING, alpha=0.7)
        right.bar_label(bars, fmt="%.2f", padding=3.0, fontsize=8)
        right.set_xlim(0.0, 1.25 * max(_FELT, *discomfort))
        right.set_xlabel("outside of the band, mean zone [K h]")
    told = "and discomfort of the controllers" if some else "of the controllers; no zone left its comfort band"
    return [picture(figure, f"Energy cost {told}")]


def _outside_so_far(run: ControlRun) -> FloatArray:
    """Integral of what zones lack or exceed of their bands, mean of the zones, shape (n_steps,) [K h]."""
    scenario, n = run.study.scenario, run.study.steps
    zone = run.loop.record.zone_temperature[1 : n + 1]
    outside = np.maximum(np.maximum(scenario.lower[:n] - zone, zone - scenario.upper[:n]), 0.0)
    return np.asarray(np.cumsum(outside.mean(axis=1)) * run.loop.record.step / 3600.0)
