"""From telemetry to a model: loads, maps of the machines, grey box, and how well it predicts days it has not seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from calibration.grey_box.fit import GreyBoxData, fit_grey_box, follow
from calibration.grey_box.judge import LeadError, judge
from calibration.grey_box.network import GreyBox
from mpc.errors import PlantError
from mpc.identify.air_handler import find_air_handler, told_by_whole_steps, with_powers
from mpc.identify.curves import EMITTER
from mpc.identify.machines import Machine, as_heated, check_terminals, pairs_as_heated
from mpc.identify.maps import led_heat, map_machines
from mpc.identify.model import PlantModel
from mpc.identify.regression import Loads
from mpc.identify.shared import out_of_reach, shared_of
from mpc.identify.source import find_source
from mpc.identify.telemetry import CARRIERS, SET, PlantTelemetry
from mpc.identify.water import SupplyWater
from mpc.identify.water_regression import WaterCourse, find_water
from thermal._types import FloatArray
from thermal.case.points import ZONE_TEMPERATURE
from thermal.units import from_si

Progress = Callable[[str, int, int], None]

#: Share of the days that is held out for judging, two at least [-]; shortest telemetry for that [d], and for a fit.
_HELD_OUT, _FEWEST = 0.25, 3.0


@dataclass(frozen=True, eq=False)
class Identified:
    """A model and what is known of it.

    Parameters
    ----------
    model : PlantModel
        Fitted to all telemetry.
    telemetry : PlantTelemetry
        That it was fitted to.
    data : GreyBoxData
        Its inputs and zone temperatures.
    loads : Loads
        Loads of the machines.
    errors : tuple of LeadError
        On the last days, of a fit to the days before.
    split : int
        First held-out step.
    notes : tuple of str
        What was assumed, in words.
    """

    model: PlantModel
    telemetry: PlantTelemetry
    data: GreyBoxData
    loads: Loads
    errors: tuple[LeadError, ...]
    split: int
    notes: tuple[str, ...]


def identify(telemetry: PlantTelemetry, machines: Sequence[Machine], progress: Progress | None = None) -> Identified:
    """Identify a plant.

    Parameters
    ----------
    telemetry : PlantTelemetry
        Of its own control, or of an excitation.
    machines : sequence of Machine
        Actuators that are to be controlled.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    PlantError
        When there is too little telemetry, or nothing tells what the machines did.
    """
    days = len(telemetry.frame) * telemetry.step / 86_400.0
    PlantError.unless(days >= _FEWEST, "identify", f"{_FEWEST:g} days of telemetry at least", f"{days:.3g}")
    machines = [_measured(machine, telemetry) for machine in machines]
    if telemetry.site.capacity:
        check_terminals(machines, telemetry.site.areas)
    above = _above(telemetry, machines)
    handler, machines, lost = find_air_handler(telemetry, machines, above)
    data = _data(telemetry, machines, lost)
    suns = tuple(telemetry.suns)
    serves = {machine.name: machine.serves for machine in machines}
    metered = tuple(bool(machine.meter) for machine in machines)
    start = GreyBox.start(telemetry.site.areas, suns, serves, metered)
    held = round(max(2.0, _HELD_OUT * days) * 86_400.0 / telemetry.step)
    split = len(data.zone) - held
    begin, errors = start, list[LeadError]()
    if split * telemetry.step >= _FEWEST * 86_400.0:
        begin = fit_grey_box(start, data.rows(0, split), progress)
        errors = judge(begin, data, split)
    box = fit_grey_box(begin, data, progress)
    loads = _loads(telemetry, machines, data, box)
    signals = np.column_stack([machine.signal(telemetry) for machine in machines])
    bought = {name: telemetry.column(name) for name in CARRIERS if name in telemetry.frame}
    if handler is not None:
        runs = handler.share(np.column_stack([telemetry.column(machine.air[0]) for machine in machines]))
        handler, bought = with_powers(handler, telemetry, machines, bought, runs)
        above = told_by_whole_steps(runs, above)
    own = [telemetry.column(m.power) if m.power and m.meter else None for m in machines]
    per_day = round(86_400.0 / telemetry.step)
    course = WaterCourse.of(telemetry, machines)
    water = None if course is None else find_water(course, telemetry, machines, loads, bought)
    reached = loads.level if course is None else _reached(course, water, telemetry, machines, loads)
    if course is not None and water is not None:
        part = water.apart(loads.level, course.water)
        bought = {kind: values - part[:, CARRIERS.index(kind)] for kind, values in bought.items()}
    maps, base = map_machines(machines, loads, signals, bought, above, per_day, own, reached)
    told = course is not None or bool(telemetry.site.capacity)
    source, left = find_source(loads, bought, maps, per_day, told=told)
    if source is not None:
        rest = [{kind: curve for kind, curve in m.powers.items() if kind not in source.powers} for m in maps]
        maps = tuple(replace(m, powers=powers) for m, powers in zip(maps, rest, strict=True))
    sign, law = machines[0].sign, np.array([found.above[1] for found in maps])
    alone, wanted = [pairs_as_heated(found.limits, sign) for found in maps], out_of_reach(above, law)
    outdoor = as_heated(loads.outdoor, sign)
    if course is not None:  # cold water is no limit of its source
        lacks = ~course.moved if water is None else water.missed(course.setpoint, course.water)
        wanted &= lacks[:, None]
    whole = float(np.maximum(led_heat(maps), 0.0).sum())
    sheet = tuple((at, heat / whole) for at, heat in telemetry.site.capacity)
    held_back = shared_of(
        led_heat(maps), telemetry.step, outdoor, loads.level, wanted, alone, pairs_as_heated(sheet, sign)
    )
    notes = _notes(telemetry, machines, suns) + _water_notes(telemetry, machines, course, water)
    shared = pairs_as_heated(held_back, sign)
    of = box, maps, base | left, shared, source, sheet, water, handler
    model = PlantModel(telemetry.site.name, telemetry.step, *of)
    return Identified(model, telemetry, data, loads, tuple(errors), split, notes)


def _measured(machine: Machine, telemetry: PlantTelemetry) -> Machine:
    """Leave out a sensor of heat that a machine which cools does not move: it is that of what heats the zone."""
    if machine.sign > 0.0 or not machine.meter or machine.signal(telemetry).max() > 1.0:
        return machine
    PlantError.unless(
        machine.power, f"telemetry: {machine.meter}", "negative heat while the zone is cooled", "none below -1 W",
        "measure what its cooling takes, or name the cooling's power in `measurements`",
    )  # fmt: skip
    return replace(machine, heat="", air=())


def _data(telemetry: PlantTelemetry, machines: Sequence[Machine], lost: FloatArray) -> GreyBoxData:
    """Collect the inputs of the grey box, with heat of an air handler's own air to the zones, (n_time, n_zone) [W]."""
    sun = np.column_stack([*telemetry.suns.values()]) if telemetry.suns else np.empty((len(telemetry.frame), 0))
    heat = np.column_stack([machine.sign * machine.signal(telemetry) for machine in machines])
    return GreyBoxData(telemetry.step, telemetry.zone, telemetry.outdoor, sun, heat, telemetry.gain + lost)


