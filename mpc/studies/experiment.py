"""Experiments on a simulated site: setpoints of a schedule on a plant, and the telemetry that they leave."""

import importlib
import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd

from calibration.experiment.outcome import joined
from calibration.experiment.schedule import Schedule
from mpc.errors import PlantError
from mpc.loop.plant import Controller, Measurements, Plant
from mpc.loop.run import FixedSetpoints
from mpc.scenario.forecast import Forecast
from thermal.case.case import Case
from thermal.case.points import ZONE_TEMPERATURE
from thermal.case.telemetry import Telemetry
from thermal.errors import Described

#: How far the temperatures of a site may be from those of the case on the same days, root mean square [K]: another
#: plant, or another seed, is further off than sensors are coarse.
_SAME = 0.1


class Site(Protocol):
    """A simulated building that goes on where a case ends: its plant runs from the first stamp of the telemetry."""

    def __call__(self, case: Case, end: pd.Timestamp) -> tuple[Plant, Mapping[str, float]]:
        """Give the plant, and its setpoints in usual operation.

        Parameters
        ----------
        case : Case
            Telemetry so far.
        end : Timestamp
            When the run ends.
        """


@dataclass(frozen=True)
class Scheduled:
    """A controller that follows a schedule, and holds usual setpoints else.

    Parameters
    ----------
    schedule : Schedule
        Of an experiment.
    usual : mapping of str to float
        Setpoints in usual operation [K] or [Pa].
    names : tuple of str
        Actuators that the plant has.
    control_step : float
        Time between two actions [s].

    Attributes
    ----------
    changes : DataFrame
        Setpoints from each change on, a column a point [K] or [Pa]; -1 where the building's own automation has it.
    """

    schedule: Schedule
    usual: Mapping[str, float]
    names: tuple[str, ...]
    control_step: float
    changes: pd.DataFrame = field(init=False, repr=False)

    def __post_init__(self) -> None:
        rows = self.schedule.rows(self.control_step)
        unknown = sorted(set(rows["point"]) - set(self.names))
        advice = "the site has no such actuator"
        PlantError.unless(not unknown, "schedule", "points that the site can set", unknown[:3], advice)
        wide = rows.pivot_table(index="time", columns="point", values="value", dropna=False)
        given = rows.assign(there=1.0).pivot_table(index="time", columns="point", values="there")
        object.__setattr__(self, "changes", wide.where(given.notna()).fillna(-1.0).where(given.notna()).ffill())

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Choose the setpoints of the hour.

        Parameters
        ----------
        measurements : Measurements
            Only their stamp counts.
        forecast : Forecast or None
            Without effect.
        """
        actions = dict(self.usual)
        now = self.changes.loc[: measurements.stamp]
        if len(now):
            actions |= {str(k): float(v) for k, v in now.iloc[-1].items() if v > 0.0}
        return actions


def open_site(name: str) -> Site:
    """Find a simulated site by name.

    Parameters
    ----------
    name : str
        ``MODULE:FUNCTION`` or ``FILE.py:FUNCTION`` of a function of a case and an end, `Site`.

    Raises
    ------
    PlantError
        When there is none.
    """
    where, _, function = name.rpartition(":")
    expected = "MODULE:FUNCTION or FILE.py:FUNCTION"
    PlantError.unless(where and function, "site", expected, repr(name))
    try:
        if where.endswith(".py"):
            spec = importlib.util.spec_from_file_location(Path(where).stem, where)
            if spec is None or spec.loader is None or not Path(where).exists():
                raise ImportError(f"no file {where}")
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        else:
            module = importlib.import_module(where)
        site: Any = getattr(module, function)
    except Exception as error:  # whatever the code of a site raises
        raise PlantError("site", expected, f"{name!r} ({type(error).__name__}: {error})") from error
    PlantError.unless(callable(site), "site", "a function of a case and an end", type(site).__name__)
    found: Site = site
    return found


def made_by(site: Site, case: Case, end: pd.Timestamp) -> tuple[Plant, Mapping[str, float]]:
    """Call a site and check what it gives.

    Parameters
    ----------
    site : Site
        Gives the plant.
    case : Case
        Telemetry so far.
    end : Timestamp
        When the run ends.

    Raises
    ------
    PlantError
        When it does not give a plant with telemetry, and its usual setpoints.
    """
    expected = "a plant with actuators, control_step and telemetry(), and its usual setpoints"
    try:
        found: Any = site(case, end)
    except Exception as error:  # whatever the code of a site raises
        if isinstance(error, Described):
            raise
        raise PlantError("site", expected, f"{type(error).__name__}: {error}") from error
    pair = isinstance(found, tuple) and len(found) == 2 and isinstance(found[1], Mapping)
    PlantError.unless(pair, "site", expected, repr(found))
    lacking = [name for name in ("actuators", "control_step", "step", "telemetry") if not hasattr(found[0], name)]
    PlantError.unless(not lacking, "site", expected, f"a {type(found[0]).__name__} without {', '.join(lacking)}")
    plant, usual = found
    return plant, usual


def carry_out(
    case: Case, schedule: Schedule, site: Site, progress: Callable[[str, int, int], None] | None = None
) -> Case:
    """Carry out an experiment on a simulated site.

    Parameters
    ----------
    case : Case
        Telemetry so far.
    schedule : Schedule
        Of the experiment; without moves, usual operation.
    site : Site
        Gives the plant.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    Case
        With the telemetry of the case and what follows, to the end of the experiment.

    Raises
    ------
    PlantError
        When the plant lacks an actuator, is over too soon, or is not the building that the case is of.
    """
    plant, usual = made_by(site, case, schedule.end)
    names = tuple(a.name for a in plant.actuators)
    controller: Controller = Scheduled(
        schedule, FixedSetpoints(usual, plant.actuators).at_hour(0.0), names, plant.control_step
    )
    seen, rows, total = (
        plant.reset(),
        0,
        max(1, round((schedule.end - case.stamps[0]).total_seconds() / plant.control_step)),
    )
    while not plant.finished:
        seen = plant.step(controller.step(seen, None))
        rows += 1
        if progress is not None and rows % 50 == 0:
            progress("experiment", min(rows, total), total)
    after = plant.telemetry()  # type: ignore[attr-defined]
    found = f"it ends at {after.index[-1]}"
    PlantError.unless(after.index[-1] >= schedule.end, "site", f"a run to {schedule.end}", found)
    frame = joined(case.telemetry.frame, after.loc[: schedule.end])
    _same_building(case, after)
    return Case(case.building, Telemetry.from_frame(frame, where="experiment"))


def _same_building(case: Case, after: pd.DataFrame) -> None:
    """Refuse a site whose past is not that of the case."""
    columns = [c for c in case.telemetry.frame if str(c).endswith(f"/{ZONE_TEMPERATURE}") and c in after]
    shared = case.telemetry.frame.index.intersection(after.index)
    if not len(shared):
        raise PlantError("site", "a run that begins with the telemetry", f"one that begins at {after.index[0]}")
    off = case.telemetry.frame.loc[shared, columns].to_numpy() - after.loc[shared, columns].to_numpy()
    size = float(np.sqrt(np.nanmean(off**2)))
    PlantError.unless(size <= _SAME, "site", "the telemetry of the case on its days", f"{size:.2f} K from it")
