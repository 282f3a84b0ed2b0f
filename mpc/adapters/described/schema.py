"""What stands in a ``plant.yaml``, as a schema."""

import re
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from mpc.adapters.described.electric import ElectricEntry
from mpc.adapters.described.programs import EnergyPlusProgram, ServerProgram, SiteProgram, UnitProgram
from thermal.case.building import Entry, Location, Number, Positive, Text
from thermal.errors import CaseError
from thermal.units import to_si

_NUMBER = re.compile(r"\s*[-+]?[0-9.]+(?:[eE][-+]?\d+)?\s*")
_WITH_UNIT = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?\d+)?)\s*([A-Za-z°]\S*)\s*")


def _kelvin(value: Any) -> Any:
    """Bring text such as ``21 degC`` into kelvin, in tables of hours too; leave all else."""
    if isinstance(value, dict | list | tuple):
        return {k: _kelvin(v) for k, v in value.items()} if isinstance(value, dict) else [_kelvin(v) for v in value]
    found = _WITH_UNIT.fullmatch(value) if isinstance(value, str) else None
    if found is None:
        return value
    try:
        return float(to_si(np.array([float(found[1])]), found[2], "temperature")[0])
    except (CaseError, ValueError) as error:
        raise ValueError(f"expected a temperature in K, or with its unit such as '21 degC' ({error})") from error


def _signal(value: Any) -> Any:
    """Take a name for a signal without more."""
    return {"signal": value} if isinstance(value, str) else value


def _text(value: Any) -> Any:
    """Take a date or time, as YAML reads it, for its text."""
    return value.isoformat() if hasattr(value, "isoformat") else value


