"""A ``site.yaml`` as read, with its plant: how a described building is operated."""

from __future__ import annotations

import hashlib
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mpc.adapters.described.read import read_description
from mpc.adapters.described.schema import PlantFile
from mpc.errors import LiveError
from mpc.live.clock import Clock, SimulatedClock
from mpc.live.site_file import BacnetLink, PointEntry, SiteFile
from mpc.loop.conversion import Conversion, conversion
from thermal.case.load import NAME, read_building_file
from thermal.case.points import POINT_TYPES
from thermal.case.schema_file import read_mapping, schema_error
from thermal.errors import nearest


class Site:
    """A site as its file describes it, with its plant.

    Parameters
    ----------
    path : Path
        The ``site.yaml``.

    Attributes
    ----------
    file : SiteFile
        As read.
    plant : PlantFile
        Of the building.
    folder : Path
        For logs, spool and sockets; made where it is not there, for this user alone.
    hash : str
        SHA-256 of the site's file, the plant's and the model's: the configuration that plans and logs name.

    Raises
    ------
    LiveError
        When the file does not fit its schema, or names what is not there.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        content = read_mapping(self.path, LiveError, self.path.name, "a description of a site")
        try:
            self.file = SiteFile.model_validate(content)
        except ValidationError as error:
            raise schema_error(error, LiveError, self.path.name, SiteFile) from error
        here = self.path.parent
        self.plant_path = here / self.file.plant
        self.plant: PlantFile = read_description(self.plant_path)
        self.folder = here / self.file.folder
        self._check()
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        self.hash = self._hash()

    @property
    def step(self) -> float:
        """Control step [s]."""
        return self.plant.control_step

    @property
    def sockets(self) -> Path:
        """Address of the guard on this machine."""
        return self.folder / "guard.sock"

    @cached_property
    def conversions(self) -> dict[str, Conversion]:
        """What brings each point's values into the library's unit."""
        return {
            name: conversion(name.rpartition("/")[2], entry.at, entry.unit) for name, entry in self.file.points.items()
        }

    def clock(self) -> Clock:
        """Give the site's clock: the machine's, or one that runs faster, of which the site's folder has the state."""
        if self.file.clock_rate == 1.0:
            return Clock()
        return SimulatedClock(self.folder / "clock.json", self.file.clock_rate)

    @property
    def writable(self) -> dict[str, PointEntry]:
        """Points that may ever be written to: those with a range, a rate and a release."""
        return {
            name: entry for name, entry in self.file.points.items()
            if entry.range is not None and entry.rate is not None and entry.release is not None
        }  # fmt: skip

    def _check(self) -> None:
        """Refuse names that fit nothing."""
        file, name = self.file, self.path.name
        for point, entry in file.points.items():
            where = f"{name}: points.{point}"
            LiveError.unless_known(entry.connection, file.connections, f"{where}.connection", "a name of `connections`")
            kind = point.rpartition("/")[2]
            advice = nearest(kind, POINT_TYPES) if kind not in POINT_TYPES else ""
            expected = "ENTITY/POINT with a point of the case format, or an actuator of the plant"
            known = kind in POINT_TYPES or point in self.plant.actuators
            LiveError.unless("/" in point and known, where, expected, repr(point), advice)
            bacnet = isinstance(file.connections[entry.connection], BacnetLink)
            topics = entry.at.split()
            plain = len(topics) in (1, 2) and not set("+#\0") & set(entry.at)
            LiveError.unless(
                bacnet or plain, f"{where}.at", "a topic to read, and one to write to, without + and #", repr(entry.at)
            )
            found = f"release {entry.release!r} on {file.connections[entry.connection].kind}"
            LiveError.unless(
                bacnet or entry.release != "relinquish", f"{where}.release", "a value where there are no priorities",
                found,
            )  # fmt: skip
        for point in self.writable:
            LiveError.unless_known(point, self.plant.actuators, f"{name}: points.{point}", "an actuator of the plant")
        needed = [f"{zone}/zone_air_temperature_sensor" for zone in self.plant.zones]
        missing = [point for point in needed if point not in file.points]
        LiveError.unless(not missing, f"{name}: points", "the temperature of each zone", f"none of {missing}")
        if file.controller == "mpc":
            advice = "model: FOLDER of buildingmpc identify, or {building: CASE}; or controller: full_speed"
            LiveError.unless(file.model is not None, f"{name}: model", "a model for mpc", "none", advice)
        hosts = [getattr(link, "host", getattr(link, "address", "")) for link in file.connections.values()]
        local = all(host.startswith(("127.", "localhost", "::1")) for host in hosts)
        LiveError.unless(
            file.clock_rate == 1.0 or local, f"{name}: clock_rate", "1 where a connection leads to another machine",
            f"{file.clock_rate:g}",
        )  # fmt: skip

    def _hash(self) -> str:
        total = hashlib.sha256()
        for part in (self.path, self.plant_path, *self._model_files()):
            total.update(part.read_bytes() if part.is_file() else str(part).encode())
        return total.hexdigest()

    def _model_files(self) -> list[Path]:
        """Files that make the model."""
        here, model = self.path.parent, self.file.model
        if model is None:
            return []
        if isinstance(model, str):
            path = here / model
            return sorted(path.glob("model.json")) if path.is_dir() else [path]
        place = here / model.building
        folder = place if place.is_dir() else place.parent
        plans = [folder / floor.plan for floor in read_building_file(folder).floors or ()]
        return [folder / NAME, *plans, *([] if model.parameters is None else [here / model.parameters])]

    def limits(self) -> dict[str, Any]:
        """Give the guard's limits with their defaults, by the names of `GuardEntry` [s]."""
        step, own = self.step, self.file.guard
        return {
            "step": step,
            "tick": own.tick or min(step / 10.0, 60.0),
            "heartbeat": own.heartbeat or step / 5.0,
            "plan_age": own.plan_age or 1.5 * step,
            "input_age": own.input_age or min(max(3.0 * self.file.collect, step / 5.0), step),
            "clock_jump": own.clock_jump,
            "override_hold": step if own.override_hold is None else own.override_hold,
            "stuck": own.stuck,
            "approval": own.approval or 4.0 * step,
        }
