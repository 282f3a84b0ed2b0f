"""Any described plant as a site: stepped on the site's clock behind a BACnet/IP device, with the files of the site."""

from __future__ import annotations

import asyncio
import math
import re
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
from _bacnet_device import BacnetDevice, Command
from _site_files import AHEAD, ForecastTables, described_site, write_site

from mpc.adapters.described.load import load_plant
from mpc.adapters.described.programs import EnergyPlusProgram
from mpc.adapters.described.read import read_description
from mpc.adapters.described.schema import PlantFile
from mpc.errors import LiveError, PlantError
from mpc.live.clock import SimulatedClock, set_clock
from mpc.loop.actuators import Actuator
from mpc.loop.conversion import Conversion, conversion
from mpc.loop.plant import Plant
from thermal.case.points import POINT_TYPES, ZONE_TEMPERATURE

#: Longest step of a plant behind its device [s]: what is written to it acts within as long.
LONGEST_STEP = 300.0

#: End of a range that a device of single precision has no number for [unit of the actuator].
LARGEST = 1e30


class PlantSite(BacnetDevice):
    """A plant and its device.

    Each measurement is an analog input, temperatures in degC, all else in the library's units. Each actuator is an
    analog value, or a binary one where it is on-off. What is commanded there when a step ends has held over the step;
    an actuator that nobody commands is left to the plant's own control. Such an actuator shows what the plant measures
    under its name, where it does, and the lower end of its range otherwise. An input that the plant has no number for
    stays as it was: the device's stack takes none.

    Parameters
    ----------
    file : PlantFile
        Describes it; its control step is that of the forecasts that are written.
    plant : Plant
        Steps in parts of the control step; ended with the site where it has `close`.
    folder : Path
        For the site's files; a new one, as the plant begins anew with each start.
    rate : float
        How many times faster than real time the site's clock runs, which begins with the plant's period [-].
    forecast_step : float
        Of the plant's forecasts [s].
    """

    def __init__(self, file: PlantFile, plant: Plant, folder: Path, rate: float, forecast_step: float) -> None:
        live = folder / "live"
        expected, advice = "a folder without an earlier run, as the plant begins anew", "name another folder"
        LiveError.unless(not live.exists(), f"folder {folder}", expected, "logs in live/", advice)
        LiveError.unless(rate > 1.0, "rate", "more than 1, as the site's clock is not the machine's", f"{rate:g}")
        self.file, self.folder, self.rate = _with_zones(file), folder, rate
        self.plant, self.step = plant, plant.control_step
        for actuator in plant.actuators:
            known = -LARGEST < actuator.lowest and actuator.highest < LARGEST
            where, expected = f"actuators.{actuator.name}.range", "a lowest and a highest value"
            PlantError.unless(known, where, expected, "none in the description and the program")
        self.seen = plant.reset()
        self._tables = ForecastTables(folder, forecast_step)
        folder.mkdir(parents=True, exist_ok=True)
        self._forecast = self._tables.write(plant.forecast())
        self.time = self.first = float(self.seen.seconds)
        self.late = 0.0
        self._clock: SimulatedClock | None = None
        self._next = self.time + self.file.control_step
        self.actuators: tuple[Actuator, ...] = self.plant.actuators
        commanded = {actuator.name for actuator in self.actuators}
        self.columns = [column for column in self.plant.columns if column not in commanded]
        self._lines = {name: _line(name) for name in (*self.plant.columns, *commanded)}
        switches = [a.kind == "on_off" and (a.lowest, a.highest) == (0.0, 1.0) for a in self.actuators]
        shown = [self._lines[a.name].out(a.lowest) for a in self.actuators]
        names = [a.name for a in self.actuators]
        super().__init__(self.file.name, self.columns, [*map(Command, names, shown, switches)])

    def begin(
        self, database: str, port: int = 8080, model: Path | None = None, more: Mapping[str, Any] | None = None
    ) -> Path:
        """Start the device, write the site's files, and let its clock run; return the site's file.

        Parameters
        ----------
        database : str
            Address of the historian.
        port : int
            Of the page.
        model : Path, optional
            Folder of ``buildingmpc identify``, for ``mpc``; the rule by default.
        more : mapping of str to object, optional
            Other keys of the site's file.
        """
        address = self.start()
        objects = {name: f"analog-input,{k}" for k, name in enumerate(self.columns, 1)}
        objects |= {actuator.name: self.at(k) for k, actuator in enumerate(self.actuators, 1)}
        points = {name: {"at": at} | ({"unit": "degC"} if _warm(name) else {}) for name, at in objects.items()}
        for actuator in self.actuators:
            # what the plant's own control has is not known: no rate can be kept from there
            written = {"range": [actuator.lowest, actuator.highest], "rate": 0.0, "release": "relinquish"}
            points[actuator.name] |= written
        start = pd.Timestamp(self.time, unit="s", tz="UTC").tz_convert(self.file.location.timezone)
        plant = described_site(self.file, objects, self._forecast, start)
        # a database may have samples of an earlier run of this plant, which would lie ahead of the clock
        schema = re.sub("[^a-z0-9_]", "_", f"site_{self.file.name.lower()[:40]}_{time.time():.0f}")
        controlled = {} if model is None else {"controller": "mpc", "model": str(model.resolve())}
        # a second of the machine is `rate` seconds here: of planning, and between two clocks that are read
        guard = {"clock_jump": max(5.0, self.rate), "input_age": self.file.control_step}
        site = write_site(
            self.folder, plant, points, address, clock_rate=self.rate, database={"address": database, "schema": schema},
            page={"port": port}, guard=guard, **controlled, **(more or {}),
        )  # fmt: skip
        (self.folder / "live").mkdir(mode=0o700)
        set_clock(self.folder / "live" / "clock.json", self.time)
        self._clock = SimulatedClock(self.folder / "live" / "clock.json", self.rate)
        return site

    @classmethod
    def described(cls, path: str | Path, folder: Path, rate: float, at: str | None = None) -> PlantSite:
        """Make the site of a described plant.

        Parameters
        ----------
        path : str or Path
            The ``plant.yaml``, or a name of `ready_plants`.
        folder, rate
            As of the class.
        at : str, optional
            As of `load_plant`.
        """
        file = _with_zones(read_description(path, at=at))
        step = _step_of(file)
        hours = file.forecast.hours + AHEAD * file.control_step / 3600.0
        changes = {
            "control_step": step, "forecast": file.forecast.model_dump() | {"hours": hours},
            "measurements": {name: signal.model_dump() for name, signal in file.measurements.items()},
        }  # fmt: skip
        plant = load_plant(path, at=at, changes=changes)
        try:
            return cls(file, plant, folder, rate, step)
        except BaseException:
            plant.close()
            raise

    @property
    def hours(self) -> float:
        """How long the plant has run [h]."""
        return (self.time - self.first) / 3600.0

    def stop(self) -> None:
        """End the device and the plant."""
        super().stop()
        getattr(self.plant, "close", lambda: None)()

    def actions(self) -> dict[str, float]:
        """Give what is commanded now, by actuator [library's unit]; the rest is left to the plant's own control."""
        found: dict[str, float] = {}
        for k, actuator in enumerate(self.actuators, 1):
            slots = {priority: value for (point, priority), value in self.now.items() if point == k}
            if slots:
                found[actuator.name] = _taken(actuator, self._lines[actuator.name].into(slots[min(slots)]))
        return found

    async def advance(self) -> bool:
        """Take a step whenever the clock has passed its end."""
        if self._clock is None:  # the device begins before the site does
            if not self._ready.is_set():
                await self._tell()
            return True
        passed = self._clock.wall() - self.time
        if passed < self.step:
            return True
        self.late = max(self.late, passed - self.step)
        self.seen = await asyncio.to_thread(self.plant.step, self.actions())
        await self._tell()
        ends = self.time + self.step
        if ends >= self._next and not self.plant.finished:
            self._tables.write(await asyncio.to_thread(self.plant.forecast))
            self._next += self.file.control_step
        self.time = ends  # whoever sees it finds all that belongs to it
        return not self.plant.finished

    async def _tell(self) -> None:
        """Show what was measured."""
        values = {name: self._lines[name].out(float(self.seen[name])) for name in self.plant.columns}
        await self.show({k: values[name] for k, name in enumerate(self.columns, 1) if math.isfinite(values[name])})
        acted = self.actions()
        for k, actuator in enumerate(self.actuators, 1):
            name = actuator.name
            if name not in acted and math.isfinite(values.get(name, math.nan)):
                await self.set_default(k, values[name])