def _loads(telemetry: PlantTelemetry, machines: Sequence[Machine], data: GreyBoxData, box: GreyBox) -> Loads:
    """Collect loads, with the temperatures of the emitters as the grey box has them."""
    states = follow(box, data).states[:-1]
    level = np.column_stack([machine.level(telemetry) for machine in machines])
    emitter = box.emitter(states)
    first = round(86_400.0 / telemetry.step)  # the filter's start
    emitter[:first] = emitter[first : 2 * first].mean(axis=0) if len(emitter) > 2 * first else EMITTER
    if machines[0].sign < 0.0:  # what cools blows air: of its water a floor tells nothing
        emitter[:] = EMITTER
    return Loads(level, data.outdoor, emitter)


def _reached(
    course: WaterCourse, water: SupplyWater | None, telemetry: PlantTelemetry, machines: Sequence[Machine], loads: Loads
) -> FloatArray:
    """Give loads that tell what terminals have, with the hottest water or the plant's own; NaN where none does."""
    if water is None:
        return np.where(course.moved[:, None], np.nan, loads.level)
    names = [f"{machine.serves[0]}/{ZONE_TEMPERATURE}" for machine in machines]
    air = np.column_stack([telemetry.bridged(telemetry.frame[name], np.nan) for name in names])
    lately = course.lately(telemetry.step, water.sign)
    return water.reached(loads.level, course.water[:, None], air, lately[:, None])


def _water_notes(
    telemetry: PlantTelemetry, machines: Sequence[Machine], course: WaterCourse | None, water: SupplyWater | None
) -> tuple[str, ...]:
    """Say why supply water that could be decided is left to the plant."""
    setpoint = telemetry.site.water
    if setpoint is None or water is not None:
        return ()
    why = "no setpoints of all zones with heat meters are controlled"
    if course is not None:
        why = f"it was told in {course.moved.mean():.0%} of the steps, which does not tell that hotter water costs more"
        why = why if machines[0].sign > 0.0 else why.replace("hotter", "colder")
    return (f"{setpoint.name} is left to the plant: {why}",)


def _above(telemetry: PlantTelemetry, machines: Sequence[Machine]) -> FloatArray:
    """How far setpoints lie above the air at the ends of the steps, below it of cooling, (n_time, n_machine) [K]."""
    columns, zones, names = [], telemetry.zone, list(telemetry.site.areas)
    for machine in machines:
        set_to = telemetry.frame.get(f"{SET}{machine.name}")
        measured = telemetry.frame.get(machine.name)
        value = set_to if set_to is not None and set_to.notna().any() else measured
        mean = pd.Series(zones[:, names.index(machine.serves[0])], index=telemetry.frame.index)
        zone = 0.5 * (mean + mean.shift(-1))
        if machine.role == "setpoint" and value is not None:
            columns.append(machine.sign * (value - zone).to_numpy(dtype=float))
        else:
            columns.append(np.full(len(zone), np.nan))
    return np.column_stack(columns)


def _notes(telemetry: PlantTelemetry, machines: Sequence[Machine], suns: Sequence[str]) -> tuple[str, ...]:
    notes = []
    for machine in machines:
        if machine.air:
            cold = machine.supply
            beyond = "" if cold is None else f" beyond {float(from_si(cold, 'degC', 'temperature')):.1f} degC"
            notes.append(f"heat of {machine.name} is that of its supply air{beyond}, {machine.meter}")
        if not machine.meter:
            notes.append(f"no heat of {machine.name} is measured: it is counted in watts of what is bought at 7 degC")
        told = [telemetry.frame[c] for c in (f"{SET}{machine.name}", machine.name) if c in telemetry.frame]
        if machine.role == "machine" and all(values.isna().all() for values in told):
            notes.append(f"no command of {machine.name} was recorded: its load is the share of the largest heat seen")
    if not suns:
        notes.append("no irradiance is known: the sun is part of the unmeasured heat")
    if not telemetry.gain.any():
        notes.append("no people are forecast: their heat is part of the unmeasured heat")
    return tuple(notes)
