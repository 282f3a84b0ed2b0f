"""Maps of machines by regression: heat and what is bought, by command, outdoor air and the emitter's temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from calibration.estimation.state_space import REFERENCE
from mpc.identify.corrections import PowerCorrection, Reading
from mpc.identify.curves import EMITTER, OUTDOOR, Curve
from mpc.identify.limits import limits_of
from mpc.identify.machines import Machine, as_heated, pairs_as_heated
from mpc.identify.regression import IDLE, SAME, Loads, regress, regress_power
from thermal._types import FloatArray

#: How a machine is run: whole or not at all for parts of the time, at any part load, or by a zone's own controller.
Operation = Literal["duty", "modulated", "setpoint"]

#: Part loads at which efficiency is compared with that of full load [-], and what full load may be worse [-].
_PARTS, WORSE = (0.3, 0.5, 0.7), 0.02

#: Range of powers over those of a curve, less 1, that are believed [-].
_RATIOS = (-0.6, 2.0)


@dataclass(frozen=True)
class OwnPower:
    """What a machine's own sensor of power says.

    Parameters
    ----------
    curve : Curve
        Power beyond `idle` [W].
    idle : float
        Power while it gives nothing [W].
    readings : tuple of tuple of float
        Power over that of the curve [-], see `mpc.identify.corrections`.
    """

    curve: Curve
    idle: float
    readings: tuple[Reading, ...] = ()


@dataclass(frozen=True)
class MachineMap:
    """What a machine does.

    Parameters
    ----------
    machine : Machine
        Its actuator and sensors.
    operation : str
        ``duty``, ``modulated`` or ``setpoint``.
    heat : Curve
        Heat, or what stands for it where it is not measured [W].
    powers : mapping of str to Curve
        Of each kind that is bought [W].
    above : tuple of float
        Of a setpoint: how far it lies above the zone's air at no load and at full load, below it where it cools [K].
    limits : tuple of tuple of float
        Of a setpoint: outdoor air [K] and load [-] of steps at which no more heat was to be had.
    own : OwnPower or None
        Of its own sensor of power; None where it has none.
    """

    machine: Machine
    operation: Operation
    heat: Curve
    powers: Mapping[str, Curve]
    above: tuple[float, float] = (0.0, 0.0)
    limits: tuple[tuple[float, float], ...] = ()
    own: OwnPower | None = None

    def at(self, curve: Curve, u: Any, outdoor: Any, emitter: Any) -> Any:
        """Evaluate at a duty or load, for a controller: duty is a share of the time at full load [W].

        Parameters
        ----------
        curve : Curve
            Of heat or power.
        u : number, array or symbol
            Duty or load [-].
        outdoor, emitter : number, array or symbol
            Temperatures [K].
        """
        if self.operation == "duty":
            return u * curve(1.0, 1.0, outdoor, emitter)
        return curve.without_standing()(0.0, u, outdoor, emitter)

    @property
    def sheet(self) -> tuple[tuple[float, float], ...]:
        """Outdoor air [K] and largest load [-] of its data sheet; nothing where there is none."""
        full = float(self.at(self.heat, 1.0, OUTDOOR, EMITTER))
        return tuple((outdoor, heat / full) for outdoor, heat in self.machine.capacity)

    def correction(self) -> PowerCorrection:
        """Make what corrects its power, with what the telemetry that it was identified on says."""
        return PowerCorrection(() if self.own is None else self.own.readings, self.sheet)

    def ratio(self, power: float, u: float, outdoor: float, emitter: float) -> float:
        """Power that its own sensor says over that of the curve, less 1 [-]; NaN where nothing tells it.

        Of a machine that is run at full load or not at all a part load is none of its own.

        Parameters
        ----------
        power : float
            Of the sensor [W].
        u : float
            Duty or load [-].
        outdoor, emitter : float
            Temperatures [K].
        """
        if self.operation == "duty" and u < 1.0:
            return np.nan
        if self.own is None or (expected := float(self.at(self.own.curve, u, outdoor, emitter))) <= 0.0:
            return np.nan
        return float(np.clip((power - self.own.idle) / expected - 1.0, *_RATIOS))

    @property
    def standing(self) -> float:
        """Power at any speed above zero, of all that is bought [W]."""
        return float(sum(curve.coefficients.get("standing", 0.0) for curve in self.powers.values()))

    @property
    def rating(self) -> tuple[float, float]:
        """Outdoor air and emitter at which its efficiency is told [K]: 7 and 30 degC, or 33 and 20 where it cools."""
        sign = self.machine.sign
        return float(as_heated(OUTDOOR, sign)), EMITTER if sign > 0.0 else REFERENCE

    def efficiency(self, u: float, outdoor: float | None = None, emitter: float | None = None) -> float:
        """Heat over what is bought [-]; NaN of a machine that buys nothing that is metered.

        Parameters
        ----------
        u : float
            Load above 0 [-].
        outdoor, emitter : float, optional
            Temperatures, those of `rating` by default [K].
        """
        outdoor, emitter = outdoor or self.rating[0], emitter or self.rating[1]
        bought = sum(curve(1.0, u, outdoor, emitter) for curve in self.powers.values())
        return float(self.heat(1.0, u, outdoor, emitter) / bought) if bought > 0.0 else np.nan


def led_heat(maps: Sequence[MachineMap]) -> FloatArray:
    """Full heat of machines that are led by a setpoint, 0 of others, shape (n_machine,) [W].

    Parameters
    ----------
    maps : sequence of MachineMap
        Of a plant.
    """
    return np.array([float(m.at(m.heat, 1.0, OUTDOOR, EMITTER)) if m.operation == "setpoint" else 0.0 for m in maps])


def map_machines(
    machines: Sequence[Machine], loads: Loads, signals: FloatArray, bought: Mapping[str, FloatArray],
    above: FloatArray, per_day: int, own: Sequence[FloatArray | None] = (), reached: FloatArray | None = None,
) -> tuple[tuple[MachineMap, ...], dict[str, float]]:
    """Make the map of each machine.

    Parameters
    ----------
    machines : sequence of Machine
        Of the plant.
    loads : Loads
        Their loads.
    signals : ndarray, shape (n_time, n_machine)
        Heat, or what is bought in its place [W].
    bought : mapping of str to ndarray
        Power of each kind that the plant buys [W].
    above : ndarray, shape (n_time, n_machine)
        How far setpoints lie above the air of their zones, below it where they cool [K]; NaN of machines.
    per_day : int
        Steps of a day.
    own : sequence of ndarray or None
        What each machine's own sensor of power says, shape (n_time,) [W]; None of those without.
    reached : ndarray, shape (n_time, n_machine), optional
        What the hottest water would have given, see `SupplyWater.reached` [-]; the loads by default.

    Returns
    -------
    tuple of MachineMap
        In the order of the machines.
    dict of str to float
        Power of each kind that no machine explains [W].
    """
    everyone = range(len(machines))
    stops = [bool((loads.level[:, m] <= IDLE).any()) for m in everyone]
    heats = [regress(loads, signals[:, m], [m], base=stops[m])[0][0] for m in everyone]
    moves = {kind: values for kind, values in bought.items() if np.nanmax(values) - np.nanmin(values) > 1.0}
    powers = {kind: regress_power(loads, values, everyone, per_day) for kind, values in moves.items()}
    made = []
    for m, machine in enumerate(machines):
        found = MachineMap(machine, "setpoint", heats[m], {kind: curves[m] for kind, (curves, _) in powers.items()})
        if machine.role == "machine":
            made.append(replace(found, operation=_operation(found)))
        else:
            level, over = loads.level[:, m], above[:, m]
            gave = level if reached is None else reached[:, m]  # largest loads are those with the hottest water
            limits = limits_of(as_heated(loads.outdoor, machine.sign), gave, over)
            made.append(replace(found, above=_local(level, over), limits=pairs_as_heated(limits, machine.sign)))
    made = [
        found if power is None else _with_own(found, m, loads, power)
        for m, (found, power) in enumerate(zip(made, own or [None] * len(made), strict=True))
    ]
    return tuple(made), {kind: base for kind, (_, base) in powers.items()}


def _with_own(found: MachineMap, m: int, loads: Loads, power: FloatArray) -> MachineMap:
    """Add what its own sensor says, and where that lies beside the curve."""
    (curve,), idle = regress(loads, power, [m], base=bool((loads.level[:, m] <= IDLE).any()))
    found = replace(found, own=OwnPower(curve, idle))
    learned = found.correction()
    for k in np.flatnonzero(loads.known & np.isfinite(power)):
        u = float(loads.level[k, m])
        ratio = found.ratio(float(power[k]), u, float(loads.outdoor[k]), float(loads.emitter[k, m]))
        if np.isfinite(ratio):
            learned.learn(float(loads.outdoor[k]), u, ratio)
    return replace(found, own=OwnPower(curve, idle, learned.readings))


def _operation(found: MachineMap) -> Operation:
    """Full load for parts of the time where the machine is made for it, or where part load is not more efficient."""
    if found.machine.actuator.kind != "continuous":
        return "duty"
    best = max(found.efficiency(u) for u in _PARTS)
    return "duty" if found.efficiency(1.0) >= (1.0 - WORSE) * best and found.standing > 0.0 else "modulated"


def _local(level: FloatArray, above: FloatArray) -> tuple[float, float]:
    """How far a setpoint lies above its zone at no load and at full load, by a line through the steps in between."""
    between = np.isfinite(above) & (level > SAME) & (level < 1.0 - SAME)
    if between.sum() < 8 or np.ptp(level[between]) < 0.2:
        return 0.0, 1.0
    slope, zero = np.polyfit(level[between], above[between], 1)
    return float(zero), float(zero + max(slope, 0.0))
