"""What a description says of battery, photovoltaics and charges, for optimal control."""

from __future__ import annotations

from mpc.adapters.described.schema import PlantFile
from mpc.control.identified.electric import Electric, Photovoltaic
from thermal.components.battery import Battery


def electric_of(file: PlantFile) -> Electric | None:
    """Read it from a description; None where electricity has a price only.

    Parameters
    ----------
    file : PlantFile
        As read.
    """
    entry, prices = file.electric, file.prices
    demand = 0.0 if prices is None or prices.demand is None else prices.demand
    if entry is None:
        return Electric(demand=demand) if demand else None
    modules = None if entry.photovoltaic is None else Photovoltaic(**entry.photovoltaic.model_dump())
    told = entry.battery
    if told is None:
        return Electric(photovoltaic=modules, feed_in=entry.feed_in, demand=demand)
    battery = Battery(told.capacity, told.power, told.charging, told.discharging)
    return Electric(battery, told.command, told.level, modules, entry.feed_in, demand)
