"""Rules for any described plant: its own control, and machines at full speed or off with a set-back and a lead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mpc.identify.machines import Machine
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal.case.points import ZONE_TEMPERATURE

#: Time before a band rises at which a rule begins to heat for it [s]: a heated floor's time to answer.
LEAD = 3 * 3600.0

#: How far above the lower edge machines run on [K]: the difference of a common thermostat.
DIFFERENCE = 0.5


class OwnControl:
    """Leaves a plant to itself."""

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Set nothing.

        Parameters
        ----------
        measurements : Measurements
            Without effect.
        forecast : Forecast or None
            Without effect.
        """
        return {}


class FullSpeed:
    """Runs machines at full speed from the lower edge of the comfort band to a difference above it, else not at all.

    The edge is the highest of the coming hours, so that zones are warm when people come; in between they are set back.
    Setpoints are at that edge. A rule without any model, and hard to beat.

    Parameters
    ----------
    machines : sequence of Machine
        What is set.
    lead : float
        How far the rule looks ahead [s].
    difference : float
        How far above the edge machines run on [K].

    Examples
    --------
    >>> FullSpeed(()).step({}, None)
    {}
    """

    def __init__(self, machines: Sequence[Machine], lead: float = LEAD, difference: float = DIFFERENCE) -> None:
        self.machines, self.lead, self.difference = tuple(machines), lead, difference
        self._on = dict.fromkeys((m.name for m in machines), False)

    def step(self, measurements: Mapping[str, float], forecast: Forecast | None) -> Mapping[str, float]:
        """Choose full speed or none.

        Parameters
        ----------
        measurements : mapping of str to float
            Temperatures of the zones [K].
        forecast : Forecast or None
            Comfort bands ahead [K]; without any, nothing is set.
        """
        if forecast is None:
            return {}
        index, chosen = forecast.table.index, dict[str, float]()
        near = np.asarray((index - index[0]).total_seconds() < self.lead)
        for machine in self.machines:
            actuator = machine.actuator
            edges = [forecast.table.loc[near, f"{zone}/comfort_lower_temperature"].max() for zone in machine.serves]
            if machine.role == "setpoint":
                chosen[machine.name] = float(np.clip(max(edges), actuator.lowest, actuator.highest))
                continue
            seen = [measurements[f"{zone}/{ZONE_TEMPERATURE}"] for zone in machine.serves]
            above = float(np.nanmin(np.array(seen) - np.array(edges)))
            if above < 0.0:
                self._on[machine.name] = True
            elif above > self.difference:
                self._on[machine.name] = False
            chosen[machine.name] = actuator.highest if self._on[machine.name] else actuator.lowest
        return chosen
