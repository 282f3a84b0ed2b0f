"""A test of BOPTEST: the state between the requests of a client, and what each request does to it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mpc.adapters.boptest import requests
from mpc.adapters.boptest.case import BegunPlant, BoptestCase, Trajectory
from mpc.adapters.boptest.signals import KPI_NAMES, UNCERTAINTY, BoundaryConditions, uncertain
from mpc.errors import BoptestRequestError
from mpc.kpi.kpis import measure_kpis
from mpc.kpi.record import PlantRecord

_FOREVER = 1e12  # s, beyond any time of a test
_SCENARIO = ("electricity_price", "time_period", "temperature_uncertainty", "solar_uncertainty", "seed")
_UNCERTAINTIES = {"TDryBul": "temperature_uncertainty", "HGloHor": "solar_uncertainty"}


class BoptestTest:
    """A test of a served building: one client's, one request at a time.

    Parameters
    ----------
    case : BoptestCase
        What is served.
    clock : callable
        Time that passes for the client [s].
    """

    def __init__(self, case: BoptestCase, clock: Callable[[], float] = time.perf_counter) -> None:
        self.case, self._clock = case, clock
        self.control_step = case.step
        self._scenario: dict[str, Any] = dict.fromkeys(_SCENARIO) | {"electricity_price": "constant"}
        self._begun: _Run | None = None
        self._ratios: list[float] = []
        self._answered: float | None = None

    @property
    def name(self) -> dict[str, Any]:
        """Name of the test case; year and time zone are ours, for clients that want dates."""
        return {"name": self.case.name, "year": self.case.clock.year, "timezone": self.case.clock.timezone}

    @property
    def scenario(self) -> dict[str, Any]:
        """Scenario, and when the test ends."""
        return {**self._scenario, "end_time": None if self._begun is None else str(self._begun.end)}

    @property
    def time(self) -> float:
        """BOPTEST's time now [s]; a test that was not initialized stands where the weather begins."""
        return self.case.covered[0] if self._begun is None else self._begun.time

    def set_step(self, body: Mapping[str, Any]) -> requests.Answer:
        """Choose the control step.

        Parameters
        ----------
        body : mapping
            ``step`` [s], a multiple of the plant's own.
        """
        (value,) = requests.required(body, "step")
        step, own = requests.number("parameter step", value), self.case.step
        if not (step >= own and math.isclose(step / own, round(step / own), rel_tol=1e-9) and step <= _FOREVER):
            raise BoptestRequestError(
                f"Invalid value {step:g} for parameter step. The plant has steps of {own:g} s: give a multiple of it, "
                "or serve the plant with shorter steps."
            )
        self.control_step = round(step / own) * own
        return requests.Answer("Control step set successfully.", {"step": self.control_step})

    def set_scenario(self, body: Mapping[str, Any]) -> requests.Answer:
        """Choose price, uncertainty of forecasts and time period; the latter initializes.

        Parameters
        ----------
        body : mapping
            Any of ``electricity_price``, ``time_period``, ``temperature_uncertainty``, ``solar_uncertainty``, ``seed``.
        """
        requests.allowed(body, _SCENARIO)
        price, period = body.get("electricity_price"), body.get("time_period")
        levels = _UNCERTAINTIES.values()
        changed: dict[str, Any] = {n: requests.choice(n, body.get(n), UNCERTAINTY, none=True) for n in levels}
        if price is not None:
            changed["electricity_price"] = requests.choice("electricity_price", price, self.case.prices)
        if period is not None:
            changed["time_period"] = requests.choice("time_period", period, self.case.periods)
        seed = body.get("seed")
        changed["seed"] = None if seed is None else int(requests.number("scenario parameter seed", seed, 0, 2**63 - 1))
        payload: dict[str, Any] = dict.fromkeys(_SCENARIO) | changed
        if period is not None:
            start, end, warm_up = self.case.periods[str(period)]
            payload["time_period"] = self._begin(self.case.begin(start, warm_up, end)).rows.last()
        self._scenario |= changed
        return requests.Answer("Test case scenario was set successfully.", payload)

    def initialize(self, body: Mapping[str, Any]) -> requests.Answer:
        """Begin anew at a time, after a warm-up.

        Parameters
        ----------
        body : mapping
            ``start_time`` and ``warmup_period`` [s].
        """
        given = requests.required(body, "start_time", "warmup_period")
        start = requests.number("parameter start_time", given[0], 0.0)
        warm_up = requests.number("parameter warmup_period", given[1], 0.0)
        run = self._begin(self.case.begin(start, warm_up))
        self._scenario["time_period"] = None
        ran = run.taken * self.case.step
        message = f"Test simulation initialized successfully to {self.time}s with warmup period of {ran}s."
        if self.time != start or ran != warm_up:
            message += f" Asked for were {start}s and {warm_up}s: times are whole minutes where there is weather."
        return requests.Answer(message, run.rows.last())

    def advance(self, body: Mapping[str, Any]) -> requests.Answer:
        """Go on by a control step; inputs out of range are clipped, as BOPTEST does, and the message says so.

        Parameters
        ----------
        body : mapping
            Values of inputs and activations, by name.
        """
        given, active, warnings = requests.read_overwrites(body, self.case.signals.inputs)
        run = self._running()
        if self._answered is not None:
            self._ratios.append((self._clock() - self._answered) / self.control_step)
        begin = run.time
        count = min(round(self.control_step / self.case.step), round((run.end - begin) / self.case.step))
        if count < 1:
            return requests.Answer("End of test case scenario time period reached.", {})
        for _ in range(count):
            run.take(given, active)
        self._answered = self._clock()
        message = warnings or f"Advanced simulation successfully from {begin}s to {run.time}s."
        return requests.Answer(message, run.rows.last())

    def results(self, body: Mapping[str, Any]) -> requests.Answer:
        """Look up what was, with its warm-up.

        Parameters
        ----------
        body : mapping
            ``point_names``, ``start_time`` and ``final_time`` [s].
        """
        given = requests.required(body, "point_names", "start_time", "final_time")
        points = requests.names("point_names", given[0], (*self.case.signals.outputs, *self.case.signals.input_names))
        start = requests.time_or_infinite("start_time", given[1])
        final = requests.time_or_infinite("final_time", given[2])
        rows = self._running().rows
        payload = rows.between(points, start, final) if points else {}
        return _queried("results data", payload)

    def forecast(self, body: Mapping[str, Any]) -> requests.Answer:
        """Forecast boundary conditions from now on; each value holds for the plant's step that begins at its time.

        Parameters
        ----------
        body : mapping
            ``point_names``, ``horizon`` and ``interval`` [s].
        """
        given = requests.required(body, "point_names", "horizon", "interval")
        points = requests.names("point_names", given[0], self.case.forecast_points)
        horizon = requests.number("parameter horizon", given[1], 0.0, _FOREVER)
        interval = requests.number("parameter interval", given[2], 1e-3, _FOREVER)
        count = math.floor(horizon / interval + 1e-9) + 1
        if count * max(len(points), 1) > requests.MOST_VALUES:
            raise BoptestRequestError(f"Invalid horizon {horizon:g} and interval {interval:g}: too many values.")
        conditions = self._running().conditions
        times = np.asarray(self.time + interval * np.arange(count), dtype=float)
        rows, late = conditions.rows(self.case.clock.zero + times)
        payload = {"time": times.tolist()}
        for name in points:
            values = conditions.series(name)[rows]
            level = self._scenario.get(_UNCERTAINTIES.get(name, ""))
            if level is not None:
                seed = (int(self._scenario["seed"] or 0), round(self.time))
                values = uncertain(name, values, level, seed, interval)
            payload[name] = values.tolist()
        message = "Queried the forecast data successfully."
        return requests.Answer(f"{message} Beyond what is known the last day repeats." if late else message, payload)

    def kpis(self) -> requests.Answer:
        """Measure indicators from the start on, at the price of the current scenario; null is what there is none of."""
        run = self._running()
        k = run.warm_up_steps
        values: dict[str, float | None] = dict.fromkeys(KPI_NAMES)
        if run.taken > k:
            price = run.conditions.prices[self._scenario["electricity_price"]]
            whole = run.plant.record()
            gas = None if whole.gas is None else whole.gas[k:]
            record = PlantRecord(whole.step, whole.zone_temperature[k:], whole.electricity[k:], gas)
            found = measure_kpis(record, replace(run.plant.scenario, electricity_price=price), first_step=k)
            values = {name: getattr(found, name) for name in KPI_NAMES}
        else:
            values |= dict.fromkeys(("cost_tot", "emis_tot", "ener_tot", "tdis_tot"), 0.0)
        values["time_rat"] = float(np.mean(self._ratios)) if self._ratios else None
        return _queried("KPIs", values)

    def _running(self) -> _Run:
        """Give the run; one that was not initialized begins where the weather does, as BOPTEST begins at 0."""
        return self._begun or self._begin(self.case.begin(self.case.covered[0], 0.0))

    def _begin(self, begun: BegunPlant) -> _Run:
        self._ratios, self._answered = [], None
        self._begun = _Run(self.case, begun)
        return self._begun


