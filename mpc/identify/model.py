"""A plant as a controller knows it: grey box and maps of the machines, in a folder of their own."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from calibration.errors import CalibrationError
from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import GreyBox
from mpc.errors import ControlError, MpcError
from mpc.identify.air_handler import AirHandler
from mpc.identify.curves import Curve
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap, OwnPower, led_heat
from mpc.identify.shared import shares_of
from mpc.identify.source import Source
from mpc.identify.telemetry import CARRIERS
from mpc.identify.water import SupplyWater
from mpc.loop.actuators import Actuator
from thermal._types import FloatArray

#: File of a model in its folder, and the version of its contents.
FILE, FORMAT = "model.json", 9

#: A load that is none [-].
_NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class PlantModel:
    """What was identified of a plant.

    Parameters
    ----------
    name : str
        Of the plant.
    step : float
        Control step that it was identified on [s].
    box : GreyBox
        Zones.
    maps : tuple of MachineMap
        Machines, in the order of the sources of the grey box.
    base : mapping of str to float
        Power of each kind that is bought whatever the machines do [W].
    shared : tuple of tuple of float
        Steps at which one source held the machines that are led by setpoints back together: outdoor air [K], and their
        load as a share of the sum of their full loads [-], see `SharedLimit`.
    source : Source or None
        What they buy together; None where each has a map of its own.
    sheet : tuple of tuple of float
        Of one source for all of them, by its data sheet: outdoor air [K], rising, and their largest load together as
        such a share [-].
    water : SupplyWater or None
        Of that source, where its temperature is decided; largest loads are then those with the hottest.
    air_handler : AirHandler or None
        That the boxes share, whose heat is then beyond its air.
    """

    name: str
    step: float
    box: GreyBox
    maps: tuple[MachineMap, ...]
    base: Mapping[str, float] = field(default_factory=dict)
    shared: tuple[tuple[float, float], ...] = ()
    source: Source | None = None
    sheet: tuple[tuple[float, float], ...] = ()
    water: SupplyWater | None = None
    air_handler: AirHandler | None = None

    @property
    def sign(self) -> float:
        """Of the heat that its machines give: 1 where they heat, -1 where they cool [-]."""
        return self.maps[0].machine.sign if self.maps else 1.0

    def bound(self, actuators: Iterable[Actuator]) -> Self:
        """Give its machines the actuators of a plant, see `Machine.bound`.

        Parameters
        ----------
        actuators : iterable of Actuator
            Of the plant, those of the model among them.
        """
        by_name = {a.name: a for a in actuators}
        water = None if self.water is None else replace(self.water, actuator=by_name[self.water.actuator.name])
        maps = tuple(replace(m, machine=m.machine.bound(by_name)) for m in self.maps)
        return replace(self, maps=maps, water=water)

    @property
    def led_heat(self) -> FloatArray:
        """Full heat of machines that are led by a setpoint, 0 of others, shape (n_machine,) [W]."""
        return led_heat(self.maps)

    @cached_property
    def shares(self) -> FloatArray:
        """Of each machine in the load of all that setpoints lead, shape (n_machine,) [-]; see `shares_of`."""
        return shares_of(self.led_heat)

    def air(self, zone: FloatArray) -> FloatArray:
        """Air that each machine heats, or cools, shape (n_machine,) [K].

        Parameters
        ----------
        zone : ndarray, shape (n_zone,)
            Of the zones [K].
        """
        return np.array([zone[served].mean() for served in self.box.serves])

    def heat(self, states: FloatArray, levels: FloatArray, outdoor: FloatArray | float) -> FloatArray:
        """Heat of each machine, or what stands for it where it is not measured, shape (..., n_machine) [W].

        Negative where they cool.

        Parameters
        ----------
        states : ndarray, shape (..., n)
            Of the grey box, at the starts of the steps [K less the reference].
        levels : ndarray, shape (..., n_machine)
            Duties and loads [-].
        outdoor : ndarray, shape (...), or float
            Outdoor air [K].
        """
        emitter = self.box.emitter(states)
        heat = np.empty(emitter.shape)
        for k, found in enumerate(self.maps):
            heat[..., k] = self.sign * found.at(found.heat, levels[..., k], outdoor, emitter[..., k])
        return heat

    def lost(self, states: FloatArray, running: float) -> FloatArray:
        """Heat of an air handler's own air to the zones, shape (n_zone,), negative; zeros without one [W].

        Parameters
        ----------
        states : ndarray, shape (n,)
            Of the grey box, at the start of the step [K less the reference].
        running : float
            Share of the time that it runs [-].
        """
        zones = len(self.box.zones)
        if self.air_handler is None:
            return np.zeros(zones)
        air = self.air(states[:zones] + REFERENCE)
        return np.asarray(self.air_handler.lost(running, air) @ self.box.serves)

    def bought(
        self, states: FloatArray, levels: FloatArray, outdoor: FloatArray | float,
        water: FloatArray | float | None = None,
    ) -> FloatArray:  # fmt: skip
        """Power that each machine buys, shape (..., n_machine, n_carrier) [W]; `base` is not among it.

        What a source buys is shared out by load.

        Parameters
        ----------
        states, levels, outdoor : ndarray
            As of `heat` [K less the reference], [-] and [K].
        water : ndarray, shape (...), or float, optional
            Supply water where it is decided; that of the plant itself by default [K].
        """
        emitter = self.box.emitter(states)
        powers = np.zeros((*emitter.shape, len(CARRIERS)))
        for k, found in enumerate(self.maps):
            for carrier, curve in found.powers.items():
                powers[..., k, CARRIERS.index(carrier)] = found.at(curve, levels[..., k], outdoor, emitter[..., k])
        if self.source is not None:
            loads = levels[..., : len(self.maps)] * self.shares
            total = loads.sum(axis=-1)
            by_load = self.source.at(total, outdoor) / np.maximum(total, _NOTHING)[..., None]
            powers += loads[..., None] * by_load[..., None, :]
        if self.water is not None:
            supply = self.water.of_plant(outdoor) if water is None else water
            powers += self.water.bought(levels[..., : len(self.maps)], supply)
        return powers

    def bought_anyway(self, running: FloatArray) -> FloatArray:
        """Power of `base`, and of an air handler while it runs, shape (..., n_carrier) [W].

        Parameters
        ----------
        running : ndarray, shape (...)
            Share of the time that an air handler runs [-].
        """
        base = np.array([self.base.get(carrier, 0.0) for carrier in CARRIERS])
        if self.air_handler is None:
            return base
        handled = np.array([self.air_handler.powers.get(carrier, 0.0) for carrier in CARRIERS])
        return np.asarray(base + np.asarray(running)[..., None] * handled)

    def to_dict(self) -> dict[str, Any]:
        """Values for a file."""
        maps = [
            {
                "machine": asdict(m.machine),
                "operation": m.operation, "heat": asdict(m.heat), "above": list(m.above),
                "limits": [list(pair) for pair in m.limits],
                "powers": {kind: asdict(curve) for kind, curve in m.powers.items()},
                "own": None if m.own is None else asdict(m.own),
            }
            for m in self.maps
        ]  # fmt: skip
        return {
            "format": FORMAT, "name": self.name, "step": self.step, "grey_box": self.box.to_dict(), "machines": maps,
            "base": dict(self.base), "source": None if self.source is None else asdict(self.source),
            "shared": [list(pair) for pair in self.shared], "sheet": [list(pair) for pair in self.sheet],
            "water": None if self.water is None else asdict(self.water),
            "air_handler": None if self.air_handler is None else asdict(self.air_handler),
        }  # fmt: skip

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Make a model of what `to_dict` wrote.

        Parameters
        ----------
        content : mapping
            Of a file.

        Raises
        ------
        ControlError
            When something is missing, or does not fit.
        """
        where, expected = f"model: {FILE}", f"what `buildingmpc identify` writes, format {FORMAT}"
        ControlError.unless(content.get("format") == FORMAT, where, expected, f"format {content.get('format')!r}")
        try:
            maps = tuple(_map_of(entry) for entry in content["machines"])
            box = GreyBox.from_dict(content["grey_box"])
            shared, sheet = (tuple((float(t), float(load)) for t, load in content[key]) for key in ("shared", "sheet"))
            base, source, water = dict(content["base"]), _source_of(content["source"]), _water_of(content["water"])
            name, step, handler = str(content["name"]), float(content["step"]), _handler_of(content["air_handler"])
            return cls(name, step, box, maps, base, shared, source, sheet, water, handler)
        except (KeyError, TypeError, ValueError, MpcError, CalibrationError) as error:
            raise ControlError(where, expected, f"{type(error).__name__}: {error}") from error


