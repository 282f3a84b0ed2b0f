"""What the guard holds plans against, as plain data that a log can carry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from mpc.live.site import Site
from mpc.live.site_file import BacnetLink, Mode
from thermal.case.points import POINT_TYPES, ZONE_TEMPERATURE


@dataclass(frozen=True)
class PointRule:
    """What may be written to a point.

    Parameters
    ----------
    mode : {"shadow", "advise", "act"}
        At the start.
    lowest, highest : float
        Range [library's unit].
    rate : float
        Largest change in an hour [library's unit/h]; 0 is any.
    release : str or float
        ``relinquish``, or a value [library's unit].
    priority : int or None
        Of our writes; None where the connection knows no priorities.
    kind : {"continuous", "on_off", "modulating"}
        Which values of the range it takes.
    minimum : float or None
        Smallest value of a modulating point that is not off [library's unit].
    """

    mode: Mode
    lowest: float
    highest: float
    rate: float
    release: float | Literal["relinquish"]
    priority: int | None
    kind: Literal["continuous", "on_off", "modulating"] = "continuous"
    minimum: float | None = None

    def takes(self, value: Any) -> bool:
        """Tell whether a value may be written, by code of the guard's own: the controller's is what it checks.

        Parameters
        ----------
        value : object
            What was planned [library's unit].
        """
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        if self.kind == "on_off":
            return value in (self.lowest, self.highest)
        least = self.lowest if self.minimum is None else self.minimum
        return least <= value <= self.highest or (self.minimum is not None and value == self.lowest)


@dataclass(frozen=True)
class Limits:
    """Limits in time, as of `mpc.live.site.GuardEntry` with their defaults [s].

    Parameters
    ----------
    step, tick, heartbeat, plan_age, input_age, clock_jump, override_hold, approval : float
        [s].
    stuck : float or None
        [s].
    """

    step: float
    tick: float
    heartbeat: float
    plan_age: float
    input_age: float
    clock_jump: float
    override_hold: float
    approval: float
    stuck: float | None = None


@dataclass(frozen=True)
class GuardRules:
    """All of them.

    Parameters
    ----------
    configuration : str
        Hash of site, plant and model that plans must name.
    limits : Limits
        In time.
    points : mapping of str to PointRule
        The white list.
    inputs : mapping of str to tuple of float
        Measurements that each plan must rest on, with the range of what is possible [library's unit].
    """

    configuration: str
    limits: Limits
    points: Mapping[str, PointRule]
    inputs: Mapping[str, tuple[float, float]]

    def to_dict(self) -> dict[str, Any]:
        """Give plain types, for the log."""
        return asdict(self) | {"inputs": {name: list(ends) for name, ends in self.inputs.items()}}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> GuardRules:
        """Make of what `to_dict` gave.

        Parameters
        ----------
        content : mapping
            Plain types.
        """
        points = {name: PointRule(**entry) for name, entry in content["points"].items()}
        inputs = {name: (float(low), float(high)) for name, (low, high) in content["inputs"].items()}
        return cls(content["configuration"], Limits(**content["limits"]), points, inputs)


def rules_of(site: Site) -> GuardRules:
    """Collect what a site says.

    Parameters
    ----------
    site : Site
        As read.
    """
    points = {}
    for name, entry in sorted(site.writable.items()):  # in the order of the log, which repeats what is decided
        link, actuator = site.file.connections[entry.connection], site.plant.actuators[name]
        ends, release, rate = entry.range, entry.release, entry.rate
        if ends is None or release is None or rate is None:
            continue
        low, high = ends
        points[name] = PointRule(
            entry.mode, low, high, rate, release, link.priority if isinstance(link, BacnetLink) else None,
            actuator.kind or "continuous", actuator.minimum,
        )  # fmt: skip
    kind = POINT_TYPES[ZONE_TEMPERATURE]
    inputs = {f"{zone}/{ZONE_TEMPERATURE}": (kind.lowest, kind.highest) for zone in sorted(site.plant.zones)}
    return GuardRules(site.hash, Limits(**site.limits()), points, inputs)
