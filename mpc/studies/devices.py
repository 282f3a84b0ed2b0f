"""Devices that a closed loop needs and a case may lack."""

from __future__ import annotations

from dataclasses import replace

from thermal.case.building import Building, Device


def equip(building: Building) -> tuple[Building, tuple[str, ...]]:
    """Give a building the devices of a plant that it lacks: a terminal a zone, an air handler, a boiler.

    Parameters
    ----------
    building : Building
        With any devices.

    Returns
    -------
    tuple
        The building, and what was done, in words.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> equip(load_bundled_case().building)[1]
    ('the case names no air handler and no boiler: one of each is assumed',)
    """
    devices = list(building.devices)
    names = {d.name for d in devices} | set(building.zone_names)
    bare = [z for z in building.zone_names if not any(d.type == "vav" for d in building.devices_of(z))]
    devices += [Device(name=_free(f"VAV_{zone}", names), type="vav", zone=zone) for zone in bare]
    spare = _spare_terminals(building)
    devices = [d for d in devices if d.name not in spare]
    lacking = {"ahu": "air handler", "boiler": "boiler"}
    added = [kind for kind in lacking if not any(d.type == kind for d in devices)]
    devices += [Device(name=_free(kind.upper(), names), type=kind, zone=None) for kind in added]
    said = []
    if bare:
        said.append(f"zones without a terminal get one: {', '.join(bare[:6])}{' ...' if len(bare) > 6 else ''}")
    if spare:
        said.append(f"zones have one terminal each: left out {', '.join(sorted(spare)[:6])}")
    if added:
        one = " and ".join(f"no {lacking[kind]}" for kind in added)
        said.append(f"the case names {one}: one{' of each' if len(added) > 1 else ''} is assumed")
    return replace(building, devices=tuple(devices)), tuple(said)


def _spare_terminals(building: Building) -> set[str]:
    """Terminals beside the first of their zone: a plant is sized with one a zone."""
    spare: set[str] = set()
    for zone in building.zone_names:
        spare |= {d.name for d in building.devices_of(zone) if d.type == "vav"} - {
            next((d.name for d in building.devices_of(zone) if d.type == "vav"), "")
        }
    return spare


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    taken.add(name)
    return name
