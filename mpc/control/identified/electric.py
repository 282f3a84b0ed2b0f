"""What of a plant is electric beside its machines: battery, photovoltaics, a price of feeding in, a demand charge."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pandas as pd

from mpc.errors import ControlError
from mpc.scenario.forecast import Forecast
from mpc.scenario.rates import HOUR
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.components.battery import Battery
from thermal.inputs.sun import suffices, sun_of

#: Price of what must not be [currency/kWh]: power that nobody delivers, energy that is not in the battery. Some times
#: any tariff, so that bounds hold, and not more, for the solver's sake.
_FORBIDDEN = 5.0

#: Irradiance at which a module's power is told [W/m2] (IEC 61215).
_STANDARD = 1000.0


@dataclass(frozen=True)
class Photovoltaic:
    """Modules on a plane.

    Parameters
    ----------
    peak : float
        Power at 1000 W/m2 [W], positive.
    azimuth, tilt : float
        Of the plane's normal, clockwise from north, and from the vertical [deg].
    performance : float
        Power over that of the irradiance alone [-]: heat, inverter and dirt; IEC 61724 calls it performance ratio.

    Raises
    ------
    ControlError
        When a number is out of range.
    """

    peak: float
    azimuth: float = 180.0
    tilt: float = 35.0
    performance: float = 0.86

    def __post_init__(self) -> None:
        fits = self.peak > 0.0 and 0.0 < self.performance <= 1.0 and 0.0 <= self.tilt <= 90.0
        found = f"{self.peak:g} W, {self.performance:g}, {self.tilt:g} deg"
        ControlError.unless(
            fits, "photovoltaic", "a peak above 0 W, a performance to 1, a tilt from 0 to 90 deg", found
        )

    def power(self, forecast: Forecast, location: Location, step: float) -> FloatArray:
        """Power along a forecast, shape (N,) [W].

        Parameters
        ----------
        forecast : Forecast
            With the sun.
        location : Location
            Where they stand.
        step : float
            Length of a step [s].

        Raises
        ------
        ControlError
            When the forecast has no sun.
        """
        table = forecast.table
        ControlError.unless(
            suffices(table), "photovoltaic", "a forecast of beam and diffuse or global irradiance", "none"
        )
        beam, diffuse = sun_of(location, pd.DatetimeIndex(table.index), step, table).plane(self.azimuth, self.tilt)
        return np.asarray(self.peak * self.performance * np.nan_to_num(beam + diffuse) / _STANDARD)


@dataclass(frozen=True)
class Electric:
    """What is decided on, and what it is paid by.

    Parameters
    ----------
    battery : Battery, optional
        With its efficiencies.
    command, level : str
        The battery's actuator, from -1 to 1 of its power, and the column that says how full it is [-].
    photovoltaic : Photovoltaic, optional
        Modules.
    feed_in : float
        Paid for what is fed into the grid [currency/kWh], never more than the price at which is bought.
    demand : float
        Charge for the highest mean over a control step of a month [currency/kW], 0 or more.

    Raises
    ------
    ControlError
        When a battery has no actuator or level, or the charge is negative.
    """

    battery: Battery | None = None
    command: str = ""
    level: str = ""
    photovoltaic: Photovoltaic | None = None
    feed_in: float = 0.0
    demand: float = 0.0

    def __post_init__(self) -> None:
        told = self.battery is None or (bool(self.command) and bool(self.level))
        ControlError.unless(told, "battery", "its actuator and the column of its charge level", "none")
        ControlError.unless(self.demand >= 0.0, "demand charge", "0 or more", f"{self.demand:g}")


@dataclass(frozen=True)
class ElectricNow:
    """State of what is electric, and what is ahead of it.

    Parameters
    ----------
    generation : ndarray, shape (N,)
        Of the photovoltaics [W].
    level : float
        How full the battery is [-].
    peak : float
        Highest mean of a step of this month so far [W].
    """

    generation: FloatArray
    level: float = 0.0
    peak: float = 0.0


class ElectricStage:
    """States, decisions and bands that are added to the stages of a plant, in kW and shares.

    Bought power ``i`` is a decision that is at least the net power, so that the cost ``(p - f) i + f net`` is a convex
    one of a price p of buying above that f of feeding in. The peak ``m' = m + r`` is at least what is bought; its
    charge is paid at the end of the horizon. The battery's level is ``e' = e + (η_c c - d / η_d) P Δt / E``. Each
    inequality is a band of a state that holds its excess, at a price that is never worth paying: linear, whatever the
    maps are.

    Parameters
    ----------
    electric : Electric
        What there is.
    most : float
        Largest power that machines and all else take [W].
    step : float
        Length of a step [s].
    """

    def __init__(self, electric: Electric, most: float, step: float) -> None:
        self.electric, self.hours = electric, step / HOUR
        battery = electric.battery
        self.power = 0.0 if battery is None else battery.power / 1e3
        self.most = most / 1e3 + self.power
        self.energy = 0.0 if battery is None else battery.capacity / (1e3 * HOUR)
        names = ["over"] + ["above", "peak"] * bool(electric.demand) + ["level"] * (battery is not None)
        choices = ["bought"] + ["rise"] * bool(electric.demand) + ["charge", "discharge"] * (battery is not None)
        self.state = {name: ca.SX.sym(name) for name in names}
        self.decision = {name: ca.SX.sym(name) for name in choices}
        self.generation = ca.SX.sym("generation")
        self.banded = [name for name in names if name != "peak"]

    def following(self, machines: ca.SX, price: ca.SX) -> tuple[ca.SX, ca.SX]:
        """States after a step, and what it costs [currency].

        Parameters
        ----------
        machines : casadi.SX
            Power of the machines and of all else [W].
        price : casadi.SX
            At which is bought [currency/kWh].
        """
        chosen, x = self.decision, self.state
        net = machines / 1e3 - self.generation
        if "charge" in chosen:
            net += self.power * (chosen["charge"] - chosen["discharge"])
        bought = self.most * chosen["bought"]
        after = {"over": net - bought}
        if "rise" in chosen:
            after["peak"] = x["peak"] + self.most * chosen["rise"]
            after["above"] = bought - after["peak"]
        battery = self.electric.battery
        if battery is not None:
            into = battery.charging * chosen["charge"] - chosen["discharge"] / battery.discharging
            after["level"] = x["level"] + into * self.power * self.hours / self.energy
        feed_in = ca.fmin(self.electric.feed_in, price)
        return ca.vertcat(*(after[name] for name in x)), ((price - feed_in) * bought + feed_in * net) * self.hours

    @property
    def end_cost(self) -> ca.SX:
        """Demand charge of the peak at the end of the horizon [currency]."""
        return self.electric.demand * self.state["peak"] if "peak" in self.state else ca.SX(0)

    def start(self, now: ElectricNow) -> FloatArray:
        """States before the first step.

        Parameters
        ----------
        now : ElectricNow
            As it is.
        """
        told = {"over": 0.0, "above": 0.0, "peak": now.peak / 1e3, "level": now.level}
        return np.array([told[name] for name in self.state])

    def bands(self, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Lower and upper ends of the bands at the edges of the steps, and prices of leaving them, (N + 1, n_band).

        Parameters
        ----------
        count : int
            Steps of the horizon.
        """
        price = _FORBIDDEN * self.hours
        told = {"over": (-np.inf, 0.0, price + self.electric.demand),
                "above": (-np.inf, 0.0, price + 2.0 * self.electric.demand),
                "level": (0.0, 1.0, _FORBIDDEN * self.energy + 2.0 * self.electric.demand * self.energy)}  # fmt: skip
        columns = np.array([told[name] for name in self.banded]).T
        lower, upper, prices = (np.repeat(row[None], count + 1, axis=0) for row in columns)
        return lower, upper, prices

    def command(self, decisions: FloatArray) -> float:
        """Command of the battery from the decisions of a step, from -1 to 1 [-].

        Parameters
        ----------
        decisions : ndarray, shape (n_decision,)
            Added to the machines' [-].
        """
        told = dict(zip(self.decision, decisions, strict=True))
        return float(np.clip(told["charge"] - told["discharge"], -1.0, 1.0))
