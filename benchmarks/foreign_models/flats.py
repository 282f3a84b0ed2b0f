"""Three flats of one storey with electric baseboards: a couple that works, a family, somebody who is at home."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from energyplus_trials.frame import Objects

from foreign_models import objects as ep
from foreign_models.thermostats import clock, comfort, present, thermostat, thermostat_points

FABRIC = ep.Fabric(wall=0.06, roof=0.1, floor=0.06, glass=(1.8, 0.6), air_changes=0.5, goods=3.0)
WIDTH, DEPTH, HEIGHT = 10.0, 7.0, 2.6  # m
_COOL = 18.0  # degC, of the thermostats' own clocks
_RADIANT = 0.3  # of a baseboard's heat [-], EnergyPlus' examples of `ZoneHVAC:Baseboard:RadiantConvective:Electric`


class Flat(NamedTuple):
    """A flat.

    Parameters
    ----------
    people : float
        Number.
    power : float
        Of its baseboards [W].
    out : tuple of int
        Hours between which nobody is in on working days.
    appliances : float
        Heat that nothing measures [W].
    """

    people: float
    power: float
    out: tuple[int, int]
    appliances: float

    @property
    def home(self) -> list[bool]:
        """Whether somebody is in on working days, by hour."""
        return [not self.out[0] <= hour < self.out[1] for hour in range(24)]


FLATS = {
    "FLAT_1": Flat(2.0, 3_500.0, (8, 18), 90.0), "FLAT_2": Flat(4.0, 2_500.0, (8, 15), 180.0),
    "FLAT_3": Flat(1.0, 3_500.0, (0, 0), 80.0),
}  # fmt: skip
ALL_DAY = [True] * 24


def flats(listed: Mapping[str, Flat] | None = None, fabric: ep.Fabric = FABRIC) -> Objects:
    """Return the flats' input: a row on a middle storey, three by default, with set-back while nobody is in."""
    listed = listed or FLATS
    model, names = ep.start(fabric), list(listed)
    for k, (zone, flat) in enumerate(listed.items()):
        behind = {"floor": "", "ceiling": ""}
        behind |= {"west": names[k - 1]} if k else {}
        behind |= {"east": names[k + 1]} if k + 1 < len(names) else {}
        glass = {"south": 8.0, "north": 4.0}
        ep.merge(model, ep.box(zone, (k * WIDTH, 0.0), (WIDTH, DEPTH, HEIGHT), glass, behind))
        ep.merge(model, ep.inside(zone, fabric, WIDTH * DEPTH, flat.people, f"{zone} presence", flat.appliances))
        ep.merge(model, thermostat(zone, clock(flat.home, cool=_COOL), clock(ALL_DAY)))
        ep.merge(model, ep.equipment(zone, [("ZoneHVAC:Baseboard:RadiantConvective:Electric", f"{zone} baseboard")]))
        ep.merge(model, {
            "Schedule:Compact": {f"{zone} presence": ep.daily([float(h) for h in flat.home], [1.0] * 24)},
            "ZoneHVAC:Baseboard:RadiantConvective:Electric": {f"{zone} baseboard": {
                "availability_schedule_name": ep.ALWAYS, "heating_design_capacity": flat.power,
                "heating_design_capacity_method": "HeatingDesignCapacity", "efficiency": 1.0,
                "fraction_radiant": _RADIANT, "fraction_of_radiant_energy_incident_on_people": 0.0,
                "surface_fractions": [
                    {"surface_name": f"{zone} {face}", "fraction_of_radiant_energy_to_surface": 0.5}
                    for face in ("floor", "ceiling")
                ],
            }},
        })  # fmt: skip
    return model


def description(listed: Mapping[str, Flat] | None = None) -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    told: dict[str, Any] = {"zones": {}, "measurements": {}, "actuators": {}, "energy": {"electricity": []}}
    for zone, flat in (listed or FLATS).items():
        name, power = zone.lower(), f"{zone} baseboard, Baseboard Electricity Rate"
        told["zones"][name] = {
            "temperature": f"{zone}, Zone Mean Air Temperature", "floor_area": WIDTH * DEPTH,
            "volume": WIDTH * DEPTH * HEIGHT, "comfort": comfort(flat.home, ALL_DAY),
            "people": present(flat.people, flat.home, ALL_DAY),
        }  # fmt: skip
        measured, acted = thermostat_points(zone, name)
        told["measurements"] |= measured | {
            f"{name}/electrical_power_sensor": power,
            f"{name}/heating_power_sensor": power,  # all of it; EnergyPlus' own output leaves the radiant part out
        }
        told["actuators"] |= acted
        told["energy"]["electricity"].append(power)
    return told
