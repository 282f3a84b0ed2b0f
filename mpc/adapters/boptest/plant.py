"""A plant behind BOPTEST's REST API, as a plant of ours."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from mpc.adapters.boptest.client import BoptestClient, check_step, regular, time_of
from mpc.adapters.boptest.mapping import BoptestSignals, as_forecast, forecast_sources, own_signals
from mpc.adapters.boptest.scenario import DAY, PERIOD_DAYS, PRICE_POINTS, YearClock
from mpc.adapters.boptest.signals import KPI_NAMES
from mpc.adapters.foreign import Declared, SignalPlant, activation
from mpc.errors import BoptestError, PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import checked_actions
from mpc.loop.plant import Measurements, need_running
from mpc.scenario.forecast import Forecast


@dataclass(frozen=True)
class BoptestTime:
    """When a test runs that is none of BOPTEST's time periods.

    Parameters
    ----------
    start : float
        Seconds of the year [s].
    duration : float
        How long it goes on [s].
    warm_up : float
        Time before the start that the server runs first [s].
    """

    start: float
    duration: float
    warm_up: float = 7 * DAY


@dataclass(frozen=True)
class BoptestSettings:
    """Scenario of a test beside its time, and how the server is talked to.

    Parameters
    ----------
    electricity_price : str
        ``constant``, ``dynamic`` or ``highly_dynamic``.
    horizon : int
        Control steps of a forecast.
    uncertainty : mapping of str to str
        ``temperature_uncertainty`` and ``solar_uncertainty`` of forecasts, ``low``, ``medium`` or ``high``.
    year, timezone : int, str, optional
        Of the stamps; those that the server says, else 2023 and UTC.
    timeout : float
        How long to wait for an answer [s]; a warm-up takes minutes on some servers.
    repeats : int
        How often requests are sent again that do no harm.

    Raises
    ------
    BoptestError
        When there is no such price, or the horizon has no step.
    """

    electricity_price: str = "constant"
    horizon: int = 24
    uncertainty: Mapping[str, str] = field(default_factory=dict)
    year: int | None = None
    timezone: str | None = None
    timeout: float = 600.0
    repeats: int = 2

    def __post_init__(self) -> None:
        BoptestError.unless_known(self.electricity_price, PRICE_POINTS, "electricity_price", "a known one")
        BoptestError.unless(self.horizon >= 1, "horizon", "a control step or more", repr(self.horizon))


class BoptestPlant(SignalPlant):
    """A test case of a BOPTEST server as a `Plant`: the server's traps are errors here.

    Setpoints out of range are refused by name before they are sent, since a server clips them and reports success. A
    step is never sent twice: when its answer fails to come, the plant must be reset. A measurement of null is NaN. An
    empty answer is the end of the test. Temperatures are in kelvin, and seconds of the year become local stamps.

    Each plant is a test of its own on the server: `close` frees it, as does leaving a ``with`` block.

    Parameters
    ----------
    url : str
        Of the server, such as ``http://127.0.0.1:8000``.
    testcase : str
        Name of the test case.
    period : str or BoptestTime
        Time period of BOPTEST's scenario, such as ``peak_heat_day``, or a time of one's own.
    control_step : float
        Time between two actions [s].
    settings : BoptestSettings
        Price, forecasts, stamps and patience.
    signals : BoptestSignals, optional
        What the server's signals are; those of a `BoptestServer` say it themselves.

    Raises
    ------
    BoptestError
        When the server has no such test case or signals.
    """

    signals: BoptestSignals

    def __init__(
        self,
        url: str,
        testcase: str,
        period: str | BoptestTime,
        control_step: float,
        settings: BoptestSettings = BoptestSettings(),
        *,
        signals: BoptestSignals | None = None,
    ) -> None:
        BoptestError.unless(control_step > 0, "plant", "a positive control step", repr(control_step))
        self._period, self._settings, self._seed = period, settings, 0
        self._client = BoptestClient(url, settings.timeout, settings.repeats)
        self._testid = ""
        try:
            self.server_version = self._client.check_version()
            self._testid = self._select(testcase)
            self._look_around(signals)
            self.control_step = self._set_step(control_step)
        except BaseException:
            self.close()
            raise
        self._time, self._end, self._start = math.nan, math.nan, math.nan
        self._broken, self._idle = "", set[str]()

    def close(self) -> None:
        """Stop the test, so that the server has room for another."""
        if self._testid:
            self._client.stop(self._testid)
        self._client.close()

    @property
    def finished(self) -> bool:
        """Whether less than a control step of the test is left."""
        return not math.isnan(self._time) and self._time + self.control_step > self._end + 1e-6

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew: the server runs the warm-up under the building's own control.

        Parameters
        ----------
        seed : int, optional
            Of uncertain forecasts; the rest of a BOPTEST server repeats anyway.

        Returns
        -------
        Measurements
            At the start, an instant.
        """
        self._seed = self._seed if seed is None else seed
        chosen = self._settings
        scenario: dict[str, Any] = {"electricity_price": chosen.electricity_price, **chosen.uncertainty}
        if chosen.uncertainty:
            scenario["seed"] = self._seed
        if isinstance(self._period, BoptestTime):
            self._ask("PUT", "scenario", scenario)
            at = {"start_time": self._period.start, "warmup_period": self._period.warm_up}
            values = self._ask("PUT", "initialize", at).payload
        else:
            answer = self._ask("PUT", "scenario", {**scenario, "time_period": self._period}).payload
            values = answer.get("time_period") if isinstance(answer, dict) else None
        self._broken, self._idle = "", set(self._switches.values())
        self._start = self._time = time_of(values, "the start")
        self._end = self._find_end()
        return self._measured(values)

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Setpoints by ``ENTITY/POINT`` [unit of the actuator]; what is left out is released: a server itself keeps an
            input as long as it is not told otherwise.

        Returns
        -------
        Measurements
            Means over the step of the readings that the server has noted down, each half a minute on BOPTEST's own; of
            a `BoptestServer` what it says at the end of the step, which are means over its own.

        Raises
        ------
        PlantActionError
            When a setpoint is unknown, no finite number or outside its range.
        PlantError
            When the test is over, or `reset` was not called.
        BoptestTimeoutError
            When the server does not answer; the plant must then be reset.
        BoptestError
            When the server refuses, changed a setpoint, or its clock is not where it should be.
        """
        need_running(not math.isnan(self._time))
        given = checked_actions(actions, self._by_name)
        PlantError.unless(not self._broken, "plant", "a reset after a step went wrong", self._broken)
        left = self._end - self._time
        PlantError.unless(not self.finished, "test", f"{self.control_step:g} s more", f"{left:g} s", "reset the plant")
        sent = {name: value for name, value in self._sent(given).items() if value or name not in self._idle}
        try:
            message, values = self._ask("POST", "advance", sent, repeat=False)
            if isinstance(values, dict) and not values:
                self._end = self._time
                raise BoptestError(f"the test is over at {self._time:g} s of the year: {message}")
            check_step(sent, message, values, self._time + self.control_step)
            self._time = time_of(values, "a step")
            self._idle = {switch for switch in self._switches.values() if not sent.get(switch)}
            return self._measured(values) if self.signals.means else self._means_of_step()
        except BoptestError as error:
            self._broken = str(error)
            raise

    def forecast(self) -> Forecast:
        """Forecast the control steps from now on: weather, prices, emissions, people and comfort bands.

        Raises
        ------
        BoptestError
            When the answer is not whole.
        """
        need_running(not math.isnan(self._time))
        step, count = self.control_step, self._settings.horizon
        points = sorted({source.point for source in self._sources.values()})
        body = {"point_names": points, "horizon": count * step, "interval": step}
        payload = self._ask("PUT", "forecast", body).payload
        ends = self._clock.zero + np.rint(self._time + step * np.arange(1, count + 1)).astype(int)
        stamps = pd.to_datetime(ends, unit="s", utc=True).tz_convert(self._clock.timezone)
        return as_forecast(payload, self._sources, stamps, means=self.signals.means)

    def record(self) -> PlantRecord:
        """Give the run since the reset from the server's results, for indicators and rewards.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        if math.isnan(self._time) or self._time <= self._start:
            raise PlantError("run", "a step at least", "none since the reset")
        points = self.signals.recorded
        body = {"point_names": points, "start_time": self._start, "final_time": self._time}
        times, columns = regular(self._ask("PUT", "results", body).payload, points)
        sums = {kind: np.sum([columns[name] for name in names], axis=0) for kind, names in self.signals.powers.items()}
        means = {kind: p[1:] if self.signals.means else 0.5 * (p[1:] + p[:-1]) for kind, p in sums.items()}
        zones = np.column_stack([columns[name] for name in self.signals.zones.values()])
        return self._record(float(times[1] - times[0]), zones, means)

    def kpis(self) -> dict[str, float | None]:
        """Ask the server for its indicators; what it has none of is None.

        Raises
        ------
        BoptestError
            When one is neither a number nor null.
        """
        payload = self._ask("GET", "kpi").payload
        BoptestError.unless(isinstance(payload, dict), "indicators", "a number or null each", repr(payload)[:100])
        found = {name: payload.get(name) for name in KPI_NAMES}
        for name, value in found.items():
            if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
                raise BoptestError(f"indicator {name}", "a number or null", repr(value)[:100])
        return {name: None if value is None else float(value) for name, value in found.items()}

    def _ask(self, method: str, what: str, body: dict[str, Any] | None = None, *, repeat: bool = True) -> Any:
        return self._client.ask(method, f"{what}/{self._testid}", body, repeat=repeat)

    def _select(self, testcase: str) -> str:
        path = f"testcases/{quote(testcase, safe='')}/select"
        answer = self._client.plain("POST", path, {}, repeat=False)
        testid = answer.get("testid") if isinstance(answer, dict) else None
        if not isinstance(testid, str) or not testid:
            raise BoptestError(f"POST /{path}", "a testid", repr(answer)[:200])
        return quote(testid, safe="")

    def _look_around(self, signals: BoptestSignals | None) -> None:
        """Learn what the test case has."""
        inputs, outputs, points = (
            self._ask("GET", what).payload for what in ("inputs", "measurements", "forecast_points")
        )
        if not all(isinstance(found, dict) for found in (inputs, outputs, points)):
            raise BoptestError("test case", "signals by name", "something else")
        self.signals = own_signals(inputs, outputs) if signals is None else signals
        self.signals.check(inputs, outputs)
        about, chosen = self._ask("GET", "name").payload or {}, self._settings
        year, timezone = about.get("year", 2023), about.get("timezone", "UTC")
        self._clock = YearClock(chosen.year or int(year), chosen.timezone or str(timezone))
        zone = self._clock.timezone
        self._map(zone, lambda name: _declared(outputs[name]), lambda name: _declared(inputs[name]), inputs)
        for signal in self.signals.actuators.values():
            switch, advice = self._switches.get(signal), "a server heeds an input while its switch is 1"
            BoptestError.unless(switch, f"input {signal!r}", f"a switch {activation(signal)!r}", "none", advice)
        self._sources = forecast_sources(points, self.signals, chosen.electricity_price)

    def _set_step(self, control_step: float) -> float:
        self._ask("PUT", "step", {"step": control_step})
        found = self._ask("GET", "step").payload
        if not isinstance(found, int | float) or abs(found - control_step) > 1e-6:
            raise BoptestError("control step", f"{control_step:g} s", repr(found))
        return float(found)

    def _find_end(self) -> float:
        """When the test ends: as told, as a server of ours says, else after BOPTEST's two weeks."""
        own = self._period.duration if isinstance(self._period, BoptestTime) else PERIOD_DAYS * DAY
        scenario = self._ask("GET", "scenario").payload
        told = scenario.get("end_time") if isinstance(scenario, dict) else None
        return min(self._start + own, math.inf if told is None else float(told))

    def _means_of_step(self) -> Measurements:
        """Means over the step that has ended of what the server has noted down."""
        points = list(dict.fromkeys(self.signals.measurements.values()))
        body = {"point_names": points, "start_time": self._time - self.control_step, "final_time": self._time}
        _, columns = regular(self._ask("PUT", "results", body).payload, points) if points else (None, {})
        rows = [line.offset + line.slope * columns[name] for name, line in self._read]
        return self._mean(np.array(rows).T, self._clock.zero + round(self._time))

    def _measured(self, values: Mapping[str, Any]) -> Measurements:
        return self._seen(values, self._clock.zero + round(self._time))


def _declared(entry: Mapping[str, Any]) -> Declared:
    low, high = (None if v is None else float(v) for v in (entry.get("Minimum"), entry.get("Maximum")))
    return Declared(entry.get("Unit"), low, high)
