"""What drives the effects of a controller's model, from a forecast: sun, sky, wind and people."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from mpc.errors import ControlError
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.inputs.normalisation import OCCUPANCY, WIND, Normalisation, filled, usual_temperatures
from thermal.inputs.provider import HVAC_INPUTS, InputProvider
from thermal.network.network import ThermalNetwork


class ForecastSignals:
    """Boundaries beside the outdoor air and signals of effects over a horizon, as `MpcController` asks for them.

    Signals of heat and air (`flow_gain`, `duct_loss`, `capacity_limit`, `valve_leak`) are not foreseen: they are taken
    as none, and what they do is found by the observer as unmeasured heat. `left_out` names them. What emitters
    give elsewhere than to the air follows from the heat that is planned (`ModalModel.heated_by_devices`). Usual
    temperatures are those of the network's normalisation, or else the middles of the forecast's comfort bands.

    Parameters
    ----------
    network : ThermalNetwork
        Of the controller's model.
    building : Building
        Where it stands, its zones and its weather station.
    people : float
        Most people in the building at a time [-], where the network's normalisation does not say: presence is counted
        as a share of them. What forecasts say counts from there on, should it be more.
    boundaries : mapping of str to float, optional
        Temperatures of boundaries beside outdoor, which are taken to stay [K].

    Raises
    ------
    ControlError
        When a boundary has no temperature.
    """

    def __init__(
        self,
        network: ThermalNetwork,
        building: Building,
        people: float = 0.0,
        boundaries: Mapping[str, float] | None = None,
    ) -> None:
        self.network, self.building, self.people = network, building, float(people)
        given = boundaries or {}
        for name in network.boundaries[1:]:
            if name not in given:
                raise ControlError(f"boundary {name!r}", "its temperature", "none", "pass it in `boundaries`")
        self._others = np.array([given[name] for name in network.boundaries[1:]], dtype=float)
        self.left_out: tuple[str, ...] = ()
        self._past = pd.DataFrame()

    def __call__(self, forecast: Forecast, stamps: pd.DatetimeIndex) -> FloatArray:
        """Lay out boundaries and signals, shape (N, n) [K], [signal unit].

        Parameters
        ----------
        forecast : Forecast
            On regular steps; where it ends early its last values stay.
        stamps : DatetimeIndex, length N
            Ends of the horizon's steps.

        Raises
        ------
        ControlError
            When the forecast lacks what a signal is made of.
        """
        n, inputs = len(forecast.table), self._inputs(forecast)
        values = np.zeros((n, len(self.network.signals)))
        unknown, planned = [], np.asarray(self.network.emitted.any(axis=1))
        for k, signal in enumerate(self.network.signals):
            if planned[k]:
                continue
            if not HVAC_INPUTS.isdisjoint(signal.inputs):
                unknown.append(signal.name)
                continue
            if lacking := inputs.lacks(signal.inputs):
                raise ControlError(f"forecast: {inputs.why_not(lacking[0])}")
            values[:, k] = signal.of(inputs)[-n:]
        self.left_out = tuple(unknown)
        others = np.tile(self._others, (len(stamps), 1))
        return np.hstack([others, self._on(pd.DatetimeIndex(forecast.table.index), values, stamps)])

    def _inputs(self, forecast: Forecast) -> InputProvider:
        """Make inputs of a forecast and the step before it, which changes need and an earlier forecast had."""
        table = forecast.table
        step = table.index[1] - table.index[0] if len(table) > 1 else pd.Timedelta(minutes=5)
        before = self._past.loc[self._past.index == table.index[0] - step]
        self._past = pd.concat([self._past, table])
        self._past = self._past.loc[~self._past.index.duplicated(keep="last")].tail(2 * len(table))
        table = pd.concat([before, table]) if len(before) else table
        zones, stamps = self.building.zone_names, pd.DatetimeIndex(table.index)
        points = {name: filled(table[name]) for name in map(str, table) if "/" not in name and name.endswith("_sensor")}
        series = points | ({"outdoor": points[OUTDOOR_TEMPERATURE]} if OUTDOOR_TEMPERATURE in points else {})
        known = self.network.normalisation or Normalisation()
        if count := [c for zone in zones if (c := f"{zone}/{OCCUPANCY}") in table]:
            series["people"] = filled(table[count].sum(axis=1, min_count=1))
            self.people = max(self.people, float(series["people"].max()))
            known = replace(known, people=self.people if known.people is None else known.people)
        if not known.usual:
            bands = {zone: [f"{zone}/comfort_{side}_temperature" for side in ("lower", "upper")] for zone in zones}
            middles = {zone: table[band].mean(axis=1) for zone, band in bands.items() if set(band) <= set(table)}
            known = replace(known, usual=usual_temperatures(pd.DataFrame(middles, stamps, list(zones), dtype=float)))
        if known.wind is None and WIND in points:
            known = replace(known, wind=float(np.maximum(points[WIND], 0.0).mean()))
        return InputProvider(self.building, stamps, step.total_seconds(), series, known, "forecast")

    @staticmethod
    def _on(index: pd.DatetimeIndex, values: FloatArray, stamps: pd.DatetimeIndex) -> FloatArray:
        """Means over the horizon's steps of what is constant over the forecast's."""
        start = stamps[0]
        ends = (index - start).total_seconds().to_numpy()
        step = float(np.median(np.diff(ends))) if len(ends) > 1 else 300.0
        to = (stamps - start).total_seconds().to_numpy()
        first = to[1] - to[0] if len(to) > 1 else step
        edges = np.concatenate([[to[0] - first], to])  # the first two steps of a horizon are as long as each other
        knots = np.concatenate([[ends[0] - step], ends, [max(ends[-1] + step, edges[-1])]])
        knots[0] = min(knots[0], edges[0])
        held = np.vstack([values, values[-1:]])
        total = np.vstack([np.zeros(values.shape[1]), np.cumsum(held * np.diff(knots)[:, None], axis=0)])
        at = [np.interp(edges, knots, column) for column in total.T]
        return np.stack([np.diff(a) / np.diff(edges) for a in at], axis=1) if at else np.zeros((len(stamps), 0))
