"""Telemetry of a building that nobody measured: a plant under thermostats, through the eyes of its sensors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.building import FloorPlans
from thermal.case.plan import zone_floor_areas
from thermal.case.points import DISCHARGE_TEMPERATURE, OUTDOOR_TEMPERATURE, SUPPLY_FLOW, ZONE_TEMPERATURE
from thermal.case.telemetry import Telemetry
from thermal.errors import ThermalError
from thermal.pilot.thermostat import Terminals, Thermostats, draw_thermostats, size_terminals
from thermal.units import AIR_HEAT_CAPACITY

#: Is told the steps that are done and all steps [-].
Progress = Callable[[int, int], None]

HEATING_SETPOINT = "zone_air_heating_temperature_setpoint"
COOLING_SETPOINT = "zone_air_cooling_temperature_setpoint"
_FREEZING = 273.15  # K
_GAIN = 0.2  # of the design power per kelvin: 12 W/m2/K at 60 W/m2, stable at 5 minutes with the heat of the air alone
_INTEGRAL_TIME = 1800.0  # s
_INTEGRAL_RANGE = 1.0  # K, so that the recovery from a set-back does not wind it up
_RAMP_TIME = 1800.0  # s from nothing to design power, as valves and trim loops take it


class Plant(Protocol):
    """What steps a building: a simulator, or another model of it."""

    @property
    def step_seconds(self) -> float:
        """Length of a step [s]."""

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Names of the zones, in the order of its arrays."""

    def reset(self, zone_temperatures: FloatArray, /) -> FloatArray:
        """Start anew.

        Parameters
        ----------
        zone_temperatures : numpy.ndarray, shape (n_zone,)
            Air temperatures to start from [K].

        Returns
        -------
        numpy.ndarray, shape (n_zone,)
            Air temperatures of the zones [K].
        """

    def step(self, zone_heat: FloatArray, boundary_temperatures: FloatArray, /) -> FloatArray:
        """Go one step.

        Parameters
        ----------
        zone_heat : numpy.ndarray, shape (n_zone,)
            Heat that each zone receives during the step [W].
        boundary_temperatures : numpy.ndarray, shape (n_boundary,)
            Mean temperatures of what the building looks out on [K], outdoor first.

        Returns
        -------
        numpy.ndarray, shape (n_zone,)
            Mean air temperatures of the zones over the step [K].
        """


@dataclass(frozen=True)
class TelemetrySettings:
    """Seed, spin-up and sensors of generated telemetry.

    Parameters
    ----------
    seed : int
        Same seed, same thermostats, terminals and noise [-]; 0 or more.
    spin_up_days : float
        Length at the start of the weather that is simulated but not reported [d], 0 or more.
    station : str
        Entity that reports the weather.
    noise : float
        Standard deviation of the temperature sensors [K], 0 or more. Default as in the shared practice cases.
    resolution : float
        Steps of the temperature sensors [K], 0 or more; 0 reports every digit. Default as in the shared practice cases.

    Raises
    ------
    ThermalError
        When a number is negative.
    """

    seed: int = 0
    spin_up_days: float = 0.0
    station: str = "weather_station"
    noise: float = 0.03
    resolution: float = 0.02

    def __post_init__(self) -> None:
        if min(self.seed, self.spin_up_days, self.noise, self.resolution) < 0.0:
            found = f"{self.seed}, {self.spin_up_days} d, {self.noise} K and {self.resolution} K"
            raise ThermalError("telemetry", "seed, spin_up_days, noise and resolution of 0 or more", found)


def generate_telemetry(
    plant: Plant,
    plans: FloorPlans,
    weather: pd.DataFrame,
    settings: TelemetrySettings | None = None,
    *,
    thermostats: Thermostats | None = None,
    progress: Progress | None = None,
) -> Telemetry:
    """Run a plant under thermostats and report what its sensors see.

    Each step a thermostat compares its zone's last temperature with the schedule, and a proportional-integral loop asks
    its terminal unit for heat or cold, which comes at a limited rate. The unit's flow goes from its minimum to its
    design flow, its discharge temperature from 12 to 35 degC. The heat is constant over the step; the discharge
    temperature that is reported is the one that belongs to this heat at the zone's mean temperature over the step, so
    that the metered heat ``flow * 1006 * (discharge - zone)`` of a stamp is the heat that the plant received in its
    interval, but for sensor noise.

    Parameters
    ----------
    plant : Plant
        The building's model.
    plans : FloorPlans
        The building.
    weather : pandas.DataFrame
        Shape (n_time, n_point), columns ``<station>/<point>`` in SI units, tz-aware index at the ends of steps of the
        plant's length, as of `generate_weather`.
    settings : TelemetrySettings, optional
        Seed, spin-up and sensors.
    thermostats : Thermostats, optional
        Schedules in the order of the plant's zones; drawn by default.
    progress : callable, optional
        Called as ``progress(steps_done, steps)`` after every step.

    Returns
    -------
    Telemetry
        Of the weather station, unchanged, and of a device ``VAV_<zone>`` a zone: zone and discharge temperature, both
        setpoints [K], supply flow [kg/s] (of single precision, as building automation stores it).

    Raises
    ------
    ThermalError
        When plant, plans and weather do not fit each other, or the plant returns what is no temperature.
    """
    settings = settings or TelemetrySettings()
    skipped = _check(plant, plans, weather, settings)
    areas = zone_floor_areas(plans)
    floor_area = np.array([areas[zone] for zone in plant.zone_names])
    thermostats = thermostats or draw_thermostats(settings.seed, len(floor_area))
    terminals = size_terminals(settings.seed, floor_area)
    index = pd.DatetimeIndex(weather.index)
    setpoints = thermostats.setpoints(index - pd.Timedelta(seconds=plant.step_seconds))
    outdoor = weather[f"{settings.station}/{OUTDOOR_TEMPERATURE}"].to_numpy(dtype=float)
    temperature, flow, heat = _run(plant, terminals, outdoor, setpoints, progress)
    discharge = temperature + heat / (AIR_HEAT_CAPACITY * flow)
    rng = np.random.default_rng([settings.seed, 1])  # not the stream of the thermostats
    points: dict[str, FloatArray] = {
        ZONE_TEMPERATURE: _measured(rng, temperature, settings),
        SUPPLY_FLOW: flow.astype(np.float32).astype(float),
        DISCHARGE_TEMPERATURE: _measured(rng, discharge, settings),
        HEATING_SETPOINT: setpoints[0],
        COOLING_SETPOINT: setpoints[1],
    }
    names = [(k, zone, point) for k, zone in enumerate(plant.zone_names) for point in points]
    columns = {f"VAV_{zone}/{point}": points[point][:, k] for k, zone, point in names}
    frame = pd.concat([weather, pd.DataFrame(columns, index=index)], axis=1)
    return Telemetry.from_frame(frame.iloc[skipped:], where="generated telemetry")