def _map_of(entry: Mapping[str, Any]) -> MachineMap:
    told = entry["machine"]
    sheet = tuple((float(outdoor), float(heat)) for outdoor, heat in told["capacity"])
    beside = None if told["beside"] is None else Actuator(**told["beside"])
    of = told["heat"], told["power"], sheet, beside, tuple(told["air"])
    machine = Machine(Actuator(**told["actuator"]), told["role"], tuple(told["serves"]), *of, told["supply"])
    powers = {kind: Curve(**curve) for kind, curve in entry["powers"].items()}
    limits = tuple((float(outdoor), float(load)) for outdoor, load in entry["limits"])
    heat, above = Curve(**entry["heat"]), tuple(entry["above"])
    return MachineMap(machine, entry["operation"], heat, powers, above, limits, _own_of(entry["own"]))


def _own_of(entry: Mapping[str, Any] | None) -> OwnPower | None:
    if entry is None:
        return None
    readings = tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in entry["readings"])
    return OwnPower(Curve(**entry["curve"]), float(entry["idle"]), readings)


def _source_of(entry: Mapping[str, Any] | None) -> Source | None:
    if entry is None:
        return None
    curves = {kind: Curve(**curve) for kind, curve in entry["powers"].items()}
    return Source(curves, float(entry["full"]), float(entry["least"]), float(entry["outdoor"]))


