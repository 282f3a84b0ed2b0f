"""What drives a closed loop: clock, weather, people, prices and carbon, and forecasts of them."""

from mpc.scenario.carbon import GAS_CARBON, CarbonIntensity
from mpc.scenario.comfort import ComfortBand
from mpc.scenario.forecast import FORECAST_UNITS, Forecast, column_unit
from mpc.scenario.forecaster import DAY_AHEAD_ERRORS, ErrorGrowth, Forecaster
from mpc.scenario.gains import RADIANT_SHARES, InternalGains
from mpc.scenario.grid import Calendar, StepGrid
from mpc.scenario.occupancy import (
    OFFICE_AREA_PER_PERSON,
    OFFICE_PRESENCE,
    Occupancy,
    RandomOccupancy,
    ScheduledOccupancy,
)
from mpc.scenario.paper import paper_carbon, paper_tariff
from mpc.scenario.rates import (
    GAS_UNITS,
    KILOWATT_HOUR,
    ConstantRate,
    HourlyRate,
    MonthlyRate,
    Rate,
    SeriesRate,
    gas_price,
)
from mpc.scenario.scenario import Scenario, build_scenario, zone_areas
from mpc.scenario.tariff import DemandBuckets, DemandCharge, Tariff, window_means
from mpc.scenario.urdb import read_urdb
from mpc.scenario.weather import WEATHER_POINTS, Weather
from mpc.scenario.weather_files import read_epw, read_tmy3, read_weather_csv, sky_radiation, weather_of_case

__all__ = [
    "DAY_AHEAD_ERRORS",
    "FORECAST_UNITS",
    "GAS_CARBON",
    "GAS_UNITS",
    "KILOWATT_HOUR",
    "OFFICE_AREA_PER_PERSON",
    "OFFICE_PRESENCE",
    "RADIANT_SHARES",
    "WEATHER_POINTS",
    "Calendar",
    "CarbonIntensity",
    "ComfortBand",
    "ConstantRate",
    "DemandBuckets",
    "DemandCharge",
    "ErrorGrowth",
    "Forecast",
    "Forecaster",
    "HourlyRate",
    "InternalGains",
    "MonthlyRate",
    "Occupancy",
    "RandomOccupancy",
    "Rate",
    "Scenario",
    "ScheduledOccupancy",
    "SeriesRate",
    "StepGrid",
    "Tariff",
    "Weather",
    "build_scenario",
    "column_unit",
    "gas_price",
    "paper_carbon",
    "paper_tariff",
    "read_epw",
    "read_tmy3",
    "read_urdb",
    "read_weather_csv",
    "sky_radiation",
    "weather_of_case",
    "window_means",
    "zone_areas",
]
