"""Rules for any described plant: its own control, and machines at full speed or off with a set-back and a lead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mpc.identify.machines import Machine, as_heated
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
    Setpoints are at that edge, those of cooling at the lowest upper one of these hours. A rule without any model, and
    hard to beat.

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
            sides = ("lower", "upper") if machine.sign > 0.0 else ("upper", "lower")
            names = [[f"{zone}/comfort_{side}_temperature" for zone in machine.serves] for side in sides]
            bands = [as_heated(forecast.table[of], machine.sign) for of in names]
            edges = bands[0][near].max().to_numpy()
            if machine.role == "setpoint":
                told = float(edges.max()), float(bands[1].iloc[0].min())
                chosen |= machine.told(*(as_heated(edge, machine.sign) for edge in told))
                continue
            seen = [measurements[f"{zone}/{ZONE_TEMPERATURE}"] for zone in machine.serves]
            above = float(np.nanmin(np.array(seen) - edges))
            if above < 0.0:
                self._on[machine.name] = True
            elif above > self.difference:
                self._on[machine.name] = False
            chosen[machine.name] = actuator.highest if self._on[machine.name] else actuator.lowest
        return chosen