def _water_of(entry: Mapping[str, Any] | None) -> SupplyWater | None:
    if entry is None:
        return None
    curves = {kind: Curve(**curve) for kind, curve in entry["powers"].items()}
    shares, (level, slope) = tuple(float(share) for share in entry["shares"]), entry["own"]
    of = Actuator(**entry["actuator"]), float(entry["sign"]), shares, curves, float(entry["temperature"])
    return SupplyWater(*of, (float(level), float(slope)), float(entry["hottest"]), float(entry["below"]))


def _handler_of(entry: Mapping[str, Any] | None) -> AirHandler | None:
    if entry is None:
        return None
    hours = tuple((int(hour), bool(runs)) for hour, runs in entry["hours"])
    of = tuple(float(capacity) for capacity in entry["conductances"]), dict(entry["powers"]), hours
    return AirHandler(float(entry["supply"]), *of)


def read_model(folder: Path) -> PlantModel:
    """Read a model's folder.

    Parameters
    ----------
    folder : Path
        That ``buildingmpc identify`` wrote, or its ``model.json``.

    Raises
    ------
    ControlError
        When it is none.
    """
    file = folder / FILE if folder.is_dir() else folder
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        expected = f"a folder with {FILE}, as `buildingmpc identify` writes it"
        raise ControlError(f"--model {folder.name}", expected, " ".join(str(error).split())) from error
    ControlError.unless(isinstance(content, Mapping), f"model: {FILE}", "a mapping", type(content).__name__)
    return PlantModel.from_dict(content)
