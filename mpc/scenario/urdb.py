"""Tariffs of the U.S. Utility Rate Database (OpenEI)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar
from mpc.scenario.rates import HourlyRate, Rate
from mpc.scenario.tariff import DemandCharge, Tariff
from thermal._types import FloatArray
from thermal.errors import describe

# Parts of a tariff that change its bill and are not modelled.
_REFUSED = {
    "coincidentratestructure": "charges for demand at the utility's peak",
    "demandratchetpercentage": "a ratchet on the demand of earlier months",
    "lookbackpercent": "a look back at the demand of earlier months",
    "demandreactivepowercharge": "a charge for reactive power",
}


def read_urdb(
    source: str | Path | Mapping[str, Any],
    gas: Rate,
    *,
    tier: int | None = None,
    calendar: Calendar | None = None,
) -> Tariff:
    """Read an electricity tariff of the U.S. Utility Rate Database.

    Energy prices are ``rate + adj`` of the period that ``energyweekdayschedule`` or ``energyweekendschedule`` gives to
    the month and the local hour, with ``fueladjustmentsmonthly``. Demand charges are the flat one
    (``flatdemandstructure``, ``flatdemandmonths``) and the one by time of use (``demandratestructure`` and its
    schedules), over ``demandwindow`` minutes. See https://openei.org/services/doc/rest/util_rates.

    Parameters
    ----------
    source : str, Path or mapping
        JSON file, or what it holds: one tariff, or an answer of the service with one item.
    gas : Rate
        Price of gas, which the database does not have [currency/kWh].
    tier : int
        Which tier's price holds, from 0, where the price depends on what was used in the month before; the last one of
        a period with fewer. Default None: a tariff with tiers is refused, since the price a controller saves at is the
        user's to choose.
    calendar : Calendar
        Holidays, on which the weekend's schedule holds; default none.

    Returns
    -------
    Tariff
        In US dollars.

    Raises
    ------
    ScenarioError
        When the file is not such a tariff, or has a part that is not modelled: it is named.
    """
    item, where = _item(source)
    for key, what in _REFUSED.items():
        if np.any([bool(value) for value in _flat(item.get(key))]):
            raise ScenarioError(describe(f"{where}: {key}", f"a tariff without {what}", "one"))
    days = calendar or Calendar()
    prices = _prices(item, "energyratestructure", tier, where, "kWh")
    weekday, weekend = (_schedule(item, f"energy{day}schedule", len(prices), where) for day in ("weekday", "weekend"))
    adjustment = np.asarray(item.get("fueladjustmentsmonthly") or [0.0] * 12, dtype=float)
    if adjustment.shape != (12,):
        raise ScenarioError(describe(f"{where}: fueladjustmentsmonthly", "12 numbers", f"{adjustment.size}"))
    tables = [prices[table] + adjustment[:, None] for table in (weekday, weekend)]
    demand = _demand(item, tier, days, where)
    name = " ".join(str(item[key]) for key in ("utility", "name") if item.get(key))
    return Tariff(HourlyRate(tables[0], tables[1], days), gas, demand, "USD", name)


def _item(source: str | Path | Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
    where = "tariff" if isinstance(source, Mapping) else str(source)
    content: Any = source
    if not isinstance(source, Mapping):
        try:
            content = json.loads(Path(source).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ScenarioError(describe(where, "a JSON file of the Utility Rate Database", str(error))) from error
    items = content.get("items", [content]) if isinstance(content, Mapping) else content
    if not isinstance(items, Sequence) or len(items) != 1 or not isinstance(items[0], Mapping):
        found = f"{len(items)} items" if isinstance(items, Sequence) else type(items).__name__
        raise ScenarioError(describe(where, "one tariff", found, "pass the item that is meant"))
    return items[0], where


def _demand(item: Mapping[str, Any], tier: int | None, days: Calendar, where: str) -> list[DemandCharge]:
    window = 60.0 * float(item.get("demandwindow") or 15.0)
    charges = []
    if item.get("flatdemandstructure"):
        rates = _prices(item, "flatdemandstructure", tier, where, "kW", item.get("flatdemandunit"))
        months = _integers(item, "flatdemandmonths", (12,), len(rates), where)
        charges.append(DemandCharge(rates.tolist(), np.repeat(months[:, None], 24, axis=1), None, window, "flat", days))
    if item.get("demandratestructure"):
        rates = _prices(item, "demandratestructure", tier, where, "kW", item.get("demandrateunit"))
        week, end = (_schedule(item, f"demand{day}schedule", len(rates), where) for day in ("weekday", "weekend"))
        charges.append(DemandCharge(rates.tolist(), week, end, window, "time of use", days))
    return [charge for charge in charges if any(charge.rates)]


def _prices(
    item: Mapping[str, Any], key: str, tier: int | None, where: str, unit: str, given: str | None = None
) -> FloatArray:
    """Price of each period of a structure."""
    structure = item.get(key)
    if not isinstance(structure, Sequence) or not structure or not all(structure):
        raise ScenarioError(describe(f"{where}: {key}", "periods of tiers", repr(structure)[:60]))
    prices = []
    for number, tiers in enumerate(structure):
        at = f"{where}: {key}[{number}]"
        if len(tiers) > 1 and tier is None:
            found = f"{len(tiers)}, the first up to {tiers[0].get('max')} {unit}"
            raise ScenarioError(describe(at, "one tier", found, "choose one by `tier`"))
        ScenarioError.unless((tier or 0) >= 0, "tier", "0 or more", repr(tier))
        chosen = tiers[min(tier or 0, len(tiers) - 1)]
        named = chosen.get("unit") or given or unit
        ScenarioError.unless(named == unit, f"{at}: unit", repr(unit), repr(named))
        try:
            prices.append(float(chosen.get("rate") or 0.0) + float(chosen.get("adj") or 0.0))
        except (TypeError, ValueError) as error:
            raise ScenarioError(describe(f"{at}: rate", "a number", repr(chosen))) from error
    return np.array(prices)


def _schedule(item: Mapping[str, Any], key: str, periods: int, where: str) -> NDArray[np.int64]:
    return _integers(item, key, (12, 24), periods, where)


def _integers(item: Mapping[str, Any], key: str, shape: tuple[int, ...], periods: int, where: str) -> NDArray[np.int64]:
    expected = f"{' x '.join(map(str, shape))} whole numbers from 0 to {periods - 1}"
    try:
        table = np.asarray(item.get(key), dtype=float)
    except (TypeError, ValueError) as error:
        raise ScenarioError(describe(f"{where}: {key}", expected, repr(item.get(key))[:60])) from error
    if table.shape != shape or not np.isin(table, np.arange(periods)).all():
        found = "nothing" if item.get(key) is None else f"shape {table.shape}, values {np.unique(table)[:8].tolist()}"
        raise ScenarioError(describe(f"{where}: {key}", expected, found))
    return table.astype(np.int64)


def _flat(value: Any) -> list[Any]:
    """Numbers of nested lists; a mapping stands for itself."""
    return [x for part in value for x in _flat(part)] if isinstance(value, list) else [value]
