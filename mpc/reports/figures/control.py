"""Figures of closed loops: what was done, what it was done for, and what came of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpc.reports.figures.style import (
    CELSIUS,
    INK,
    MEASURED,
    MUTED,
    SIMULATED,
    WARNING,
    Picture,
    day_numbers,
    picture,
    styled,
    time_axis,
)
from mpc.studies.run import AHEAD, ControlRun, compared_decisions
from thermal._types import FloatArray

_KILO = 1000.0
_FELT = 0.1  # K h outside of the band: bars of less are to look like little
_OTHERS = ("#009E73", "#CC79A7", "#E69F00", "#56B4E9")

#: Colour of each controller, from a palette that the colour-blind can tell apart.
COLOURS = {"mpc": SIMULATED, "bound": INK, "schedule": _OTHERS[2], "reset": _OTHERS[1], "guideline36": MEASURED}


@styled
def course(run: ControlRun) -> list[Picture]:
    """Draw a run: prices, weather and people, zone temperatures in their bands, setpoints, power.

    Parameters
    ----------
    run : ControlRun
        Of a study.
    """
    study = run.study
    figure = Figure(figsize=(10.0, 10.5))
    axes = figure.subplots(5, 1, sharex=True, gridspec_kw={"height_ratios": [1.0, 1.0, 1.7, 1.3, 1.3]})
    x, n = day_numbers(study.stamps), study.steps
    _prices(axes[0], run, x)
    _forecast(axes[1], run, x)
    _zones(axes[2], run, x)
    _setpoints(axes[3], run)
    axes[4].stackplot(
        x, run.loop.record.electricity[:n] / _KILO, _gas(run) / _KILO, labels=["electricity", "gas"],
        colors=[MEASURED, SIMULATED], alpha=0.75, step="pre",
    )  # fmt: skip
    axes[4].set_title("What it took")
    axes[4].set_ylabel("power [kW]")
    for one in axes:
        _legend(one)
    axes[0].set_xlim(x[0], x[-1])
    time_axis(axes[4], study.stamps.tz, ticks=9)
    return [picture(figure, "Prices, weather, zone temperatures, setpoints and power of the run, over time")]


def _legend(axes: Axes) -> None:
    axes.legend(loc="upper left", bbox_to_anchor=(1.06, 1.0), fontsize=8)


def _prices(axes: Axes, run: ControlRun, x: FloatArray) -> None:
    scenario, n = run.study.scenario, run.study.steps
    axes.step(x, scenario.electricity_price[:n], where="pre", color=MEASURED, label="electricity")
    axes.step(x, scenario.gas_price[:n], where="pre", color=SIMULATED, label="gas")
    axes.set_ylim(bottom=0.0)
    axes.set_title("Prices")
    axes.set_ylabel(f"[{scenario.currency}/kWh]")


def _forecast(axes: Axes, run: ControlRun, x: FloatArray) -> None:
    scenario, n = run.study.scenario, run.study.steps
    axes.plot(x, scenario.outdoor[:n] - CELSIUS, color=MEASURED, label="outdoor air")
    axes.set_title("What was to come: outdoor air, and heat of people, light and equipment")
    axes.set_ylabel("[°C]")
    right = axes.twinx()
    right.step(x, scenario.gains[:n].sum(axis=1) / _KILO, where="pre", color=MUTED)
    axes.plot([], [], color=MUTED, label="heat of people ...")
    right.set_ylabel("[kW]")
    right.set_ylim(bottom=0.0)
    right.grid(visible=False)


def _zones(axes: Axes, run: ControlRun, x: FloatArray) -> None:
    scenario, n = run.study.scenario, run.study.steps
    zone = run.loop.record.zone_temperature[1 : n + 1] - CELSIUS
    low, high = scenario.lower[:n].max(axis=1) - CELSIUS, scenario.upper[:n].min(axis=1) - CELSIUS
    axes.fill_between(x, low, high, step="pre", color="#009E73", alpha=0.13, linewidth=0, label="comfort band")
    axes.fill_between(x, zone.min(axis=1), zone.max(axis=1), color=MUTED, alpha=0.35, linewidth=0, label="all zones")
    first, last = np.percentile(zone, [10, 90], axis=1)
    axes.fill_between(x, first, last, color=MUTED, alpha=0.45, linewidth=0, label="80 % of the zones")
    axes.plot(x, np.median(zone, axis=1), color=INK, linewidth=1.2, label="median zone")
    axes.set_title("Zone temperatures")
    axes.set_ylabel("[°C]")


def _setpoints(axes: Axes, run: ControlRun) -> None:
    actions = run.loop.actions
    air = [c for c in actions if str(c).endswith("supply_air_temperature_setpoint")]
    water = [c for c in actions if str(c).endswith("supply_water_temperature_setpoint")]
    x = day_numbers(pd.DatetimeIndex(actions.index))
    for k, column in enumerate(air[:4]):
        label = "supply air" if len(air) == 1 else str(column).partition("/")[0]
        axes.step(x, actions[column] - CELSIUS, where="pre", color=(MEASURED, *_OTHERS)[k], linewidth=1.2, label=label)
    axes.set_title("What was set")
    axes.set_ylabel("supply air [°C]")
    right = axes.twinx()
    for column in water:
        right.step(x, actions[column] - CELSIUS, where="pre", color=SIMULATED, linewidth=1.2)
    axes.plot([], [], color=SIMULATED, label="supply water")
    right.set_ylabel("supply water [°C]")
    right.grid(visible=False)


def _gas(run: ControlRun) -> FloatArray:
    record = run.loop.record
    return np.zeros(record.n_steps) if record.gas is None else record.gas


@styled
def expectations(run: ControlRun) -> list[Picture]:
    """Draw what optimal control expected after an hour, and what came.

    Parameters
    ----------
    run : ControlRun
        With decisions; without any there is nothing to draw.
    """
    rows = compared_decisions(run)
    if len(rows) < 2:  # a point is no course
        return []
    record, ahead = run.loop.record, round(AHEAD / run.loop.record.step)
    stamps = run.study.stamps[[first + ahead - 1 for first, _ in rows]]
    x = day_numbers(stamps)
    expected = np.stack([d.zone for _, d in rows]) - CELSIUS
    came = np.stack([record.zone_temperature[first + ahead] for first, _ in rows]) - CELSIUS
    figure = Figure(figsize=(10.0, 5.4))
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(x, came.mean(axis=1), color=MEASURED, label="realised")
    upper.plot(x, expected.mean(axis=1), color=SIMULATED, linewidth=1.0, label="expected an hour before")
    upper.set_title("Mean temperature of the zones")
    upper.set_ylabel("[°C]")
    total = [float((record.electricity + _gas(run))[first : first + ahead].mean()) / _KILO for first, _ in rows]
    lower.plot(x, total, color=MEASURED, label="realised")
    lower.plot(x, [sum(d.power) / _KILO for _, d in rows], color=SIMULATED, linewidth=1.0, label="expected")
    lower.set_title("Electricity and gas, mean of the hour")
    lower.set_ylabel("[kW]")
    for one in (upper, lower):
        one.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8)
    upper.set_xlim(x[0], x[-1])
    time_axis(lower, stamps.tz, ticks=9)
    return [picture(figure, "Expected and realised zone temperatures and power")]


@styled
def side_by_side(runs: Sequence[ControlRun]) -> list[Picture]:
    """Draw cost, setpoints and the coldest and warmest zone of several controllers.

    Parameters
    ----------
    runs : sequence of ControlRun
        Of one study.
    """
    study = runs[0].study
    figure = Figure(figsize=(10.0, 9.5))
    axes = figure.subplots(4, 1, sharex=True)
    x, n, scenario = day_numbers(study.stamps), study.steps, study.scenario
    low, high = scenario.lower[:n].max(axis=1) - CELSIUS, scenario.upper[:n].min(axis=1) - CELSIUS
    axes[1].fill_between(x, low, high, step="pre", color="#009E73", alpha=0.13, linewidth=0)
    for run in runs:
        record, colour = run.loop.record, COLOURS.get(run.controller, _OTHERS[3])
        style = {"color": colour, "linewidth": 1.2, "linestyle": "--" if run.controller == "bound" else "-"}
        spent = scenario.electricity_price[:n] * record.electricity + scenario.gas_price[:n] * _gas(run)
        axes[0].plot(x, np.cumsum(spent) * record.step / 3.6e6, label=run.entry.title, **style)
        zone = record.zone_temperature[1 : n + 1] - CELSIUS
        axes[1].plot(x, zone.min(axis=1), **style)
        axes[1].plot(x, zone.max(axis=1), **style)
        acted, actions = day_numbers(pd.DatetimeIndex(run.loop.actions.index)), run.loop.actions - CELSIUS
        for one, kind in ((axes[2], "supply_air_temperature_setpoint"), (axes[3], "supply_water_temperature_setpoint")):
            columns = [c for c in actions if str(c).endswith(kind)]
            if columns:
                one.step(acted, actions[columns].mean(axis=1), where="pre", **style)
    titles = ("Energy cost so far", "Coldest and warmest zone", "Supply air setpoint", "Supply water setpoint")
    for one, title, unit in zip(axes, titles, (f"[{scenario.currency}]", "[°C]", "[°C]", "[°C]"), strict=True):
        one.set_title(title)
        one.set_ylabel(unit)
    axes[0].legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8)
    axes[0].set_xlim(x[0], x[-1])
    time_axis(axes[3], study.stamps.tz, ticks=9)
    return [picture(figure, "Cost, zone temperatures and setpoints of the controllers over time")]


@styled
def cost_bars(runs: Sequence[ControlRun]) -> list[Picture]:
    """Draw the energy cost of each controller, electricity and gas, and its discomfort beside it.

    Parameters
    ----------
    runs : sequence of ControlRun
        Of one study.
    """
    figure = Figure(figsize=(10.0, 0.9 + 0.42 * len(runs)))
    left, right = figure.subplots(1, 2, sharey=True, gridspec_kw={"width_ratios": [2.0, 1.0]})
    names, place = [run.entry.title for run in runs], np.arange(len(runs))
    parts = np.array([_cost_parts(run) for run in runs])
    left.barh(place, parts[:, 0], color=MEASURED, alpha=0.8, label="electricity")
    left.barh(place, parts[:, 1], left=parts[:, 0], color=SIMULATED, alpha=0.8, label="gas")
    left.set_yticks(place, names)
    left.invert_yaxis()
    left.set_xlabel(f"energy cost [{runs[0].study.scenario.currency}]")
    left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=8)  # above: bars fill the axes
    discomfort = [run.kpis.tdis_tot for run in runs]
    bars = right.barh(place, discomfort, color=WARNING, alpha=0.7)
    right.bar_label(bars, fmt="%.2f", padding=3.0, fontsize=8)  # where nobody leaves the band there is no bar
    right.set_xlim(0.0, 1.25 * max(_FELT, *discomfort))
    right.set_xlabel("outside of the band, mean zone [K h]")
    return [picture(figure, "Energy cost and discomfort of the controllers")]


def _cost_parts(run: ControlRun) -> tuple[float, float]:
    """Give what electricity and gas cost [currency].

    Parameters
    ----------
    run : ControlRun
        Of a study.
    """
    record, scenario, n = run.loop.record, run.study.scenario, run.study.steps
    unit = record.step / 3.6e6
    return (
        float(scenario.electricity_price[:n] @ record.electricity) * unit,
        float(scenario.gas_price[:n] @ _gas(run)) * unit,
    )
