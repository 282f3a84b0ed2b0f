"""What a ``plant.yaml`` says of battery and photovoltaics, as a schema."""

from typing import Annotated

from pydantic import Field

from thermal.case.building import Entry, Number, Positive, Text


class BatteryEntry(Entry):
    """A battery that is charged and discharged.

    Parameters
    ----------
    command : str
        Its actuator, from -1 to 1 of its power.
    level : str
        The measurement that says how full it is [-].
    capacity, power : float
        [J], and largest electric power either way [W].
    charging, discharging : float
        Efficiencies [-]; by default as `thermal.components.battery.Battery`.
    """

    command: Text
    level: Text
    capacity: Positive
    power: Positive
    charging: Annotated[Number, Field(ge=0.5, le=1)] = 0.95
    discharging: Annotated[Number, Field(ge=0.5, le=1)] = 0.95


class ModulesEntry(Entry):
    """Photovoltaics.

    Parameters
    ----------
    peak : float
        Power at 1000 W/m2 [W].
    azimuth, tilt : float
        Where they look, clockwise from north, and from the vertical [deg].
    performance : float
        Power over that of the irradiance alone [-].
    """

    peak: Positive
    azimuth: Number = 180.0
    tilt: Annotated[Number, Field(ge=0, le=90)] = 35.0
    performance: Annotated[Number, Field(gt=0, le=1)] = 0.86


class ElectricEntry(Entry):
    """What is electric beside the machines.

    Parameters
    ----------
    battery : BatteryEntry, optional
        A battery.
    photovoltaic : ModulesEntry, optional
        Modules.
    feed_in : float
        Paid for what is fed into the grid [currency/kWh].
    """

    battery: BatteryEntry | None = None
    photovoltaic: ModulesEntry | None = None
    feed_in: Number = 0.0
