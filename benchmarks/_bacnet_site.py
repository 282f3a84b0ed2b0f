"""A simulated building of two zones behind a BACnet/IP device, with what drills do to it."""

from __future__ import annotations

import math
import random
import time
from dataclasses import dataclass, field

from _bacnet_device import BacnetDevice, Command

ZONES = ("north", "south")

#: J/K and W/K of a zone, W of its heater, and W/K of its thermostat: a room of 60 m2 with a heavy floor.
CAPACITY, LOSS, HEATER, GAIN = 6e6, 90.0, 4000.0, 3000.0

#: What the device's own control holds [degC], and the outdoor air [degC].
OWN, OUTDOOR = 20.0, 2.0

#: Time between two steps of the building [s]: a time constant of the thermostat is CAPACITY / GAIN, half an hour.
STEP = 30.0


@dataclass
class SimulatedSite(BacnetDevice):
    """The building and its device.

    Objects: analog inputs 1 (outdoor air), 2 and 3 (zones) [degC], 4 and 5 (heat) [W]; analog values 1 and 2 (heating
    setpoints of the zones) [degC], 3 (a setpoint that nobody may touch).
    """

    rate: float
    seed: int = 0
    frozen: bool = False
    absurd: float | None = None
    outdoor: float | None = None
    heat: float | None = None
    temperatures: dict[str, float] = field(default_factory=lambda: dict.fromkeys(ZONES, OWN))

    def __post_init__(self) -> None:
        inputs = ("outdoor", *ZONES, *(f"heat {zone}" for zone in ZONES))
        super().__init__("hall", inputs, [Command(f"setpoint {number}", OWN) for number in (1, 2, 3)])
        self._rng, self._last = random.Random(self.seed), 0.0

    async def advance(self) -> bool:
        """Let the building go on, exactly over what has passed, and tell the inputs."""
        now = time.monotonic()
        passed = (now - self._last) * self.rate if self._last else 0.0
        if self._last and passed < STEP:
            return True
        self._last = now
        shown: dict[int, float] = {1: OUTDOOR if self.outdoor is None else self.outdoor}
        for k, zone in enumerate(ZONES):
            temperature = self.temperatures[zone]
            heat = min(max(GAIN * (await self.commanded(k + 1) - temperature), 0.0), HEATER)
            rest = OUTDOOR + heat / LOSS
            self.temperatures[zone] = rest + (temperature - rest) * math.exp(-passed * LOSS / CAPACITY)
            shown[k + 2] = self.temperatures[zone] + self._rng.gauss(0.0, 0.01)
            shown[k + 4] = heat if self.heat is None else self.heat
        if self.absurd is not None:
            shown[2] = self.absurd
        if not self.frozen:
            await self.show(shown)
        return True