def _rising(pairs: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Refuse a data sheet whose outdoor temperatures do not rise."""
    outdoor = [pair[0] for pair in pairs]
    if any(b <= a for a, b in pairwise(outdoor)):
        raise ValueError(f"expected a capacity over rising outdoor temperatures, found {outdoor} K")
    return pairs


def _branch(value: Any) -> str | None:
    """Tell a number, a name and a table of hours apart."""
    if isinstance(value, bool) or (isinstance(value, str) and _NUMBER.fullmatch(value)):  # in quotes by mistake
        return None
    kinds = ((float | int, "<number>"), (str, "<name>"), (dict, "<hours>"))
    return next((tag for kind, tag in kinds if isinstance(value, kind)), None)


class Hours(Entry):
    """Values by the local hour.

    Parameters
    ----------
    weekday : tuple of float
        24 values from midnight on [unit of what they stand for].
    weekend : tuple of float, optional
        On Saturdays and Sundays [the same unit]; as on weekdays by default.
    """

    weekday: Annotated[tuple[Number, ...], Field(min_length=24, max_length=24)]
    weekend: Annotated[tuple[Number, ...], Field(min_length=24, max_length=24)] | None = None


#: A number, the name of a series, or values by the hour.
Value = Annotated[
    Annotated[Number, Tag("<number>")] | Annotated[Text, Tag("<name>")] | Annotated[Hours, Tag("<hours>")],
    Discriminator(
        _branch, custom_error_type="value",
        custom_error_message="Input should be a number, the name of a series, or hours (weekday, weekend)",
    ),
]  # fmt: skip
Kelvin = Annotated[Number, BeforeValidator(_kelvin)]

#: Outdoor temperatures, rising, and the most heat at each; on straight lines between them.
DataSheet = Annotated[tuple[tuple[Kelvin, Positive], ...], AfterValidator(_rising)]


class Signal(Entry):
    """A signal of the program that stands for the building, or a series.

    Parameters
    ----------
    signal : str
        Its name there.
    unit : str, optional
        Where the program declares none, or a wrong one.
    """

    signal: Text
    unit: Text | None = None


Named = Annotated[Signal, BeforeValidator(_signal)]


class Input(Signal):
    """An actuator.

    Parameters
    ----------
    signal, unit : str
        As of `Signal`.
    range : tuple of float, optional
        Lowest and highest value [library's unit], or temperatures with their unit; those declared by default.
    kind : {"continuous", "on_off", "modulating"}
        Which values of its range it takes; on-off by default where the program says that it is a Boolean.
    minimum : float, optional
        Smallest value of a modulating actuator that is not off [library's unit].
    release : str, optional
        Input that hands the actuator over while it is 1; ``X_activate`` of ``X_u`` by default where it is there.
    capacity : tuple of tuple of float
        Of a setpoint, a data sheet: outdoor temperatures [K], rising, and the most heat that its machine gives at each,
        or takes where it cools [W].
    """

    range: tuple[Kelvin, Kelvin] | None = None
    kind: Literal["continuous", "on_off", "modulating"] | None = None
    minimum: Number | None = None
    release: Text | None = None
    capacity: DataSheet = ()

    @model_validator(mode="after")
    def _fits(self) -> "Input":
        if (self.kind == "modulating") != (self.minimum is not None):
            raise ValueError("expected a minimum of a modulating actuator, and of no other")
        return self


Acted = Annotated[Input, BeforeValidator(_signal)]


class SharedSource(Entry):
    """One source for the terminals of all zones, such as a heat pump behind fan coils.

    Parameters
    ----------
    heating, cooling : tuple of tuple of float
        Data sheets of what gives heat, and of what takes it: outdoor temperatures [K], rising, and the most at each
        [W].
    heating_water, cooling_water : str, optional
        Actuators with a range: setpoints of the water that it supplies to terminals with controllers of their own,
        which optimal control may decide.
    """

    heating: DataSheet = ()
    cooling: DataSheet = ()
    heating_water: Text | None = None
    cooling_water: Text | None = None


class Comfort(Entry):
    """Comfort band of a zone: two edges, or a band by the clock.

    Parameters
    ----------
    lower, upper : float, str or Hours
        Edges [K], as numbers, with their unit, or names of series.
    occupied, unoccupied : tuple of float
        Lower and upper temperature in occupied hours and outside of them [K].
    weekday, saturday, sunday : tuple of float
        Begin and end of the occupied hours, local [h]; a day without is left out.
    """

    lower: Annotated[Value, BeforeValidator(_kelvin)] | None = None
    upper: Annotated[Value, BeforeValidator(_kelvin)] | None = None
    occupied: tuple[Kelvin, Kelvin] | None = None
    unoccupied: tuple[Kelvin, Kelvin] | None = None
    weekday: tuple[Number, Number] | None = None
    saturday: tuple[Number, Number] | None = None
    sunday: tuple[Number, Number] | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> "Comfort":
        edges = self.lower is not None and self.upper is not None
        clock = self.occupied is not None and self.unoccupied is not None
        mixed = (self.lower or self.upper) and (self.occupied or self.unoccupied or self.weekday)
        if edges == clock or mixed:
            raise ValueError("expected 'lower' and 'upper', or 'occupied' and 'unoccupied' with hours")
        return self


class Zone(Entry):
    """A zone.

    Parameters
    ----------
    temperature : Signal
        Its air, or operative, temperature.
    floor_area : float
        [m2].
    volume : float, optional
        Of its air [m3]; 2.7 m of height by default, as the test houses of ASHRAE 140.
    comfort : Comfort, optional
        Its band; BOPTEST's office by default.
    people : float, str or Hours
        Number of people in it [-].
    gains : float, str or Hours
        Heat of lights and equipment [W], beside that of people.
    """

    temperature: Named
    floor_area: Positive
    volume: Positive | None = None
    comfort: Comfort | None = None
    people: Value = 0.0
    gains: Value = 0.0


class Energy(Entry):
    """Signals whose sums are the powers that are bought [W].

    Parameters
    ----------
    electricity, gas, district_heating : tuple of str
        Of each kind.
    """

    electricity: tuple[Text, ...] = ()
    gas: tuple[Text, ...] = ()
    district_heating: tuple[Text, ...] = ()


class Prices(Entry):
    """What energy costs.

    Parameters
    ----------
    electricity, gas, district_heating : float, str or Hours
        Prices [currency/kWh]; that of district heating is needed where it is bought.
    demand : float, optional
        Charge for the highest quarter of an hour of a month [currency/kW].
    currency : str
        For reports.
    """

    electricity: Value
    gas: Value = 0.0
    district_heating: Value | None = None
    demand: Annotated[Number, Field(ge=0)] | None = None
    currency: Text = "EUR"


class Emissions(Entry):
    """What energy emits.

    Parameters
    ----------
    electricity, gas, district_heating : float, str or Hours
        [kg/kWh]; that of district heating is needed where it is bought.
    kind : {"average", "marginal"}
        Which that of electricity is.
    """

    electricity: Value
    gas: Value = 0.0
    district_heating: Value | None = None
    kind: Literal["average", "marginal"] = "average"


class Outlook(Entry):
    """Forecasts.

    Parameters
    ----------
    hours : float
        How far they reach, up to a year [h].
    errors : {"none", "day_ahead"}
        Whether the weather is known, or wrong as `mpc.scenario.forecast.DAY_AHEAD_ERRORS`.
    seed : int
        Of the errors.
    """

    hours: Annotated[Number, Field(gt=0, le=8784)] = 24.0
    errors: Literal["none", "day_ahead"] = "none"
    seed: Annotated[int, Field(ge=0, strict=True)] = 0


class Period(Entry):
    """When the plant runs.

    Parameters
    ----------
    start : str
        ISO 8601, local.
    days : float
        Length, up to ten years [d].
    warm_up_days : float
        Before the start, under the building's own control, up to a year, within the start's year [d].
    """

    start: Annotated[Text, BeforeValidator(_text)]
    days: Annotated[Number, Field(gt=0, le=3660)]
    warm_up_days: Annotated[Number, Field(ge=0, le=366)] = 0.0


class PlantFile(Entry):
    """A ``plant.yaml``.

    Parameters
    ----------
    format : int
        1.
    name : str
        Of the plant.
    about : str
        In words, for people.
    location : Location
        Where it stands; its time zone is that of all times.
    year : int
        That seconds of the year, and periods by name, belong to.
    plant : UnitProgram, ServerProgram, EnergyPlusProgram or SiteProgram
        What stands for the building.
    control_step : float
        Time between two actions, a second or more [s].
    period : str or Period
        When it runs; a name is one of BOPTEST's time periods, such as ``peak_heat_day``.
    zones : mapping of str to Zone
        By name.
    measurements : mapping of str to Signal
        Of each column ``ENTITY/POINT`` with a point type of the case format.
    actuators : mapping of str to Input
        Of each actuator ``ENTITY/POINT``.
    source : SharedSource, optional
        That feeds the terminals of all zones.
    energy : Energy
        What is bought.
    prices : Prices, optional
        What it costs.
    emissions : Emissions, optional
        What it emits; not counted by default.
    electric : ElectricEntry, optional
        Battery and photovoltaics, whose powers are not among those of `energy`.
    series : tuple of str
        Where named series come from, in this order: ``unit``, the tables that a unit of BOPTEST brings; a ``.csv``
        file; ``outputs``, variables of the unit from a run ahead under its own control.
    weather : str or mapping of str to Signal, optional
        An ``.epw`` file, or a series of each point of the weather station.
    forecast : Outlook
        How far forecasts reach, and how wrong they are.
    """

    format: Literal[1]
    name: Text
    about: str = ""
    location: Location
    year: Annotated[int, Field(ge=1900, le=2200, strict=True)] = 2023
    plant: Annotated[UnitProgram | ServerProgram | EnergyPlusProgram | SiteProgram, Field(discriminator="kind")]
    control_step: Annotated[Number, Field(ge=1)]
    period: Annotated[
        Annotated[Text, Tag("<name>")] | Annotated[Period, Tag("<period>")],
        Discriminator(
            lambda value: "<name>" if isinstance(value, str) else "<period>" if isinstance(value, dict) else None,
            custom_error_type="period", custom_error_message="Input should be a period's name, or its start and days",
        ),
    ]  # fmt: skip
    zones: Annotated[dict[Text, Zone], Field(min_length=1)]
    measurements: dict[Text, Named] = Field(default_factory=dict)
    actuators: dict[Text, Acted] = Field(default_factory=dict)
    source: SharedSource | None = None
    energy: Energy = Energy()
    prices: Prices | None = None
    emissions: Emissions | None = None
    electric: ElectricEntry | None = None
    series: tuple[Text, ...] = ()
    weather: Annotated[
        Annotated[Text, Tag("<file>")] | Annotated[dict[Text, Named], Tag("<points>")],
        Discriminator(
            lambda value: "<file>" if isinstance(value, str) else "<points>" if isinstance(value, dict) else None,
            custom_error_type="weather", custom_error_message="Input should be an .epw file, or a series of each point",
        ),
    ] | None = None  # fmt: skip
    forecast: Outlook = Outlook()

    @model_validator(mode="after")
    def _district_heating_is_priced(self) -> "PlantFile":
        for name, part in (("prices", self.prices), ("emissions", self.emissions)):
            if self.energy.district_heating and part is not None and part.district_heating is None:
                raise ValueError(f"expected {name}.district_heating, which is bought, found none")
        return self

    @model_validator(mode="after")
    def _water_is_there(self) -> "PlantFile":
        for key in ("heating_water", "cooling_water"):
            name = None if self.source is None else getattr(self.source, key)
            if name is None:
                continue
            if not name.endswith("_temperature_setpoint") or name not in self.actuators:
                raise ValueError(f"expected a temperature setpoint of `actuators` as source.{key}, found {name!r}")
            if self.actuators[name].range is None:
                raise ValueError(f"expected a range of {name}, the coldest and the hottest water, found none")
            if (sensor := name.removesuffix("setpoint") + "sensor") not in self.measurements:
                raise ValueError(f"expected the measurement {sensor} beside source.{key}, found none")
        return self

    @model_validator(mode="after")
    def _battery_is_there(self) -> "PlantFile":
        battery = None if self.electric is None else self.electric.battery
        if battery is not None:
            for name, known, what in ((battery.command, self.actuators, "an actuator"),
                                      (battery.level, self.measurements, "a measurement")):  # fmt: skip
                if name not in known:
                    raise ValueError(f"expected {what} of the description as the battery's, found {name!r}")
        return self
