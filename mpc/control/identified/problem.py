"""The stage problem of an identified plant, and what changes of it from step to step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import COP_AT, COP_PER
from mpc.control.solvers.stages import StageData, StageProblem
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import CARRIERS, facade_sun
from mpc.scenario.forecast import Forecast
from mpc.scenario.rates import HOUR, KILOWATT_HOUR
from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE

#: Cost is counted in parts of the currency: a day's is of order 1 to 100, as interior points like it [1/currency].
SCALE = 10.0

#: Weight of the square of a decision [currency]: what costs the same whenever it is done is done evenly.
_EVEN = 1e-4

#: Band that a back-off leaves [K].
_NARROWEST = 0.1

_PRICES = {"electricity": "electricity_price", "gas": "gas_price"}


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
    """

    outdoor: FloatArray
    sun: FloatArray
    gain: FloatArray
    prices: FloatArray
    lower: FloatArray
    upper: FloatArray
    occupied: np.ndarray

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
            columns([_PRICES.get(carrier, "") for carrier in CARRIERS]), columns(edges[0]), columns(edges[1]), occupied,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class IdentifiedProblem:
    """A model as a problem in stages: ``x' = A x + B [T_out, sun, heat of the machines, gains]``.

    Decisions are duties and loads of the machines from 0 to 1, within ends that are parameters of each step, so that
    one of them can be fixed without another problem. Heat and power are the maps at the step's outdoor air and the
    emitter's temperature at its start. Bands are those of the air nodes.

    Parameters
    ----------
    model : PlantModel
        Identified.
    """

    model: PlantModel

    @cached_property
    def _space(self):  # type: ignore[no-untyped-def]
        return self.model.box.space(self.model.step)

    @cached_property
    def stage(self) -> StageProblem:
        """The problem of a step."""
        model, box, space = self.model, self.model.box, self._space
        nz, ns, m = len(box.zones), len(box.suns), len(model.maps)
        x, u = ca.SX.sym("x", 4 * nz), ca.SX.sym("u", m)
        p = ca.SX.sym("p", 1 + ns + nz + len(CARRIERS) + 2 * m)
        outdoor, sun, gain, price, low, high = ca.vertsplit(p, np.cumsum([0, 1, ns, nz, len(CARRIERS), m, m]).tolist())
        chosen = low + (high - low) * u
        emitter = REFERENCE + ca.mtimes(ca.DM(box.emitter_weights.T), x)
        heats, cost = [], ca.SX(0)
        for k, found in enumerate(model.maps):
            slope = 1.0 + float(box.slopes[k]) * (outdoor - COP_AT) / COP_PER
            heats.append(found.at(found.heat, chosen[k], outdoor, emitter[k]) * slope)
            for carrier, curve in found.powers.items():
                power = found.at(curve, chosen[k], outdoor, emitter[k])
                cost += price[CARRIERS.index(carrier)] * power
        inputs = ca.vertcat(outdoor - REFERENCE, sun, *heats, gain)
        following = ca.mtimes(ca.DM(space.transition), x) + ca.mtimes(ca.DM(space.drive), inputs)
        cost = SCALE * (cost * model.step / KILOWATT_HOUR + _EVEN * ca.sumsqr(u))
        return StageProblem(x, u, p, following, cost, ca.SX(0), x[:nz], np.zeros(m), np.ones(m))

    def data(
        self,
        state: FloatArray,
        ahead: Ahead,
        back_off: FloatArray,
        comfort_price: float,
        ends: tuple[FloatArray, FloatArray],
    ) -> StageData:
        """Put together what changes.

        Parameters
        ----------
        state : ndarray, shape (5 n_zone,)
            Nodes less the reference [K], and unmeasured heat [W].
        ahead : Ahead
            Of the horizon.
        back_off : ndarray, shape (N, n_zone)
            By which lower edges are raised, or lowered where it is negative [K].
        comfort_price : float
            Of a zone's kelvin outside of its band for an hour [currency/K/h].
        ends : tuple of ndarray, shape (N, n_machine)
            Lowest and highest duties and loads of the steps [-].
        """
        box, step, count = self.model.box, self.model.step, len(ahead.outdoor)
        nodes, zones = box.capacity.size, len(box.zones)
        keep = box.disturbed(step).keep ** np.arange(count)
        gain = ahead.gain + keep[:, None] * state[nodes:]
        parameters = np.column_stack([ahead.outdoor, ahead.sun, gain, ahead.prices, *ends])
        # an edge lies in the bands of the step before and of the step after it; nothing can be done about the first
        wanted = np.minimum(ahead.lower + back_off, ahead.upper - _NARROWEST) - REFERENCE
        lower = np.vstack([wanted[:1], np.maximum(wanted[:-1], wanted[1:]), wanted[-1:]])
        upper = (
            np.vstack([ahead.upper[:1], np.minimum(ahead.upper[:-1], ahead.upper[1:]), ahead.upper[-1:]]) - REFERENCE
        )
        price = np.full((count + 1, zones), SCALE * comfort_price * step / HOUR)
        return StageData(state[:nodes], parameters, np.minimum(lower, upper), upper, price)
