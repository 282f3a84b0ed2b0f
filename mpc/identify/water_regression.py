"""What telemetry says of a source's supply water: its course, and what a kelvin of it is worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import pandas as pd

from mpc.errors import PlantError
from mpc.identify.curves import OUTDOOR, PER, interval_of
from mpc.identify.limits import RUNS
from mpc.identify.machines import Machine, as_heated
from mpc.identify.regression import Loads, curve_of, design_of, least_squares, left_out_error
from mpc.identify.source import LEAST, source_design
from mpc.identify.telemetry import SET, PlantTelemetry, Site
from mpc.identify.water import LATELY, STORED, WATER, SupplyWater, sensor_of, stored
from mpc.loop.actuators import Actuator
from thermal._types import BoolArray, FloatArray

#: Share of the steps in which water has to have been told for its worth to be known [-]: a plant's own reset is a
#: function of the weather, which bends what is bought by itself.
_TOLD = 0.1

#: Steps with the plant's own setpoint that a line over outdoor air takes at least.
_FEWEST = 8


def decided_water(site: Site, machines: Sequence[Machine]) -> Actuator | None:
    """Give the setpoint of supply water where it is decided: with setpoints of all zones whose heat has a meter.

    Zones that nobody controls here would be left with the water of the others.

    Parameters
    ----------
    site : Site
        Of the plant.
    machines : sequence of Machine
        That are controlled.
    """
    fitting = all(machine.role == "setpoint" and machine.heat for machine in machines)
    served = {zone for machine in machines for zone in machine.serves}
    return site.water if fitting and served >= set(site.areas) else None


@dataclass(frozen=True, eq=False)
class WaterCourse:
    """Supply water over telemetry.

    Parameters
    ----------
    actuator : Actuator
        Its setpoint.
    water : ndarray, shape (n_time,)
        Measured [K]; NaN in long gaps.
    setpoint : ndarray, shape (n_time,)
        As it was told, else as the plant has it [K]; NaN where nothing says it.
    moved : ndarray of bool, shape (n_time,)
        Whether it was told.
    """

    actuator: Actuator
    water: FloatArray
    setpoint: FloatArray
    moved: BoolArray

    @classmethod
    def of(cls, telemetry: PlantTelemetry, machines: Sequence[Machine]) -> Self | None:
        """Read it; None where no water is decided.

        Parameters
        ----------
        telemetry : PlantTelemetry
            Of the plant.
        machines : sequence of Machine
            That are controlled.

        Raises
        ------
        PlantError
            When the water is not measured.
        """
        actuator, frame = decided_water(telemetry.site, machines), telemetry.frame
        if actuator is None:
            return None
        sensor = sensor_of(actuator.name)
        PlantError.unless(
            sensor in frame, f"telemetry: {sensor}", "the temperature of the source's water", "none",
            f"add it to `measurements`, or leave {actuator.name} out of `source`",
        )  # fmt: skip
        nothing = np.full(len(frame), np.nan)
        told, has = (
            frame[column].to_numpy(dtype=float) if column in frame else nothing
            for column in (f"{SET}{actuator.name}", actuator.name)
        )
        moved = np.isfinite(told)
        water = telemetry.bridged(frame[sensor], np.nan)
        return cls(actuator, water, np.where(moved, told, has), moved)

    def lately(self, step: float, sign: float) -> FloatArray:
        """Hottest water of the last hour, the coldest where it cools, shape (n_time,) [K].

        Parameters
        ----------
        step : float
            Of the telemetry [s].
        sign : float
            As of `SupplyWater` [-].
        """
        course = pd.Series(as_heated(self.water, sign)).rolling(max(round(LATELY / step), 1) + 1, min_periods=1)
        return np.asarray(as_heated(course.max().to_numpy(), sign))


def find_water(
    course: WaterCourse, telemetry: PlantTelemetry, machines: Sequence[Machine], loads: Loads,
    bought: Mapping[str, FloatArray],
) -> SupplyWater | None:  # fmt: skip
    """Find what a kelvin of supply water costs; None where hotter water costs no more, or nothing tells.

    Parameters
    ----------
    course : WaterCourse
        Of the telemetry.
    telemetry : PlantTelemetry
        In which the water's setpoint was moved.
    machines : sequence of Machine
        Terminals.
    loads : Loads
        Of the machines [-].
    bought : mapping of str to ndarray
        Power of each kind that the plant buys, shape (n_time,) [W].
    """
    if course.moved.mean() < _TOLD:
        return None
    sign, water = machines[0].sign, course.water
    full = np.array([machine.full(telemetry) for machine in machines])
    total, warmed = loads.level @ (full / full.sum()), stored(water, sign)
    rows = loads.known & np.isfinite(total) & np.isfinite(water) & np.isfinite(warmed)
    middle = float(np.average(water[rows], weights=total[rows]))
    hotter = (as_heated(water, sign) - as_heated(middle, sign)) / PER
    beyond, per_day = loads.outdoor - float(np.median(loads.outdoor)), round(86_400.0 / telemetry.step)
    designs = [source_design(total[:, None], np.ones(1), beyond, least) for least in LEAST]
    designs.append(design_of(loads, range(len(machines))))
    powers = {}
    for kind, values in bought.items():
        told = [np.column_stack([design, warmed, total * hotter]) for design in designs]
        design = min(told, key=lambda columns: left_out_error(columns, values, per_day))
        seen = rows & np.isfinite(values)
        found, deviations = least_squares(design[seen], values[seen])
        powers[kind] = curve_of([*[""] * (design.shape[1] - 2), STORED, WATER], found, deviations)
    powers = {kind: curve for kind, curve in powers.items() if interval_of(curve, WATER)[0] > 0.0}
    if not powers:
        return None
    low = as_heated(course.setpoint, sign) - as_heated(water, sign)
    held = rows & (total > RUNS) & np.isfinite(low) & (np.abs(warmed) < 1.0 / PER)
    below = float(np.median(low[held])) if held.any() else 0.0
    shares, actuator = tuple((full / full.sum()).tolist()), course.actuator
    hottest = actuator.highest if sign > 0.0 else actuator.lowest
    return SupplyWater(actuator, sign, shares, powers, middle, _own(course, telemetry, middle), hottest, below)


def _own(course: WaterCourse, telemetry: PlantTelemetry, middle: float) -> tuple[float, float]:
    """Setpoint of the plant itself over outdoor air: a line through the steps in which it had the water."""
    has = np.where(np.isfinite(course.setpoint), course.setpoint, course.water)
    free = np.isfinite(has) & ~course.moved
    if free.sum() < _FEWEST:
        return middle, 0.0
    slope, level = np.polyfit(telemetry.outdoor[free] - OUTDOOR, has[free], 1)
    return float(level), float(slope)
