"""Air-to-water heat pumps and chillers as EnergyPlus' ``HeatPump:PlantLoop:EIR``, whose curves follow a stated law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from energyplus_trials.frame import Objects

_RATED = (35.0, 7.0)  # degC, supply water and outdoor air, as EN 14511 rates for low temperature
_LIFT = 5.0  # K between water and condensation, and between air and evaporation: usual of plate and finned coils
_WATER, _AIR = (20.0, 60.0), (-20.0, 20.0)  # degC, ranges of the curves


@dataclass(frozen=True)
class HeatPump:
    """A heat pump at its rating point, water at 35 and air at 7 degC.

    Parameters
    ----------
    capacity : float
        Full capacity [W].
    cop : float
        Coefficient of performance at full capacity [-].
    standing : float
        Share of the full power that is drawn whatever the compressor's speed, by outdoor fan, oil heater, inverter and
        electronics [-]; between an inverter machine at its best (0.1) and BOPTEST's house with a heat pump (0.5).
    minimum : float
        Smallest part load [-]; below it cycles.
    per_air : float
        What a kelvin of outdoor air adds to the capacity, of that at the rating point [1/K].
    per_water : float
        What a kelvin of supply water adds [1/K].
    """

    capacity: float
    cop: float
    standing: float = 0.3
    minimum: float = 0.25
    per_air: float = 0.022
    per_water: float = -0.006

    def curves(self) -> dict[str, np.ndarray]:
        """Coefficients of capacity and electric input over water and air, EnergyPlus' order of ``Curve:Biquadratic``.

        The capacity is linear in both. The electric input per heat is that of a constant share of Carnot's efficiency
        between condensation and evaporation, fitted by least squares over the ranges of the curves.
        """
        return _fitted(self.at, (self.per_water, self.per_air), _per_heat)

    @property
    def at(self) -> tuple[tuple[float, float], ...]:
        """Water and air of the rating point, and ranges of water and of air [degC]."""
        return _RATED, _WATER, _AIR

    def sheet(self, water: float) -> list[list[float | str]]:
        """Return the most heat over outdoor air, or cold, from the rows of a data sheet [degC, W].

        Parameters
        ----------
        water : float
            That is supplied [degC].
        """
        (rated_water, rated_air), _, (low, high) = self.at
        rows: list[list[float | str]] = []
        for air in (low, 0.5 * (low + high), high):  # the capacity is linear
            share = 1.0 + self.per_air * (air - rated_air) + self.per_water * (water - rated_water)
            rows.append([f"{air:g} degC", round(self.capacity * share, -2)])
        return rows

    def part_load(self) -> tuple[float, float, float]:
        """Coefficients of the electric input per heat over part load, EnergyPlus' order of ``Curve:Exponent``.

        EnergyPlus multiplies the heat that is given by it: a standing share s of the full power needs 1 - s + s / PLR.
        """
        return 1.0 - self.standing, self.standing, -1.0


@dataclass(frozen=True)
class Chiller(HeatPump):
    """A chiller in outdoor air at its rating point, water at 7 and air at 35 degC (EN 14511); parameters of `HeatPump`.

    Parameters
    ----------
    per_air : float
        What a kelvin of outdoor air adds to the capacity, of that at the rating point [1/K].
    per_water : float
        What a kelvin of supply water adds [1/K].
    """

    per_air: float = -0.009
    per_water: float = 0.03

    def curves(self) -> dict[str, np.ndarray]:
        """As of a heat pump, of the cold that it gives."""
        return _fitted(self.at, (self.per_water, self.per_air), _per_cold)

    @property
    def at(self) -> tuple[tuple[float, float], ...]:
        """Water and air of the rating point, and ranges of water and of air [degC]."""
        return (7.0, 35.0), (4.0, 15.0), (5.0, 45.0)


def _fitted(
    at: tuple[tuple[float, float], ...], slopes: tuple[float, float],
    per: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> dict[str, np.ndarray]:  # fmt: skip
    """Fit biquadratics of capacity and electric input over water and air."""
    rated, *ranges = at
    water, air = (a.ravel() for a in np.meshgrid(*(np.linspace(*ends, 21) for ends in ranges)))
    terms = np.column_stack([np.ones_like(water), water, water**2, air, air**2, water * air])
    capacity = 1.0 + slopes[1] * (air - rated[1]) + slopes[0] * (water - rated[0])
    values = {"capacity": capacity, "input": per(water, air) / per(np.array(rated[0]), np.array(rated[1]))}
    return {name: np.linalg.lstsq(terms, value, rcond=None)[0] for name, value in values.items()}


def _per_cold(water: np.ndarray, air: np.ndarray) -> np.ndarray:
    """Electric input per heat that is taken, of an ideal machine [-]."""
    return np.asarray((air - water + 2.0 * _LIFT) / (water - _LIFT + 273.15))


def _per_heat(water: np.ndarray, air: np.ndarray) -> np.ndarray:
    """Electric input per heat, of an ideal machine [-]."""
    return np.asarray((water - air + 2.0 * _LIFT) / (water + _LIFT + 273.15))


def heat_pump(name: str, machine: HeatPump, flow: float) -> Objects:
    """Return the machine, its curves and its outdoor node; water nodes are ``NAME in`` and ``NAME out``.

    Parameters
    ----------
    name : str
        Of the machine.
    machine : HeatPump
        What it can.
    flow : float
        Of water [m3/s].
    """
    curves: dict[str, dict[str, Any]] = {}
    for what, values in machine.curves().items():
        keys = ("coefficient1_constant", "coefficient2_x", "coefficient3_x_2", "coefficient4_y", "coefficient5_y_2",
                "coefficient6_x_y")  # fmt: skip
        curves[f"{name} {what}"] = dict(zip(keys, (float(round(v, 9)) for v in values), strict=True)) | dict(
            zip(("minimum_value_of_x", "maximum_value_of_x", "minimum_value_of_y", "maximum_value_of_y"),
                (*machine.at[1], *machine.at[2]), strict=True)
        )  # fmt: skip
    keys = ("coefficient1_constant", "coefficient2_constant", "coefficient3_constant")
    part_load = dict(zip(keys, machine.part_load(), strict=True))
    return {
        f"HeatPump:PlantLoop:EIR:{'Cooling' if isinstance(machine, Chiller) else 'Heating'}": {name: {
            "load_side_inlet_node_name": f"{name} in", "load_side_outlet_node_name": f"{name} out",
            "condenser_type": "AirSource", "source_side_inlet_node_name": f"{name} outdoor",
            "source_side_outlet_node_name": f"{name} exhaust", "load_side_reference_flow_rate": flow,
            "source_side_reference_flow_rate": 1.0, "reference_capacity": machine.capacity,
            "reference_coefficient_of_performance": machine.cop,
            "capacity_modifier_function_of_temperature_curve_name": f"{name} capacity",
            "electric_input_to_output_ratio_modifier_function_of_temperature_curve_name": f"{name} input",
            "electric_input_to_output_ratio_modifier_function_of_part_load_ratio_curve_name": f"{name} part load",
            "control_type": "Load", "flow_mode": "ConstantFlow", "minimum_part_load_ratio": machine.minimum,
        }},
        "OutdoorAir:Node": {f"{name} outdoor": {}},
        "Curve:Biquadratic": curves,
        "Curve:Exponent": {f"{name} part load": part_load | {
            "minimum_value_of_x": machine.minimum, "maximum_value_of_x": 1.0,
        }},
    }  # fmt: skip
