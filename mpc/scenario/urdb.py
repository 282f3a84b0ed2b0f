"""Tariffs of the U.S. Utility Rate Database (OpenEI)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar
from mpc.scenario.rates import HourlyRate, Rate
from mpc.scenario.tariff import DemandCharge, Tariff
from thermal._types import FloatArray, IntArray

# Parts of a tariff that change its bill and are not modelled.
_REFUSED = {
    "coincidentratestructure": "charges for demand at the utility's peak",
    "demandratchetpercentage": "a ratchet on the demand of earlier months",
    "lookbackpercent": "a look back at the demand of earlier months",
    "demandreactivepowercharge": "a charge for reactive power",
}


def read_urdb(
    source: str | Path | Mapping[str, Any], gas: Rate, *, tier: int | None = None, calendar: Calendar | None = None
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
    item, days = _found(source, tier), calendar or Calendar()
    for key, what in _REFUSED.items():
        none = not any(map(bool, _flat(item.parts.get(key))))
        ScenarioError.unless(none, f"{item.where}: {key}", f"a tariff without {what}", "one")
    prices = item.prices("energyratestructure", "kWh")
    adjustment = np.asarray(item.parts.get("fueladjustmentsmonthly") or [0.0] * 12, dtype=float)
    twelve = adjustment.shape == (12,)
    ScenarioError.unless(twelve, f"{item.where}: fueladjustmentsmonthly", "12 numbers", f"{adjustment.size}")
    tables = [prices[table] + adjustment[:, None] for table in item.schedules("energy", len(prices))]
    name = " ".join(str(item.parts[key]) for key in ("utility", "name") if item.parts.get(key))
    return Tariff(HourlyRate(tables[0], tables[1], days), gas, _demand(item, days), "USD", name)


def _found(source: str | Path | Mapping[str, Any], tier: int | None) -> _Item:
    where = "tariff" if isinstance(source, Mapping) else str(source)
    content: Any = source
    if not isinstance(source, Mapping):
        try:
            content = json.loads(Path(source).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            found = "no such file" if isinstance(error, FileNotFoundError) else str(error)
            expected = "a price per kilowatt-hour, such as 0.25, or a JSON file of the Utility Rate Database"
            raise ScenarioError(where, expected, found) from error
    items = content.get("items", [content]) if isinstance(content, Mapping) else content
    if not isinstance(items, Sequence) or len(items) != 1 or not isinstance(items[0], Mapping):
        found = f"{len(items)} items" if isinstance(items, Sequence) else type(items).__name__
        raise ScenarioError(where, "one tariff", found, "pass the item that is meant")
    return _Item(items[0], where, tier)


def _demand(item: _Item, days: Calendar) -> list[DemandCharge]:
    window = 60.0 * float(item.parts.get("demandwindow") or 15.0)
    charges = []
    if item.parts.get("flatdemandstructure"):
        rates = item.prices("flatdemandstructure", "kW", "flatdemandunit")
        months = np.repeat(item.integers("flatdemandmonths", (12,), len(rates))[:, None], 24, axis=1)
        charges.append(DemandCharge(rates.tolist(), months, None, window, "flat", days))
    if item.parts.get("demandratestructure"):
        rates = item.prices("demandratestructure", "kW", "demandrateunit")
        week, end = item.schedules("demand", len(rates))
        charges.append(DemandCharge(rates.tolist(), week, end, window, "time of use", days))
    return [charge for charge in charges if any(charge.rates)]


class _Item(NamedTuple):
    """A tariff as the database has it, where it stands, and which tier counts."""

    parts: Mapping[str, Any]
    where: str
    tier: int | None

    def prices(self, key: str, unit: str, given: str = "") -> FloatArray:
        """Price of each period of a structure."""
        structure, tier, prices = self.parts.get(key), self.tier, []
        if not isinstance(structure, Sequence) or not structure or not all(structure):
            raise ScenarioError(f"{self.where}: {key}", "periods of tiers", repr(structure)[:60])
        ScenarioError.unless((tier or 0) >= 0, "tier", "0 or more", repr(tier))
        for number, tiers in enumerate(structure):
            at, found = f"{self.where}: {key}[{number}]", f"{len(tiers)}, the first up to {tiers[0].get('max')} {unit}"
            advice = "choose one, the first by --tariff FILE:0 (tier=0)"
            ScenarioError.unless(len(tiers) == 1 or tier is not None, at, "one tier", found, advice)
            chosen = tiers[min(tier or 0, len(tiers) - 1)]
            named = chosen.get("unit") or self.parts.get(given) or unit
            ScenarioError.unless(named == unit, f"{at}: unit", repr(unit), repr(named))
            try:
                prices.append(float(chosen.get("rate") or 0.0) + float(chosen.get("adj") or 0.0))
            except (TypeError, ValueError) as error:
                raise ScenarioError(f"{at}: rate", "a number", repr(chosen)) from error
        return np.array(prices)

    def schedules(self, of: str, periods: int) -> list[IntArray]:
        """Period of each month and hour, on weekdays and at weekends."""
        return [self.integers(f"{of}{day}schedule", (12, 24), periods) for day in ("weekday", "weekend")]

    def integers(self, key: str, shape: tuple[int, ...], periods: int) -> IntArray:
        """Whole numbers of a shape, below the number of periods."""
        given, where = self.parts.get(key), f"{self.where}: {key}"
        expected = f"{' x '.join(map(str, shape))} whole numbers from 0 to {periods - 1}"
        try:
            table = np.asarray(given, dtype=float)
        except (TypeError, ValueError) as error:
            raise ScenarioError(where, expected, repr(given)[:60]) from error
        found = "nothing" if given is None else f"shape {table.shape}, values {np.unique(table)[:8].tolist()}"
        fit = table.shape == shape and bool(np.isin(table, np.arange(periods)).all())
        ScenarioError.unless(fit, where, expected, found)
        return table.astype(np.int64)


def _flat(value: Any) -> list[Any]:
    """Numbers of nested lists; a mapping stands for itself."""
    return [x for part in value for x in _flat(part)] if isinstance(value, list) else [value]
