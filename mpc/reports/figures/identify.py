"""Figures of an identification: maps with their points, the days held out, and what was done."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from calibration.grey_box.fit import follow, predict, run_starts
from mpc.identify.identify import Identified
from mpc.identify.maps import MachineMap
from mpc.reports.figures import style
from mpc.reports.figures.style import CELSIUS, MEASURED, MUTED, SIMULATED, Picture, panel, picture, styled

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
    """Draw the map of each machine with its points: what is bought over the load, and heat over what is bought.

    Parameters
    ----------
    found : Identified
        Of a plant.
    """
    drawn, bought = [], found.telemetry.bought
    for m, machine in list(enumerate(found.model.maps))[:_DRAWN]:
        level = found.loads.level[:, m]
        rows = np.isfinite(level) & (level > 1e-3)
        figure = Figure(figsize=(9.0, 3.4))
        left, right = figure.subplots(1, 2)
        own = found.telemetry.column(machine.machine.power) if machine.machine.power else bought
        shade = found.loads.outdoor[rows] - CELSIUS
        points = left.scatter(level[rows], own[rows] / _KILO, c=shade, s=9, cmap="viridis", label="measured")
        u = np.linspace(max(float(np.min(level[rows], initial=1.0)), 0.02), 1.0, 40)
        outdoor = float(np.median(found.loads.outdoor))
        emitter = float(np.median(found.loads.emitter[:, m]))
        power = sum((curve(1.0, u, outdoor, emitter) for curve in machine.powers.values()), 0.0 * u)
        left.plot(u, power / _KILO, color=SIMULATED, label="map at the median outdoor air")
        figure.suptitle(machine.machine.name, x=0.01, ha="left", fontsize=10)
        left.set(title="what is bought", xlabel="load [-]", ylabel="[kW]", ylim=(0.0, None))
        left.legend(fontsize=8)
        _efficiency(right, machine, (u, outdoor, emitter), (level[rows], found.data.heat[rows, m], own[rows], shade))
        figure.colorbar(points, ax=[left, right], label="outdoor air [°C]", fraction=0.04)
        drawn.append(picture(figure, f"Power and efficiency of {machine.machine.name} over its load"))
    return drawn


def _efficiency(axes, machine: MachineMap, line, seen) -> None:  # type: ignore[no-untyped-def]
    """Heat over what is bought."""
    u, outdoor, emitter = line
    level, heat, bought, shade = seen
    there = bought > 0.02 * np.max(bought, initial=1.0)
    axes.scatter(level[there], heat[there] / bought[there], c=shade[there], s=9, cmap="viridis")
    values = [machine.efficiency(float(part), outdoor, emitter) for part in u]
    axes.plot(u, values, color=SIMULATED)
    axes.set(title="heat over what is bought", xlabel="load [-]", ylabel="[-]")
    top = float(np.quantile(np.concatenate([heat[there] / bought[there], values]), 0.98)) if there.any() else 1.0
    axes.set_ylim(0.0, 1.3 * max(top, 0.1))


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
