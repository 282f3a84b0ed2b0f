"""Two air handlers of EnergyPlus' own buildings, with five VAV boxes each.

Nobody here drew them. They run in working hours, and at night where a room falls below its setpoint, and blow 12.8 degC
at all their rooms then. No meter has the heat of a room: it is that of the air which its box gives. `FLOOR` is the
lowest storey of the Medium Office: electric reheat, a gas furnace in the air handler. `SCHOOL` is a wing of the Primary
School: hot water heats in the boxes and in the air handler, whose DX coil cools classes in winter, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models.thermostats import comfort, present
from mpc.adapters.energyplus.input import building_path, read_input

WEATHER = "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3"
_NOBODY = [False] * 24


@dataclass(frozen=True)
class Boxes:
    """VAV boxes on one air handler, in a building that EnergyPlus brings.

    Parameters
    ----------
    source : str
        The building.
    zones : mapping of str to tuple
        EnergyPlus' names and floor areas [m2], by ours.
    height : float
        Of a room [m].
    area_each : float
        Floor area for a person [m2].
    hours : tuple of int
        In which people are in on working days: first, and that after the last.
    energy : mapping of str to tuple of str
        What the air handler takes, by carrier.
    reheat : tuple of str
        Carrier and variable of what a box takes.
    prices : mapping of str to float
        Of what is not electricity [EUR/kWh].
    """

    source: str
    zones: Mapping[str, tuple[str, float]]
    height: float
    area_each: float
    hours: tuple[int, int]
    energy: Mapping[str, tuple[str, ...]]
    reheat: tuple[str, str]
    prices: Mapping[str, float]

    def model(self) -> Objects:
        """Return the input, as EnergyPlus brings it."""
        return {kind: {name: dict(fields) for name, fields in objects.items()}
                for kind, objects in read_input(building_path(self.source)).content.items()}  # fmt: skip

    def description(self) -> dict[str, Any]:
        """Return what ``plant.yaml`` says of zones, points and actuators."""
        told: dict[str, Any] = {"zones": {}, "measurements": {}, "actuators": {}}
        energy = {carrier: list(points) for carrier, points in self.energy.items()}
        carrier, variable = self.reheat
        work = [self.hours[0] <= hour < self.hours[1] for hour in range(24)]
        for name, (zone, area) in self.zones.items():
            told["zones"][name] = {
                "temperature": f"{zone}, Zone Mean Air Temperature", "floor_area": area, "volume": area * self.height,
                "comfort": comfort(work, _NOBODY), "people": present(area / self.area_each, work, _NOBODY),
            }  # fmt: skip
            outlet, setpoint = f"{zone} VAV Box Outlet Node Name", f"{name}/zone_air_heating_temperature_setpoint"
            told["measurements"] |= {
                f"{name}/zone_air_temperature_sensor": f"{zone}, Zone Mean Air Temperature",
                f"{name}/supply_air_flowrate_sensor": f"{outlet}, System Node Mass Flow Rate",
                f"{name}/discharge_air_temperature_sensor": f"{outlet}, System Node Temperature",
                setpoint: f"{zone}, Zone Thermostat Heating Setpoint Temperature",
            }
            told["actuators"][setpoint] = {
                "signal": f"{zone}, Zone Temperature Control, Heating Setpoint", "range": ["12 degC", "23.5 degC"],
            }  # fmt: skip
            energy.setdefault(carrier, []).append(f"{zone} VAV Box Reheat Coil, {variable}")
        return told | {"energy": energy, "prices": dict(self.prices)}


FLOOR = Boxes(
    "RefBldgMediumOfficeNew2004_Chicago",
    {
        "core": ("Core_bottom", 983.54), "south": ("Perimeter_bot_ZN_1", 207.34),
        "east": ("Perimeter_bot_ZN_2", 131.26), "north": ("Perimeter_bot_ZN_3", 207.34),
        "west": ("Perimeter_bot_ZN_4", 131.26),
    },
    2.74, 18.58, (6, 22),
    {"electricity": ("VAV_1_Fan, Fan Electricity Rate",), "gas": ("VAV_1_HeatC, Heating Coil NaturalGas Rate",)},
    ("electricity", "Heating Coil Electricity Rate"), {"gas": 0.05},
)  # fmt: skip

SCHOOL = Boxes(
    "RefBldgPrimarySchoolNew2004_Chicago",
    {
        "south_corner": ("Corner_Class_1_Pod_1_ZN_1_FLR_1", 99.0),
        "north_corner": ("Corner_Class_2_Pod_1_ZN_1_FLR_1", 99.0),
        "corridor": ("Corridor_Pod_1_ZN_1_FLR_1", 192.0),
        "south": ("Mult_Class_1_Pod_1_ZN_1_FLR_1", 477.0), "north": ("Mult_Class_2_Pod_1_ZN_1_FLR_1", 477.0),
    },
    4.0, 4.0, (8, 21),
    {
        "electricity": ("VAV_POD_1_Fan, Fan Electricity Rate",
                        "VAV_POD_1_CoolC DXCoil, Cooling Coil Electricity Rate"),
        "district_heating": ("VAV_POD_1_HeatC, Heating Coil Heating Rate",),
    },
    ("district_heating", "Heating Coil Heating Rate"), {"district_heating": 0.06},
)  # fmt: skip