def _run(
    plant: Plant,
    terminals: Terminals,
    outdoor: FloatArray,
    setpoints: tuple[FloatArray, FloatArray],
    progress: Progress | None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Close the loop: zone temperatures [K], supply flows [kg/s] and heats [W], each of shape (n_time, n_zone)."""
    heating, cooling = setpoints
    temperature, flow, heat = (np.empty_like(heating) for _ in range(3))
    zone = _temperatures(plant.reset(heating[0].copy()), heating.shape[1], "reset")
    integral = np.zeros((2, heating.shape[1]))  # heating, cooling [W]
    rate = plant.step_seconds / _INTEGRAL_TIME
    gain, ramp = _GAIN * terminals.design_heat, plant.step_seconds / _RAMP_TIME * terminals.design_heat
    demand = np.zeros(heating.shape[1])
    for k in range(len(outdoor)):
        error = np.stack([heating[k] - zone, zone - cooling[k]])
        growing = np.where(np.abs(error) <= _INTEGRAL_RANGE, rate * gain * error, 0.0)
        integral = np.clip(integral + growing, 0.0, terminals.design_heat)
        warm, cold = np.clip(gain * error + integral, 0.0, terminals.design_heat)
        demand = demand + np.clip(warm - cold - demand, -ramp, ramp)
        flow[k], heat[k] = terminals.supply(demand, zone)
        zone = _temperatures(plant.step(heat[k].copy(), outdoor[k : k + 1].copy()), len(zone), f"step {k}")
        temperature[k] = zone
        if progress is not None:
            progress(k + 1, len(outdoor))
    return temperature, flow, heat


def _temperatures(values: FloatArray, n_zone: int, where: str) -> FloatArray:
    """Refuse what a plant returns when it is not one temperature a zone."""
    zone = np.asarray(values, dtype=float)
    if zone.shape != (n_zone,) or not np.isfinite(zone).all():
        found = f"shape {zone.shape} with {int((~np.isfinite(zone)).sum())} that are not finite"
        raise ThermalError("plant", f"{n_zone} finite temperatures from {where}", found)
    return zone


def _measured(rng: np.random.Generator, temperature: FloatArray, sensors: TelemetrySettings) -> FloatArray:
    """Report what a sensor does [K]: with noise, in steps of its resolution counted from 0 degC."""
    celsius = temperature - _FREEZING + sensors.noise * rng.standard_normal(temperature.shape)
    if sensors.resolution > 0.0:
        celsius = sensors.resolution * np.round(celsius / sensors.resolution)
    return np.asarray(celsius + _FREEZING, dtype=float)


def _check(plant: Plant, plans: FloorPlans, weather: pd.DataFrame, settings: TelemetrySettings) -> int:
    """Refuse what does not fit; return the steps of the spin-up."""
    zones = {zone for floor in plans.floors for zone in floor.zone_names}
    strange = sorted(zones.symmetric_difference(plant.zone_names))
    ThermalError.unless(not strange, "plant", "the zones of the plans", f"a difference in {', '.join(strange[:5])}")
    column = f"{settings.station}/{OUTDOOR_TEMPERATURE}"
    if column not in weather or not isinstance(weather.index, pd.DatetimeIndex) or weather.index.tz is None:
        raise ThermalError(f"weather: expected a column {column!r} on a tz-aware index, found {list(weather)[:3]}")
    if not np.isfinite(weather[column].to_numpy(dtype=float)).all():
        raise ThermalError(f"weather: expected a value of {column!r} at every step, found gaps")
    steps = np.unique(np.diff(weather.index.as_unit("us").asi8) / 1e6)
    if not np.array_equal(steps, [plant.step_seconds]):
        raise ThermalError(f"weather: expected steps of the plant's {plant.step_seconds} s, found {steps[:3]} s")
    skipped = round(settings.spin_up_days * 86400.0 / plant.step_seconds)
    if len(weather) < skipped + 2:
        raise ThermalError(f"weather: expected at least {skipped + 2} steps with the spin-up, found {len(weather)}")
    return skipped
