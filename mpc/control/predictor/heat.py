"""Heat itself as the decision: the building in its modes, with a plant that gives each zone what is asked for."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, cast, get_args

import numpy as np

from mpc.control.predictor.predictor import Predictor, Rollout, Sensitivity
from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import Horizon, HorizonData
from mpc.errors import ControlError
from thermal._types import FloatArray
from thermal.model.modal import ModalModel
from thermal.model.step import IMPLICIT_EULER, Scheme
from thermal.units import REFERENCE_TEMPERATURE

#: What a plant can do to a zone.
HeatQuantity = Literal["heating", "cooling"]


@dataclass(frozen=True)
class HeatChannel:
    """Heating or cooling of a zone as a decision.

    Parameters
    ----------
    quantity : str
        ``heating`` or ``cooling``.
    zone : int
        Number of the zone.
    upper : float
        Most of it [W], positive.
    lower : float
        Least of it [W], 0 or more.
    rate : float
        Most change in an hour, either way [W/h]; infinite by default.

    Raises
    ------
    ControlError
        When the quantity is not known, or a number is out of its range.
    """

    quantity: HeatQuantity
    zone: int
    upper: float
    lower: float = 0.0
    rate: float = np.inf

    def __post_init__(self) -> None:
        ControlError.unless_known(self.quantity, get_args(HeatQuantity), "heat channel", "heating or cooling")
        possible = 0.0 <= self.lower < self.upper < np.inf and self.rate > 0.0 and self.zone >= 0
        ControlError.unless(possible, "heat channel", "a zone, a range of watts and a positive rate", self)

    @property
    def unit(self) -> str:
        """``W``."""
        return "W"

    @property
    def name(self) -> str:
        """In words, for reports."""
        return f"{self.quantity} of zone {self.zone}"


class HeatPredictor(Predictor):
    """A building whose zones are given the heat that is decided: linear.

    Electricity is the cooling over the coefficient of performance, fuel the heating over the efficiency, both
    constant. Thermostats, air and water are left out; `HorizonData` may hold anything for them. It takes a
    `ControlProblem` to any solver: `LinearSolver` to its optimum at once.

    Parameters
    ----------
    modes : ModalModel
        Of a reduced model, at one θ.
    horizon : Horizon
        Steps and blocks.
    channels : sequence of HeatChannel
        What is decided.
    efficiency : float
        Heat over fuel [-], positive; of a condensing boiler by default.
    performance : float
        Cold over electricity [-], positive; of a chiller with its auxiliaries by default.
    disturbance_time : float
        Time constant with which the unmeasured heat fades [s]; infinite by default: it stays.
    scheme : Scheme
        Of time; by default implicit Euler.

    Raises
    ------
    ControlError
        When a channel is of a zone that the building does not have, two are the same, or a number is not positive.
    """

    def __init__(
        self,
        modes: ModalModel,
        horizon: Horizon,
        channels: Sequence[HeatChannel],
        efficiency: float = 0.9,
        performance: float = 3.0,
        disturbance_time: float = np.inf,
        scheme: Scheme = IMPLICIT_EULER,
    ) -> None:
        places, n_zone = [(c.quantity, c.zone) for c in channels], modes.output.shape[0]
        if not places or len(set(places)) != len(places) or max(zone for _, zone in places) >= n_zone:
            expected = f"channels of zones 0 to {n_zone - 1}, each once"
            raise ControlError("heat predictor", expected, f"{places}")
        fits, found = efficiency > 0.0 and performance > 0.0, f"{efficiency!r} and {performance!r}"
        ControlError.unless(fits, "heat predictor", "a positive efficiency and performance", found)
        self.channels = cast("tuple[Channel, ...]", tuple(channels))  # of problems: range, rate, name and unit
        self.efficiency, self.performance = efficiency, performance
        self._prepare(modes, horizon, disturbance_time, scheme)
        heats = np.array([c.quantity == "heating" for c in channels])
        #: Heat of the zones per channel, shape (n_zone, n_channel) [-].
        self.into_zones = np.where(heats, 1.0, -1.0) * np.eye(n_zone)[:, [c.zone for c in channels]]
        #: Fuel and electricity per channel, shape (n_channel,) [-].
        self.fuel_per_channel, self.electric_per_channel = heats / efficiency, ~heats / performance

    def transition(self, step: float) -> tuple[FloatArray, FloatArray]:
        """Give a step of the building: what modes keep, shape (r,) [-], and what channels add, shape (r, n_channel).

        Parameters
        ----------
        step : float
            One of the horizon's [s].
        """
        return self._end[step], self._push[step] @ self.into_zones

    def drive(self, data: HorizonData) -> FloatArray:
        """Give what is added to the modes in each step, whatever is decided, shape (N, r) [(W K)^0.5].

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        """
        return self._undecided(data)

    def rollout(self, data: HorizonData, plan: FloatArray, near: Rollout | None = None) -> Rollout:
        """Follow a plan.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        plan : ndarray, shape (n_block, n_channel)
            Heating and cooling [W].
        near : Rollout, optional
            Of no use here.
        """
        given, drive, x = plan[self.horizon.block_of], self._undecided(data), data.state
        heat, states = given @ self.into_zones.T, [data.state]
        for k, dt in enumerate(self.horizon.steps):
            x = self._end[dt] * x + drive[k] + self._push[dt] @ heat[k]
            states.append(x)
        zone, none = np.array(states) @ self._output.T + REFERENCE_TEMPERATURE, np.zeros((len(heat), 0))
        electric, fuel = given @ self.electric_per_channel, given @ self.fuel_per_channel
        return Rollout(plan, zone, zone[1:], electric, fuel, x, none, none, heat, none, none)

    def sensitivity(self, data: HorizonData, rollout: Rollout) -> Sensitivity:
        """Differentiate by all decisions; the same everywhere.

        Parameters
        ----------
        data : HorizonData
            Of the horizon.
        rollout : Rollout
            Of `rollout`.
        """
        count, m = len(self.horizon), len(self.channels)
        zone = np.zeros((count + 1, self.n_zone, self.n_decision))
        states = np.zeros((self._output.shape[1], self.n_decision))
        electric, fuel = np.zeros((count, self.n_decision)), np.zeros((count, self.n_decision))
        for k, dt in enumerate(self.horizon.steps):
            mine = slice(self.horizon.block_of[k] * m, (self.horizon.block_of[k] + 1) * m)
            states *= self._end[dt][:, None]
            states[:, mine] += self._push[dt] @ self.into_zones
            zone[k + 1] = self._output @ states
            electric[k, mine], fuel[k, mine] = self.electric_per_channel, self.fuel_per_channel
        return Sensitivity(zone, electric, fuel, states)