def _with_zones(file: PlantFile) -> PlantFile:
    """Measure the temperature of each zone, which a site must."""
    zones = {f"{name}/{ZONE_TEMPERATURE}": zone.temperature for name, zone in file.zones.items()}
    return file.model_copy(update={"measurements": zones | dict(file.measurements)})


def _step_of(file: PlantFile) -> float:
    """Step of the plant [s]: EnergyPlus' own, or the largest part of a control step that is short enough."""
    if isinstance(file.plant, EnergyPlusProgram):
        return 3600.0 / file.plant.steps_per_hour
    return file.control_step / math.ceil(file.control_step / LONGEST_STEP - 1e-9)


def _warm(name: str) -> bool:
    """Tell whether a point is a temperature, which the device has in degC."""
    kind = POINT_TYPES.get(name.rpartition("/")[2])
    return kind is not None and kind.quantity == "temperature"


def _line(name: str) -> Conversion:
    return conversion(name.rpartition("/")[2], name, "degC" if _warm(name) else None)


def _taken(actuator: Actuator, value: float) -> float:
    """Value of an actuator's range that is nearest: a device has numbers of single precision."""
    least = actuator.lowest if actuator.minimum is None else actuator.minimum
    within = actuator.highest if actuator.kind == "on_off" else min(max(least, value), actuator.highest)
    if actuator.kind == "continuous":
        return within
    return min(actuator.lowest, within, key=lambda end: abs(end - value))
