"""Actions of an agent: numbers from -1 to 1 for the setpoints that it may choose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from mpc.errors import MpcError, PlantActionError
from mpc.loop.actuators import Actuator
from thermal._types import FloatArray
from thermal.errors import describe, nearest

#: What the paper's agent sets: supply water, and supply air common to the air handlers.
SUPPLY_SETPOINTS = ("supply_water_temperature_setpoint", "supply_air_temperature_setpoint")

_LARGEST = 1.0 + 1e-6  # agents compute in single precision


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
            if name not in known:
                advice = nearest(name, known)
                raise MpcError(describe("actions", "a setpoint of the plant", repr(name), advice))
            groups.append([a for a in actuators if name in (a.name, a.name.rpartition("/")[2])])
        set_by = [a.name for group in groups for a in group]
        missing = [a.name for a in actuators if a.required and a.name not in set_by]
        if missing or len(set_by) != len(set(set_by)):
            expected = "every setpoint that is required, each once"
            found = f"none for {missing[0]}" if missing else "one twice"
            raise MpcError(describe("actions", expected, found))
        self.chosen = tuple(chosen)
        self.lowest = np.array([max(a.lowest for a in group) for group in groups])
        self.highest = np.array([min(a.highest for a in group) for group in groups])
        spans = (self.highest - self.lowest).tolist()
        self._groups = [
            ([a.name for a in group], low, span)
            for group, low, span in zip(groups, self.lowest.tolist(), spans, strict=True)
        ]

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
            raise PlantActionError(describe("action", expected, repr(action)))
        setpoints = {}
        for (names, lowest, span), value in zip(self._groups, given, strict=True):
            reached = lowest + span * min(max(0.5 * (value + 1.0), 0.0), 1.0)
            for name in names:
                setpoints[name] = reached
        return setpoints

    def action(self, setpoints: Mapping[str, float]) -> FloatArray:
        """Give the action of setpoints, shape (n_action,) [-]: the inverse of `setpoints`.

        Parameters
        ----------
        setpoints : mapping of str to float
            By ``ENTITY/POINT`` [K or Pa]; of devices in common the first one counts.
        """
        values = np.array([setpoints[names[0]] for names, _, _ in self._groups])
        return np.asarray(2.0 * (values - self.lowest) / (self.highest - self.lowest) - 1.0)
