"""What drives the effects of a controller's model, from a forecast: sun, sky, wind and people."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from mpc.errors import ControlError
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.case import Case
from thermal.case.points import ZONE_TEMPERATURE
from thermal.case.quality import QualityReport
from thermal.case.telemetry import Telemetry
from thermal.errors import EffectError, describe
from thermal.inputs.drivers import Drivers
from thermal.network.network import ThermalNetwork

_OCCUPANCY = "occupancy_count_sensor"


class _OnlyMeasured(ControlError):  # noqa: N818 - control flow within this module, never seen outside
    """A signal is made of heat or air that only the running plant knows."""


class _Ahead(Drivers):
    """Drivers of a forecast, which does not know what the plant will do."""

    def _unknown(self) -> Any:
        raise _OnlyMeasured

    heat = cached_property(_unknown)
    supply = cached_property(_unknown)
    airflow = cached_property(_unknown)


class ForecastSignals:
    """Boundaries beside the outdoor air and signals of effects over a horizon, as `MpcController` asks for them.

    Signals of heat and air (`flow_gain`, `duct_loss`, `capacity_limit`, `valve_leak`) are not foreseen: they are taken
    as none, and what they do is found by the observer as unmeasured heat. `left_out` names them.

    Parameters
    ----------
    network : ThermalNetwork
        Of the controller's model.
    building : Building
        Where it stands, its zones and its weather station.
    people : float
        Most people in the building at a time [-]: presence is counted as a share of them. What forecasts say counts
        from there on, should it be more.
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
                raise ControlError(describe(f"boundary {name!r}", "its temperature", "none", "pass it in `boundaries`"))
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
        n = len(forecast.table)
        drivers = _Ahead(self._case(forecast))
        values = np.zeros((n, len(self.network.signals)))
        unknown = []
        for k, signal in enumerate(self.network.signals):
            try:
                values[:, k] = np.asarray(signal.of(drivers))[-n - 1 : -1]
            except _OnlyMeasured:
                unknown.append(signal.name)
            except EffectError as error:
                raise ControlError(f"forecast: {error}") from error
        self.left_out = tuple(unknown)
        others = np.tile(self._others, (len(stamps), 1))
        return np.hstack([others, self._on(pd.DatetimeIndex(forecast.table.index), values, stamps)])

    def _case(self, forecast: Forecast) -> Case:
        """Make a case of a forecast, after the step before it, and before one in which everybody is in.

        Signals of change need the former; presence is a share of the latter.
        """
        table, station, zones = forecast.table, self.building.weather_station, self.building.zone_names
        points = [str(c) for c in table if str(c).endswith("_sensor") and "/" not in str(c)]
        columns = {f"{station}/{point}": table[point] for point in points}
        count = [f"{zone}/{_OCCUPANCY}" for zone in zones if f"{zone}/{_OCCUPANCY}" in table]
        columns |= {name: table[name] for name in count}
        for zone in zones:
            band = [f"{zone}/comfort_{side}_temperature" for side in ("lower", "upper")]
            if set(band) <= set(table):
                columns[f"{zone}/{ZONE_TEMPERATURE}"] = table[band].mean(axis=1)
        frame = pd.DataFrame(columns)
        step = frame.index[1] - frame.index[0] if len(frame) > 1 else pd.Timedelta(minutes=5)
        last = frame.iloc[[-1]].set_axis(pd.DatetimeIndex([frame.index[-1] + step]))
        if count:
            self.people = max(self.people, float(frame[count].sum(axis=1).max()))
            last[count] = self.people / len(count)
        before = self._past.loc[self._past.index == frame.index[0] - step]
        self._past = pd.concat([self._past, frame])
        self._past = self._past.loc[~self._past.index.duplicated(keep="last")].tail(2 * len(frame))
        whole = pd.concat([before, frame, last])
        whole.index = pd.DatetimeIndex(whole.index, name="timestamp")
        nothing = QualityReport(whole.index[0], whole.index[-1], step.total_seconds(), len(whole), (), ())
        return Case(self.building, Telemetry.from_frame(whole, where="forecast"), judged=nothing)

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
