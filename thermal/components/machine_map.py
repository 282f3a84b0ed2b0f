"""A machine that moves heat, by its map: capacity and input over two temperatures, part load, cycling, frost.

One map is a heat pump, a chiller, or direct expansion: what differs are curves, and which side is of use.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

from thermal.components.component import Component, Port, Range
from thermal.components.curves import DX_PART_LOAD, Curve, Polynomial, celsius
from thermal.components.moist_air import saturation_humidity
from thermal.components.operations import Operations, Value
from thermal.errors import ModelError

_LEAST_FROST = 1e-6  # kg/kg: excess of humidity over a dry coil, EnergyPlus' least too
_SMALL = 1e-9  # share of the capacity: keeps ratios finite where a machine can do nothing


class MachineStep(NamedTuple):
    """What a machine did in a step; means over it.

    Parameters
    ----------
    output : Value
        Heat or cold [W], not negative.
    power : Value
        Electric power [W].
    duty : Value
        Share of the step that it ran [-].
    available : Value
        Most output that it had [W].
    """

    output: Value
    power: Value
    duty: Value
    available: Value


class Frosted(NamedTuple):
    """What frost leaves of a machine that runs.

    Parameters
    ----------
    capacity, power : Value
        Most output, and electric power at full load, over those without frost [-].
    taken : Value
        Heat that melts the frost, over the rated capacity [-].
    added : Value
        Electric power of defrosting over the rated capacity [-].
    """

    capacity: Value = 1.0
    power: Value = 1.0
    taken: Value = 0.0
    added: Value = 0.0


@dataclass(frozen=True)
class Defrost(Component):
    """Defrosting of an outdoor coil on demand, by reversing the cycle or by resistance.

    Parameters
    ----------
    highest : float
        Outdoor temperature below which it frosts [K]; the default is EnergyPlus' 5 degC.
    reverse : bool
        True: the cycle is reversed, and its heat is from the building. False: resistance.
    input_share : float
        Electric power while it defrosts over the rated capacity [-]: of the compressor, or of the resistance. The
        default is that of the Small Office's heat pump in ASHRAE's 90.1 prototypes, 2019 (HPACCOOLEIRFT at the lowest
        temperatures of its range).
    pressure : float
        Of the air [Pa].

    Notes
    -----
    EnergyPlus Engineering Reference 26.1, DX heating coil, on demand: the coil is at ``0.82 T - 8.589`` degC;
    ``dw = max(1e-6, w - w_sat(T_coil))``, time share ``t = 1 / (1 + 0.01446 / dw)``; output is ``0.875 (1 - t)`` and
    power ``0.954 (1 - t)`` of those without frost; a reversed cycle takes ``0.01 t (7.222 - T) Q_rated / 1.01667``.
    """

    ports = (Port("power", "electricity", "W"),)

    highest: Annotated[float, Range("K", 263.15, 288.15)] = 278.15
    reverse: bool = True
    input_share: Annotated[float, Range("-", 0.0, 3.0)] = 0.8
    pressure: Annotated[float, Range("Pa", 5e4, 1.1e5)] = 101_325.0

    def frosted(self, ops: Operations, outdoor: Value, humidity: Value) -> Frosted:
        """Tell what frost leaves.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        outdoor : Value
            Outdoor temperature [K].
        humidity : Value
            Humidity ratio outdoors [kg/kg].
        """
        cold, degrees = ops.step(self.highest - outdoor), celsius(outdoor)
        coil = 273.15 + 0.82 * degrees - 8.589
        vapour = ops.minimum(humidity, saturation_humidity(ops, outdoor, self.pressure), 1e-3)  # air carries no more
        excess = ops.maximum(vapour - saturation_humidity(ops, coil, self.pressure), _LEAST_FROST, 1e-3)
        time = cold / (1.0 + 0.01446 / excess)
        capacity, power = (1.0 + cold * (whole * (1.0 - time) - 1.0) for whole in (0.875, 0.954))
        taken = 0.01 * time * (7.222 - degrees) / 1.01667 if self.reverse else 0.0
        return Frosted(capacity, power, taken, self.input_share * time / (1.01667 if self.reverse else 1.0))


@dataclass(frozen=True)
class MachineMap(Component):
    """A machine over its rated capacity: heat pump, chiller or direct expansion.

    Parameters
    ----------
    cop : float
        Rated output over electric power at full load, that of `running_share` not counted [-].
    capacity_curve, input_curve : Curve
        Capacity over the rated one, and electric power per capacity over the rated one; x is the temperature on the
        side of use, y that on the other side [degC].
    part_load : Polynomial
        Electric power over that at full load, by part load, down to `minimum`.
    minimum : float
        Least part load that it can modulate to [-]; below it cycles. 1 for a machine that is on or off.
    cycling_loss : float
        Loss of a machine that cycles: it runs ``d / (1 - C (1 - d))`` of the time where d would do [-]. The default
        has none; ANSI/AHRI 210/240 takes 0.25 where nothing is measured.
    running_share, standing_share : float
        Power of fans, pumps and controls while it runs, whatever its load, and always, over its rated power [-].
    defrost : Defrost, optional
        Of an outdoor coil that frosts; None for one that does not.

    Notes
    -----
    ``Q_full = Q_rated f_Q(x, y)``; part load ``r = Q / Q_full``, level ``l = max(r, r_min)``, duty ``d = r / l``, run
    time ``t = d / (1 - C (1 - d))`` and ``P = t (Q_full f_E(x, y) f_PL(l) + p_running Q_rated) / COP + p_standing
    Q_rated / COP``: EnergyPlus' HeatPump:PlantLoop:EIR and Chiller:Electric:EIR; with a minimum of 1, its coils of
    direct expansion. The law of Carnot is left to the curves.
    """

    ports = (Port("power", "electricity", "W"),)

    cop: Annotated[float, Range("-", 1.0, 20.0)]
    capacity_curve: Curve
    input_curve: Curve
    part_load: Polynomial = DX_PART_LOAD
    minimum: Annotated[float, Range("-", 0.01, 1.0)] = 1.0
    cycling_loss: Annotated[float, Range("-", 0.0, 0.5)] = 0.0
    running_share: Annotated[float, Range("-", 0.0, 2.0)] = 0.0
    standing_share: Annotated[float, Range("-", 0.0, 1.0)] = 0.0
    defrost: Defrost | None = field(default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.part_load.lowest <= self.minimum <= self.part_load.highest):
            expected = f"a range that has the minimum of {self.minimum:g} in it"
            found = f"{self.part_load.lowest:g} to {self.part_load.highest:g}"
            raise ModelError("MachineMap.part_load", expected, found)

    def frosted(self, ops: Operations, other: Value, humidity: Value) -> Frosted:
        """Tell what frost leaves of it; all where it does not frost.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        other : Value
            Outdoor temperature [K].
        humidity : Value
            Humidity ratio outdoors [kg/kg].
        """
        return Frosted() if self.defrost is None else self.defrost.frosted(ops, other, humidity)

    def available(self, ops: Operations, capacity: Value, use: Value, other: Value, frost: Frosted) -> Value:
        """Most output [W].

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        capacity : Value
            Rated capacity [W].
        use, other : Value
            Temperatures on the side of use and on the other [K].
        frost : Frosted
            Of `frosted`.
        """
        full = self.capacity_curve(ops, celsius(use), celsius(other)) * frost.capacity - frost.taken
        return capacity * ops.maximum(full, _SMALL, 1e-3)

    def run_at(
        self, ops: Operations, wanted: Value, capacity: Value, use: Value, other: Value, humidity: Value = 0.0
    ) -> MachineStep:
        """Run the machine for an output that is wanted, as far as it can.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        wanted : Value
            Mean output over the step [W].
        capacity : Value
            Rated capacity [W].
        use, other : Value
            Temperatures on the side of use and on the other [K].
        humidity : Value
            Humidity ratio outdoors, for frost [kg/kg].
        """
        frost = self.frosted(ops, other, humidity)
        x, y = celsius(use), celsius(other)
        most = self.available(ops, capacity, use, other, frost)
        load = ops.clip(wanted / most, 0.0, 1.0)
        level = ops.maximum(load, self.minimum)
        duty = load / level
        time = duty / (1.0 - self.cycling_loss * (1.0 - duty))
        # frost takes more of the output than of the power: that is of the output that there would be without
        full = capacity * self.capacity_curve(ops, x, y) * frost.power
        working = full * self.input_curve(ops, x, y) * self.part_load(ops, level)
        rated = capacity / self.cop
        power = time * (working / self.cop + rated * self.running_share + capacity * frost.added)
        return MachineStep(load * most, power + rated * self.standing_share, time, most)
