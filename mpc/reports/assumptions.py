"""What costs on a page rest on: plant, weather, tariff, prices, people, comfort, emissions."""

import numpy as np

from mpc.reports.page import counted, significant
from mpc.scenario.occupancy import ComfortBand, Occupancy, ScheduledOccupancy
from mpc.studies.described import SeenStudy
from mpc.studies.study import Study
from thermal._types import FloatArray

_CELSIUS = 273.15

_PLANTS = {
    "reduced": "its few slow modes (accurate to hundredths of a degree)",
    "grid": "every control volume of the grid",
    "random": "every control volume of the grid, air mixed at random",
}


def assumption_rows(study: Study | SeenStudy) -> list[tuple[str, str]]:
    """Rows of the table of what was assumed, each with its value in words.

    Parameters
    ----------
    study : Study or SeenStudy
        What controllers ran on.
    """
    return _of_plant(study) if isinstance(study, SeenStudy) else _of_case(study)


def _of_plant(study: SeenStudy) -> list[tuple[str, str]]:
    """Of a described plant: its description says all, and each edge of a band by the hour."""
    scenario, n = study.scenario, study.steps
    bands = [f"{_span(edge[:n] - _CELSIUS)} °C" for edge in (scenario.lower, scenario.upper)]
    return [
        ("plant", f"Simulated, not a real building: {study.setup}."),
        *_prices(study),
        ("currency", f"{scenario.currency}, as the description has it; nothing is converted"),
        ("comfort band", f"lower edge {bands[0]}, upper edge {bands[1]}, by the hour as described"),
        _discomfort(study),
    ]


def _prices(study: Study | SeenStudy) -> list[tuple[str, str]]:
    scenario, n = study.scenario, study.steps
    both = (scenario.electricity_price, scenario.gas_price)
    electricity, gas = (listed_prices(of[:n], scenario.currency) for of in both)
    burnt = [("gas price", f"{gas} per kWh of upper heating value")] if np.any(scenario.gas_price[:n]) else []
    district = [] if scenario.district_price is None else [
        ("district heating price", f"{listed_prices(scenario.district_price[:n], scenario.currency)} per kWh")
    ]  # fmt: skip
    return [("electricity price", f"{electricity} per kWh"), *burnt, *district]


def _discomfort(study: Study | SeenStudy) -> tuple[str, str]:
    price = f"{study.comfort_price:g} {study.scenario.currency}"
    return ("price of discomfort", f"{price} for a zone's kelvin outside of its band for an hour: what optimal control "
            "weighs energy against; it is on no bill")  # fmt: skip


def _of_case(study: Study) -> list[tuple[str, str]]:
    scenario, given, n = study.scenario, study.settings, study.steps
    currency, heat = scenario.currency, scenario.heat
    sensors = "with noise" if given.noise is not None else "exact"
    weather = f"{study.weather[:1].upper()}{study.weather[1:]}"
    demand = [f"{charge.name}: {listed_prices(np.asarray(charge.rates), currency)} per kW and month" for charge in
              given.tariff.demand]  # fmt: skip
    emissions = scenario.electricity_carbon[:n] * 1000.0
    rows = [
        ("plant", f"Simulated, not the real building: the model of the case with the parameters given, stepped by "
         f"{_PLANTS[given.kind]}, in closed loop with a simulated HVAC system; sensors {sensors}."),
        ("weather", f"{weather}; forecasts "
         f"{'with the errors of a day-ahead forecast' if given.errors else 'perfect'}."),
        ("tariff", given.tariff.name or "given"),
        *_prices(study),
        ("demand charges", "; ".join(demand) or "none"),
        ("fixed charges, taxes", "left out: no controller changes them"),
        ("currency", f"{currency}, as the tariff has it; nothing is converted"),
        ("occupancy", _people_words(scenario.people, scenario.assigned, scenario.floor_area)),
        ("internal gains", _gain_words(heat.sensible, heat.equipment, heat.lights)),
        ("comfort band", comfort_band_words(given.comfort or ComfortBand())),
        _discomfort(study),
    ]  # fmt: skip
    if scenario.carbon_kind:
        rows.append(("emissions", f"electricity {_span(emissions)} g CO₂ per kWh ({scenario.carbon_kind}), gas "
                     f"{significant(1000.0 * float(scenario.gas_carbon[:n].mean()))} g CO₂ per kWh"))  # fmt: skip
    return rows


def listed_prices(prices: FloatArray, currency: str) -> str:
    """Spell the prices of a run: one, or the lowest and the highest.

    Parameters
    ----------
    prices : ndarray, shape (n,)
        Prices [currency/unit].
    currency : str
        Of them.

    Examples
    --------
    >>> listed_prices(np.array([0.16, 0.2]), "EUR")
    '0.16 to 0.2 EUR'
    """
    low, high = (f"{end:.4g}" for end in (float(np.min(prices)), float(np.max(prices))))
    return f"{low} {currency}" if low == high else f"{low} to {high} {currency}"


def _span(values: FloatArray) -> str:
    low, high = (significant(float(end), 2) for end in (np.min(values), np.max(values)))
    return low if low == high else f"{low} to {high}"


def comfort_band_words(band: ComfortBand) -> str:
    """Spell a comfort band with its hours.

    Parameters
    ----------
    band : ComfortBand
        Of all zones.

    Examples
    --------
    >>> comfort_band_words(ComfortBand())[:45]
    '21 to 24 °C when occupied (Monday to Friday 6'
    """
    inside, outside = (
        f"{low - _CELSIUS:.4g} to {high - _CELSIUS:.4g} °C" for low, high in (band.occupied, band.unoccupied)
    )
    days = (("Monday to Friday", band.weekday), ("Saturday", band.saturday), ("Sunday", band.sunday))
    hours = [f"{day} {of[0]:g} to {of[1]:g} h" for day, of in days if of is not None]
    return f"{inside} when occupied ({', '.join(hours) or 'never'}), {outside} otherwise"


def _people_words(people: Occupancy, assigned: FloatArray, area: float) -> str:
    total = float(assigned.sum())
    text = f"{counted(round(total), 'person').replace('persons', 'people')}"
    text += f" (one per {significant(area / total)} m²)" if total > 0.0 else ""
    if not isinstance(people, ScheduledOccupancy):
        return f"{text}, {'always in' if type(people) is Occupancy else 'who come and go at random'}"
    share = np.asarray(people.presence, dtype=float)
    present = [f"{name} up to {100 * row.max():.0f} %" for name, row in
               zip(("weekdays", "Saturdays", "Sundays"), share, strict=True) if row.max() > 0.0]  # fmt: skip
    busy = np.flatnonzero(share[0] >= 0.5)
    when = f", mostly from {busy[0]} to {busy[-1] + 1} h" if busy.size else ""
    return f"{text}; present: {', '.join(present) or 'never'}{when}"


def _gain_words(sensible: float, equipment: float, lights: float) -> str:
    if not sensible and not equipment and not lights:
        return "those of the calibrated effect, none is added"
    return f"{sensible:.3g} W a person; equipment {equipment:.3g} W/m², lights {lights:.3g} W/m² when all are in"
