"""A PI for the foreign plants whose machine has a speed, beside the library's own rules."""

from __future__ import annotations

from collections.abc import Sequence

from mpc.errors import ControlError
from mpc.identify.machines import Machine
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal.case.points import ZONE_TEMPERATURE


class ProportionalIntegral:
    """A PI from the lower edge of the coming hours' band to the speed of machines, which are off below their minimum.

    Parameters
    ----------
    machines : sequence of Machine
        What is set; those without a speed are left to the plant.
    lead : float
        So long before somebody comes it heats [h].
    above : float
        Set point over the edge [K].
    gain, reset : float
        [1/K] and [h].
    step : float
        Control step [h].

    Raises
    ------
    ControlError
        When no machine has a speed.
    """

    def __init__(self, machines: Sequence[Machine], lead: float = 3.0, above: float = 0.3, gain: float = 0.6,
                 reset: float = 6.0, step: float = 0.25) -> None:  # fmt: skip
        self.rows, self.above, self.gain, self._share = max(round(lead / step), 1), above, gain, step / reset
        self.machines = [m for m in machines if m.role == "machine" and m.actuator.kind != "on_off"]
        if not self.machines:
            raise ControlError("PI", "a machine with a speed", ", ".join(m.name for m in machines) or "none")
        self._sum = dict.fromkeys((m.name for m in self.machines), 0.0)

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Give each machine its speed."""
        if forecast is None:
            raise ControlError("PI", "a forecast of the comfort bands", "none")
        chosen = {}
        for machine in self.machines:
            edges = {
                z: forecast.table[f"{z}/comfort_lower_temperature"].iloc[: self.rows].max() for z in machine.serves
            }
            lack = max(float(edge) - measurements[f"{zone}/{ZONE_TEMPERATURE}"] for zone, edge in edges.items())
            error = self.gain * (lack + self.above)
            wanted = error + self._sum[machine.name]
            speed = min(max(wanted, 0.0), 1.0)
            if wanted == speed or (wanted > 1.0) == (error < 0.0):  # no winding up
                self._sum[machine.name] += error * self._share
            low, span = machine.actuator.lowest, machine.actuator.highest - machine.actuator.lowest
            least = 0.0 if machine.actuator.minimum is None else (machine.actuator.minimum - low) / span
            chosen[machine.name] = low + span * (0.0 if speed < 0.5 * least else max(speed, least))
        return chosen
