"""Rules without a model for the foreign plants: their own control, full speed with set-back and lead, and a PI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mpc.errors import ControlError
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal.case.points import ZONE_TEMPERATURE

_HELPERS = ("pump", "fan")
Served = Mapping[Actuator, Sequence[str]]


class Own:
    """Sets nothing: the plant's own control."""

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Release every actuator."""
        return {}


def commands(actuators: Sequence[Actuator], zones: Sequence[str]) -> Served:
    """Find the commands of machines, on-off or modulating, and the zones that each serves.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant.
    zones : sequence of str
        Names.
    """
    found = [a for a in actuators if a.kind != "continuous" and a.name.rpartition("/")[2] not in _HELPERS]
    return {a: [e] if (e := a.name.rpartition("/")[0]) in zones else list(zones) for a in found}


def lower_edge(zone: str, forecast: Forecast | None, lead: float) -> float:
    """Highest lower edge of a zone's band, now and during a lead [K].

    Parameters
    ----------
    zone : str
        Its name.
    forecast : Forecast or None
        With the band.
    lead : float
        [h]
    """
    if forecast is None:
        raise ControlError("rule", "a forecast of the comfort bands", "none")
    edges = forecast.table[f"{zone}/comfort_lower_temperature"]
    step = (edges.index[1] - edges.index[0]).total_seconds() / 3600.0
    return float(edges.iloc[: max(round(lead / step), 1)].max())


class FullSpeed:
    """Machines at full speed below the band of the coming hours, off above it; thermostats at its lower edge.

    A plant whose machines take no command is led by its thermostats, which switch by themselves.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant.
    zones : sequence of str
        Names.
    lead : float
        So long before somebody comes it heats [h].
    width : float
        Between switching on, at the edge, and off [K].
    above : float
        Of a thermostat's setpoint over the edge, so that its own band is within [K].

    Raises
    ------
    ControlError
        When the plant has neither.
    """

    def __init__(self, actuators: Sequence[Actuator], zones: Sequence[str], lead: float = 3.0, width: float = 0.3,
                 above: float = 0.1) -> None:  # fmt: skip
        self.lead, self.width, self.above, self.served = lead, width, above, commands(actuators, zones)
        self._on = dict.fromkeys(self.served, False)
        names = {f"{zone}/{HEATING_SETPOINT}": zone for zone in zones}
        self._thermostats = {} if self.served else {a: names[a.name] for a in actuators if a.name in names}
        if not self.served and not self._thermostats:
            expected = f"a command of a machine, or a {HEATING_SETPOINT}"
            raise ControlError("rule", expected, ", ".join(a.name for a in actuators) or "none")

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Switch machines, set thermostats [K]."""
        chosen = {}
        for command, zones in self.served.items():
            lack = max(lower_edge(z, forecast, self.lead) - measurements[f"{z}/{ZONE_TEMPERATURE}"] for z in zones)
            self._on[command] = lack > (-self.width if self._on[command] else 0.0)
            chosen[command.name] = command.highest if self._on[command] else command.lowest
        for setpoint, zone in self._thermostats.items():
            wanted = lower_edge(zone, forecast, self.lead) + self.above
            chosen[setpoint.name] = min(max(wanted, setpoint.lowest), setpoint.highest)
        return chosen


class ProportionalIntegral:
    """A PI from the band's lower edge to the speed of a modulating machine, which is off below its minimum.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant.
    zones : sequence of str
        Names.
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
        When the plant has no command of a machine.
    """

    def __init__(self, actuators: Sequence[Actuator], zones: Sequence[str], lead: float = 3.0, above: float = 0.3,
                 gain: float = 0.6, reset: float = 6.0, step: float = 0.25) -> None:  # fmt: skip
        self.lead, self.above, self.gain, self._share = lead, above, gain, step / reset
        self.served = commands(actuators, zones)
        if not self.served:
            raise ControlError("PI", "a command of a machine", ", ".join(a.name for a in actuators) or "none")
        self._sum = dict.fromkeys(self.served, 0.0)

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Give each machine its speed."""
        chosen = {}
        for command, zones in self.served.items():
            lack = max(lower_edge(z, forecast, self.lead) - measurements[f"{z}/{ZONE_TEMPERATURE}"] for z in zones)
            error = self.gain * (lack + self.above)
            wanted = error + self._sum[command]
            speed = min(max(wanted, 0.0), 1.0)
            if wanted == speed or (wanted > 1.0) == (error < 0.0):  # no winding up
                self._sum[command] += error * self._share
            span, least = command.highest - command.lowest, command.minimum
            low = 1.0 if least is None else (least - command.lowest) / span
            share = 0.0 if speed < 0.5 * low else max(speed, low)
            chosen[command.name] = command.lowest + share * span
        return chosen
