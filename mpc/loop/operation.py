"""When the plant runs, and what the thermostats are set to: schedules of a building's own automation."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mpc.errors import PlantError
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray


@dataclass(frozen=True, eq=False)
class Operation:
    """Schedules of a building's automation, one row a step of the scenario; made by `scheduled_operation`.

    Parameters
    ----------
    heating, cooling : ndarray, shape (n_steps, n_zone)
        Setpoints of the thermostats [K].
    set_back : ndarray of bool, shape (n_steps, n_zone)
        Whether these are those of set-back.
    running : ndarray, shape (n_steps, n_air_handler)
        1 while an air handler runs by schedule, else 0 [-].
    ventilation : ndarray, shape (n_steps,)
        Share of the minimum of outdoor air that is asked for [-].
    night_cycle : float or None
        An air handler that is off by schedule runs while one of its zones lacks this much of its heating setpoint, or
        exceeds its cooling setpoint by it, until all are back within the setpoints [K]. None: it stays off.

    Raises
    ------
    PlantError
        When shapes do not fit or a value is out of its range.
    """

    heating: FloatArray
    cooling: FloatArray
    set_back: NDArray[np.bool_]
    running: FloatArray
    ventilation: FloatArray
    night_cycle: float | None = 1.0

    def __post_init__(self) -> None:
        shapes = {"heating": self.heating.shape, "cooling": self.heating.shape, "set_back": self.heating.shape,
                  "running": (len(self.heating), np.shape(self.running)[-1]),
                  "ventilation": (len(self.heating),)}  # fmt: skip
        for name, shape in shapes.items():
            values = getattr(self, name)
            missing = int((~np.isfinite(values)).sum())
            found, valid = f"shape {values.shape}, {missing} not finite", values.shape == shape and not missing
            PlantError.unless(valid, f"operation: {name}", f"finite values of shape {shape}", found)
        if not (self.heating <= self.cooling).all():
            row = int(np.argmax((self.heating > self.cooling).any(axis=1)))
            raise PlantError("operation", "heating setpoints not above cooling ones", f"others in row {row}")
        valid = self.night_cycle is None or 0.0 < self.night_cycle < 20.0
        PlantError.unless(valid, "operation: night_cycle", "0 to 20 K, or None", repr(self.night_cycle))

    def __len__(self) -> int:
        return len(self.heating)

    def fits(self, n_steps: int, n_zone: int, n_air_handler: int) -> None:
        """Refuse schedules of another building.

        Parameters
        ----------
        n_steps, n_zone, n_air_handler : int
            What the plant has.

        Raises
        ------
        PlantError
            When they have another shape.
        """
        shapes = (*self.heating.shape, self.running.shape[1])
        found, wanted = "{} steps, {} zones, {} air handlers", (n_steps, n_zone, n_air_handler)
        PlantError.unless(shapes == wanted, "operation", found.format(*wanted), found.format(*shapes))


def scheduled_operation(
    scenario: Scenario,
    air_handlers: int = 1,
    *,
    lead_hours: float = 1.5,
    margin: float = 0.5,
    always: bool = False,
    night_cycle: float | None = 1.0,
) -> Operation:
    """Run a plant for the occupied hours of a scenario's comfort bands, as an ordinary building does.

    Parameters
    ----------
    scenario : Scenario
        Its comfort bands say when zones are occupied: where the band is at its narrowest.
    air_handlers : int
        Number of air handlers; what has none, such as radiators, runs always, by its setpoints.
    lead_hours : float
        By how much plant and setpoints come before the occupied hours [h], 0 to 12.
    margin : float
        Setpoints lie this far inside of the band [K], 0 or more, as proportional thermostats let zones under load drift
        beyond them. The default is half of their throttling range.
    always : bool
        Whether air handlers run around the clock.
    night_cycle : float or None
        As in `Operation` [K].

    Returns
    -------
    Operation
        On the steps of the scenario. Outdoor air is asked for in occupied hours only.

    Raises
    ------
    PlantError
        When a number is out of its range.
    """
    if not (air_handlers >= 0 and 0.0 <= lead_hours <= 12.0 and margin >= 0.0):
        found = f"{air_handlers}, {lead_hours} h and {margin} K"
        raise PlantError("operation", "air handlers from 0 on, 0 to 12 h, a margin of 0 K or more", found)
    width = scenario.upper - scenario.lower
    occupied = width <= width.min(axis=0) + 1e-9
    early = occupied.copy()
    for ahead in range(1, round(lead_hours * 3600.0 / scenario.grid.step) + 1):
        early[:-ahead] |= occupied[ahead:]
    # setpoints of the band that comes: its first step's values while the plant is ahead of it
    lower, upper = (_ahead(edge, occupied, early) for edge in (scenario.lower, scenario.upper))
    inside = np.minimum(margin, 0.5 * (upper - lower))
    any_zone = np.repeat(early.any(axis=1, keepdims=True), air_handlers, axis=1)
    running = np.ones_like(any_zone, dtype=float) if always else any_zone.astype(float)
    ventilation = occupied.any(axis=1).astype(float)
    return Operation(lower + inside, upper - inside, ~early, running, ventilation, night_cycle)


def _ahead(edge: FloatArray, occupied: NDArray[np.bool_], early: NDArray[np.bool_]) -> FloatArray:
    """Values of a band's edge, those of the next occupied step where the plant is ahead of it."""
    out = edge.copy()
    for row in range(len(edge) - 2, -1, -1):
        lead = early[row] & ~occupied[row]
        out[row, lead] = out[row + 1, lead]
    return out


def shared_rows(values: FloatArray) -> list[FloatArray]:
    """Rows of an array, the same object as long as they are the same: what has been checked once is known again.

    Parameters
    ----------
    values : ndarray, shape (n, m)
        Rows [any].
    """
    frozen = np.ascontiguousarray(values, dtype=float)
    frozen.setflags(write=False)
    same = np.append(False, (frozen[1:] == frozen[:-1]).all(axis=1)) if len(frozen) else np.zeros(0, dtype=bool)
    rows: list[FloatArray] = []
    for row, repeats in zip(frozen, same, strict=True):
        rows.append(rows[-1] if repeats else row)
    return rows
