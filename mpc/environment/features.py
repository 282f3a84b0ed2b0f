"""What an observation is made of: its entries, each with a fixed physical range."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mpc.errors import MpcError
from mpc.loop.actuators import Actuator
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, split_column
from thermal.errors import describe, nearest
from thermal.units import QUANTITIES

#: Ends of the range that each point is counted in [library's units]; those of powers and air flows are per floor area
#: [W/m2] and [kg/s/m2], shared out among the devices that report them. An observation is -1 at the lower end and 1 at
#: the upper one. Temperatures of zones: the unoccupied band of BOPTEST's office; of the air handlers' and the boiler's
#: setpoints: the ranges of the actuators. Powers and flows: about the design loads that `thermal.pilot.size_system`
#: finds for offices.
OBSERVED_RANGES: Mapping[str, tuple[float, float]] = {
    "zone_air_temperature_sensor": (288.15, 303.15),
    "zone_air_heating_temperature_setpoint": (288.15, 303.15),
    "zone_air_cooling_temperature_setpoint": (288.15, 303.15),
    "supply_air_flowrate_sensor": (0.0, 0.01),
    "exhaust_air_flowrate_sensor": (0.0, 0.01),
    "discharge_air_temperature_sensor": (283.15, 323.15),
    "heating_power_sensor": (-60.0, 60.0),
    "supply_air_temperature_sensor": (280.15, 303.15),
    "supply_air_temperature_setpoint": (285.0, 300.0),
    "mixed_air_temperature_sensor": (273.15, 303.15),
    "return_air_temperature_sensor": (288.15, 303.15),
    "supply_water_temperature_sensor": (290.0, 355.0),
    "supply_water_temperature_setpoint": (310.0, 355.0),
    "return_water_temperature_sensor": (290.0, 355.0),
    "supply_air_damper_percentage_command": (0.0, 1.0),
    "heating_water_valve_percentage_command": (0.0, 1.0),
    "supply_fan_power_sensor": (0.0, 10.0),
    "electrical_power_sensor": (0.0, 40.0),
    "gas_power_sensor": (0.0, 100.0),
    "pump_power_sensor": (0.0, 2.0),
    "occupancy_count_sensor": (0.0, 0.1),
    "zone_air_co2_concentration_sensor": (4e-4, 2e-3),
    "outside_air_temperature_sensor": (263.15, 313.15),
    "wind_speed_sensor": (0.0, 15.0),
    "direct_normal_irradiance_sensor": (0.0, 1000.0),
    "diffuse_horizontal_irradiance_sensor": (0.0, 500.0),
    "global_horizontal_irradiance_sensor": (0.0, 1000.0),
    "horizontal_infrared_irradiance_sensor": (200.0, 450.0),
    "supply_air_static_pressure_setpoint": (0.0, 1000.0),
    "supply_air_static_pressure_sensor": (0.0, 1000.0),
    "differential_pressure_setpoint": (0.0, 150_000.0),
    "differential_pressure_sensor": (0.0, 150_000.0),
    "electricity_price": (0.0, 0.4),
    "gas_price": (0.0, 0.1),
    "electricity_carbon_intensity": (0.0, 1.0),
    "gas_carbon_intensity": (0.0, 1.0),
    "internal_gain": (0.0, 40.0),
    "comfort_lower_temperature": (288.15, 303.15),
    "comfort_upper_temperature": (288.15, 303.15),
}

#: Values are cut at this many times half of their range from its middle [-].
LARGEST = 4.0

_BY_AREA = ("air_flow", "power", "count")


@dataclass(frozen=True)
class Feature:
    """An entry of an observation.

    Parameters
    ----------
    name : str
        ``ENTITY/POINT``, or what it says of the forecast or the clock.
    unit : str
        Of the ends of its range.
    lowest, highest : float
        What counts as -1 and as 1 [unit].
    """

    name: str
    unit: str
    lowest: float
    highest: float


def measured_features(
    columns: Sequence[str],
    actuators: Sequence[Actuator],
    floor_area: float,
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> tuple[tuple[int, ...], tuple[Feature, ...]]:
    """Lay out what is observed of a plant's measurements.

    Directions (of the wind) have no range from low to high and are left out.

    Parameters
    ----------
    columns : sequence of str
        Of the plant's measurements, ``ENTITY/POINT``.
    actuators : sequence of Actuator
        Their own ranges hold for the setpoints that are measured.
    floor_area : float
        Of the building [m2].
    ranges : mapping of str to tuple of float, optional
        By point, or by column, in the place of `OBSERVED_RANGES` and as they are there [library's units].

    Returns
    -------
    tuple
        Positions among the columns, and a feature for each.

    Raises
    ------
    MpcError
        When the floor area or a range is none, or a range is for nothing that is measured.
    """
    points = [split_column(column, "plant")[1] for column in columns]
    given = dict(ranges or {})
    for name, (lowest, highest) in given.items():
        if name not in (known := {*points, *columns, *OBSERVED_RANGES}):
            advice = nearest(name, known)
            raise MpcError(describe("ranges", "a point that is observed", repr(name), advice))
        if not -np.inf < lowest < highest < np.inf:
            found = repr((lowest, highest))
            raise MpcError(describe(f"ranges: {name}", "a lower and a higher number", found))
    if not 0.0 < floor_area < np.inf:
        raise MpcError(describe("floor area", "a positive number of m2", repr(floor_area)))
    own = {a.name: (a.lowest, a.highest) for a in actuators if a.required}
    count, kept, features = Counter(points), [], []
    for at, (column, point) in enumerate(zip(columns, points, strict=True)):
        quantity = POINT_TYPES[point].quantity
        if quantity == "angle":
            continue
        per_device = floor_area / count[point] if quantity in _BY_AREA else 1.0
        default = own.get(column) or tuple(per_device * v for v in {**OBSERVED_RANGES, **given}[point])
        lowest, highest = given.get(column, default)
        kept.append(at)
        features.append(Feature(column, QUANTITIES[quantity].unit, lowest, highest))
    return tuple(kept), tuple(features)


def scaling(features: Sequence[Feature]) -> tuple[FloatArray, FloatArray]:
    """Factors and offsets that bring values into their ranges: ``factor * value + offset``.

    Parameters
    ----------
    features : sequence of Feature
        In the order of the values.

    Returns
    -------
    tuple of ndarray, shape (n_feature,)
        Factors [1/unit] and offsets [-].
    """
    lowest, highest = (np.array([getattr(f, end) for f in features], dtype=float) for end in ("lowest", "highest"))
    factor = 2.0 / (highest - lowest)
    return factor, -1.0 - factor * lowest
