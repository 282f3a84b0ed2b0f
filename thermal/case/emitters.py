"""What devices give their heat by: to the air, radiating in part, or to a layer of the floor or the ceiling."""

from collections.abc import Container
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np
import pandas as pd

from thermal.case.building import Building, Device
from thermal.case.points import HEATING_POWER

#: Devices whose heat is that of supply air, and so goes to the air for certain.
_OF_AIR = frozenset({"vav", "fan_coil", "supply_air_terminal", "unitary_heat_pump", "heat_recovery_ventilator"})

#: What devices of these types give their heat by where a case does not say it.
_BY_TYPE = {"floor_heating": "floor"}

#: What plain heaters of which a case says nothing are taken for.
Unknown = Literal["air", "radiator", "floor"]

#: What a device gives its heat by; the unknown are a guess that data are to confirm.
Kind = Literal["radiator", "baseboard", "floor", "ceiling", "unknown_radiator", "unknown_floor"]


@dataclass(frozen=True)
class Emitter:
    """Devices of one zone that give their heat in one way.

    Parameters
    ----------
    zone
        Where.
    kind
        What they give it by, if not to the air.
    devices
        Their positions in `Building.devices`.
    share
        Part of the zone's heat that is taken for theirs where nothing but that is known of it [-]: equal parts of its
        heaters, none where air brings heat too, which nobody could tell from it.
    """

    zone: str
    kind: Kind
    devices: tuple[int, ...]
    share: float = 1.0

    @property
    def sides(self) -> tuple[str, ...]:
        """What of the zone it heats, ``floor`` or ``ceiling``; nothing where it only radiates."""
        side = self.kind.removeprefix("unknown_")
        return (side,) if side in ("floor", "ceiling") else ()


def is_heater(device: Device) -> bool:
    """Whether a device may be a plain heater of a zone: one whose heat supply air does not bring.

    Parameters
    ----------
    device
        Of a building.
    """
    return device.zone is not None and device.type not in _OF_AIR


def unknown_heaters(building: Building, columns: Container[str]) -> tuple[str, ...]:
    """Names of plain heaters with metered power of which the case does not say what they give it by.

    Parameters
    ----------
    building
        With its devices.
    columns
        Of the telemetry.
    """
    unknown = (d.name for d in building.devices if is_heater(d) and (d.emitter or _BY_TYPE.get(d.type)) is None)
    return tuple(name for name in unknown if f"{name}/{HEATING_POWER}" in columns)


def emitters_of(building: Building, unknown: Unknown = "air") -> tuple[Emitter, ...]:
    """Devices whose heat does not all go to the air, by zone and kind.

    Parameters
    ----------
    building
        With its devices.
    unknown
        What plain heaters of which the case says nothing are taken for.
    """
    found: dict[tuple[str, str], list[int]] = {}
    for number, device in enumerate(building.devices):
        kind = device.emitter or _BY_TYPE.get(device.type) or f"unknown_{unknown}"
        if is_heater(device) and not kind.endswith("air"):
            found.setdefault((str(device.zone), kind), []).append(number)
    made = []
    for (zone, kind), own in found.items():
        beside = building.devices_of(zone)
        share = len(own) / len(beside) if all(map(is_heater, beside)) else 0.0
        made.append(Emitter(zone, cast(Kind, kind), tuple(own), share))
    return tuple(made)


def power_by_device(
    building: Building, frame: pd.DataFrame, power: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Heat that each device reports as power; where it fails to, its share of what its zone is estimated to get.

    A share is within what the device was ever read to give (at least 0 W where it was never read), since a zone may be
    estimated to get less than its other devices tell, or more than they all can give.

    Parameters
    ----------
    building
        With its devices.
    frame
        Usable telemetry, shape (n_time, n_column) [library's units].
    power
        By zone, from `thermal.case.metered_heat.estimate_parts` [W].

    Returns
    -------
    tuple of DataFrame
        Shape (n_time, n_device) [W], columns 0..n-1 in the order of `building.devices`; 0 for a device without power.
        And what the zones get by power with these, shape of `power` [W].
    """
    watts = {n: frame.get(f"{device.name}/{HEATING_POWER}") for n, device in enumerate(building.devices)}
    found = pd.DataFrame(0.0, index=frame.index, columns=range(len(building.devices)))
    whole = power.copy()
    for zone in power:
        own = [n for n, device in enumerate(building.devices) if device.zone == zone and watts[n] is not None]
        told = pd.DataFrame({n: watts[n] for n in own}, dtype=float)
        rest = (power[zone] - told.sum(axis=1)) / told.isna().sum(axis=1).clip(lower=1)
        for n in own:
            low, high = (0.0, np.inf) if told[n].isna().all() else (told[n].min(), told[n].max())
            found[n] = told[n].fillna(rest.clip(low, high))
        estimated = told.isna().any(axis=1) & power[zone].notna()
        whole[zone] = power[zone].where(~estimated, found[own].sum(axis=1))
    return found, whole
