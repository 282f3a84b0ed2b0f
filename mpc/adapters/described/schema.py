"""What stands in a ``plant.yaml``, as a schema."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from mpc.adapters.described.electric import ElectricEntry
from mpc.adapters.described.programs import EnergyPlusProgram, ServerProgram, SiteProgram, UnitProgram
from mpc.adapters.described.values import Acted, DataSheet, Kelvin, Named, Value, kelvin
from mpc.loop.actuators import SUPPLY_WATER
from thermal.case.building import Entry, Location, Number, Positive, Text


def _text(value: Any) -> Any:
    """Take a date or time, as YAML reads it, for its text."""
    return value.isoformat() if hasattr(value, "isoformat") else value


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

    lower: Annotated[Value, BeforeValidator(kelvin)] | None = None
    upper: Annotated[Value, BeforeValidator(kelvin)] | None = None
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
            if not name.endswith(SUPPLY_WATER) or name not in self.actuators:
                raise ValueError(f"expected one of `actuators`, ENTITY/{SUPPLY_WATER}, as source.{key}, found {name!r}")
            told = self.actuators[name]
            if told.range is None or told.range[0] >= told.range[1] or told.kind not in (None, "continuous"):
                raise ValueError(f"expected a range of {name} from the coldest to the hottest water, of any value")
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
