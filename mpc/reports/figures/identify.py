"""Figures of an identification: maps with their points, the days held out, and what was done."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from calibration.grey_box.fit import follow, predict, run_starts
from mpc.identify.identify import Identified
from mpc.identify.source import Source
from mpc.reports.figures import style
from mpc.reports.figures.style import CELSIUS, MEASURED, MUTED, SIMULATED, Picture, panel, picture, styled
from thermal._types import BoolArray, FloatArray

_KILO = 1000.0

#: Zones and machines that are drawn.
_DRAWN = 4


@styled
def error_pictures(found: Identified) -> list[Picture]:
    """Draw predictions a day ahead of the held-out days, one run a day after the other.

    Parameters
    ----------
    found : Identified
        Of a plant.
    """
    data, steps = found.data, round(86_400.0 / found.data.step)
    if len(data.zone) - steps <= found.split:
        return []
    starts = run_starts(data, steps, 86_400.0)
    starts = np.arange(found.split, len(data.zone) - steps + 1, steps)
    box = found.model.box
    made = predict(box, data, follow(box, data).states, starts, steps) - CELSIUS
    drawn = []
    for k, zone in enumerate(box.zones[:_DRAWN]):
        figure, axes = panel(9.0, 3.0, title=zone, ylabel="°C")
        stamps = pd.DatetimeIndex(found.telemetry.frame.index[found.split :])
        x = style.lines_over_time(axes, stamps)
        axes.plot(x, data.zone[found.split :, k] - CELSIUS, color=MEASURED, label="measured")
        for i, start in enumerate(starts - found.split):
            label = "predicted at midnight, model of all days" if i == 0 else None
            axes.plot(x[start : start + steps], made[i, :, k], color=SIMULATED, linewidth=1.1, label=label)
        style.keys_below(figure, 2)
        drawn.append(picture(figure, f"Measured and predicted temperature of {zone}"))
    return drawn


@styled
def map_pictures(found: Identified) -> list[Picture]:
    """Draw the map of each machine, or of the source of all, with its points: what is bought, and heat over that.

    Parameters
    ----------
    found : Identified
        Of a plant.
    """
    outdoor, bought = float(np.median(found.loads.outdoor)), found.telemetry.bought
    if (water := found.model.water) is not None:  # points as with the water that maps are told at
        supply = found.telemetry.bridged(found.telemetry.frame[water.sensor], np.nan)
        bought = bought - water.apart(found.loads.level, supply).sum(axis=1)
    if found.model.source is not None:
        return [_source_picture(found, found.model.source, outdoor, bought)]
    drawn = []
    for m, machine in list(enumerate(found.model.maps))[:_DRAWN]:
        own = found.telemetry.column(machine.machine.power) if machine.machine.power else bought
        emitter = float(np.median(found.loads.emitter[:, m]))
        level = found.loads.level[:, m]
        u = _line_of(level, 1.0)
        power = sum((curve(1.0, u, outdoor, emitter) for curve in machine.powers.values()), 0.0 * u)
        efficiency = np.array([machine.efficiency(float(part), outdoor, emitter) for part in u])
        seen = level, own, found.model.sign * found.data.heat[:, m]
        drawn.append(_map_picture(machine.machine.name, found.loads.outdoor, seen, (u, power, efficiency)))
    return drawn


def _source_picture(found: Identified, source: Source, outdoor: float, bought: FloatArray) -> Picture:
    """Draw what one source buys over the load of all its terminals."""
    model = found.model
    level = found.loads.level @ model.shares
    u = _line_of(level, source.full)
    power = source.at(u, outdoor).sum(axis=-1)
    base = sum(watts for kind, watts in model.base.items() if kind in source.powers)
    seen = level, bought - base, found.model.sign * found.data.heat.sum(axis=1)
    heat = u * float(model.led_heat.sum())
    return _map_picture("one source of all", found.loads.outdoor, seen, (u, power, heat / power))


def _line_of(level: FloatArray, end: float) -> FloatArray:
    """Choose loads at which a map is drawn, from the least that was seen on."""
    return np.linspace(max(float(np.min(level[_rows(level)], initial=end)), 0.02), end, 40)


def _rows(level: FloatArray) -> BoolArray:
    return np.asarray(np.isfinite(level) & (level > 1e-3))


def _map_picture(name: str, outdoor: FloatArray, seen: tuple[FloatArray, ...], line: tuple[FloatArray, ...]) -> Picture:
    """Draw power and efficiency over the load: points of load, power and heat; lines of load, power and efficiency."""
    rows = _rows(seen[0])
    level, power, heat = (values[rows] for values in seen)
    shade = outdoor[rows] - CELSIUS
    figure = Figure(figsize=(9.0, 3.4))
    left, right = figure.subplots(1, 2)
    points = left.scatter(level, power / _KILO, c=shade, s=9, cmap="viridis", label="measured")
    left.plot(line[0], line[1] / _KILO, color=SIMULATED, label="map at the median outdoor air")
    figure.suptitle(name, x=0.01, ha="left", fontsize=10)
    left.set(title="what is bought", xlabel="load [-]", ylabel="[kW]", ylim=(0.0, None))
    left.legend(fontsize=8)
    there = power > 0.02 * np.max(power, initial=1.0)
    right.scatter(level[there], heat[there] / power[there], c=shade[there], s=9, cmap="viridis")
    right.plot(line[0], line[2], color=SIMULATED)
    right.set(title="heat over what is bought", xlabel="load [-]", ylabel="[-]")
    top = float(np.quantile(np.concatenate([heat[there] / power[there], line[2]]), 0.98)) if there.any() else 1.0
    right.set_ylim(0.0, 1.3 * max(top, 0.1))
    figure.colorbar(points, ax=[left, right], label="outdoor air [°C]", fraction=0.04)
    return picture(figure, f"Power and efficiency of {name} over its load")


@styled
def course_pictures(found: Identified) -> list[Picture]:
    """Draw the telemetry: zones in their bands, loads and outdoor air.

    Parameters
    ----------
    found : Identified
        Of a plant.
    """
    frame, zones = found.telemetry.frame, found.model.box.zones
    figure = Figure(figsize=(10.0, 6.5))
    room, load, outdoor = figure.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [1.6, 1.0, 0.8]})
    x = style.lines_over_time(outdoor, pd.DatetimeIndex(frame.index), ticks=9)
    names = [(f"{z}/comfort_lower_temperature", f"{z}/comfort_upper_temperature") for z in zones]
    if all(name in frame for pair in names for name in pair):
        low = np.max([frame[a] for a, _ in names], axis=0) - CELSIUS
        high = np.min([frame[b] for _, b in names], axis=0) - CELSIUS
        room.fill_between(x, low, high, step="pre", color="#009E73", alpha=0.13, linewidth=0)
    for k in range(min(len(zones), _DRAWN)):
        room.plot(x, found.data.zone[:, k] - CELSIUS, linewidth=1.0, label=zones[k])
    room.set(title="Zones in their comfort band", ylabel="[°C]")
    for m, machine in list(enumerate(found.model.maps))[:_DRAWN]:
        load.step(x, found.loads.level[:, m], where="pre", linewidth=0.9, label=machine.machine.name)
    load.set(title="Loads; none while the plant's own control has a machine", ylabel="[-]")
    outdoor.plot(x, found.data.outdoor - CELSIUS, color=MUTED)
    outdoor.axvline(x[found.split], color=style.INK, linewidth=0.8, linestyle=":")
    outdoor.set(title="Outdoor air; days right of the dotted line were held out", ylabel="[°C]")
    for axes in (room, load):
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8)
    return [picture(figure, "Zone temperatures, loads and outdoor air over time")]
