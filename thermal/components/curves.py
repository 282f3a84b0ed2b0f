"""Performance curves of equipment, with the buildings and documents that they are from."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from thermal.components.operations import Operations, Value
from thermal.errors import ModelError

_FREEZING = 273.15  # K


class Curve(Protocol):
    """A performance curve of two temperatures [degC], or of a share and a temperature."""

    def __call__(self, ops: Operations, x: Value, y: Value) -> Value:
        """Evaluate the curve at x and y."""


@dataclass(frozen=True)
class Polynomial:
    """A polynomial of one share, such as a part-load ratio; the share is held within its range.

    Parameters
    ----------
    coefficients : tuple of float
        Of rising powers, from the constant on [-].
    lowest, highest : float
        Range of the argument [-].
    source : str
        Document or model that the coefficients are from.
    """

    coefficients: tuple[float, ...]
    lowest: float
    highest: float
    source: str

    def __post_init__(self) -> None:
        if not self.coefficients or not self.lowest < self.highest:
            found = f"{len(self.coefficients)} and a range {self.lowest} to {self.highest}"
            raise ModelError("polynomial", "coefficients and a rising range", found)

    def __call__(self, ops: Operations, x: Value) -> Value:
        """Evaluate the polynomial at a share [-]."""
        x = ops.clip(x, self.lowest, self.highest)
        value, rest = self._falling
        for coefficient in rest:
            value = value * x + coefficient
        return value

    @cached_property
    def _falling(self) -> tuple[float, tuple[float, ...]]:
        """Coefficient of the highest power, and the others."""
        return self.coefficients[-1], self.coefficients[-2::-1]


@dataclass(frozen=True)
class Biquadratic:
    """A curve ``c1 + c2 x + c3 x^2 + c4 y + c5 y^2 + c6 x y`` of EnergyPlus, its arguments held within their ranges.

    Parameters
    ----------
    coefficients : tuple of float
        c1 to c6, of temperatures in degC [-].
    x_range, y_range : tuple of float
        Lowest and highest x and y [degC], or [-] where x is a part-load ratio.
    source : str
        Document or model that the coefficients are from.
    """

    coefficients: tuple[float, float, float, float, float, float]
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    source: str

    def __post_init__(self) -> None:
        if len(self.coefficients) != 6 or not (self.x_range[0] < self.x_range[1] and self.y_range[0] < self.y_range[1]):
            found = f"{len(self.coefficients)} coefficients, ranges {self.x_range} and {self.y_range}"
            raise ModelError("biquadratic curve", "six coefficients and rising ranges", found)

    def __call__(self, ops: Operations, x: Value, y: Value) -> Value:
        """Evaluate the curve at x and y in the units of its ranges."""
        c1, c2, c3, c4, c5, c6 = self.coefficients
        x, y = ops.clip(x, *self.x_range), ops.clip(y, *self.y_range)
        return c1 + x * (c2 + c3 * x + c6 * y) + y * (c4 + c5 * y)


@dataclass(frozen=True)
class OtherSide:
    """A curve of the temperature on the other side alone, such as outdoors.

    Parameters
    ----------
    polynomial : Polynomial
        Of y [degC].
    """

    polynomial: Polynomial

    def __call__(self, ops: Operations, x: Value, y: Value) -> Value:
        """Evaluate the curve at y [degC]."""
        return self.polynomial(ops, y)


@dataclass(frozen=True)
class LiftInput:
    """Energy input ratio over the rated one of a machine whose COP is a polynomial of the lift x - y.

    Parameters
    ----------
    cop : Polynomial
        COP [-] of the lift [K].
    rated_lift : float
        Lift at which it is 1 [K].
    """

    cop: Polynomial
    rated_lift: float

    def __call__(self, ops: Operations, x: Value, y: Value) -> Value:
        """Evaluate the curve at x and y [degC]."""
        return self.rated_cop / self.cop(ops, x - y)

    @cached_property
    def rated_cop(self) -> float:
        """COP at the rated lift [-]."""
        return float(sum(c * self.rated_lift**k for k, c in enumerate(self.cop.coefficients)))


def celsius(temperature: Value) -> Value:
    """Temperature as curves take it [degC], from [K]."""
    return temperature - _FREEZING


_OFFICE = "DOE commercial reference building, new 2004, "
_WET_BULB, _OUTDOOR = (11.1, 29.4), (10.0, 50.3)  # degC

#: Capacity over rated capacity [-] of a 10-ton direct-expansion coil; x entering wet bulb, y outdoor air [degC].
DX_CAPACITY = Biquadratic(
    (0.52357, 0.03478, 0.0, -0.001915, -0.00010838, 0.0), _WET_BULB, _OUTDOOR,
    _OFFICE + "Medium Office: Measured_CoolCStandard10Ton_CapFT",
)  # fmt: skip
#: Energy input ratio over the rated one [-] of the same coil; x entering wet bulb, y outdoor air [degC].
DX_INPUT = Biquadratic(
    (0.9847, -0.04285, 0.0013562, 0.009934, 0.0006398, -0.0011690), _WET_BULB, _OUTDOOR,
    _OFFICE + "Medium Office: Measured_CoolCStandard10Ton_EIRFT",
)  # fmt: skip
#: Energy input over part load [-]: that of the Medium Office's coil, which loses nothing at part load.
DX_PART_LOAD = Polynomial((0.0, 1.0), 0.0, 1.0, _OFFICE + "Medium Office: No_PLR_Degredation")
_CHILLER = "EnergyPlus ExpandObjects, HVACTemplate:Plant:Chiller, reciprocating (those of DOE-2.1E): Recip"
_CHILLED, _CONDENSER = (5.0, 10.0), (24.0, 35.0)  # degC

#: Capacity over that at 6.67 degC of chilled water and 29.4 degC at the condenser [-] of a reciprocating chiller; x
#: chilled water, y air at the condenser [degC].
CHILLER_CAPACITY = Biquadratic(
    (0.507883, 0.145228, -0.00625644, -0.0011178, -0.0001296, -0.00028188), _CHILLED, _CONDENSER, _CHILLER + "CapFT"
)
#: Energy input ratio over the rated one [-] of the same chiller; x chilled water, y air at the condenser [degC].
CHILLER_INPUT = Biquadratic(
    (1.03076, -0.103536, 0.00710208, 0.0093186, 0.00031752, -0.00104328), _CHILLED, _CONDENSER, _CHILLER + "EIRFT"
)
#: Its energy input over that at full load [-], by part load; below a quarter, its least unloading, it cycles.
CHILLER_PART_LOAD = Polynomial((0.088065, 1.137742, -0.225806), 0.25, 1.0, _CHILLER + "EIRFPLR")
#: Fan power over design power [-] at a share of the design flow, variable speed.
FAN_PART_LOAD = Polynomial(
    (0.0407598940, 0.08804497, -0.072926120, 0.9437398230), 0.0, 1.0,
    _OFFICE + "Medium and Large Office: Fan:VariableVolume",
)  # fmt: skip
#: Efficiency over the nominal one [-] of a condensing boiler; x part-load ratio [-], y return water [degC].
CONDENSING_BOILER = Biquadratic(
    (1.124970374, 0.014963852, -0.02599835, 0.0, -1.40464e-6, -0.00153624), (0.1, 1.0), (30.0, 85.0),
    "EnergyPlus Input Output Reference, Boiler:HotWater: CondensingBoilerEff",
)  # fmt: skip
#: Efficiency over the nominal one [-] of an ordinary boiler; x part-load ratio [-], y return water [degC].
ORDINARY_BOILER = Biquadratic(
    (0.97, 0.0633, -0.0333, 0.0, 0.0, 0.0), (0.0, 1.0), (20.0, 95.0),
    "EnergyPlus ExpandObjects, HVACTemplate:Plant:Boiler: boiler efficiency curve",
)  # fmt: skip
#: Efficiency over the nominal one [-] where a boiler has the same at any load; the Large Office's.
CONSTANT_EFFICIENCY = Biquadratic(
    (1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 1.0), (0.0, 100.0), _OFFICE + "Large Office: HeatSys1 Boiler"
)
_STAFFELL = "Staffell et al. (2012), A review of domestic heat pumps, Energy Environ. Sci. 5, 9291-9306: "
#: Input over that at 35 degC of water and 7 degC of air [-] of air-source heat pumps, defrosting in it.
AIR_SOURCE_INPUT = LiftInput(Polynomial((6.81, -0.121, 0.000630), 15.0, 60.0, _STAFFELL + "air source"), 28.0)
#: Input over that at 35 degC of water and 0 degC of brine [-] of ground-source heat pumps.
GROUND_SOURCE_INPUT = LiftInput(Polynomial((8.77, -0.150, 0.000734), 20.0, 60.0, _STAFFELL + "ground source"), 35.0)
_SMALL_OFFICE = "ASHRAE 90.1 prototype, 2019, Small Office: "
#: Heating capacity over that at 8.3 degC [-] of air-source direct expansion; y outdoor air [degC].
DX_HEATING_CAPACITY = OtherSide(
    Polynomial((0.758746, 0.027626, 0.000148716, 3.4992e-6), -20.0, 20.0, _SMALL_OFFICE + "HPACHeatCapFT")
)
#: Energy input ratio of heating over that at 8.3 degC [-] of the same coil.
DX_HEATING_INPUT = OtherSide(
    Polynomial((1.19248, -0.0300438, 0.00103745, -2.3328e-5), -20.0, 20.0, _SMALL_OFFICE + "HPACHeatEIRFT")
)
#: The same at any temperature: capacity of a machine that nothing more is known of, such as one on brine.
CONSTANT = Biquadratic((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (-50.0, 100.0), (-50.0, 100.0), "definition")
_WATER_COOLED = "ASHRAE 90.1 prototype, 2019, Large Office: WC_PD_2004_"
#: Capacity over the rated one [-] of a water-cooled chiller with positive displacement; x chilled water, y water that
#: enters the condenser [degC].
WATER_COOLED_CAPACITY = Biquadratic(
    (0.9061150, 0.0292277, -0.0003647, -0.0009709, -0.0000905, 0.0002527), _CHILLED, (17.78, 46.11),
    _WATER_COOLED + "CAPFT",
)  # fmt: skip
#: Energy input ratio over the rated one [-] of the same chiller.
WATER_COOLED_INPUT = Biquadratic(
    (0.3617105, -0.0229833, 0.0009519, 0.0131889, 0.0003752, -0.0007059), _CHILLED, (17.78, 46.11),
    _WATER_COOLED + "EIRFT",
)  # fmt: skip
