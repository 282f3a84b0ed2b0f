"""Rewards of a step: the paper's weighted regret, and minus the cost of the step."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from mpc.errors import MpcError
from mpc.kpi.record import excess
from mpc.scenario.rates import HOUR, KILOWATT_HOUR
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.components.operations import Value

Pair = tuple[ArrayLike, ArrayLike]  # lower and upper edge, or electricity and gas
Factors = tuple[float, float]  # of electricity and of gas
_NOBODY = 1e-12  # people, or currency: nothing, to be divided by


class StepValues(NamedTuple):
    """What a reward is made of: a step of a plant, as numbers and arrays, or as traced values of many plants.

    Parameters
    ----------
    start, end : Value, shape (n_zone,)
        Temperatures of the zones at its ends, counted from where the band is [K].
    lower, upper : Value, shape (n_zone,)
        Edges of the comfort band [K].
    people : Value, shape (n_zone,)
        In the zones [-].
    powers : tuple of Value
        Electricity and gas, means over the step [W].
    prices, carbons : tuple of Value
        Of both [currency/kWh], [kg/kWh].
    step : float
        Length [s].
    """

    start: Value
    end: Value
    lower: Value
    upper: Value
    people: Value
    powers: tuple[Value, Value]
    prices: tuple[Value, Value]
    carbons: tuple[Value, Value]
    step: float


class RewardTerms(NamedTuple):
    """Reward of a step and what it is made of.

    Parameters
    ----------
    reward : ndarray, shape (...,)
        Weighted mean of the terms, -1 to 0 [-].
    comfort : ndarray, shape (...,)
        Regret of productivity, or of setpoint deviation, -1 to 0 [-].
    cost : ndarray, shape (...,)
        Minus cost over the highest cost, -1 to 0 [-].
    carbon : ndarray, shape (...,)
        Minus emissions over the highest emissions, -1 to 0 [-].
    """

    reward: FloatArray
    comfort: FloatArray
    cost: FloatArray
    carbon: FloatArray


@dataclass(frozen=True)
class PaperReward:
    """Weighted sum of negative cost functions for comfort, energy cost and carbon, as the paper defines its reward.

    ``r = (u c - v f / f_max - w g / g_max) / (u + v + w)``, each term between -1 and 0. The paper gives the sum; how
    each term is normalised is that of its simulator (google/sbsim, SetpointEnergyCarbonRegretFunction):

    - **comfort** c, ``productivity``: a person earns P_max an hour within the band, and
      ``P_max / (1 + e^{-s (m - d)})`` at a distance d outside of it: half at d = m. The sum over zones, weighed with
      their people, is at least P_min for each, and ``c = (P - P_min) / (P_max - P_min) - 1``; 0 when nobody is in. (At
      the edge itself the curve jumps from 1 to ``1 / (1 + e^{-s m})``, 0.90 with the defaults, in the simulator too.)
    - **comfort** c, ``setpoint_deviation``: the paper's words instead: minus the mean over zones of d, occupied or not,
      as a share of `deviation_scale`, at most 1.
    - **cost** f: energy prices times powers, powers capped at their highest; f_max with the highest powers.
    - **carbon** g: emissions, in the same way.

    Parameters
    ----------
    comfort : str
        ``productivity`` (default) or ``setpoint_deviation``.
    comfort_weight, cost_weight, carbon_weight : float
        u, v, w [-], not negative; defaults of the simulator's configuration.
    highest_electricity, highest_gas : float
        Powers that normalise [W]; defaults are those of the simulator's pilot building.
    highest_productivity, lowest_productivity : float
        P_max and P_min [USD/h] of a person; defaults of the simulator.
    half_distance : float
        m [K]; default of the simulator.
    stiffness : float
        s [1/K]; default of the simulator.
    deviation_scale : float
        Distance that counts as the worst [K]; an assumption: the paper has none.

    Raises
    ------
    MpcError
        When a number is out of range or the comfort term is not known.
    """

    comfort: Literal["productivity", "setpoint_deviation"] = "productivity"
    comfort_weight: float = 0.2
    cost_weight: float = 0.4
    carbon_weight: float = 0.4
    highest_electricity: float = 160e3
    highest_gas: float = 400e3
    highest_productivity: float = 300.0
    lowest_productivity: float = 100.0
    half_distance: float = 0.5
    stiffness: float = 4.3
    deviation_scale: float = 3.0

    def __post_init__(self) -> None:
        terms = ("productivity", "setpoint_deviation")
        MpcError.unless_known(self.comfort, terms, "reward: comfort", "a known term")
        weights = (self.comfort_weight, self.cost_weight, self.carbon_weight)
        some = min(weights) >= 0 and sum(weights) > 0
        MpcError.unless(some, "reward: weights", "numbers of 0 or more, not all 0", weights)
        scales = (self.highest_electricity, self.highest_gas, self.stiffness, self.half_distance, self.deviation_scale)
        rises = min(scales) > 0 and 0 <= self.lowest_productivity < self.highest_productivity
        MpcError.unless(rises, "reward: scales", "positive numbers, a productivity that rises", self)

    def of_step(
        self, scenario: Scenario, k: int, temperature: ArrayLike, electricity: ArrayLike, gas: ArrayLike
    ) -> RewardTerms:
        """Reward of a step of a scenario, of one run or of many at once.

        Parameters
        ----------
        scenario : Scenario
            Bands, people, prices and emissions.
        k : int
            Number of the step.
        temperature : array_like, shape (..., n_zone)
            Of the zones, means over the step or at its end [K].
        electricity, gas : array_like, shape (...,)
            Powers, means over the step [W].

        Returns
        -------
        RewardTerms
            Reward and terms, shape (...,) each.
        """
        prices = (scenario.electricity_price[k], scenario.gas_price[k])
        carbons = (scenario.electricity_carbon[k], scenario.gas_carbon[k])
        band = (scenario.lower[k], scenario.upper[k])
        return self.of_values(temperature, band, scenario.occupancy[k], (electricity, gas), prices, carbons)

    def of_values(
        self, temperature: ArrayLike, band: Pair, occupancy: ArrayLike, powers: Pair, prices: Factors, carbons: Factors
    ) -> RewardTerms:
        """Reward of a step from plain values.

        Parameters
        ----------
        temperature : array_like, shape (..., n_zone)
            Of the zones [K].
        band : tuple of array_like, shape (n_zone,)
            Lower and upper edge [K].
        occupancy : array_like, shape (n_zone,)
            People in the zones [-].
        powers : tuple of array_like, shape (...,)
            Electricity and gas [W].
        prices, carbons : tuple of float
            Price [currency/kWh] and emissions [kg/kWh] of electricity and of gas.

        Returns
        -------
        RewardTerms
            Reward and terms, shape (...,) each.
        """
        zones, people = np.asarray(temperature, dtype=float), np.asarray(occupancy, dtype=float)
        power = np.asarray(powers[0], dtype=float), np.asarray(powers[1], dtype=float)
        edges = np.asarray(band[0], dtype=float), np.asarray(band[1], dtype=float)
        return self.terms(zones, edges, people, power, prices, carbons)

    def terms(
        self,
        zones: Value,
        band: tuple[Value, Value],
        people: Value,
        powers: tuple[Value, Value],
        prices: tuple[Value, Value],
        carbons: tuple[Value, Value],
    ) -> RewardTerms:
        """Reward of a step: the equations of `of_values`, for arrays and for traced values.

        Parameters
        ----------
        zones : Value, shape (..., n_zone)
            Temperatures [K].
        band : tuple of Value, shape (n_zone,)
            Lower and upper edge, counted from where the temperatures are [K].
        people : Value, shape (n_zone,)
            In the zones [-].
        powers : tuple of Value
            Electricity and gas [W].
        prices, carbons : tuple of Value
            Price [currency/kWh] and emissions [kg/kWh] of electricity and of gas.
        """
        outside = np.maximum(band[0] - zones, zones - band[1])
        if self.comfort == "setpoint_deviation":
            share = np.minimum(np.maximum(outside / self.deviation_scale, 0.0), 1.0)
            comfort = -share.mean(axis=-1)
        else:
            comfort = self._productivity(outside, people)
        electricity = np.minimum(powers[0], self.highest_electricity)
        gas = np.minimum(powers[1], self.highest_gas)
        cost, carbon = (self._share(electricity, gas, factors) for factors in (prices, carbons))
        weights = (self.comfort_weight, self.cost_weight, self.carbon_weight)
        total = (weights[0] * comfort - weights[1] * cost - weights[2] * carbon) / sum(weights)
        return RewardTerms(total, comfort, -cost, -carbon)

    def _productivity(self, outside: Value, people: Value) -> Value:
        count = people.sum(axis=-1)
        share = np.where(outside > 0.0, expit(self.stiffness * (self.half_distance - outside)), 1.0)
        lowest = self.lowest_productivity / self.highest_productivity
        mean = np.maximum((share * people).sum(axis=-1) / np.maximum(count, _NOBODY), lowest)
        return (count > 0.0) * ((mean - lowest) / (1.0 - lowest) - 1.0)

    def _share(self, electricity: Value, gas: Value, factors: tuple[Value, Value]) -> Value:
        highest = self.highest_electricity * factors[0] + self.highest_gas * factors[1]
        return (electricity * factors[0] + gas * factors[1]) / np.maximum(highest, _NOBODY)


#: What a zone's kelvin outside of its band for an hour counts [currency/K/h], unless told otherwise: so much that
#: optimal control of the pilot building leaves its bands by no more than hundredths of a kelvin hour a day.
DISCOMFORT_PRICE = 1.0


@dataclass(frozen=True)
class StageCost:
    """Cost of a step: energy, carbon and discomfort in one currency; a reward is minus it.

    ``(p_e P_e + p_g P_g) Δt + p_c (e_e P_e + e_g P_g) Δt + p_d Σ_zones ∫ (lack + excess) dt``. Summed over a run it is
    what `measure_kpis` says: ``cost_tot A + p_c emis_tot A + p_d n_zone tdis_tot``. Demand charges belong to no single
    step and are left out.

    Parameters
    ----------
    discomfort_price : float
        p_d [currency/K/h] of a zone; default `DISCOMFORT_PRICE`, which is that of optimal control.
    carbon_price : float
        p_c [currency/kg]; default 0.

    Raises
    ------
    MpcError
        When a price is negative.
    """

    discomfort_price: float = DISCOMFORT_PRICE
    carbon_price: float = 0.0

    def __post_init__(self) -> None:
        none_negative = self.discomfort_price >= 0 and self.carbon_price >= 0
        MpcError.unless(none_negative, "stage cost", "prices of 0 or more", self)

    def of_step(
        self, scenario: Scenario, k: int, start: ArrayLike, end: ArrayLike, electricity: ArrayLike, gas: ArrayLike
    ) -> FloatArray:
        """Cost of a step of a scenario, of one run or of many at once.

        Parameters
        ----------
        scenario : Scenario
            Bands, prices and emissions.
        k : int
            Number of the step.
        start, end : array_like, shape (..., n_zone)
            Temperatures of the zones at its start and end, a straight line in between [K].
        electricity, gas : array_like, shape (...,)
            Powers, means over the step [W].

        Returns
        -------
        ndarray, shape (...,)
            Cost [currency].
        """
        first, last = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        lower, upper = scenario.lower[k], scenario.upper[k]
        power_e, power_g = np.asarray(electricity, dtype=float), np.asarray(gas, dtype=float)
        price_e = scenario.electricity_price[k] + self.carbon_price * scenario.electricity_carbon[k]
        price_g = scenario.gas_price[k] + self.carbon_price * scenario.gas_carbon[k]
        step = float(scenario.grid.step)
        energy = self.energy(power_e, power_g, price_e, price_g, step)
        if (np.minimum(first, last) >= lower).all() and (np.maximum(first, last) <= upper).all():
            return np.asarray(energy)
        return np.asarray(energy + self.discomfort(first, last, lower, upper, step))

    def energy(self, electricity: Value, gas: Value, electricity_price: Value, gas_price: Value, step: float) -> Value:
        """Cost of energy over a step [currency].

        Parameters
        ----------
        electricity, gas : Value
            Powers, means over the step [W].
        electricity_price, gas_price : Value
            With the price of emissions [currency/kWh].
        step : float
            Length [s].
        """
        return (electricity_price * electricity + gas_price * gas) * (step / KILOWATT_HOUR)

    def discomfort(self, start: Value, end: Value, lower: Value, upper: Value, step: float) -> Value:
        """Cost of discomfort over a step [currency].

        Parameters
        ----------
        start, end : Value, shape (..., n_zone)
            Temperatures of the zones, a straight line in between [K].
        lower, upper : Value, shape (n_zone,)
            Edges of the comfort band [K].
        step : float
            Length [s].
        """
        outside = excess(lower - start, lower - end)[0] + excess(start - upper, end - upper)[0]
        return (self.discomfort_price * step / HOUR) * outside.sum(axis=-1)
