"""Coils between hot water and air: effectiveness-NTU, sizing, and what a valve does to them.

Symbols after Incropera et al., Fundamentals of Heat and Mass Transfer (7th ed.), ch. 11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from scipy.optimize import brentq

from thermal.components.checks import in_range
from thermal.components.component import Component, Port, Range
from thermal.components.moist_air import WATER_HEAT_CAPACITY
from thermal.components.operations import FloatOperations, Operations, Value
from thermal.errors import ModelError
from thermal.units import AIR_HEAT_CAPACITY

_LITTLE_NTU = 0.01**-0.15  # NTU of the water at a hundredth of its flow over that at full flow: hA as flow to 0.85
LEAST_FLOW = 1e-12  # kg/s or share: keeps powers, and temperatures of what does not flow, finite


def _effectiveness(ops: Operations, ntu: Value, ratio: Value) -> Value:
    """Effectiveness of a cross-flow exchanger, both fluids unmixed (Incropera eq. 11.32).

    ``eps = 1 - exp((exp(-Cr NTU^0.78) - 1) NTU^0.22 / Cr)``

    Parameters
    ----------
    ops : Operations
        Arithmetic.
    ntu : Value
        Number of transfer units UA/C_min [-].
    ratio : Value
        C_min/C_max [-], 0 to 1.
    """
    stretch = ntu**0.22 / ratio
    return -ops.expm1(ops.expm1(-ntu / stretch) * stretch)


@dataclass(frozen=True)
class WaterCoil(Component):
    """A coil that heats air with hot water.

    Parameters
    ----------
    air_conductance, water_conductance : float
        Film conductance times area on either side at the design flows [W/K], positive.
    air_flow : float
        Design air flow [kg/s], positive.
    water_flow : float
        Water flow with the valve fully open at the design differential pressure [kg/s], positive.

    Notes
    -----
    ``1/UA = 1/hA_air + 1/hA_water`` with hA in powers 0.8 and 0.85 of the flows (Wetter 1999, LBNL-42354, as
    EnergyPlus' Coil:Heating:Water; its small dependence on temperatures is left out).
    """

    ports = (Port("air", "air", "kg/s"), Port("hot_water", "water", "kg/s"))

    air_conductance: Annotated[float, Range("W/K", 1e-3, 1e8)]
    water_conductance: Annotated[float, Range("W/K", 1e-3, 1e8)]
    air_flow: Annotated[float, Range("kg/s", 1e-6, 1e4)]
    water_flow: Annotated[float, Range("kg/s", 1e-6, 1e4)]

    @classmethod
    def sized(
        cls,
        capacity: float,
        air_flow: float,
        air_temperature: float = 289.75,
        water_temperature: float = 355.35,
        water_difference: float = 11.1,
        film_ratio: float = 0.5,
    ) -> WaterCoil:
        """Size a coil for its capacity at design conditions.

        Parameters
        ----------
        capacity : float
            Heat at design flows and temperatures [W], positive.
        air_flow : float
            Design air flow [kg/s], positive.
        air_temperature, water_temperature : float
            Of the air and water that enter [K]; the defaults are EnergyPlus' rated 16.6 and 82.2 degC.
        water_difference : float
            Fall of the water's temperature at design [K]; the default is EnergyPlus' rated 82.2 to 71.1 degC.
        film_ratio : float
            hA of the air over hA of the water [-]; the default is EnergyPlus' (air films govern).

        Returns
        -------
        WaterCoil
            Reaches the capacity within 1e-9.

        Raises
        ------
        ModelError
            No coil of any size reaches the capacity at these flows and temperatures.

        Examples
        --------
        >>> coil = WaterCoil.sized(5000.0, 0.3)
        >>> round(coil.conductance(FloatOperations(), 0.3) * (355.35 - 289.75), 3)
        5000.0
        """
        in_range("WaterCoil.sized: capacity", capacity, "W", 1e-3, 1e8)
        in_range("WaterCoil.sized: air_flow", air_flow, "kg/s", 1e-6, 1e4)
        in_range("WaterCoil.sized: water_difference", water_difference, "K", 0.5, 80.0)
        in_range("WaterCoil.sized: film_ratio", film_ratio, "-", 1e-3, 1e3)
        ops = FloatOperations()
        water = capacity / water_difference
        least, most = sorted((AIR_HEAT_CAPACITY * air_flow, water))
        wanted = capacity / (least * max(water_temperature - air_temperature, 1e-9))
        reachable = _effectiveness(ops, 30.0, least / most)
        if not wanted < reachable:
            limit = f"an effectiveness below {reachable:.3f}"
            advice = "more air or a smaller fall of the water's temperature"
            raise ModelError("WaterCoil.sized: capacity", limit, f"{wanted:.3f}", advice)
        ntu = brentq(lambda n: _effectiveness(ops, n, least / most) - wanted, 1e-12, 30.0, xtol=1e-14)
        overall = ntu * least
        return cls(
            air_conductance=overall * (1.0 + film_ratio),
            water_conductance=overall * (1.0 + film_ratio) / film_ratio,
            air_flow=air_flow,
            water_flow=water / WATER_HEAT_CAPACITY,
        )

    def conductance(self, ops: Operations, air_flow: Value, water_share: Value = 1.0) -> Value:
        """Heat per difference between the water and the air that enter [W/K], valve open.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        air_flow : Value
            Air through the coil [kg/s].
        water_share : Value
            Water flow over `water_flow` [-].
        """
        air = air_flow + LEAST_FLOW
        resistance = (air / self.air_flow) ** -0.8 / self.air_conductance
        return coil_conductance(ops, AIR_HEAT_CAPACITY * air, resistance, self.water_side(ops, water_share))

    def water_side(self, ops: Operations, water_share: Value) -> WaterSide:
        """Give the water's side of the coil, valve open.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        water_share : Value
            Water flow over `water_flow` [-].
        """
        return water_side(ops, WATER_HEAT_CAPACITY * self.water_flow, self.water_conductance, water_share)


class WaterSide(NamedTuple):
    """The water's side of a coil with its valve open.

    Parameters
    ----------
    rate : Value
        Heat capacity rate [W/K].
    resistance : Value
        1/hA of the film [K/W].
    curve : _Characteristic
        That follows from both.
    """

    rate: Value
    resistance: Value
    curve: _Characteristic


def water_side(ops: Operations, rate: Value, film: Value, share: Value) -> WaterSide:
    """Derive the water's side of a coil from that at its design flow.

    Parameters
    ----------
    ops : Operations
        Arithmetic.
    rate, film : Value
        Heat capacity rate, and hA of the film [W/K].
    share : Value
        Flow over the design flow [-].
    """
    share = share + LEAST_FLOW
    rate, resistance = rate * share, share**-0.85 / film
    return WaterSide(rate, resistance, _characteristic(ops, rate, resistance))


def coil_conductance(ops: Operations, air_rate: Value, air_resistance: Value, water: WaterSide) -> Value:
    """Heat per difference between the water and the air that enter [W/K], for one coil or many.

    Parameters
    ----------
    ops : Operations
        Arithmetic.
    air_rate : Value
        Heat capacity rate of the air [W/K], above 0.
    air_resistance : Value
        1/hA of the air's film at this flow [K/W].
    water : WaterSide
        The other side.
    """
    least, most = ops.ordered(air_rate, water.rate)
    transfer_units = 1.0 / ((air_resistance + water.resistance) * least)
    return _effectiveness(ops, transfer_units, least / most) * least


class _Characteristic(NamedTuple):
    """How a coil's heat goes with its water, per conductance of the open coil.

    Parameters
    ----------
    offset, slope : Value
        Of ``S(r) = G (offset + slope r)`` [K/W].
    """

    offset: Value
    slope: Value


def _characteristic(ops: Operations, water_rate: Value, water_resistance: Value) -> _Characteristic:
    """Derive how a coil's heat goes with its water from what is known of both ends.

    At full flow S is the relative change of heat by that of water. With mean temperatures of air and water ``1/G =
    1/UA + 1/(2 C_a) + 1/(2 C_w)``, so it is ``G (1/(2 C_w) + 0.85/hA_w)``; 0.6 in the place of 1/2 fits cross flow
    better. At little flow the water film governs: water leaves by ``1 - exp(-NTU)`` of the difference, with NTU taken
    at a hundredth of the flow. Both are at least G/C_w, with which the water leaves no colder than the air enters.

    Parameters
    ----------
    ops : Operations
        Arithmetic.
    water_rate : Value
        Heat capacity rate of the water, valve open [W/K].
    water_resistance : Value
        1/hA of its film at that flow [K/W].
    """
    full = ops.maximum(1.0 / water_rate, 0.6 / water_rate + 0.85 * water_resistance, 1e-5)
    little = -1.0 / (water_rate * ops.expm1(-_LITTLE_NTU / (water_resistance * water_rate)))
    return _Characteristic(little, full - little)


def water_share(throttled: Value, conductance: Value, curve: _Characteristic) -> Value:
    """Share of the full water flow [-] at which a coil has a conductance below that of the open valve.

    With r the one over the other: ``phi = S r / (1 - r + S r)``, the form of Petitjean, Total Hydronic Balancing
    (1994), with an S that follows the film of the water: within 0.03 of effectiveness-NTU at the reduced flow for coils
    of usual sizes, 3 % of the flow in the mean.

    Parameters
    ----------
    throttled, conductance : Value
        Of the coil with its valve as it stands, and open [W/K].
    curve : _Characteristic
        Of its water side.
    """
    part = (curve.offset * conductance + curve.slope * throttled) * throttled  # G S r
    return part / (conductance - throttled + part)


def heat_share(ops: Operations, flow_share: Value, conductance: Value, curve: _Characteristic) -> Value:
    """Inverse of `water_share`: share of the full heat [-] at a share of the full water flow [-]."""
    first, second = conductance * curve.offset, conductance * curve.slope
    linear = first + flow_share * (1.0 - first)
    root = ops.sqrt(ops.positive(linear * linear + 4.0 * second * (1.0 - flow_share) * flow_share))
    return 2.0 * flow_share / (linear + root)


def valve_flow(ops: Operations, position: Value, rangeability: float) -> Value:
    """Share of the full flow [-] of an equal-percentage valve, ``(R^p - 1) / (R - 1)``, closed at position 0.

    ASHRAE Handbook, HVAC Systems and Equipment (2016), ch. 47, taken to zero flow at zero lift.
    """
    return ops.expm1(position * math.log(rangeability)) / (rangeability - 1.0)


def valve_position(ops: Operations, flow: Value, rangeability: float) -> Value:
    """Inverse of `valve_flow`: position [-] that lets a share of the full flow through [-]."""
    return ops.log(1.0 + flow * (rangeability - 1.0)) / math.log(rangeability)
