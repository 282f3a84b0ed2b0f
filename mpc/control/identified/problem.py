"""The stage problem of an identified plant, and what changes of it from step to step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import COP_AT, COP_PER
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import WEIGHTS, beyond, carrier_of
from mpc.control.identified.electric import Electric, ElectricNow, ElectricStage
from mpc.control.solvers.stages import StageData, StageProblem
from mpc.identify.curves import EMITTER, OUTDOOR
from mpc.identify.machines import as_heated
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import CARRIERS
from mpc.scenario.rates import HOUR, KILOWATT_HOUR
from thermal._types import FloatArray

#: Cost is counted in parts of the currency: a day's is of order 1 to 100, as interior points like it [1/currency].
SCALE = 10.0

#: Weight of the square of a decision [currency]: what costs the same whenever it is done is done evenly.
_EVEN = 1e-4

#: Load of all machines together that is none of a limit, a share of their full loads [-].
_UNLIMITED = 10.0

#: Band that a back-off leaves [K].
_NARROWEST = 0.1


@dataclass(frozen=True, eq=False)
class IdentifiedProblem:
    """A model as a problem in stages: ``x' = A x + B [T_out, sun, heat of the machines, gains]``.

    Decisions are duties and loads of the machines from 0 to 1, within ends that are parameters of each step, so that
    one of them can be fixed without another problem. Heat and power are the maps at the step's outdoor air and the
    emitter's temperature at its start, power with what `mpc.control.identified.beyond` adds. Bands are those of the
    air nodes. Machines that setpoints lead keep to what one source has for all of them (`SharedLimit`); what it buys
    (`Source`) is a line over their load, a parameter of each step; what hotter water costs is added (`SupplyWater`).
    Where they share an air handler (`AirHandler`) its running is the last decision: at least in hours of its own, which
    are a parameter, and at least as long as any of them heats.

    Parameters
    ----------
    model : PlantModel
        Identified.
    electric : Electric, optional
        Battery, photovoltaics and charges; electricity alone is bought at its price by default.
    """

    model: PlantModel
    electric: Electric | None = None

    @cached_property
    def _added(self) -> ElectricStage | None:
        """What is electric, as a part of the stages."""
        if self.electric is None:
            return None
        model, most = self.model, self.model.base.get(CARRIERS[0], 0.0)
        weather = as_heated(OUTDOOR + np.array([-30.0, 10.0]), model.sign)
        for found in model.maps:
            if CARRIERS[0] in found.powers:  # in hard weather or in mild, whatever its map says
                most += max(float(found.at(found.powers[CARRIERS[0]], 1.0, outdoor, EMITTER)) for outdoor in weather)
        if model.source is not None:
            nothing = np.zeros(2)
            most += float(
                model.source.lines(weather, nothing + np.inf, nothing)[1][:, 0].max()
            )  # it counts by tangents
        if model.water is not None:
            most += float(model.water.by_kelvin[0]) * (model.water.ends[1] - model.water.ends[0])
        if model.air_handler is not None:
            most += model.air_handler.powers.get(CARRIERS[0], 0.0)
        return ElectricStage(self.electric, 1.5 * most, model.step)

    @property
    def decisions(self) -> int:
        """Number of decisions of a step: those of the machines first."""
        return self.stage.decision.numel()

    def command(self, decisions: FloatArray) -> dict[str, float]:
        """Value of the battery's actuator, where there is one.

        Parameters
        ----------
        decisions : ndarray, shape (n_decision,)
            Of a step [-].
        """
        added = self._added
        if added is None or added.electric.battery is None:
            return {}
        first = len(self.model.maps)
        return {added.electric.command: added.command(decisions[first : first + len(added.decision)])}

    def running(self, own: FloatArray, decisions: FloatArray | None) -> FloatArray:
        """Share of the steps that an air handler runs by a plan, shape (N,) [-].

        Parameters
        ----------
        own : ndarray, shape (N,)
            That in hours of its own [-].
        decisions : ndarray, shape (N, n_decision), or None
            Of the plan, where there is one [-].
        """
        if self.model.air_handler is None or decisions is None:
            return own
        return np.asarray(own + (1.0 - own) * np.clip(decisions[:, -1], 0.0, 1.0))

    @cached_property
    def matrices(self) -> tuple[FloatArray, FloatArray]:
        """A and B."""
        space = self.model.box.space(self.model.step)
        return space.transition, space.drive

    def heat(self, k: int, load: Any, outdoor: Any, emitter: Any) -> Any:
        """Heat of a machine that arrives, with numbers, arrays or symbols, negative where it cools [W].

        Parameters
        ----------
        k : int
            Which machine.
        load : number, array or symbol
            Duty or load [-].
        outdoor, emitter : number, array or symbol
            Temperatures [K].
        """
        found = self.model.maps[k]
        slope = 1.0 + float(self.model.box.slopes[k]) * (outdoor - COP_AT) / COP_PER
        return self.model.sign * found.at(found.heat, load, outdoor, emitter) * slope

    @cached_property
    def stage(self) -> StageProblem:
        """The problem of a step."""
        model, box = self.model, self.model.box
        nz, ns, m = len(box.zones), len(box.suns), len(model.maps)
        line, hot = len(CARRIERS) if model.source is not None else 0, (0, 0) if model.water is None else (3, m)
        handled = 0 if model.air_handler is None else 1
        sizes = [1, ns, nz, len(CARRIERS), m, m, m * WEIGHTS, 1, line, line, *hot, handled]
        x, u, p, added = ca.SX.sym("x", 4 * nz), ca.SX.sym("u", m), ca.SX.sym("p", sum(sizes)), self._added
        outdoor, sun, gain, price, low, high, weights, together, standing, by_load, water, most, own = ca.vertsplit(
            p, np.cumsum([0, *sizes]).tolist()
        )
        chosen = low + (high - low) * u
        emitter = REFERENCE + ca.mtimes(ca.DM(box.emitter_weights.T), x)
        heats, powers = [], list[tuple[str, ca.SX]]()
        for k, found in enumerate(model.maps):
            heats.append(self.heat(k, chosen[k], outdoor, emitter[k]))
            for carrier, curve in found.powers.items():
                power = found.at(curve, chosen[k], outdoor, emitter[k])
                if found.own is not None and carrier == carrier_of(found):
                    power += beyond(weights[k * WEIGHTS : (k + 1) * WEIGHTS], chosen[k])
                powers.append((carrier, power))
        total = ca.dot(ca.DM(model.shares), chosen)
        for carrier in model.source.powers if model.source is not None else ():
            place = CARRIERS.index(carrier)
            powers.append((carrier, standing[place] + by_load[place] * total))
        if model.water is not None:
            hotter, prices = model.water.hotter(chosen, chosen / most, water), model.water.by_kelvin
            powers += [(carrier, by * hotter) for carrier, by in zip(CARRIERS, prices, strict=True) if by]
        within = total - together if model.shares.any() else ca.SX(0, 1)
        runs = ca.SX.sym("runs", handled)
        if model.air_handler is not None:
            running = own + (1.0 - own) * runs
            served, air = ca.DM(box.serves.astype(float)), REFERENCE + x[:nz]
            of_rooms = ca.mtimes(served, air) / ca.sum2(served)
            lost = running * ca.DM(model.air_handler.conductances) * (model.air_handler.supply - of_rooms)
            gain = gain + ca.mtimes(served.T, lost)
            powers += [(carrier, watts * running) for carrier, watts in model.air_handler.powers.items()]
            # as long as each heats; and no longer than all ask for, one after the other: by itself it cools nobody
            within = ca.vertcat(within, chosen - high * running, runs - ca.sum1(u))
        cost, electricity = ca.SX(0), ca.SX(model.base.get(CARRIERS[0], 0.0))
        for carrier, power in powers:
            if added is not None and carrier == CARRIERS[0]:
                electricity += power
            else:
                cost += price[CARRIERS.index(carrier)] * power
        inputs = ca.vertcat(outdoor - REFERENCE, sun, *heats, gain)
        transition, drive = self.matrices
        following = ca.mtimes(ca.DM(transition), x) + ca.mtimes(ca.DM(drive), inputs)
        cost, end, banded = cost * model.step / KILOWATT_HOUR, ca.SX(0), x[:nz]
        if added is not None:
            after, paid = added.following(electricity, price[0])
            following, cost, end = ca.vertcat(following, after), cost + paid, added.end_cost
            banded = ca.vertcat(banded, *(added.state[name] for name in added.banded))
            x, u = ca.vertcat(x, *added.state.values()), ca.vertcat(u, *added.decision.values())
            p = ca.vertcat(p, added.generation)
        u = ca.vertcat(u, runs)
        cost, m = SCALE * (cost + _EVEN * ca.sumsqr(u)), u.numel()
        return StageProblem(x, u, p, following, cost, SCALE * end, banded, np.zeros(m), np.ones(m), within)

    def data(
        self,
        state: FloatArray,
        ahead: Ahead,
        back_off: FloatArray,
        comfort_price: float,
        ends: tuple[FloatArray, FloatArray],
        now: ElectricNow | None = None,
        planned: FloatArray | None = None,
        most: FloatArray | None = None,
    ) -> StageData:
        """Put together what changes.

        Parameters
        ----------
        state : ndarray, shape (5 n_zone,)
            Nodes less the reference [K], and unmeasured heat [W].
        ahead : Ahead
            Of the horizon.
        back_off : ndarray, shape (N, n_zone)
            By which the edges that machines keep zones from are moved into the bands, or out where it is negative [K].
        comfort_price : float
            Of a zone's kelvin outside of its band for an hour [currency/K/h].
        ends : tuple of ndarray, shape (N, n_machine)
            Lowest and highest duties and loads of the steps [-].
        now : ElectricNow, optional
            Of what is electric; none generated, nothing stored and no peak by default.
        planned : ndarray, shape (N, n_machine), optional
            Loads at which the power of a source is touched, see `Source.lines` and `SupplyWater.line` [-].
        most : ndarray, shape (N, n_machine), optional
            Largest loads, where the temperature of supply water is decided [-].
        """
        box, step, count = self.model.box, self.model.step, len(ahead.outdoor)
        nodes, zones = box.capacity.size, len(box.zones)
        keep = box.disturbed(step).keep ** np.arange(count)
        gain = ahead.gain + keep[:, None] * state[nodes:]
        weights = ahead.beyond.reshape(count, -1)
        together = np.minimum(ahead.together, _UNLIMITED)
        parameters = np.column_stack([ahead.outdoor, ahead.sun, gain, ahead.prices, *ends, weights, together])
        if self.model.source is not None:
            touched = None if planned is None else planned @ self.model.shares
            parameters = np.column_stack([parameters, *self.model.source.lines(ahead.outdoor, together, touched)])
        if self.model.water is not None:
            most = np.ones((count, len(self.model.maps))) if most is None else most
            zone = self.model.air(state[:zones] + REFERENCE)
            parameters = np.column_stack([parameters, self.model.water.line(planned, most, zone), most])
        if self.model.air_handler is not None:
            parameters = np.column_stack([parameters, ahead.running])
        # an edge lies in the bands of the step before and of the step after it; nothing can be done about the first
        near, far = ahead.edges(self.model.sign)
        near = np.minimum(near + back_off, far - _NARROWEST)
        near = np.vstack([near[:1], np.maximum(near[:-1], near[1:]), near[-1:]])
        far = np.vstack([far[:1], np.minimum(far[:-1], far[1:]), far[-1:]])
        ends_of = as_heated(np.minimum(near, far), self.model.sign), as_heated(far, self.model.sign)
        lower, upper = (edge - REFERENCE for edge in (ends_of if self.model.sign > 0.0 else ends_of[::-1]))
        price = np.full((count + 1, zones), SCALE * comfort_price * step / HOUR)
        start = state[:nodes]
        if self._added is not None:
            now = now or ElectricNow(np.zeros(count))
            stored = self._added.bands(count)
            lower, upper = np.hstack([lower, stored[0]]), np.hstack([upper, stored[1]])
            price = np.hstack([price, SCALE * stored[2]])
            start = np.concatenate([start, self._added.start(now)])
            parameters = np.column_stack([parameters, now.generation / 1e3])
        return StageData(start, parameters, lower, upper, price)
