"""Observations and actions of an agent: vectors of fixed length, scaled by ranges known before the first step."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mpc.environment.features import CLOCK_FEATURES, LARGEST, Feature, Outlook, measured_features, scaling
from mpc.errors import MpcError, PlantActionError
from mpc.loop.actuators import Actuator
from mpc.loop.view import PointView
from thermal._types import FloatArray
from thermal.batch.program import Program
from thermal.batch.trace import Tape, Traced
from thermal.case.points import split_column
from thermal.components.operations import Value

Observation = NDArray[np.float32]
Values = NDArray[Any]

#: Points that a histogram can stand for, with the edges of its bins [library's units]: those of google/sbsim's
#: HistogramReducer, its flow setpoint taken for the flow.
HISTOGRAM_EDGES: Mapping[str, tuple[float, ...]] = {
    "zone_air_temperature_sensor": tuple(float(t) for t in range(285, 304)),
    "supply_air_damper_percentage_command": (0.0, 0.2, 0.4, 0.6, 0.8, 1.0),
    "supply_air_flowrate_sensor": (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9),
}

#: What the paper's agent sets: supply water, and supply air common to the air handlers.
SUPPLY_SETPOINTS = ("supply_water_temperature_setpoint", "supply_air_temperature_setpoint")

_LARGEST = 1.0 + 1e-6  # agents compute in single precision


class ObservationLayout:
    """What an agent sees: each entry scaled by a range that is known before the first step.

    Measurements come first, then histograms where they are wanted, the forecast and the clock. No entry depends on
    what was seen before: there are no running statistics. A measurement that is missing counts as the middle of its
    range.

    Parameters
    ----------
    columns : sequence of str
        Of the plant's measurements.
    actuators : sequence of Actuator
        Of the plant.
    floor_area : float
        Of the building [m2].
    outlook : Outlook, optional
        Of forecasts; none are observed by default.
    histograms : bool
        Whether the points of `HISTOGRAM_EDGES` are observed as shares of the devices in bins, so that the length does
        not depend on how many there are.
    ranges : mapping of str to tuple of float, optional
        In the place of `OBSERVED_RANGES` and as there [library's units].

    Attributes
    ----------
    features : tuple of Feature
        Entries in order.

    Examples
    --------
    >>> air = Actuator("AHU/supply_air_temperature_setpoint", "K", 285.0, 300.0)
    >>> layout = ObservationLayout(["AHU/supply_air_temperature_setpoint"], [air], 100.0)
    >>> layout.observe(np.array([300.0]), None, np.zeros(6)).tolist()
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    """

    def __init__(
        self,
        columns: Sequence[str],
        actuators: Sequence[Actuator],
        floor_area: float,
        outlook: Outlook | None = None,
        histograms: bool = False,
        ranges: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        kept, features = measured_features(columns, actuators, floor_area, ranges)
        self.outlook, self._histograms = outlook, list[tuple[NDArray[np.intp], FloatArray]]()
        counted: list[Feature] = []
        if histograms:
            points = [split_column(column, "plant")[1] for column in columns]
            for point, edges in HISTOGRAM_EDGES.items():
                at = np.array([k for k, name in enumerate(points) if name == point], dtype=np.intp)
                if at.size:
                    self._histograms.append((at, np.asarray(edges[1:-1])))
                    counted += [Feature(f"share of {point} in {a:g} to {b:g}", "-", -1.0, 1.0)
                                for a, b in pairwise(edges)]  # fmt: skip
            pairs = [(k, f) for k, f in zip(kept, features, strict=True) if points[k] not in HISTOGRAM_EDGES]
            kept, features = tuple(k for k, _ in pairs), tuple(f for _, f in pairs)
        self._kept = np.array(kept, dtype=np.intp)
        self._factor, self._offset = scaling(features)
        ahead = () if outlook is None else outlook.features
        self.features: tuple[Feature, ...] = (*features, *counted, *ahead, *CLOCK_FEATURES)
        self._ends = len(features) + len(counted), len(features) + len(counted) + len(ahead)

    def __len__(self) -> int:
        return len(self.features)

    @property
    def own(self) -> int:
        """Entries of measurements and histograms, which come first."""
        return self._ends[0]

    def observe(self, values: FloatArray, ahead: FloatArray | None, now: FloatArray) -> Observation:
        """Observe.

        Parameters
        ----------
        values : ndarray, shape (n_column,)
            Measurements [library's units].
        ahead : ndarray or None
            Of the outlook [-]; None where there is none.
        now : ndarray, shape (6,)
            Of `clock` [-].

        Returns
        -------
        ndarray of float32, shape (n_feature,)
            Within `LARGEST` of 0 [-].
        """
        seen = np.empty(len(self.features), dtype=np.float32)
        counted, forecast = self._ends
        seen[:counted] = self.measured(values)
        if ahead is not None:
            seen[counted:forecast] = ahead
        seen[forecast:] = now
        if np.isnan(seen.sum()):
            seen[np.isnan(seen)] = 0.0
        return np.minimum(np.maximum(seen, -LARGEST, out=seen), LARGEST, out=seen)

    def measured(self, values: Value) -> Value:
        """Scale measurements, and count those that histograms stand for: what an observation begins with.

        Parameters
        ----------
        values : Value, shape (n_column,)
            Measurements, or such that are traced [library's units].

        Returns
        -------
        Value, shape (n_measured,)
            Neither cut at `LARGEST` nor without NaN [-].
        """
        parts = [values[self._kept] * self._factor + self._offset]
        for at, edges in self._histograms:
            beyond = [np.where(values[at] >= edge, 1.0, 0.0).sum() for edge in edges]
            parts.append((np.stack([float(at.size), *beyond]) - np.stack([*beyond, 0.0])) / at.size)
        return np.concatenate(parts)

    def trace(self, columns: int, view: PointView | None = None) -> tuple[Tape, Traced, Traced]:
        """Note how an observation begins: what `measured` gives, cut at `LARGEST`, and 0 for NaN.

        Parameters
        ----------
        columns : int
            Of the measurements.
        view : PointView, optional
            What the plant is seen through.

        Returns
        -------
        tuple
            The notes, what is set and what results.
        """
        tape = Tape()
        values = tape.value(columns)
        scaled = self.measured(values if view is None else view.of(values))
        cut = np.maximum(np.minimum(np.where(scaled == scaled, scaled, 0.0), LARGEST), -LARGEST)
        return tape, values, tape.keep(cut, self.own)


class ManyObservations:
    """Observations of many plants at once, as `ObservationLayout.observe` gives them.

    Parameters
    ----------
    layout : ObservationLayout
        Of each.
    columns, members : int
        Of the measurements, and how many plants.
    dtype : type
        Of the measurements.
    compiled : bool
        As in `thermal.batch.program.Program`.
    view : PointView, optional
        What the plants are seen through.
    """

    def __init__(
        self, layout: ObservationLayout, columns: int, members: int, dtype: Any, compiled: bool,
        view: PointView | None = None,
    ) -> None:  # fmt: skip
        tape, values, own = layout.trace(columns, view)
        self._program, self._shape = Program(tape, members, dtype, compiled), (len(layout), members)
        self._values, self._own = self._program.of(values), self._program.of(own)

    def observe(self, values: Values, ahead: Values, now: Values) -> Observation:
        """Observe.

        Parameters
        ----------
        values : ndarray, shape (n_column, n)
            Measurements, a column a plant [library's units].
        ahead : ndarray, shape (n_ahead, n or 1)
            Of the outlook, within `LARGEST` of 0 [-]; without rows where there is none.
        now : ndarray, shape (6, n or 1)
            Of `clock` [-].

        Returns
        -------
        ndarray of float32, shape (n, n_feature)
            A row a plant; the transpose of what lies in memory.
        """
        np.copyto(self._values, values)
        self._program.run()
        seen, own, forecast = np.empty(self._shape, dtype=np.float32), len(self._own), len(self._own) + len(ahead)
        seen[:own], seen[own:forecast], seen[forecast:] = self._own, ahead, now
        return seen.T


class ActionLayout:
    """Setpoints as numbers from -1 to 1, one a kind of setpoint or one an actuator.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant.
    chosen : sequence of str
        Kinds of setpoints, each common to all devices that have it, or actuators by ``ENTITY/POINT``; those of
        `SUPPLY_SETPOINTS` by default.

    Raises
    ------
    MpcError
        When a setpoint is not the plant's, is chosen twice, or one that every action must have is left out.

    Examples
    --------
    >>> air = Actuator("AHU/supply_air_temperature_setpoint", "K", 285.0, 300.0)
    >>> ActionLayout([air], ["supply_air_temperature_setpoint"]).setpoints([0.0])
    {'AHU/supply_air_temperature_setpoint': 292.5}
    """

    def __init__(self, actuators: Sequence[Actuator], chosen: Sequence[str] = SUPPLY_SETPOINTS) -> None:
        names = {a.name for a in actuators}
        known = names | {name.rpartition("/")[2] for name in names}
        groups = []
        for name in chosen:
            MpcError.unless_known(name, known, "actions", "a setpoint of the plant")
            groups.append([a for a in actuators if name in (a.name, a.name.rpartition("/")[2])])
        set_by = [a.name for group in groups for a in group]
        missing = [a.name for a in actuators if a.required and a.name not in set_by]
        each_once, found = len(set_by) == len({*set_by}), f"none for {missing[0]}" if missing else "one twice"
        MpcError.unless(each_once and not missing, "actions", "every setpoint that is required, each once", found)
        self.chosen = tuple(chosen)
        self.lowest = np.array([max(a.lowest for a in group) for group in groups])
        self.highest = np.array([min(a.highest for a in group) for group in groups])
        named = [[a.name for a in group] for group in groups]
        self._groups = list(zip(named, self.lowest.tolist(), (self.highest - self.lowest).tolist(), strict=True))

    def __len__(self) -> int:
        return len(self.chosen)

    def setpoints(self, action: ArrayLike) -> dict[str, float]:
        """Give the setpoints of an action.

        Parameters
        ----------
        action : array_like, shape (n_action,)
            From -1, the lower end of the range, to 1 [-].

        Returns
        -------
        dict of str to float
            By ``ENTITY/POINT`` [K or Pa].

        Raises
        ------
        PlantActionError
            When a number is not finite or out of range.
        """
        values = np.asarray(action, dtype=float)
        given = values.tolist() if values.shape == self.lowest.shape else []
        if not given or not all(-_LARGEST <= value <= _LARGEST for value in given):  # NaN is in no range
            expected = f"{len(self)} numbers from -1 to 1, for {', '.join(self.chosen)}"
            raise PlantActionError("action", expected, repr(action))
        setpoints: dict[str, float] = {}
        for (names, lowest, span), value in zip(self._groups, given, strict=True):
            setpoints |= dict.fromkeys(names, lowest + span * min(max(0.5 * (value + 1.0), 0.0), 1.0))
        return setpoints

    @property
    def names(self) -> tuple[str, ...]:
        """Actuators that are set, by ``ENTITY/POINT``, in the order of `setpoints_of_many`."""
        return tuple(name for names, _, _ in self._groups for name in names)

    def setpoints_of_many(self, actions: ArrayLike) -> FloatArray:
        """Give the setpoints of many plants' actions.

        Parameters
        ----------
        actions : array_like, shape (n, n_action)
            From -1 to 1 [-].

        Returns
        -------
        ndarray, shape (n_actuator, n)
            In the order of `names` [K or Pa].

        Raises
        ------
        PlantActionError
            When a number is not finite or out of range.
        """
        values = np.asarray(actions, dtype=float)
        valid = values.ndim == 2 and values.shape[1] == len(self) and bool((np.abs(values) <= _LARGEST).all())
        if not valid:  # NaN is in no range
            expected = f"rows of {len(self)} numbers from -1 to 1, for {', '.join(self.chosen)}"
            raise PlantActionError("action", expected, f"shape {values.shape}, {values.min()} to {values.max()}")
        shares = np.minimum(np.maximum(0.5 * (values.T + 1.0), 0.0), 1.0)
        each = self.lowest[:, None] + (self.highest - self.lowest)[:, None] * shares
        return np.asarray(np.repeat(each, [len(names) for names, _, _ in self._groups], axis=0))

    def action(self, setpoints: Mapping[str, float]) -> FloatArray:
        """Give the action of setpoints, shape (n_action,) [-]: the inverse of `setpoints`.

        Parameters
        ----------
        setpoints : mapping of str to float
            By ``ENTITY/POINT`` [K or Pa]; of devices in common the first one counts.
        """
        values = np.array([setpoints[names[0]] for names, _, _ in self._groups])
        return np.asarray(2.0 * (values - self.lowest) / (self.highest - self.lowest) - 1.0)
