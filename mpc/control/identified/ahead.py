"""What a controller of an identified plant reads from a forecast."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.control.identified.beyond import WEIGHTS
from mpc.identify.machines import as_heated
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import CARRIERS, facade_sun
from mpc.scenario.forecast import Forecast
from mpc.scenario.grid import hours_of_week
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE

_PRICES = {carrier: f"{carrier}_price" for carrier in CARRIERS}


@dataclass(frozen=True, eq=False)
class Ahead:
    """What is expected over a horizon, one row a step.

    Parameters
    ----------
    outdoor : ndarray, shape (N,)
        Outdoor air [K].
    sun : ndarray, shape (N, n_sun)
        Irradiances [W/m2].
    gain : ndarray, shape (N, n_zone)
        Heat of people, and the constant one [W].
    prices : ndarray, shape (N, n_carrier)
        Of each of `CARRIERS` [currency/kWh].
    lower, upper : ndarray, shape (N, n_zone)
        Comfort bands [K].
    occupied : ndarray of bool, shape (N, n_zone)
        Whether people are expected.
    beyond : ndarray, shape (N, n_machine, n_weight)
        Weights of what machines buy beyond their maps, see `mpc.control.identified.beyond` [W].
    together : ndarray, shape (N,)
        Largest load of all machines that setpoints lead, a share of their full loads; infinite where none is known [-].
    hours : ndarray of int, shape (N,)
        Of the week, local.
    running : ndarray, shape (N,)
        Share that an air handler runs: by itself before a plan, and as planned in what is kept of it [-].
    """

    outdoor: FloatArray
    sun: FloatArray
    gain: FloatArray
    prices: FloatArray
    lower: FloatArray
    upper: FloatArray
    occupied: np.ndarray
    beyond: FloatArray
    together: FloatArray
    hours: np.ndarray
    running: FloatArray

    def edges(self, sign: float) -> tuple[FloatArray, FloatArray]:
        """Give the edges that machines keep zones from, and those beyond which they never drive them, as `as_heated`.

        Parameters
        ----------
        sign : float
            1 where machines heat, -1 where they cool [-].

        Returns
        -------
        tuple of ndarray, shape (N, n_zone)
            Lower edges and upper ones where they heat; upper and lower ones, mirrored, where they cool [K].
        """
        near, far = (self.lower, self.upper) if sign > 0.0 else (self.upper, self.lower)
        return as_heated(near, sign), as_heated(far, sign)

    @classmethod
    def of(cls, model: PlantModel, forecast: Forecast, location: Location) -> Ahead:
        """Read a forecast.

        Parameters
        ----------
        model : PlantModel
            Whose zones and irradiances are wanted.
        forecast : Forecast
            Of the plant.
        location : Location
            Where it stands.
        """
        table, zones = forecast.table, model.box.zones

        def of_zones(name: str) -> list[str]:
            return [f"{zone}/{name}" for zone in zones]

        edges = of_zones("comfort_lower_temperature"), of_zones("comfort_upper_temperature")
        told = [name for name in (*of_zones("occupancy_count_sensor"), *of_zones("internal_gain"), *_PRICES.values())
                if name in table]  # fmt: skip
        names = [OUTDOOR_TEMPERATURE, *edges[0], *edges[1], *told]
        known = dict(zip(names, forecast.values(names, fill="hold").T, strict=True))

        def columns(wanted: list[str]) -> FloatArray:
            return np.column_stack([known.get(name, np.zeros(len(table))) for name in wanted])

        suns = facade_sun(location, model.step, table) if model.box.suns else {}
        sun = (
            np.column_stack([suns[name] for name in model.box.suns])
            if suns
            else np.zeros((len(table), len(model.box.suns)))
        )
        people = of_zones("occupancy_count_sensor")
        occupied = columns(people) > 0.0 if people[0] in known else np.ones((len(table), len(zones)), dtype=bool)
        return cls(
            known[OUTDOOR_TEMPERATURE], np.nan_to_num(sun),
            columns(of_zones("internal_gain")) + model.box.parts["constant gain"],
            columns([*_PRICES.values()]), columns(edges[0]), columns(edges[1]), occupied,
            np.zeros((len(table), len(model.maps), WEIGHTS)), np.full(len(table), np.inf),
            hours_of_week(pd.DatetimeIndex(table.index), model.step), np.zeros(len(table)),
        )  # fmt: skip
