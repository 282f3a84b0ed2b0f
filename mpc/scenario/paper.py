"""Prices and emissions that the paper's simulator has, in local time."""

from __future__ import annotations

from mpc.scenario.grid import Calendar
from mpc.scenario.rates import ConstantRate, HourlyRate, monthly_rate
from mpc.scenario.tariff import CarbonIntensity, Tariff

# google/sbsim, smart_control/reward: PG&E's time of use for commerce [USD/kWh], EIA's gas price for California in 2020
# [USD/kcf], carbon of the grid at the pilot [kg/MWh]; its 1000 cubic feet are 293.07107 kWh and emit 53.12 kg.
_WEEKDAY = (0.16,) * 6 + (0.18,) * 6 + (0.20,) * 7 + (0.16,) * 5
_WEEKEND = (0.16,) * 24
_GAS_BY_MONTH = (9.02, 8.35, 7.77, 7.26, 6.69, 6.86, 6.77, 6.76, 6.99, 7.19, 7.96, 8.98)
_GAS_ENERGY, _GAS_CARBON = 293.07107, 53.12  # kWh, kg
_CARBON_BY_HOUR = (
    *(88.19666493, 87.79190866, 87.87607686, 87.83054163, 88.00279618, 88.19648183, 89.70663283, 93.97947901),
    *(98.85868291, 100.7853521, 101.3866866, 101.7795612, 102.5919168, 103.4403736, 104.1380294, 104.7359292),
    *(102.0714466, 97.04226176, 93.57895651, 92.46355045, 91.72914657, 90.69209747, 89.76552213, 88.99950995),
)


def paper_tariff(calendar: Calendar | None = None) -> Tariff:
    """Prices of the paper's simulator: PG&E's time of use, gas by the month.

    The simulator reads them with the hour in UTC; here the local clock counts, as on the bill.

    Parameters
    ----------
    calendar : Calendar
        Holidays; default none.
    """
    days = calendar or Calendar()
    gas = monthly_rate([price / _GAS_ENERGY for price in _GAS_BY_MONTH])
    return Tariff(HourlyRate(_WEEKDAY, _WEEKEND, days), gas, name="PG&E as in google/sbsim")


def paper_carbon() -> CarbonIntensity:
    """Carbon intensities of the paper's simulator: average by the local hour of the day, and that of gas."""
    rate = HourlyRate([value / 1000.0 for value in _CARBON_BY_HOUR])
    return CarbonIntensity(rate, "average", ConstantRate(_GAS_CARBON / _GAS_ENERGY))
