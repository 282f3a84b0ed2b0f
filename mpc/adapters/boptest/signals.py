"""Signals of a plant by BOPTEST's conventions: names, units, ranges, values after a step, and forecast points."""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import chain, count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpc.adapters.boptest.scenario import PRICE_POINTS
from mpc.adapters.foreign import activation
from mpc.loop.actuators import DIFFERENTIAL_PRESSURE, STATIC_PRESSURE
from mpc.loop.conversion import SIGNAL_UNITS
from mpc.loop.history import PlantStep
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import ErrorGrowth
from mpc.scenario.rates import Rate
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, split_column
from thermal.system.system import HvacSystem

Metadata = dict[str, dict[str, Any]]

#: Outputs beside the sensors': true power of the whole plant, means over the plant's step that ends at their time [W].
ELECTRICITY_OUTPUT, GAS_OUTPUT = "reaPEle_y", "reaPGas_y"

_MEANINGS = {
    STATIC_PRESSURE: "setpoint of the supply air's static pressure",
    DIFFERENTIAL_PRESSURE: "setpoint of the heating water's differential pressure",
}

#: Names of the indicators that `GET /kpi` gives.
KPI_NAMES = ("cost_tot", "emis_tot", "ener_tot", "idis_tot", "pdih_tot", "pele_tot", "pgas_tot", "tdis_tot", "time_rat")

#: BOPTEST's names of weather, with unit, point of the case format, factor from the library's unit, and meaning.
WEATHER_NAMES: Mapping[str, tuple[str, str, float, str]] = {
    "TDryBul": ("K", "outside_air_temperature_sensor", 1.0, "Outdoor air temperature"),
    "HGloHor": ("W/m2", "global_horizontal_irradiance_sensor", 1.0, "Global irradiance on the horizontal"),
    "HDirNor": ("W/m2", "direct_normal_irradiance_sensor", 1.0, "Direct normal irradiance"),
    "HDifHor": ("W/m2", "diffuse_horizontal_irradiance_sensor", 1.0, "Diffuse irradiance on the horizontal"),
    "HHorIR": ("W/m2", "horizontal_infrared_irradiance_sensor", 1.0, "Infrared irradiance from the sky"),
    "winSpe": ("m/s", "wind_speed_sensor", 1.0, "Wind speed"),
    "winDir": ("rad", "wind_direction_sensor", float(np.pi / 180.0), "Direction that the wind comes from"),
}

#: BOPTEST's names of what each zone has, with unit, column of our forecasts, and meaning; a point is ``name[zone]``.
ZONE_NAMES: Mapping[str, tuple[str, str, str]] = {
    "LowerSetp": ("K", "comfort_lower_temperature", "Lower edge of the comfort band"),
    "UpperSetp": ("K", "comfort_upper_temperature", "Upper edge of the comfort band"),
    "Occupancy": ("number of people", "occupancy_count_sensor", "People expected"),
    "InternalGainsCon": ("W", "internal_gain", "Expected sensible heat of people, light and equipment into the air"),
    "InternalGainsLat": ("W", "", "Expected latent heat of people"),
}

#: BOPTEST's names of what the whole building pays and emits, with unit, column of our forecasts, and meaning.
SITE_NAMES: Mapping[str, tuple[str, str, str]] = {
    "PriceGasPower": ("{currency}/kWh", "gas_price", "Price of gas by its upper heating value"),
    "EmissionsElectricPower": ("kgCO2/kWh", "electricity_carbon_intensity", "Emissions of electricity, {carbon}"),
    "EmissionsGasPower": ("kgCO2/kWh", "gas_carbon_intensity", "Emissions of gas"),
}

# Irradiances, and what `thermal.inputs.sun.Sun` calls them.
_SUN = {
    "global_horizontal_irradiance_sensor": "horizontal",
    "direct_normal_irradiance_sensor": "normal",
    "diffuse_horizontal_irradiance_sensor": "diffuse",
}

#: Levels of ``temperature_uncertainty`` and ``solar_uncertainty``: the deviation at long leads as a share of that of
#: day-ahead weather prediction, assumed [-].
UNCERTAINTY: Mapping[str, float] = {"low": 0.5, "medium": 1.0, "high": 1.5}
_STREAM = 22  # of random numbers of a seed
# forecast points that may be uncertain: number of their random stream, and how their errors grow
_ERRORS = {"TDryBul": (11, ErrorGrowth(2.0, 24 * 3600.0)), "HGloHor": (3, ErrorGrowth(0.3, 6 * 3600.0))}


class ObservedPlant(SimulatedPlant):
    """A simulated plant that hands out the step it has just taken."""

    @property
    def last_step(self) -> PlantStep:
        """What the last step of the plant did."""
        return self._kept()[-1]

    @property
    def zone_temperature(self) -> FloatArray:
        """True temperatures of the zones now, shape (n_zone,) [K]."""
        air: FloatArray = self.loop.air
        return air


