"""Twin: a case made by the library's own model, with the truth beside it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from scipy.special import ndtr, ndtri

from thermal._types import FloatArray
from thermal.case.building import Building, FloorPlans
from thermal.case.case import Case
from thermal.case.plan import zone_floor_areas
from thermal.case.points import DISCHARGE_TEMPERATURE, OUTDOOR_TEMPERATURE, SUPPLY_FLOW, ZONE_TEMPERATURE
from thermal.case.telemetry import Telemetry
from thermal.errors import ThermalError
from thermal.model.simulator import Simulator
from thermal.network.build import build_network
from thermal.parameters import Parameter, Scope
from thermal.pilot.building import devices
from thermal.pilot.telemetry import Progress, TelemetrySettings, generate_telemetry
from thermal.pilot.thermostat import draw_prbs_thermostats, draw_thermostats
from thermal.pilot.weather import Period, draw_disturbance
from thermal.units import AIR_HEAT_CAPACITY


@dataclass(frozen=True)
class TwinRanges:
    """What a twin's unmeasured heat and sensors are drawn from, each log-uniformly between two values.

    Parameters
    ----------
    disturbance_deviation : tuple of float
        Stationary standard deviation of a zone's unmeasured heat per floor area [W/m2], 0 or more. The default goes
        from a well metered zone to an office whose people, plugs and sun nobody records.
    disturbance_time : tuple of float
        Its correlation time [s], positive. The default is half an hour (doors, meetings) to 8 hours (a working day).
    noise : tuple of float
        Standard deviation of the temperature sensors [K], 0 or more. The default goes from a calibrated probe to a wall
        thermostat.

    Raises
    ------
    ThermalError
        When a range is out of order, below its least value, or leads from zero to something.
    """

    disturbance_deviation: tuple[float, float] = (0.3, 3.0)
    disturbance_time: tuple[float, float] = (1800.0, 28800.0)
    noise: tuple[float, float] = (0.02, 0.1)

    def __post_init__(self) -> None:
        for name, (low, high) in vars(self).items():
            positive = low > 0.0 or (low == high == 0.0 and name != "disturbance_time")
            expected = "two positive numbers in order (or twice 0 for none)"
            ThermalError.unless(positive and low <= high < np.inf, f"ranges: {name}", expected, f"{low}, {high}")


@dataclass(frozen=True, eq=False)
class TwinTruth:
    """What is true of a twin, and what its telemetry does not say.

    Parameters
    ----------
    seed : int
        That it was made from.
    parameters : tuple of Parameter
        Of its model.
    theta : numpy.ndarray, shape (n_parameter,)
        Their true values [parameter units].
    disturbance_deviation : float
        Stationary standard deviation of the unmeasured heat per floor area [W/m2].
    disturbance_time : float
        Its correlation time [s].
    noise : float
        Standard deviation of the temperature sensors [K].
    resolution : float
        Steps of the temperature sensors [K], 0 for none.
    zone_temperatures : numpy.ndarray, shape (n_time, n_zone)
        Mean air temperatures over the steps of the telemetry [K].
    heat : numpy.ndarray, shape (n_time, n_zone)
        Heat that the terminal units brought into the air [W].
    disturbance : numpy.ndarray, shape (n_time, n_zone)
        Unmeasured heat that entered the air beside it [W].
    states : numpy.ndarray, shape (n_node,)
        Temperatures of all control volumes at the first stamp [K].
    """

    seed: int
    parameters: tuple[Parameter, ...]
    theta: FloatArray
    disturbance_deviation: float
    disturbance_time: float
    noise: float
    resolution: float
    zone_temperatures: FloatArray
    heat: FloatArray
    disturbance: FloatArray
    states: FloatArray

    @property
    def values(self) -> dict[str, float]:
        """True value of each parameter by name, as `Simulator` takes them [parameter units]."""
        return {p.name: float(value) for p, value in zip(self.parameters, self.theta, strict=True)}

    def to_dict(self) -> dict[str, Any]:
        """Give all but the series as plain types, for JSON; ``parameters`` is what `load_parameters` reads."""
        names = ("seed", "disturbance_deviation", "disturbance_time", "noise", "resolution")
        return {
            **{name: getattr(self, name) for name in names},
            "parameters": {name: {"value": value} for name, value in self.values.items()},
        }


#: How set-points move: by schedule with night set-back, or in a pseudo-random binary sequence [-].
Excitation = Literal["schedule", "prbs"]

#: What the discharge sensor of a twin reports: its own noise, or what makes the metered heat exact [-].
Meter = Literal["sensors", "exact"]

_DAY = 86400.0  # s
_THETA, _CONDITIONS = 2, 3  # streams of random numbers of a seed; the sensors have 1


@dataclass(frozen=True)
class TwinSettings(Period):
    """Period, model and sensors of a twin.

    Parameters
    ----------
    dx : float, optional
        Distance between control volumes [m]; the plan's cell size by default. Calibrate with the same.
    excitation : {"schedule", "prbs"}
        Set-points with night set-back (`draw_thermostats`), or in a pseudo-random sequence (`draw_prbs_thermostats`).
    fixed : mapping of str to float
        Parameters that are not drawn, with their values [parameter units].
    scopes : mapping of str to {"global", "zone"}, optional
        Parameters with one value a zone.
    ranges : TwinRanges
        Of the unmeasured heat and of the sensor noise.
    meter : {"sensors", "exact"}
        What the discharge sensor reports, see the notes of `generate_twin`.
    resolution : float
        Steps of the temperature sensors [K], 0 or more; 0 reports every digit.
    start : str
        As in `Period`; by default a Monday in winter.
    days, spin_up_days : float
        As in `Period` [d].
    step_seconds : float
        As in `Period` [s].

    Raises
    ------
    ThermalError
        When an option is unknown.
    """

    start: str = "2023-01-09"
    days: float = 21.0
    spin_up_days: float = 7.0
    dx: float | None = None
    excitation: Excitation = "schedule"
    fixed: Mapping[str, float] = field(default_factory=dict)
    scopes: Mapping[str, Scope] | None = None
    ranges: TwinRanges = TwinRanges()
    meter: Meter = "sensors"
    resolution: float = 0.0

    def __post_init__(self) -> None:
        for name, options in (("excitation", get_args(Excitation)), ("meter", get_args(Meter))):
            ThermalError.unless_known(getattr(self, name), options, name, f"one of {', '.join(options)}")


class _DisturbedPlant:
    """A simulator that receives the unmeasured heat as well, and remembers what it did and received."""

    def __init__(self, simulator: Simulator, disturbance: FloatArray, outdoor_at_start: float, skipped: int) -> None:
        self._simulator, self._disturbance, self._outdoor = simulator, disturbance, outdoor_at_start
        self._skipped, self.step_seconds, self.zone_names = skipped, simulator.step_seconds, simulator.zone_names
        self.heat: list[FloatArray] = []
        self.temperatures: list[FloatArray] = []
        self.states: FloatArray = np.empty(0)

    def reset(self, zone_temperatures: FloatArray, /) -> FloatArray:
        # walls between the zones and the season's outdoor air, not as warm as the zones all through
        return self._simulator.reset(zone_temperatures, np.array([self._outdoor]))

    def step(self, zone_heat: FloatArray, boundary_temperatures: FloatArray, /) -> FloatArray:
        number = len(self.heat)
        zone = self._simulator.step(zone_heat + self._disturbance[number], boundary_temperatures)
        self.heat.append(zone_heat)
        self.temperatures.append(zone)
        if number == self._skipped:
            self.states = self._simulator.states
        return zone


def generate_twin(
    building: Building,
    seed: int = 0,
    settings: TwinSettings | None = None,
    *,
    progress: Progress | None = None,
) -> tuple[Case, TwinTruth]:
    """Make telemetry of a building under thermostats, with parameters drawn from their priors, and keep the truth.

    The plant is the grid model that calibration fits, by implicit Euler at the telemetry's step. θ is drawn normally on
    the estimation scale, with each parameter's `prior_deviation` about its start, within its physical range. Beside the
    heat of its terminal unit each zone receives an autocorrelated heat (`draw_disturbance`) that no sensor sees: only
    the temperatures show it, and through them the thermostats.

    Parameters
    ----------
    building : Building
        With floor plans. A VAV terminal a zone takes the place of its devices; its `airflows` are left out.
    seed : int
        Same seed, same twin; 0 or more. Weather, set-points, θ, disturbance and sensors all come from it.
    settings : TwinSettings, optional
        Period, model and sensors.
    progress : callable, optional
        Called as ``progress(steps_done, steps)`` after every step.

    Returns
    -------
    tuple of Case and TwinTruth
        What a user would have, and what is true.

    Raises
    ------
    ThermalError
        When the building has no floor plans.
    ModelError
        When a fixed parameter is not of this building.
    ThermalError
        When a length is out of range.

    Notes
    -----
    Heat is metered as ``flow * 1006 * (discharge - zone)`` of the temperatures that are *reported* (`Case.zone_heat`).
    With ``meter="sensors"`` both sensors have noise of their own, as in a real building: the heat that entered the air
    is `TwinTruth.heat`, and the metered heat is off by ``flow * 1006 * (e_discharge - e_zone)``, white and without
    bias. With ``meter="exact"`` the discharge sensor is off by as much as the zone's, so that the metered heat of a
    stamp is exactly the heat that entered the air, whatever the noise. The flow is reported as it was, but for its
    single precision.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> case, truth = generate_twin(load_bundled_case().building, 3, TwinSettings(days=1.0, spin_up_days=1.0, dx=1.0))
    >>> case.zone_heat().shape == truth.heat.shape
    True
    """
    at, plans, station = settings or TwinSettings(), building.geometry, building.weather_station
    if not isinstance(plans, FloorPlans):
        advice = "its terminal units are sized by floor plans"
        raise ThermalError(f"building {building.name!r}", "floor plans", "a zone table", advice)
    twin = replace(building, name=f"{building.name}_twin_{seed}", devices=devices(plans), airflows=())
    weather = at.weather(seed, building.location, station)
    parameters = build_network(twin, dx=at.dx, scopes=at.scopes).parameters
    values = _draw_values(seed, parameters) | dict(at.fixed)
    deviation, time_constant, noise = _draw_conditions(seed, at.ranges)
    floor_areas = zone_floor_areas(plans)
    areas = np.array([floor_areas[zone] for zone in twin.zone_names])
    disturbance = draw_disturbance(seed, len(weather), deviation * areas, time_constant, at.step_seconds)
    outdoor = weather[f"{station}/{OUTDOOR_TEMPERATURE}"].iloc[: round(_DAY / at.step_seconds)].mean()
    skipped = round(at.spin_up_days * _DAY / at.step_seconds)
    simulator = Simulator(twin, values, at.step_seconds, dx=at.dx, scopes=at.scopes)
    plant = _DisturbedPlant(simulator, disturbance, float(outdoor), skipped)
    draw = draw_prbs_thermostats if at.excitation == "prbs" else draw_thermostats
    sensors = TelemetrySettings(seed, at.spin_up_days, station, noise, at.resolution)
    thermostats = draw(seed, len(areas))
    telemetry = generate_telemetry(plant, plans, weather, sensors, thermostats=thermostats, progress=progress)
    heat = np.array(plant.heat[skipped:])
    truth = TwinTruth(
        seed=seed,
        parameters=parameters,
        theta=simulator.theta,
        disturbance_deviation=deviation,
        disturbance_time=time_constant,
        noise=noise,
        resolution=at.resolution,
        zone_temperatures=np.array(plant.temperatures[skipped:]),
        heat=heat,
        disturbance=disturbance[skipped:],
        states=plant.states,
    )
    metered = telemetry if at.meter == "sensors" else _metered_exactly(telemetry, plant.zone_names, heat)
    return Case(twin, metered), truth


def _draw_values(seed: int, parameters: tuple[Parameter, ...]) -> dict[str, float]:
    """Draw each parameter from its prior, cut at its physical range [parameter units]."""
    shares = np.random.default_rng([seed, _THETA]).uniform(size=len(parameters))
    values = {}
    for p, share in zip(parameters, shares, strict=True):
        centre, spread = p.transform(p.start), p.prior_deviation
        low, high = (ndtr((p.transform(bound) - centre) / spread) for bound in (p.lower, p.upper))
        drawn = p.inverse(centre + spread * float(ndtri(low + share * (high - low))))
        values[p.name] = float(np.clip(drawn, p.lower, p.upper))
    return values


def _draw_conditions(seed: int, ranges: TwinRanges) -> tuple[float, float, float]:
    """Draw deviation [W/m2] and correlation time [s] of the unmeasured heat, and the sensors' noise [K]."""
    limits = (ranges.disturbance_deviation, ranges.disturbance_time, ranges.noise)
    shares = np.random.default_rng([seed, _CONDITIONS]).uniform(size=len(limits))
    pairs = zip(limits, shares, strict=True)
    first, second, third = (low if low == high else low * (high / low) ** share for (low, high), share in pairs)
    return float(first), float(second), float(third)


def _metered_exactly(telemetry: Telemetry, zones: tuple[str, ...], heat: FloatArray) -> Telemetry:
    """Report the discharge temperatures [K] that belong to the heat and to what the other sensors report."""
    frame = telemetry.frame.copy()
    for number, zone in enumerate(zones):
        flow, air = frame[f"VAV_{zone}/{SUPPLY_FLOW}"], frame[f"VAV_{zone}/{ZONE_TEMPERATURE}"]
        frame[f"VAV_{zone}/{DISCHARGE_TEMPERATURE}"] = air + heat[:, number] / (AIR_HEAT_CAPACITY * flow)
    return replace(telemetry, frame=frame)
