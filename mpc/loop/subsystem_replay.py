"""Replay of a plant's sub-systems against a case's telemetry, to tell where a gap arises.

Each sub-system is driven by what was measured around it, so that a fault in one leaves the others alone: terminals by
their commands, supply air and water; air handlers by the air that comes back; the hot water by the heat that coils
took; zones by the metered heat.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from calibration.estimation.heat_balance import heat_balance
from calibration.evaluation.intervals import Interval
from mpc.errors import MpcError
from mpc.loop.hvac_replay import Gap, Measured, Replayed, replay_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.sensors import plant_devices
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.case.points import POINT_TYPES, split_column
from thermal.case.telemetry import Telemetry
from thermal.model.case_replay import LEAST_SPIN_UP, SPIN_UP, replay_inputs
from thermal.model.matrices import SymbolicModel
from thermal.system.system import HvacSystem

_HOUR = 3600.0
_SIGNIFICANT = 3.0  # times what noise alone makes


@dataclass(frozen=True)
class SubsystemGap:
    """How far one signal of a device is from what its model makes of what was measured around it.

    Parameters
    ----------
    subsystem : str
        ``terminal``, ``air handler``, ``hot water`` or ``zone``.
    device : str
        Name of the device, or of the zone.
    signal : str
        What is compared.
    unit : str
        Unit of the error.
    error, bias : float
        Root mean square and mean of model minus measurement [unit].
    heat : float
        The error as heat or power, root mean square of its hourly means [W].
    floor : float
        The part of it that sensor noise alone makes [W].
    size : float
        Root mean square of what the device handles [W].
    score : float
        Heat over what counts as none: three times the floor and the tolerance's share of the size [-]; above 1 is a
        gap.
    """

    subsystem: str
    device: str
    signal: str
    unit: str
    error: float
    bias: float
    heat: float
    floor: float
    size: float
    score: float


@dataclass(frozen=True)
class SubsystemReplay:
    """Gaps of all sub-systems of a case.

    Parameters
    ----------
    case : str
        Its name.
    gaps : tuple of SubsystemGap
        The widest first, by score.
    hours : int
        Hours that were compared.
    """

    case: str
    gaps: tuple[SubsystemGap, ...]
    hours: int

    @cached_property
    def located(self) -> tuple[SubsystemGap, ...]:
        """Gaps that are more than noise and tolerance, one a device, the widest first."""
        seen: dict[str, SubsystemGap] = {}
        for gap in self.gaps:
            if gap.score > 1.0:
                seen.setdefault(gap.device, gap)
        return tuple(seen.values())

    def table(self) -> pd.DataFrame:
        """All gaps, a row each, shape (n_gap, 10)."""
        return pd.DataFrame([vars(gap) for gap in self.gaps])

    @property
    def sentence(self) -> str:
        """Where the widest gap is, in words."""
        if not self.located:
            return f"{self.case}: no sub-system is off by more than noise and tolerance in {self.hours} hours"
        worst, rest = self.located[0], len(self.located) - 1
        more = f"; {rest} more device{'s' * (rest > 1)} with gaps" if rest else ""
        return (
            f"{self.case}: the {worst.subsystem} {worst.device} is off in its {worst.signal} by {worst.error:.3g} "
            f"{worst.unit} ({worst.heat:.3g} W; noise makes {worst.floor:.3g} W){more}"
        )


def replay_subsystems(
    case: Case,
    system: HvacSystem,
    model: SymbolicModel | None = None,
    theta: FloatArray | None = None,
    *,
    ventilation: FloatArray | float = 1.0,
    room: float = 293.15,
    noise: SensorNoise | None = None,
    tolerance: float = 0.1,
    seed: int = 0,
) -> SubsystemReplay:
    """Replay terminals, air handlers, hot water and zones of a case, each driven by what was measured around it.

    Parameters
    ----------
    case : Case
        Telemetry with setpoints, commands, water and air temperatures of the plant's devices, as a closed loop or
        `save_pilot` make it.
    system : HvacSystem
        What the plant is thought to be.
    model : SymbolicModel, optional
        What the building is thought to be, better reduced; without it zones are left out.
    theta : ndarray, shape (n_parameter,), optional
        Its parameter values [parameter units]; starts by default.
    ventilation : ndarray or float
        Share of the minimum of outdoor air that was asked for [-], shape (n_time,) or one.
    room : float
        Temperature of the plant room [K].
    noise : SensorNoise, optional
        Of the sensors; the defaults of `SensorNoise` by default. What it makes of each gap is found by adding it once
        more.
    tolerance : float
        Share of what a device handles that no model need get right [-], 0 to 1.
    seed : int
        Of that noise.

    Returns
    -------
    SubsystemReplay
        Gaps, and where the widest are.

    Raises
    ------
    MpcError
        When a point is missing, or the telemetry is shorter than a day.
    """
    MpcError.unless(0.0 <= tolerance <= 1.0, "replay: tolerance", "a share from 0 to 1", repr(tolerance))
    if len(case.stamps) * case.step < 2.0 * LEAST_SPIN_UP:
        raise MpcError("replay", "a day of telemetry or more", f"{len(case.stamps)} steps")
    devices = plant_devices(case.building, system)

    def parts(of: Case) -> list[Replayed]:
        measured = Measured(of.usable, devices, system, of.step)
        found = replay_plant(measured, system, devices, ventilation, room)
        return found if model is None else found + _zones(of, model, theta)

    with_noise = parts(_noisier(case, noise or SensorNoise(), seed))
    gaps = [_gap(one, again, case.step, tolerance) for one, again in zip(parts(case), with_noise, strict=True)]
    ranked = sorted(gaps, key=lambda gap: -gap.score)
    return SubsystemReplay(case.building.name, tuple(ranked), int(len(case.stamps) * case.step // _HOUR))


def _zones(case: Case, model: SymbolicModel, theta: FloatArray | None) -> list[Replayed]:
    """Heat that the zones lack in the model, by the hour."""
    values = model.network.start() if theta is None else np.asarray(theta, dtype=float)
    inputs = replay_inputs(case, model.network)
    # walls and slabs remember days: half of a short case goes into the spin-up
    begin = inputs.stamps[min(round(SPIN_UP / inputs.step), len(inputs) // 2)]
    balance = heat_balance(model, values, inputs, [Interval(begin, inputs.stamps[-1])])
    missing = balance.needed - balance.metered
    return [
        Replayed(Gap("zone", zone, "missing heat", "W"), missing[:, k], missing[:, k], balance.metered[:, k], True)
        for k, zone in enumerate(balance.zones)
    ]


def _noisier(case: Case, noise: SensorNoise, seed: int) -> Case:
    """Add the noise of sensors to a case once more."""
    rng, columns = np.random.default_rng([seed, 11]), {}
    frame = case.telemetry.frame
    for column in frame.columns:
        point, values = split_column(str(column), "telemetry")[1], frame[column].to_numpy(dtype=float)
        quantity, white = POINT_TYPES[point].quantity, rng.standard_normal(len(values))
        # a resolution of d is a uniform error of d / sqrt(12)
        absolute = np.hypot(noise.temperature, noise.resolution / np.sqrt(12.0))
        size = {"temperature": absolute, "air_flow": noise.flow * np.abs(values),
                "power": noise.power * np.abs(values)}.get(quantity, 0.0)  # fmt: skip
        columns[column] = values + size * white if point.endswith("_sensor") else values
    telemetry = Telemetry(pd.DataFrame(columns, index=frame.index), case.telemetry.step, case.telemetry.missing_rows)
    return Case(case.building, telemetry, judged=case.quality)


def _gap(one: Replayed, again: Replayed, step: float, tolerance: float) -> SubsystemGap:
    """Compare a replay with itself under more noise."""
    per_hour = 1 if one.hourly else max(1, round(_HOUR / step))
    heat, floor, size = (_rms(_hourly(v, per_hour)) for v in (one.heat, again.heat - one.heat, one.handled))
    least = float(np.hypot(_SIGNIFICANT * floor, tolerance * size))
    known = one.error[np.isfinite(one.error)]
    bias = float(known.mean()) if known.size else 0.0
    return SubsystemGap(*one.gap, _rms(one.error), bias, heat, floor, size, heat / max(least, 1e-9))


def _hourly(values: FloatArray, count: int) -> FloatArray:
    """Means of as many values; NaN where all are."""
    whole = values[: len(values) // count * count].reshape(-1, count)
    known = np.isfinite(whole)
    total = np.where(known, whole, 0.0).sum(axis=1)
    means: FloatArray = np.divide(total, known.sum(axis=1), out=np.full(len(whole), np.nan), where=known.any(axis=1))
    return means


def _rms(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0
