"""What a run bought beside electricity, and what all of it cost, step by step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mpc.kpi.record import PlantRecord
from mpc.scenario.rates import KILOWATT_HOUR
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray


class Fuel(NamedTuple):
    """What was bought beside electricity: gas, district heating, or both as one.

    Parameters
    ----------
    name : str
        In words.
    power : ndarray, shape (n_steps,)
        [W].
    price : ndarray, shape (n_steps,)
        [currency/kWh].
    """

    name: str
    power: FloatArray
    price: FloatArray


def fuel_of(record: PlantRecord, scenario: Scenario) -> Fuel:
    """Give what a run bought beside electricity; gas, none of it, where it bought nothing else.

    Parameters
    ----------
    record : PlantRecord
        Of the run, on the steps of the scenario from its first on.
    scenario : Scenario
        Prices; that of district heating is there where it was bought.
    """
    done = record.n_steps
    gas = ("gas", record.gas, scenario.gas_price)
    district = ("district heating", record.district_heating, scenario.district_price)
    found = [Fuel(name, power, price[:done]) for name, power, price in (gas, district)
             if power is not None and price is not None]  # fmt: skip
    if not found:
        return Fuel("gas", np.zeros(done), scenario.gas_price[:done])
    if len(found) == 1:
        return found[0]
    power = np.sum([fuel.power for fuel in found], axis=0)
    cost = np.sum([fuel.power * fuel.price for fuel in found], axis=0)
    mean = np.mean([fuel.price for fuel in found], axis=0)
    price = np.divide(cost, power, out=mean, where=power > 0.0)
    return Fuel(" and ".join(fuel.name for fuel in found), power, price)


def costs_of(record: PlantRecord, scenario: Scenario) -> tuple[FloatArray, FloatArray]:
    """Give what electricity cost, and what all else did, shape (n_steps,) each [currency].

    Parameters
    ----------
    record, scenario
        As of `fuel_of`.
    """
    fuel, unit = fuel_of(record, scenario), record.step / KILOWATT_HOUR
    electricity = scenario.electricity_price[: record.n_steps] * record.electricity
    return electricity * unit, fuel.price * fuel.power * unit
