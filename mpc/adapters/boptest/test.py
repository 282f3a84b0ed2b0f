"""A test of BOPTEST: the state between the requests of a client, and what each request does to it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mpc.adapters.boptest.case import BegunPlant, BoptestCase
from mpc.adapters.boptest.forecast import UNCERTAINTY, BoundaryConditions, forecast_metadata, uncertain
from mpc.adapters.boptest.overwrites import read_overwrites
from mpc.adapters.boptest.periods import Period
from mpc.adapters.boptest.signals import Metadata
from mpc.adapters.boptest.trajectory import Trajectory
from mpc.adapters.boptest.values import MOST_VALUES, allowed, choice, names, number, required, time_or_infinite
from mpc.errors import BoptestRequestError
from mpc.kpi.kpis import measure_kpis
from mpc.kpi.record import PlantRecord

#: Names of the indicators that `GET /kpi` gives.
KPI_NAMES = ("cost_tot", "emis_tot", "ener_tot", "idis_tot", "pdih_tot", "pele_tot", "pgas_tot", "tdis_tot", "time_rat")

_FOREVER = 1e12  # s, beyond any time of a test
_SCENARIO = ("electricity_price", "time_period", "temperature_uncertainty", "solar_uncertainty", "seed")
_UNCERTAINTIES = {"TDryBul": "temperature_uncertainty", "HGloHor": "solar_uncertainty"}


class Answer(NamedTuple):
    """What a request is answered with, beside the status 200.

    Parameters
    ----------
    message : str
        For people.
    payload : object
        What was asked for, of plain types.
    """

    message: str
    payload: Any


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
        self._step = case.step
        self._scenario: dict[str, Any] = dict.fromkeys(_SCENARIO) | {"electricity_price": "constant"}
        self._begun: BegunPlant | None = None
        self._conditions: BoundaryConditions | None = None
        self._taken = 0
        self._ratios: list[float] = []
        self._answered: float | None = None
        self._rows = Trajectory(())

    @cached_property
    def _forecast_points(self) -> Metadata:
        return forecast_metadata(self.case)

    @property
    def time(self) -> float:
        """BOPTEST's time now [s]; a test that was not initialized stands where the weather begins."""
        if self._begun is None:
            return self.case.covered[0]
        return self._begun.start + (self._taken - self._begun.warm_up_steps) * self.case.step

    def get_name(self) -> Answer:
        """Name of the test case; year and time zone are ours, for clients that want dates."""
        clock = self.case.clock
        payload = {"name": self.case.name, "year": clock.year, "timezone": clock.timezone}
        return Answer("Queried the name of the test case successfully.", payload)

    def get_inputs(self) -> Answer:
        """Metadata of the inputs."""
        return Answer("Queried the inputs successfully.", self.case.signals.input_metadata())

    def get_measurements(self) -> Answer:
        """Metadata of the outputs."""
        return Answer("Queried the measurements successfully.", self.case.signals.measurement_metadata())

    def get_forecast_points(self) -> Answer:
        """Metadata of the boundary conditions."""
        return Answer("Queried the forecast points successfully.", self._forecast_points)

    def get_step(self) -> Answer:
        """Control step [s]."""
        return Answer("Queried the control step successfully.", self._step)

    def set_step(self, body: Mapping[str, Any]) -> Answer:
        """Choose the control step.

        Parameters
        ----------
        body : mapping
            ``step`` [s], a multiple of the plant's own.
        """
        (value,) = required(body, "step")
        step, own = number("parameter step", value), self.case.step
        if not (step >= own and math.isclose(step / own, round(step / own), rel_tol=1e-9) and step <= _FOREVER):
            raise BoptestRequestError(
                f"Invalid value {step:g} for parameter step. The plant has steps of {own:g} s: give a multiple of it, "
                "or serve the plant with shorter steps."
            )
        self._step = round(step / own) * own
        return Answer("Control step set successfully.", {"step": self._step})

    def get_scenario(self) -> Answer:
        """Scenario, and when the test ends."""
        end = None if self._begun is None else str(self._begun.end)
        return Answer("Queried current test scenario successfully.", {**self._scenario, "end_time": end})

    def set_scenario(self, body: Mapping[str, Any]) -> Answer:
        """Choose price, uncertainty of forecasts and time period; the latter initializes.

        Parameters
        ----------
        body : mapping
            Any of ``electricity_price``, ``time_period``, ``temperature_uncertainty``, ``solar_uncertainty``, ``seed``.
        """
        allowed(body, _SCENARIO)
        price, period = body.get("electricity_price"), body.get("time_period")
        levels = {name: body.get(name) for name in _UNCERTAINTIES.values()}
        changed: dict[str, Any] = {name: choice(name, level, UNCERTAINTY, none=True) for name, level in levels.items()}
        if price is not None:
            changed["electricity_price"] = choice("electricity_price", price, self.case.prices)
        if period is not None:
            changed["time_period"] = choice("time_period", period, self.case.periods)
        seed = body.get("seed")
        changed["seed"] = None if seed is None else int(number("scenario parameter seed", seed, 0, 2**63 - 1))
        payload: dict[str, Any] = dict.fromkeys(_SCENARIO) | changed
        if period is not None:
            payload["time_period"] = self._begin_period(self.case.periods[str(period)])
        self._scenario |= changed
        return Answer("Test case scenario was set successfully.", payload)

    def initialize(self, body: Mapping[str, Any]) -> Answer:
        """Begin anew at a time, after a warm-up.

        Parameters
        ----------
        body : mapping
            ``start_time`` and ``warmup_period`` [s].
        """
        given = required(body, "start_time", "warmup_period")
        start = number("parameter start_time", given[0], 0.0)
        warm_up = number("parameter warmup_period", given[1], 0.0)
        payload = self._begin(self.case.begin(start, warm_up))
        self._scenario["time_period"] = None
        ran = self._taken * self.case.step
        message = f"Test simulation initialized successfully to {self.time}s with warmup period of {ran}s."
        if self.time != start or ran != warm_up:
            message += f" Asked for were {start}s and {warm_up}s: times are whole minutes where there is weather."
        return Answer(message, payload)

    def advance(self, body: Mapping[str, Any]) -> Answer:
        """Go on by a control step; inputs out of range are clipped, as BOPTEST does, and the message says so.

        Parameters
        ----------
        body : mapping
            Values of inputs and activations, by name.
        """
        given, active, warnings = read_overwrites(body, self.case.signals.inputs)
        begun = self._running()
        if self._answered is not None:
            self._ratios.append((self._clock() - self._answered) / self._step)
        begin = self.time
        count = min(round(self._step / self.case.step), round((begun.end - begin) / self.case.step))
        if count < 1:
            return Answer("End of test case scenario time period reached.", {})
        for _ in range(count):
            self._take(given, active)
        self._answered = self._clock()
        message = warnings or f"Advanced simulation successfully from {begin}s to {self.time}s."
        return Answer(message, self._rows.last())

    def results(self, body: Mapping[str, Any]) -> Answer:
        """Look up what was, with its warm-up.

        Parameters
        ----------
        body : mapping
            ``point_names``, ``start_time`` and ``final_time`` [s].
        """
        given = required(body, "point_names", "start_time", "final_time")
        points = names("point_names", given[0], (*self.case.signals.outputs, *self.case.signals.input_names))
        start, final = (
            time_or_infinite(name, value) for name, value in zip(("start_time", "final_time"), given[1:], strict=True)
        )
        self._running()
        payload = self._rows.between(points, start, final) if points else {}
        return Answer("Queried results data successfully.", payload)

    def forecast(self, body: Mapping[str, Any]) -> Answer:
        """Forecast boundary conditions from now on; each value holds for the plant's step that begins at its time.

        Parameters
        ----------
        body : mapping
            ``point_names``, ``horizon`` and ``interval`` [s].
        """
        given = required(body, "point_names", "horizon", "interval")
        points = names("point_names", given[0], self._forecast_points)
        horizon = number("parameter horizon", given[1], 0.0, _FOREVER)
        interval = number("parameter interval", given[2], 1e-3, _FOREVER)
        count = math.floor(horizon / interval + 1e-9) + 1
        if count * max(len(points), 1) > MOST_VALUES:
            raise BoptestRequestError(f"Invalid horizon {horizon:g} and interval {interval:g}: too many values.")
        self._running()
        if self._conditions is None:
            raise BoptestRequestError("The test was not initialized.")
        times = np.asarray(self.time + interval * np.arange(count), dtype=float)
        rows, late = self._conditions.rows(self.case.clock.zero + times)
        payload = {"time": times.tolist()}
        for name in points:
            values = self._conditions.series(name)[rows]
            level = self._scenario.get(_UNCERTAINTIES.get(name, ""))
            if level is not None:
                seed = (int(self._scenario["seed"] or 0), round(self.time))
                values = uncertain(name, values, level, seed, interval)
            payload[name] = values.tolist()
        message = "Queried the forecast data successfully."
        return Answer(f"{message} Beyond what is known the last day repeats." if late else message, payload)

    def kpis(self) -> Answer:
        """Measure indicators from the start on, at the price of the current scenario; null is what there is none of."""
        begun = self._running()
        rows = self._taken - begun.warm_up_steps
        values: dict[str, float | None] = dict.fromkeys(KPI_NAMES)
        if rows and self._conditions is not None:
            price = self._conditions.prices[self._scenario["electricity_price"]]
            whole, k = begun.plant.record(), begun.warm_up_steps
            gas = None if whole.gas is None else whole.gas[k:]
            record = PlantRecord(whole.step, whole.zone_temperature[k:], whole.electricity[k:], gas)
            found = measure_kpis(record, replace(begun.plant.scenario, electricity_price=price), first_step=k)
            values = {name: getattr(found, name) for name in KPI_NAMES}
        else:
            values |= dict.fromkeys(("cost_tot", "emis_tot", "ener_tot", "tdis_tot"), 0.0)
        values["time_rat"] = float(np.mean(self._ratios)) if self._ratios else None
        return Answer("Queried KPIs successfully.", values)

    def _running(self) -> BegunPlant:
        """Give the run; one that was not initialized begins where the weather does, as BOPTEST begins at 0."""
        if self._begun is None:
            self._begin(self.case.begin(self.case.covered[0], 0.0))
        if self._begun is None:
            raise BoptestRequestError("The test was not initialized.")
        return self._begun

    def _begin_period(self, period: Period) -> dict[str, float]:
        return self._begin(self.case.begin(period.start, period.warm_up, period.end))

    def _begin(self, begun: BegunPlant) -> dict[str, float]:
        """Run the warm-up under the building's own control, or take one that another test has run."""
        signals, plant, key = self.case.signals, begun.plant, (begun.start, begun.warm_up_steps)
        self._conditions = BoundaryConditions(plant.scenario, self.case.prices)
        self._begun, self._taken, self._ratios, self._answered = begun, 0, [], None
        self._rows = Trajectory((*signals.outputs, *signals.input_names))
        seen, warmed = plant.reset(), self.case.warmed.get(key)
        if warmed is not None:
            plant.restore_state(warmed[0])
            self._rows, self._taken = warmed[1].copy(), begun.warm_up_steps
            return self._rows.last()
        first = seen.values_array
        inputs = [plant.default_actions.get(a.name, a.lowest) for a in signals.inputs.values()]
        self._append(signals.output_values(first, None, plant.zone_temperature), inputs, ())
        for _ in range(begun.warm_up_steps):
            self._take({}, ())
        if begun.warm_up_steps:
            self.case.warmed.put(key, (plant.save_state(), self._rows.copy()))
        return self._rows.last()

    def _take(self, given: Mapping[str, float], active: tuple[str, ...]) -> None:
        """Take a step of the plant and note it down."""
        begun = self._running()
        seen = begun.plant.step({**begun.plant.default_actions, **given})
        step, signals = begun.plant.last_step, self.case.signals
        self._taken += 1
        self._append(signals.output_values(seen.values_array, step, step.end), signals.input_values(step), active)

    def _append(self, outputs: list[float], inputs: list[float], active: tuple[str, ...]) -> None:
        used = zip(self.case.signals.inputs, inputs, strict=True)
        both = [v for name, value in used for v in (value, float(name in active))]
        self._rows.append(self.time, [*outputs, *both])