class _Run:
    """A plant under way after its warm-up, with what was noted down of it.

    Parameters
    ----------
    case : BoptestCase
        What is served.
    begun : BegunPlant
        The plant, which runs its warm-up under the building's own control, or takes one that another test has run.
    """

    def __init__(self, case: BoptestCase, begun: BegunPlant) -> None:
        self.plant, self.start, self.end, self.warm_up_steps = begun
        self.conditions = BoundaryConditions(self.plant.scenario, case.prices)
        self._step, self._signals, self.taken = case.step, case.signals, 0
        self.rows = Trajectory((*self._signals.outputs, *self._signals.input_names))
        seen, kept = self.plant.reset(), case.warmed(self.start, self.warm_up_steps) if self.warm_up_steps else []
        if kept:
            state, rows = kept[0]
            self.plant.restore_state(state)
            self.rows, self.taken = rows.copy(), self.warm_up_steps
            return
        inputs = [self.plant.default_actions.get(a.name, a.lowest) for a in self._signals.inputs.values()]
        self._append(self._signals.output_values(seen.values_array, None, self.plant.zone_temperature), inputs, ())
        for _ in range(self.warm_up_steps):
            self.take({}, ())
        if self.warm_up_steps:
            kept.append((self.plant.save_state(), self.rows.copy()))

    @property
    def time(self) -> float:
        """BOPTEST's time now [s]."""
        return self.start + (self.taken - self.warm_up_steps) * self._step

    def take(self, given: Mapping[str, float], active: tuple[str, ...]) -> None:
        """Take a step of the plant and note it down.

        Parameters
        ----------
        given : mapping of str to float
            Setpoints by actuator [unit of the actuator].
        active : tuple of str
            Names of the inputs that are overwritten.
        """
        seen = self.plant.step({**self.plant.default_actions, **given})
        step, signals = self.plant.last_step, self._signals
        self.taken += 1
        self._append(signals.output_values(seen.values_array, step, step.end), signals.input_values(step), active)

    def _append(self, outputs: list[float], inputs: list[float], active: tuple[str, ...]) -> None:
        used = zip(self._signals.inputs, inputs, strict=True)
        self.rows.append(self.time, [*outputs, *(v for name, value in used for v in (value, float(name in active)))])


def _queried(what: str, payload: Any) -> requests.Answer:
    return requests.Answer(f"Queried {what} successfully.", payload)


#: What a test is asked, by method and path; requests other than GET have arguments.
REQUESTS: dict[tuple[str, str], Callable[..., requests.Answer]] = {
    ("GET", "name"): lambda test: _queried("the name of the test case", test.name),
    ("GET", "inputs"): lambda test: _queried("the inputs", test.case.signals.input_metadata()),
    ("GET", "measurements"): lambda test: _queried("the measurements", test.case.signals.measurement_metadata()),
    ("GET", "forecast_points"): lambda test: _queried("the forecast points", test.case.forecast_points),
    ("GET", "step"): lambda test: _queried("the control step", test.control_step),
    ("GET", "scenario"): lambda test: _queried("current test scenario", test.scenario),
    ("GET", "kpi"): BoptestTest.kpis,
    ("PUT", "initialize"): BoptestTest.initialize,
    ("PUT", "step"): BoptestTest.set_step,
    ("PUT", "scenario"): BoptestTest.set_scenario,
    ("PUT", "forecast"): BoptestTest.forecast,
    ("PUT", "results"): BoptestTest.results,
    ("POST", "advance"): BoptestTest.advance,
}
