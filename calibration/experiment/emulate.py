"""Telemetry of an experiment before it is carried out: days of the past as they would have been with its setpoints.

The weather and the use are those of measured days. A member's model says what the zones' temperatures and the metered
heat would be where terminals follow the setpoints within the heat that they were seen to give.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.experiment.members import Member
from calibration.experiment.schedule import STATIC_PRESSURE, SUPPLY_AIR, Schedule
from thermal._types import FloatArray
from thermal.case.commands import air_column
from thermal.case.emitters import is_heater
from thermal.case.points import HEATING_POWER, SUPPLY_FLOW
from thermal.inputs.provider import HVAC_INPUTS, InputProvider, telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.model.case_replay import Inputs, replay_inputs, spin_up
from thermal.model.step import Stepper
from thermal.units import AIR_HEAT_CAPACITY
from thermal.units import REFERENCE_TEMPERATURE as _REFERENCE

#: Share of the time in which a zone's heat is below what counts as the most that its terminal gives [-].
_MOST = 0.99

#: Heat of a zone per floor area below which its terminal does not work [W/m2].
_IDLE = 0.5

#: Times that signals made of the metered heat follow the heat that they change: the third changes it by under 1 %
#: where they are a third of it, the most that a meter is off.
_TIMES = 3

#: Share of its largest flow from which a terminal brings air [-], as for `valve_leak`.
_RUNS = 0.02

#: Inputs that no experiment changes.
_UNMOVED = frozenset({
    "sun", "sky", "wind", "usual", "occupancy", "at_home", "through_windows", "occupancy_rate", "outdoor_rate",
})  # fmt: skip

#: Bins of a zone's heat by which its terminal's flow is known.
_BINS = 24


@dataclass(frozen=True)
class Emulated:
    """Days of the past with an experiment's setpoints.

    Parameters
    ----------
    drivers : InputProvider
        Inputs of effects, from the spin-up on.
    zone, heat : ndarray, shape (n_time, n_zone)
        Temperatures [K] and metered heat [W] of the experiment's steps.
    """

    drivers: InputProvider
    zone: FloatArray
    heat: FloatArray


class Emulator:
    """Emulates experiments on some measured days.

    Parameters
    ----------
    models : ModelComparison
        The case.
    start : Timestamp
        When the days begin that an experiment is put on.
    hours : float
        Their length [h].
    """

    def __init__(self, models: ModelComparison, start: pd.Timestamp, hours: float) -> None:
        self.models, self.start, self.hours = models, start, hours
        end = start + pd.Timedelta(hours=hours)
        before = pd.Timedelta(seconds=models.settings.spin_up_seconds)
        self.case = models.case.slice(start - before, end)
        self.first = int(self.case.stamps.searchsorted(start, side="right"))
        self.stamps = self.case.stamps[self.first :]
        self.zones = models.case.building.zone_names
        self.measured = self.case.zone_temperatures().interpolate(limit_direction="both").to_numpy(dtype=float)
        self.heat = (
            self.case.zone_heat_estimated().interpolate(limit_direction="both").fillna(0.0).to_numpy(dtype=float)
        )
        self.base = telemetry_inputs(self.case, models.drivers.normalisation)
        self._replays: dict[str, Inputs] = {}
        self.device = {zone: self._device(zone) for zone in self.zones}
        areas = {name: room.floor_area for name, room in models.anatomy.rooms.items()}
        self._usual_of: dict[str, Emulated] = {}
        self.idle = _IDLE * np.array([areas[z] for z in self.zones])

    def _device(self, zone: str) -> tuple[str, str, str] | None:
        """Columns of the flow and discharge temperature of a zone's terminal, or twice that of its power."""
        building, columns = self.models.case.building, set(self.models.case.telemetry.frame.columns)
        for device in building.devices_of(zone):
            flow, power = f"{device.name}/{SUPPLY_FLOW}", f"{device.name}/{HEATING_POWER}"
            discharge = air_column(building, device, columns)
            if flow in columns and discharge in columns:
                return device.name, flow, str(discharge)
            if power in columns:
                return device.name, power, power
        return None

    @property
    def movable(self) -> tuple[str, ...]:
        """Zones whose heat a terminal gives and a meter tells."""
        known = np.isfinite(self.measured).all(axis=0)
        return tuple(z for z, seen in zip(self.zones, known, strict=True) if seen and self.device[z] is not None)

    @cached_property
    def _whole(self) -> tuple[FloatArray, pd.DataFrame]:
        return self.models.case.zone_heat().to_numpy(dtype=float), self.models.case.usable

    @cached_property
    def capacity(self) -> tuple[FloatArray, FloatArray]:
        """Least and most heat that each zone was given, shape (n_zone,) each [W]."""
        heat = np.nan_to_num(self._whole[0])
        low, high = (np.quantile(heat, q, axis=0) for q in (1.0 - _MOST, _MOST))
        return np.minimum(low, 0.0), np.maximum(high, 0.0)

    @cached_property
    def flows(self) -> Mapping[str, tuple[FloatArray, FloatArray]]:
        """Heat [W] and flow [kg/s] of each air terminal, in order of the heat."""
        heat, frame = self._whole
        found = {}
        for i, zone in enumerate(self.zones):
            device = self.device[zone]
            if device is None or device[1].endswith(HEATING_POWER):
                continue
            pair = np.column_stack([heat[:, i], frame[device[1]].to_numpy(dtype=float)])
            pair = pair[np.isfinite(pair).all(axis=1)]
            parts = np.array_split(pair[np.argsort(pair[:, 0], kind="stable")], _BINS)
            centres = np.array([np.median(part, axis=0) for part in parts if len(part)])
            found[zone] = centres[:, 0], centres[:, 1]
        return found

    def run(self, member: Member, schedule: Schedule) -> Emulated:
        """Emulate an experiment in a building that is as a member's model is.

        What the member's model changes by with the schedule is added to what was measured: where it errs in usual
        operation, telemetry has told that already. Without moves the telemetry is as it was.

        Parameters
        ----------
        member : Member
            Its model.
        schedule : Schedule
            Of the experiment, which begins with these days.
        """
        zone, heat = self.measured[self.first :], self.heat[self.first :]
        if not schedule.moves:
            return self._with(zone, heat, schedule)
        if member.effect not in self._usual_of:
            self._usual_of[member.effect] = self._raw(member, replace(schedule, moves=()))
        usual, made = self._usual_of[member.effect], self._raw(member, schedule)
        low, high = self.capacity
        changed = np.clip(heat + made.heat - usual.heat, np.minimum(low, heat), np.maximum(high, heat))
        return self._with(zone + made.zone - usual.zone, changed, schedule)

    def _raw(self, member: Member, schedule: Schedule) -> Emulated:
        """Telemetry by a member's model alone."""
        asked = schedule.setpoints(self.stamps, self.case.step, self.zones)
        network = member.fit.built.network
        made = self._with(self.measured[self.first :], self.heat[self.first :], schedule)
        follows = any(HVAC_INPUTS & set(s.inputs) for s in network.signals)
        for _ in range(_TIMES if follows else 1):
            made = self._with(*self._closed(member, self.inputs(member, made), asked), schedule)
        if follows:  # with the signals of this heat, for a signal that jumps settles on nothing
            inputs = self.inputs(member, made)
            made = self._with(*self._closed(member, inputs, asked, made.heat), schedule)
        return made

    def _closed(
        self, member: Member, inputs: Inputs, asked: FloatArray, given: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Temperatures and heat where terminals follow setpoints, or of given heat, with the signals as they are."""
        fit, first = member.fit, self.first
        matrices = fit.model.matrices(fit.theta)
        before = np.array([first - 1])
        usual_inputs = replace(inputs, held=self.case.zone_temperatures().ffill().bfill().to_numpy(dtype=float))
        states, _ = spin_up(matrices, usual_inputs, 0, before)
        # signals are counted from the reference temperature, as differences of temperatures are
        states, boundary = states - _REFERENCE * matrices.uniform[:, None], inputs.boundary - _REFERENCE
        stepper, n = Stepper(matrices, inputs.step, fit.settings.stepping), len(self.zones)
        unit = np.hstack([np.zeros((n, 1)), np.eye(n)])
        emitted = fit.built.network.emitted  # goes with the heat, which is to be found
        first_signal = boundary.shape[1] - len(emitted)
        boundary[:, first_signal:][:, emitted.any(axis=1)] = 0.0
        low, high = self.capacity
        moved = np.isfinite(asked[:, :, 0])
        still = np.array([z not in self.movable for z in self.zones])
        zone, heat = np.empty((len(asked), n)), np.empty((len(asked), n))
        for k in range(len(asked)):
            row = first + k
            columns, outside = np.repeat(states, n + 1, axis=1), np.repeat(boundary[row][:, None], n + 1, axis=1)
            outside[first_signal:, 1:] += 1000.0 * emitted
            ends, means, _, _ = stepper.advance(
                columns, outside, 1000.0 * unit,
                np.repeat(inputs.airflow[row][:, None], n + 1, axis=1) if inputs.airflow.shape[1] else None,
            )  # fmt: skip
            seen = np.asarray(matrices.output @ ends) + _REFERENCE
            alone, gain = seen[:, 0], (seen[:, 1:] - seen[:, :1]) / 1000.0
            usual = self.heat[row]
            pair = np.where(moved[k][:, None], asked[k], self.measured[row][:, None])
            idle = (~moved[k] & (np.abs(usual) < self.idle)) | still
            q = (
                given[k]
                if given is not None
                else _followed(
                    alone, gain, pair, np.minimum(low, usual), np.maximum(high, usual), np.where(idle, usual, np.nan)
                )
            )
            states = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) @ q[:, None] / 1000.0
            zone[k] = _REFERENCE + means[:, 0] + (means[:, 1:] - means[:, :1]) @ q / 1000.0
            heat[k] = q
        return zone, heat

    def _of_handlers(self, schedule: Schedule, handlers: list[str], point: str) -> FloatArray | None:
        """Setpoint of the air handlers on the steps, NaN where it is as usual, shape (n_time,) [K] or [Pa]."""
        if not any(m.point == point for m in schedule.moves):
            return None
        values = schedule.setpoints(self.stamps, self.case.step, handlers, point)[:, :, 0]
        return np.asarray(
            np.where(np.isfinite(values).any(axis=1), np.nanmax(np.nan_to_num(values, nan=-1.0), axis=1), np.nan)
        )

    def inputs(self, member: Member, made: Emulated) -> Inputs:
        """Give the inputs of a member's replay of emulated telemetry.

        Parameters
        ----------
        member : Member
            Its model.
        made : Emulated
            The telemetry.
        """
        network = member.fit.built.network
        if member.effect not in self._replays:
            self._replays[member.effect] = replay_inputs(self.case, network, self.base)
        base, rows = self._replays[member.effect], slice(self.first, None)
        zone, bridged, held, boundary = (v.copy() for v in (base.zone, base.bridged, base.held, base.boundary))
        for series in (zone, bridged, held):
            series[rows] = np.where(np.isfinite(series[rows]), made.zone, np.nan)
        if network.signals:
            boundary[:, -len(network.signals) :] = _REFERENCE + signal_values(network.signals, made.drivers)
        told, airflow = made.drivers.series, base.airflow
        return replace(
            base, zone=zone, bridged=bridged, held=held, boundary=boundary, heat=told["heat"],
            airflow=told["airflow"] if airflow.shape[1] else airflow,
        )  # fmt: skip

    def _with(self, zone: FloatArray, heat: FloatArray, schedule: Schedule) -> Emulated:
        """Make inputs that tell of given temperatures and heat."""
        building, rows, base = self.case.building, slice(self.first, None), self.base
        handlers = [d.name for d in building.devices if d.type == "ahu"]
        levels = [self._of_handlers(schedule, handlers, point) for point in (SUPPLY_AIR, STATIC_PRESSURE)]
        names = ("heat", "supply_flow", "supply_heat", "airflow")
        made = {name: base.series[name].copy() for name in names}
        made["heat"][rows] = heat
        if "emitted" in base.series:
            made["emitted"] = base.series["emitted"].copy()
            for number, device in enumerate(building.devices):
                if is_heater(device) and device.zone not in self.flows:
                    i = building.zone_names.index(str(device.zone))
                    beside = len(building.devices_of(str(device.zone)))
                    made["emitted"][rows, number] += (heat[:, i] - self.heat[rows, i]) / beside
        for i, name in enumerate(self.zones):
            if name in self.flows:
                own = made["supply_flow"][rows, i].copy()
                rate = self._rate(i, own, zone[:, i], heat[:, i], *levels)
                made["supply_flow"][rows, i] = rate
                made["supply_heat"][rows, i] += heat[:, i] - self.heat[rows, i]
                for k, airflow in enumerate(building.airflows):
                    if airflow.device == self.device[name][0]:  # type: ignore[index]
                        made["airflow"][rows, k] += airflow.fraction * (rate - own)
        drivers = InputProvider(building, base.stamps, base.step, {**base.series, **made}, base.normalisation)
        kept = {key: value for key, value in vars(base).items() if key in _UNMOVED}
        vars(drivers).update(kept)
        return Emulated(drivers, zone, heat)

    def _rate(
        self, i: int, own: FloatArray, zone: FloatArray, heat: FloatArray, warmer: FloatArray | None,
        pressure: FloatArray | None,
    ) -> FloatArray:  # fmt: skip
        """Flow of a zone's terminal that gives some heat, from what it was with the measured one [kg/s]."""
        levels, flows = self.flows[self.zones[i]]
        most = max(float(flows.max()), 1e-6)
        least = float(flows[flows > _RUNS * most].min(initial=most))
        rate = np.where(np.abs(heat - self.heat[self.first :, i]) > 1.0, np.interp(heat, levels, flows), own)
        rate = np.where(own > _RUNS * most, np.maximum(rate, least), rate)  # what runs brings air, called or not
        if pressure is not None:  # dampers are open as far as they go, and flow falls with the root of the pressure
            columns = [c for c in self.case.telemetry.frame if str(c).endswith(f"/{STATIC_PRESSURE}")]
            usual = float(self.case.telemetry.frame[columns].median().median())
            rate = np.where(np.isfinite(pressure), np.minimum(rate, most * np.sqrt(pressure / usual)), rate)
        if warmer is not None:
            needed = -heat / AIR_HEAT_CAPACITY / np.maximum(zone - warmer, 1.0)
            rate = np.where(np.isfinite(warmer) & (heat < -self.idle[i]), np.minimum(needed, most), rate)
        return np.asarray(np.where(np.abs(heat) > 1.0, np.maximum(rate, 0.05 * most), rate))


def _followed(
    alone: FloatArray, gain: FloatArray, pair: FloatArray, low: FloatArray, high: FloatArray, fixed: FloatArray
) -> FloatArray:
    """Heat by which zones come within their setpoints at the end of a step, as far as their terminals can, (n_zone,).

    Parameters
    ----------
    alone : ndarray, shape (n_zone,)
        Temperatures without heat [K].
    gain : ndarray, shape (n_zone, n_zone)
        What heat adds to them [K/W].
    pair : ndarray, shape (n_zone, 2)
        Heating and cooling setpoints [K].
    low, high : ndarray, shape (n_zone,)
        Least and most heat [W].
    fixed : ndarray, shape (n_zone,)
        Heat of zones that follow nothing [W], NaN for the others.
    """
    heat = np.where(np.isfinite(fixed), fixed, 0.0)
    free, own = ~np.isfinite(fixed), np.diag(gain)
    for _ in range(3):  # zones hardly heat each other within a step
        for i in np.flatnonzero(free):
            rest = float(alone[i] + gain[i] @ heat - own[i] * heat[i])
            target = min(max(rest, pair[i, 0]), pair[i, 1])
            heat[i] = min(max((target - rest) / own[i], low[i]), high[i])
    return heat
