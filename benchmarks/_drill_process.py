"""A part of a site in a drill: as in operation, but for a controller that fails on inputs of one's choice."""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Mapping
from pathlib import Path

from mpc.errors import ControlError
from mpc.live.collector import run_collector
from mpc.live.controller import ControlProcess
from mpc.live.guard.process import run_guard
from mpc.live.site import Site
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast

SETPOINTS = ("north/zone_air_heating_temperature_setpoint", "south/zone_air_heating_temperature_setpoint")
OUTDOOR = "weather_station/outside_air_temperature_sensor"

HEAT = "north/heating_power_sensor"

#: Means over a step below or above which the controller fails: outdoor air at which it raises, or gives NaN [K], and
#: heat at which it asks for what is out of range [W]; in between the building stays by itself.
RAISES, NO_NUMBER, OUT_OF_RANGE = 268.15, 293.15, 10_000.0


class DrillController:
    """Chooses setpoints at random, by the time of the step: the same again when a log is repeated."""

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Choose, or fail as the outdoor air says."""
        outdoor, rng = measurements[OUTDOOR], random.Random(measurements.seconds)
        if outdoor < RAISES:
            raise ControlError("mpc", "a plan", "none: the solver did not converge")
        chosen = {name: round(rng.uniform(291.2, 296.1), 2) for name in SETPOINTS}
        if measurements[HEAT] > OUT_OF_RANGE:
            return chosen | {SETPOINTS[0]: 400.0}
        return dict.fromkeys(chosen, math.nan) if outdoor > NO_NUMBER else chosen


def main() -> int:
    """Run a part."""
    part, site = sys.argv[1], Site(Path(sys.argv[2]))
    if part == "guard":
        return run_guard(site)
    if part == "collector":
        return run_collector(site)
    return ControlProcess(site, controller=DrillController()).run()


if __name__ == "__main__":
    sys.exit(main())
