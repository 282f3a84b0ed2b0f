"""Prices and comfort as people write them on a command line."""

import re
from pathlib import Path

from mpc.errors import ScenarioError
from mpc.scenario.occupancy import ComfortBand
from mpc.scenario.rates import GAS_UNITS, ConstantRate, gas_price
from mpc.scenario.tariff import Tariff, paper_tariff
from mpc.scenario.urdb import read_urdb
from thermal.units import to_si

_NUMBER = r"[+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?"


def read_gas_price(text: str) -> ConstantRate:
    """Read the price of gas.

    Parameters
    ----------
    text : str
        A price per kilowatt-hour of upper heating value, or with another unit behind a stroke: ``1.2/therm``.

    Raises
    ------
    ScenarioError
        When it is no price of 0 or more, or the unit is none that gas is sold by.

    Examples
    --------
    >>> round(read_gas_price("1.2/therm").value, 4), read_gas_price("0.08").value
    (0.0409, 0.08)
    """
    found = re.fullmatch(rf"\s*({_NUMBER})\s*(?:/\s*(\S+))?\s*", text)
    expected = f"a price per kWh, or with a unit such as 1.2/therm; units are {', '.join(GAS_UNITS)}"
    if found is None or float(found[1]) < 0.0 or (found[2] or "kWh") not in GAS_UNITS:
        raise ScenarioError("--gas-price", expected, repr(text))
    return gas_price(float(found[1]), found[2] or "kWh")


def read_tariff(electricity: str | None = None, gas: str | None = None, currency: str | None = None) -> Tariff:
    """Read what electricity and gas cost, as people give it.

    Parameters
    ----------
    electricity : str, optional
        A price per kilowatt-hour, or a file of the Utility Rate Database, with a colon and the number of a tier behind
        it where it has several; the paper's time of use by default.
    gas : str, optional
        As `read_gas_price` takes it; the paper's by the month by default.
    currency : str, optional
        Of both prices; USD by default. Nothing is converted, so that prices in another currency are both given.

    Raises
    ------
    ScenarioError
        When a price cannot be read, or is left out in a currency that the default is not in.

    Examples
    --------
    >>> read_tariff("0.25", "0.09", "EUR").name
    '0.25 EUR/kWh always'
    """
    default, named = paper_tariff(), currency or "USD"
    constant = electricity is not None and re.fullmatch(_NUMBER, electricity.strip()) is not None
    if named != default.currency:
        given = electricity is not None and constant and gas is not None
        ScenarioError.unless(
            given, f"--currency {named}", f"prices in {named} for electricity and gas", "prices in USD",
            "give both: --tariff PRICE --gas-price PRICE; nothing is converted",
        )  # fmt: skip
    of_gas = default.gas if gas is None else read_gas_price(gas)
    if electricity is None:
        told = default.name + ("" if gas is None else f"; gas at {gas.strip()} {named}")
        return Tariff(default.electricity, of_gas, (), named, told)
    if not constant:
        file, _, tier = electricity.rpartition(":")
        tiered = bool(file) and tier.isdigit()
        return read_urdb(Path(file if tiered else electricity), of_gas, tier=int(tier) if tiered else None)
    price = float(electricity)
    ScenarioError.unless(price >= 0.0, "--tariff", "a price of 0 or more, or a file", electricity)
    return Tariff(ConstantRate(price), of_gas, (), named, f"{price:g} {named}/kWh always")


def read_comfort(text: str) -> ComfortBand:
    """Read a comfort band.

    Parameters
    ----------
    text : str
        Lower and upper temperature of occupied hours, and of others if they are not the default's: ``21,24`` or
        ``21,24,15,30`` [degC]; with F behind a number that one is in degF, ``70F,75F``.

    Raises
    ------
    ScenarioError
        When it is no band.

    Examples
    --------
    >>> read_comfort("68F,77F").occupied
    (293.15, 298.15)
    """
    parts = [part.strip() for part in text.split(",")]
    expected = "LOW,HIGH or LOW,HIGH,LOW,HIGH, the second pair for unoccupied hours, in degC or with F behind"
    found = [re.fullmatch(rf"({_NUMBER})\s*(?:deg|°)?([CF]?)", part) for part in parts]
    ScenarioError.unless(len(parts) in (2, 4) and all(found), "--comfort", expected, repr(text))
    values = [round(float(to_si(float(m[1]), f"deg{m[2] or 'C'}", "temperature")), 6) for m in found if m]
    rising = all(low < high for low, high in zip(values[::2], values[1::2], strict=True))
    ScenarioError.unless(rising, "--comfort", expected, repr(text), "each LOW is below its HIGH")
    bands = {"occupied": (values[0], values[1])} | ({"unoccupied": (values[2], values[3])} if len(values) == 4 else {})
    return ComfortBand(**bands)  # type: ignore[arg-type]
