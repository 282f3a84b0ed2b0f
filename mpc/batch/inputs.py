"""What drives many plants from outside, laid out before the first step: schedules, weather, people, prices, noise."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mpc.batch.alike import driven_by
from mpc.batch.building import Array
from mpc.loop.noise import STREAM
from mpc.loop.random_numbers import compiled_filling, normal_numbers, stream_key
from mpc.loop.simulated import SimulatedPlant
from thermal._types import FloatArray, IntArray
from thermal.units import REFERENCE_TEMPERATURE

#: Members' steps whose noise is drawn together, and steps of one at most.
_TOGETHER, _LONGEST = 4096, 64


def plant_rows(plant: SimulatedPlant, outside: Sequence[str]) -> dict[str, FloatArray]:
    """Lay out what drives a plant, a row a step; temperatures of zones are counted from the reference temperature.

    Parameters
    ----------
    plant : SimulatedPlant
        The plant.
    outside : sequence of str
        Of `mpc.batch.alike.driven_by`: what drives the building of this plant or of another one.
    """
    scenario, operation, n = plant.scenario, plant.operation, plant.scenario.grid.n_steps
    prices = [getattr(scenario, f"{of}_{kind}") for kind in ("price", "carbon") for of in ("electricity", "gas")]
    running = operation.running if operation.running.shape[1] else np.ones((n, 1))
    return {
        "heating": operation.heating - REFERENCE_TEMPERATURE,
        "cooling": operation.cooling - REFERENCE_TEMPERATURE,
        "running": operation.running,
        "some_idle": (running.min(axis=1, keepdims=True) < 1.0) * 1.0,
        "ventilation": operation.ventilation[:, None],
        "outdoor": scenario.outdoor[:, None],
        "weather": scenario.weather.frame.to_numpy(dtype=float),
        "lower": scenario.lower - REFERENCE_TEMPERATURE,
        "upper": scenario.upper - REFERENCE_TEMPERATURE,
        "prices": np.column_stack(prices),
        **people_rows(plant, plant.scenario, outside),
    }


def people_rows(plant: SimulatedPlant, scenario: Any, outside: Sequence[str]) -> dict[str, FloatArray]:
    """Lay out what depends on who is in: people, their heat, and signals of effects.

    Parameters
    ----------
    plant : SimulatedPlant
        The plant.
    scenario : Scenario
        Its own, or with other people.
    outside : sequence of str
        As in `plant_rows`; what this building does not have stays at 0.
    """
    own, network = plant.outside(scenario), plant.model.network
    own -= np.repeat([REFERENCE_TEMPERATURE, 0.0], [len(network.boundaries), len(network.signals)])
    whole = np.zeros((len(own), len(outside)))
    whole[:, [outside.index(name) for name in driven_by(plant.model)]] = own
    return {"gains": scenario.gains, "people": scenario.occupancy, "outside": whole}


class DrivingRows:
    """Rows of several plants' inputs, given out to members.

    Parameters
    ----------
    tables : sequence of mapping of str to ndarray, shape (n_steps, width)
        One a plant, with the same names and widths [any].
    members : int
        How many.
    own : sequence of str
        Names of what each member has for itself, drawn at its reset.
    dtype : numpy.dtype
        Precision.

    Attributes
    ----------
    parts : dict of str to slice
        Where each part stands in a row.
    each : bool
        Whether members may differ.
    """

    def __init__(
        self, tables: Sequence[Mapping[str, FloatArray]], members: int, own: Sequence[str], dtype: Any
    ) -> None:
        self.parts, end, widths = dict[str, slice](), 0, {name: v.shape[1] for name, v in tables[0].items()}
        for name in sorted(widths, key=lambda name: name in own):  # what is a member's own comes last
            self.parts[name], end = slice(end, end + widths[name]), end + widths[name]
        self.width, self.each, self._dtype = end, len(tables) > 1 or bool(own), np.dtype(dtype)
        whole = [np.hstack([table[name] for name in self.parts]) for table in tables]
        lengths = [len(table) for table in whole]
        self.first = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.intp)
        self._rows = np.ascontiguousarray(np.vstack(whole), dtype=dtype)
        self._names, self._common = tuple(own), end - sum(widths[name] for name in own)
        self._own = np.zeros((members, max(lengths), end - self._common), dtype=dtype) if own else None
        self._begin, self._last, self._numbers = (np.arange(members) * k for k in (0, 0, 1))
        self._lengths = np.array(lengths)

    def begin(self, member: int, plant: int, own: Mapping[str, FloatArray] | None) -> None:
        """Tell which plant a member has.

        Parameters
        ----------
        member, plant : int
            Numbers.
        own : mapping of str to ndarray, shape (n_steps, width), or None
            What it has for itself [any].
        """
        self._begin[member], self._last[member] = self.first[plant], self._lengths[plant] - 1
        if self._own is not None and own is not None:
            for name in self._names:
                part, values = self.parts[name], own[name]
                self._own[member, : len(values), part.start - self._common : part.stop - self._common] = values

    def put(self, parts: Mapping[str, FloatArray]) -> None:
        """Let the first steps of the first plant, and of all members, have other values.

        Parameters
        ----------
        parts : mapping of str to ndarray, shape (n_steps, width)
            What is replaced [any].
        """
        for name, values in parts.items():
            part, n = self.parts[name], len(values)
            self._rows[:n, part] = values
            if self._own is not None and name in self._names:
                self._own[:, :n, part.start - self._common : part.stop - self._common] = values

    def fill(self, steps: IntArray, out: Array) -> None:
        """Fill in the rows of a step of each member.

        Parameters
        ----------
        steps : ndarray of int, shape (member,)
            Numbers of the steps.
        out : ndarray, shape (width, member or 1)
            Filled.
        """
        if not self.each:
            out[:, 0] = self._rows[min(int(steps[0]), len(self._rows) - 1)]
            return
        steps = np.minimum(steps, self._last)
        np.copyto(out[: self._common], self._rows[self._begin + steps, : self._common].T)
        if self._own is not None:
            np.copyto(out[self._common :], self._own[self._numbers, steps].T)

    def table(self) -> Array:
        """Give all rows of all members, shape (n_steps, width, member or 1); the last row of shorter ones repeats."""
        members = len(self._numbers)
        found = np.zeros((int(self._lengths.max()), self.width, members if self.each else 1), self._dtype)
        for step, row in enumerate(found):
            self.fill(np.full(members, step), row)
        return found


class DrawnNoise:
    """Noise of many members: each has the numbers that it has alone.

    Parameters
    ----------
    width : int
        Numbers of a step.
    members : int
        How many.
    dtype : numpy.dtype
        Precision.
    compiled : bool
        Whether numba draws each step's numbers where they are needed; otherwise those of some steps are drawn together.
    """

    def __init__(self, width: int, members: int, dtype: Any, compiled: bool) -> None:
        self._keys, self._members = np.zeros(members, dtype=np.uint64), np.arange(members)
        self._compiled = compiled_filling(np.dtype(dtype)) if compiled else None
        # few enough to stay in the processor's cache
        self._block = min(max(_TOGETHER // members, 1), _LONGEST)
        self._numbers = np.full(members, -1, dtype=np.int64)
        self._drawn = np.zeros((width, self._block, 0 if compiled else members), dtype=dtype)

    def begin(self, member: int, seed: int) -> None:
        """Give a member a seed.

        Parameters
        ----------
        member, seed : int
            Numbers.
        """
        self._keys[member], self._numbers[member] = stream_key(seed, STREAM), -1

    def fill(self, steps: IntArray, out: Array) -> None:
        """Fill in the random numbers of a step of each member.

        Parameters
        ----------
        steps : ndarray of int, shape (member,)
            Numbers of the steps.
        out : ndarray, shape (width, member)
            Filled.
        """
        if self._compiled is not None:
            self._compiled(self._keys, steps, out)
            return
        numbers, rows = np.divmod(steps, self._block)
        if (stale := np.flatnonzero(numbers != self._numbers)).size:
            each = self._block * numbers[stale] + np.arange(self._block)[:, None]
            keys = np.broadcast_to(self._keys[stale], each.shape)
            drawn = normal_numbers(keys.ravel(), each.ravel(), len(out))
            self._drawn[:, :, stale] = drawn.reshape(len(out), *each.shape)
            self._numbers[stale] = numbers[stale]
        same = bool((rows == rows[0]).all())
        np.copyto(out, self._drawn[:, rows[0]] if same else self._drawn[:, rows, self._members])