def _signal_names(names: Iterable[str]) -> dict[str, str]:
    """Make names of signals of names of points: letters, digits and underscores, each once.

    Parameters
    ----------
    names : iterable of str
        Such as ``ENTITY/POINT``.

    Returns
    -------
    dict of str to str
        Signal by point.

    Examples
    --------
    >>> _signal_names(["AHU 1/gas_power_sensor", "AHU-1/gas_power_sensor"])["AHU-1/gas_power_sensor"]
    'AHU_1_gas_power_sensor_2'
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = re.sub(r"\W+", "_", name)
        numbered = (f"{plain}_{k}" for k in count(2))
        found[name] = next(signal for signal in chain([plain], numbered) if signal not in taken)
        taken.add(found[name])
    return found


class PlantSignals:
    """What of a plant is seen and set through BOPTEST's API.

    Parameters
    ----------
    plant : SimulatedPlant
        Any run of it.

    Attributes
    ----------
    columns : tuple of str
        Of the plant's measurements.
    outputs : tuple of str
        Names of the measurements, ``<name>_y``.
    inputs : dict of str to Actuator
        By the name of the signal, ``<name>_u``.
    """

    def __init__(self, plant: SimulatedPlant) -> None:
        self.columns = plant.columns
        sensors = _signal_names(plant.columns)
        zones = _signal_names(plant.zone_names)
        self._zones = {f"reaTZon_{signal}_y": zone for zone, signal in zones.items()}
        self._sensors = {f"{signal}_y": column for column, signal in sensors.items()}
        self.outputs = (*self._sensors, *self._zones, ELECTRICITY_OUTPUT, GAS_OUTPUT)
        setters = _signal_names(actuator.name for actuator in plant.actuators)
        self.inputs = {f"{setters[actuator.name]}_u": actuator for actuator in plant.actuators}
        self.input_names = tuple(name for u in self.inputs for name in (u, activation(u)))
        self._reads = [_reader(a.name, plant.system, plant.zone_names) for a in plant.actuators]

    def measurement_metadata(self) -> Metadata:
        """Describe each output with its unit, as `GET /measurements` does."""
        found: Metadata = {}
        for name, column in self._sensors.items():
            kind = POINT_TYPES[split_column(column, "plant")[1]]
            found[name] = _entry(f"{column}: {kind.meaning}, mean over the last step", SIGNAL_UNITS[kind.quantity])
        for name, zone in self._zones.items():
            found[name] = _entry(f"Air temperature of zone {zone} at this time, without errors of sensors", "K")
        found[ELECTRICITY_OUTPUT] = _entry("Electric power of the whole plant, mean over the last step", "W")
        found[GAS_OUTPUT] = _entry("Gas power of the whole plant (upper heating value), mean over the last step", "W")
        return found

    def input_metadata(self) -> Metadata:
        """Describe each input with its unit and range, as `GET /inputs` does."""
        found: Metadata = {}
        for name, actuator in self.inputs.items():
            point = actuator.name.rpartition("/")[2]
            meaning = _MEANINGS.get(point) or POINT_TYPES[point].meaning
            found[name] = _entry(f"{actuator.name}: {meaning}", actuator.unit, actuator.lowest, actuator.highest)
            found[activation(name)] = _entry(f"Activation of {name}: 1 overwrites, 0 leaves the building's own", None)
        return found

    def output_values(self, seen: FloatArray, step: PlantStep | None, zones: FloatArray) -> list[float]:
        """Values of all outputs, in their order.

        Parameters
        ----------
        seen : ndarray, shape (n_column,)
            What the sensors say [library's units].
        step : PlantStep or None
            The last step; None before the first.
        zones : ndarray, shape (n_zone,)
            True temperatures now [K].
        """
        powers = [0.0, 0.0] if step is None else [float(step.done.electric_power), float(step.done.fuel_power)]
        return [*seen.tolist(), *zones.tolist(), *powers]

    def input_values(self, step: PlantStep) -> list[float]:
        """Values that the plant used in a step, in the order of the inputs: the building's own where not overwritten.

        Parameters
        ----------
        step : PlantStep
            The step.
        """
        return [float(read(step)) for read in self._reads]


def _entry(text: str, unit: str | None, lowest: float | None = None, highest: float | None = None) -> dict[str, Any]:
    return {"Unit": unit, "Description": text, "Minimum": lowest, "Maximum": highest}


def _reader(name: str, system: HvacSystem, zones: Sequence[str]) -> Any:
    """Find where a step holds the value of an actuator."""
    entity, _, kind = name.rpartition("/")
    if name in system.actuators:
        return lambda step: step.actions.get(name, system.defaults.get(name))
    zone = zones.index(entity)
    return lambda step: getattr(step.conditions, kind)[zone]


def forecast_metadata(points: Collection[str], zones: Sequence[str], currency: str, carbon: str) -> Metadata:
    """Describe each forecast point with its unit, as `GET /forecast_points` does.

    Parameters
    ----------
    points : collection of str
        Points of the weather station that are known.
    zones : sequence of str
        Names of the zones.
    currency : str
        Of prices.
    carbon : str
        Kind of electricity's emissions.
    """
    known = set(points)
    if "global_horizontal_irradiance_sensor" in known or known >= {*_SUN} - {"global_horizontal_irradiance_sensor"}:
        known |= {*_SUN}  # any two give the third, and the global one alone is split
    rows: dict[str, tuple[str, str]] = {
        name: (unit, f"{text}, mean from the time on")
        for name, (unit, point, _, text) in WEATHER_NAMES.items()
        if point in known
    }
    for kind, name in PRICE_POINTS.items():
        rows[name] = (f"{currency}/kWh", f"Price of electricity, {kind.replace('_', ' ')}")
    for name, (unit, _, text) in SITE_NAMES.items():
        rows[name] = (unit.format(currency=currency), text.format(carbon=carbon))
    for name, (unit, _, text) in ZONE_NAMES.items():
        rows |= {f"{name}[{zone}]": (unit, f"{text}, zone {zone}") for zone in zones}
    return {name: {"Unit": unit, "Description": text} for name, (unit, text) in rows.items()}


class BoundaryConditions:
    """Boundary conditions of a test's scenario, step by step.

    Parameters
    ----------
    scenario : Scenario
        That drives the plant.
    prices : mapping of str to Rate
        Of the scenarios.
    """

    def __init__(self, scenario: Scenario, prices: Mapping[str, Rate]) -> None:
        self._scenario, grid = scenario, scenario.grid
        self.prices = {kind: np.asarray(rate.on(grid), dtype=float) for kind, rate in prices.items()}
        self._known = scenario.to_frame(expected=True)
        self._known[[PRICE_POINTS[kind] for kind in self.prices]] = np.column_stack([*self.prices.values()])

    def series(self, name: str) -> FloatArray:
        """Values over the steps of the scenario, shape (n_steps,) [unit of the point].

        Parameters
        ----------
        name : str
            A forecast point of the case.
        """
        if name in WEATHER_NAMES:
            _, point, factor, _ = WEATHER_NAMES[name]
            weather = self._scenario.weather
            if point in _SUN and point not in weather.frame:
                return np.asarray(getattr(weather.sun, _SUN[point]), dtype=float)
            return factor * weather.values(point)
        kind, _, zone = name.removesuffix("]").partition("[")
        if kind == "InternalGainsLat":
            people = self._known[f"{zone}/{ZONE_NAMES['Occupancy'][1]}"].to_numpy(dtype=float)
            return self._scenario.heat.moisture_heat(people)
        column = f"{zone}/{ZONE_NAMES[kind][1]}" if zone else SITE_NAMES[name][1] if name in SITE_NAMES else name
        return self._known[column].to_numpy(dtype=float)

    def rows(self, seconds: FloatArray) -> tuple[NDArray[np.int64], bool]:
        """Find the steps that hold at some times; beyond the scenario those of the same hour of its last day.

        Parameters
        ----------
        seconds : ndarray, shape (n,)
            Since 1970 in UTC [s].

        Returns
        -------
        tuple
            Numbers of the steps, shape (n,), and whether any lies beyond the scenario.
        """
        grid = self._scenario.grid
        numbers = np.floor((seconds - grid.edges[0]) / grid.step + 1e-9).astype(np.int64)
        day = min(round(86_400.0 / grid.step), grid.n_steps)
        late = numbers >= grid.n_steps
        beyond = numbers[late] - grid.n_steps
        numbers[late] = grid.n_steps - day + beyond % day
        return numbers, bool(late.any())


def uncertain(name: str, values: FloatArray, level: str, seed: tuple[int, ...], interval: float) -> FloatArray:
    """Add the errors of an uncertain forecast of temperature or sun.

    Parameters
    ----------
    name : str
        ``TDryBul`` or ``HGloHor``.
    values : ndarray, shape (n,)
        The truth, from now on [unit of the point].
    level : str
        A key of `UNCERTAINTY`.
    seed : tuple of int
        Of the errors.
    interval : float
        Time between values [s].
    """
    stream, growth = _ERRORS[name]
    later = growth.path(np.random.default_rng([_STREAM, stream, *seed]), max(values.size - 1, 0), interval)
    errors = UNCERTAINTY[level] * np.concatenate([[0.0], later])[: values.size]
    return values + errors if name == "TDryBul" else values * np.maximum(1.0 + errors, 0.0)
