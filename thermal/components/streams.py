"""What components tell each other through their ports, stream by stream.

Air: a supplier says what its duct drives, hears what is drawn, and says what it supplies. Water: a supplier says what
it can bring, hears what is drawn, and says how warm the water is at the end of the step. What depends on that
temperature does so linearly, so that a loop is solved exactly.
"""

from typing import NamedTuple

from thermal.components.operations import Value


class Duct(NamedTuple):
    """What an air handler says before air is drawn.

    Parameters
    ----------
    reach : Value
        Most flow that its pressure drives through open dampers, over the design flow [-].
    """

    reach: Value


class AirDrawn(NamedTuple):
    """Air that is drawn from an air handler and comes back to it.

    Parameters
    ----------
    flow : Value
        Supply air [kg/s].
    warmth : Value
        Flows times temperatures of the zones that the return air comes from [kg K/s].
    """

    flow: Value
    warmth: Value


class SupplyAir(NamedTuple):
    """Supply air of ``offset + slope * water`` [K], with the temperature of the supply water at the end of the step.

    Parameters
    ----------
    offset : Value
        Supply temperature but for what the water brings [K].
    slope : Value
        Share of the water's temperature in it [-].
    """

    offset: Value
    slope: Value


class HotWater(NamedTuple):
    """What a hot-water loop says before heat is drawn.

    Parameters
    ----------
    opening : Value
        Water through open valves over the design flow [-].
    warmest : Value
        Warmest water that the step can bring [K], for which valves are set.
    """

    opening: Value
    warmest: Value


class WaterDrawn(NamedTuple):
    """Heat of ``conductance * water - source`` [W] that is drawn from a loop, and the water that takes it there.

    Parameters
    ----------
    conductance : Value
        Heat per temperature of the supply water, valves set [W/K].
    source : Value
        Conductance times the temperature that the water meets [W].
    flow : Value
        Water at the design differential pressure [kg/s].
    """

    conductance: Value
    source: Value
    flow: Value


class SupplyWater(NamedTuple):
    """What a hot-water loop supplies.

    Parameters
    ----------
    temperature : Value
        Of the supply water at the end of the step [K].
    """

    temperature: Value


class AirCommand(NamedTuple):
    """What an air handler is told.

    Parameters
    ----------
    supply_air_temperature_setpoint : Value
        Of the supply air behind the fan [K].
    supply_air_static_pressure_setpoint : Value
        In the duct [Pa].
    fan_running : Value
        1 while the fans run, else 0 [-].
    ventilation : Value
        Share of the minimum of outdoor air that is asked for [-].
    """

    supply_air_temperature_setpoint: Value
    supply_air_static_pressure_setpoint: Value
    fan_running: Value = 1.0
    ventilation: Value = 1.0
