"""What the page shows of a plan: bands, expected temperatures, price and cost, in plain types."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from mpc.live.site import Site

_JOULES = 3.6e6  # of a kilowatt hour

#: Points whose means are bought electricity [W].
_METER = "/electrical_power_sensor"


def picture(site: Site, plan: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any] | None:
    """Collect what a plan expects and what it must keep to; None where there is no forecast.

    Parameters
    ----------
    site : Site
        As read.
    plan, inputs : mapping
        Of `mpc.live.planner.Planner.plan`.

    Returns
    -------
    dict
        ``begin`` and ``step`` [s]; ``number`` of the plan; ``price`` [currency/kWh], ``outdoor`` [K] over the steps;
        ``zones``: of each ``lower``, ``upper`` over the steps and ``expected`` at their edges [K]; ``power`` [W] and
        ``cost`` [currency] of the plan, and ``rule``: ``plan``, ``rule``, what both cost by the model [currency], and
        ``saving`` [-]; None where it says nothing of them.
    """
    forecast = inputs["forecast"]
    if forecast is None:
        return None
    table = dict(zip(forecast["columns"], forecast["values"], strict=True))

    def of(name: str) -> list[float | None]:
        return [None if v is None else round(v, 3) for v in table.get(name, [])]

    ahead, price = plan.get("ahead"), of("electricity_price")
    zones: dict[str, Any] = {
        zone: {"lower": of(f"{zone}/comfort_lower_temperature"), "upper": of(f"{zone}/comfort_upper_temperature"),
               "expected": None}
        for zone in site.plant.zones
    }  # fmt: skip
    power, cost, rule = None, None, None
    if ahead is not None:
        power = [round(row[0], 1) for row in ahead["power"]]
        for k, zone in enumerate(zones):
            zones[zone]["expected"] = [round(row[k], 3) for row in ahead["zone"]]
        rule = ahead.get("rule")
        other = "gas_price" if "gas_price" in table else "district_heating_price"
        prices = [of("electricity_price"), of(other)]
        hours = ahead["step"] / _JOULES
        rows = [zip(ahead["power"], one, strict=False) for one in prices]
        cost = sum(row[k] * (p or 0.0) * hours for k, one in enumerate(rows) for row, p in one)
    return {
        "number": plan["number"], "begin": inputs["begin"], "step": site.step, "price": price, "zones": zones,
        "outdoor": of("outside_air_temperature_sensor"), "power": power, "cost": cost, "rule": rule,
        "currency": site.plant.prices.currency if site.plant.prices is not None else "",
    }  # fmt: skip


class DayCost:
    """Cost of the electricity that meters of a site have shown since local midnight.

    Parameters
    ----------
    site : Site
        As read.
    before : mapping, optional
        What an earlier one gave, to go on from on the same day.
    """

    def __init__(self, site: Site, before: Mapping[str, Any] | None = None) -> None:
        self.meters = [name for name in site.file.points if name.endswith(_METER)]
        self._zone, self._step = site.plant.location.timezone, site.step
        self._state: dict[str, Any] = dict(before or {})
        self._price: tuple[float, float] | None = None

    def add(self, inputs: Mapping[str, Any]) -> dict[str, Any] | None:
        """Add the step that has ended; give ``since`` [s], ``cost`` [currency], and ``steps``, those that are known.

        Parameters
        ----------
        inputs : mapping
            Of the plan.
        """
        begin, forecast = float(inputs["begin"]), inputs["forecast"]
        if not self.meters:
            return None
        midnight = pd.Timestamp(begin, unit="s", tz="UTC").tz_convert(self._zone).normalize().timestamp()
        if self._state.get("since") != midnight:
            self._state = {"since": midnight, "until": midnight, "cost": 0.0, "steps": 0}
        powers = [inputs["means"].get(name) for name in self.meters]
        ended = self._price is not None and abs(self._price[0] + self._step - begin) < 1.0
        if self._price is not None and ended and self._state["until"] < begin and None not in powers:
            energy = sum(float(p) for p in powers if p is not None) * self._step / _JOULES
            self._state |= {"until": begin, "cost": self._state["cost"] + energy * self._price[1],
                            "steps": self._state["steps"] + 1}  # fmt: skip
        self._price = None
        if forecast is not None and "electricity_price" in forecast["columns"]:
            price = forecast["values"][forecast["columns"].index("electricity_price")][0]
            self._price = None if price is None else (begin, float(price))
        return dict(self._state)
