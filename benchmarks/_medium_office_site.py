"""EnergyPlus' Medium Office in Chicago that optimal control and learned policies are compared on.

The building is that of `mpc_energyplus`: fifteen zones, three air handlers with electric reheat. Everybody acts each
half hour on the supply air of the three, sees the same noisy measurements, and the weather file as forecast over
thirteen hours; nobody is told what people, lights and equipment will do, and the thermostats are the building's own.
The models are those of three telemetries with mild excitation, each of the two weeks before a test week: ``before`` is
the calibrated baseline, ``after`` the model of the diagnosis.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd
from _energyplus_control import COMFORT_PRICE, optimal
from _energyplus_offices import CONTROL_STEPS, HORIZON, OFFICES, STEP, Office, prepared
from _modelled_office import modelled_building, modelled_office
from _site import POLICIES, Site, Week, World

from mpc.adapters.energyplus.building import energyplus_building
from mpc.adapters.energyplus.plant import EnergyPlusPlant
from mpc.baselines.plants import OwnControl
from mpc.baselines.rules import OutdoorReset
from mpc.environment.environment import ScenarioPlant
from mpc.loop.plant import Controller
from mpc.loop.run import FixedSetpoints
from mpc.loop.view import ViewedPlant
from mpc.model import control_model
from thermal.effects.catalogue import chosen
from thermal.model.reduce import ReducedModel

_SUMMER = Office("medium_summer", "Medium Office", OFFICES["medium_winter"].file, "summer", "2023-07-03")
SEASONS = {o.season: o for o in (OFFICES["medium_winter"], OFFICES["medium_spring"], _SUMMER)}
_TEST = {season: (office.controlled, 2) for season, office in SEASONS.items()}
_VALIDATION = {"winter": ("2023-02-20", 3), "summer": ("2023-08-21", 3)}
#: Policies are trained on fortnights, as the warm-up of EnergyPlus takes as long as a week of the run.
_FORTNIGHT = 14
_HELD_OUT = [pd.Timestamp(day) for day, _ in (*_TEST.values(), *_VALIDATION.values())]
_TRAINING = [
    f"{start:%Y-%m-%d}"
    for start in pd.date_range("2023-01-02", "2023-12-04", freq="14D")
    if not any(0 <= (held - start).days < _FORTNIGHT for held in _HELD_OUT)
]
_HANDLERS = ("VAV_1", "VAV_2", "VAV_3")
_MEAN_AREA = 332.0  # m2 of a zone


@dataclass(frozen=True)
class MediumOfficeSite(Site):
    """The office for a number of days.

    Parameters
    ----------
    length : int
        Of the weeks [d].
    """

    length: int = 7

    key, name = "medium_office", "EnergyPlus' Medium Office, Chicago, 15 zones, 4982 m2"
    hours_a_step = CONTROL_STEPS * STEP / 3600.0
    block_ends = (0.5, 1.0, 2.0, 3.0, 4.5, 6.0, 9.0, 12.0)
    actions = tuple(f"{name}/supply_air_temperature_setpoint" for name in _HANDLERS)
    discomfort_price, reward_scale = COMFORT_PRICE * _MEAN_AREA, 0.3
    budget: ClassVar[Mapping[str, int]] = {"ppo": 50_000, "sac": 20_000}
    rules = ("floor", "own", "reset")
    optimal = ("mpc_before", "mpc_after")
    peers = ()
    test_weeks: ClassVar[Mapping[str, Week]] = _TEST
    validation_weeks: ClassVar[Mapping[str, Week]] = _VALIDATION
    training_weeks: ClassVar[Mapping[str, Week]] = {day: (day, 100 + k) for k, day in enumerate(_TRAINING)}

    @property
    def days(self) -> int:
        """Length of the weeks [d]."""
        return self.length

    def plant(self, week: Week, world: World = "plant", *, bound: bool = False) -> Any:
        """Make the plant of a week: EnergyPlus, or the model of the season in its place."""
        if bound:
            raise ValueError("expected no bound: nobody knows EnergyPlus' state")
        if world != "plant":
            return self.modelled(week, world=world)
        days = _FORTNIGHT if week in self.training_weeks.values() else self.length
        return _SUMMER.plant(week[0], days, HORIZON, week[1])

    def modelled(self, week: Week, season: str | None = None, world: World = "after") -> ViewedPlant:
        """Put a model in EnergyPlus' place.

        Parameters
        ----------
        week : tuple of str and int
            First day and seed.
        season : str, optional
            Of its telemetry; the nearest by default.
        world : str
            ``before`` or ``after`` its diagnosis.
        """
        plant = self.plant(week)
        return modelled_office(plant, known_model(season or season_of(plant), world))

    def controller(self, name: str, price: float, plant: ScenarioPlant) -> Controller:
        """Make a controller that does not learn."""
        if not isinstance(plant, EnergyPlusPlant):
            raise TypeError(f"expected a plant of this site, found {type(plant).__name__}")
        if name in self.optimal:
            model = models()[season_of(plant)][name.removeprefix("mpc_")]
            return optimal(plant, model["values"], model["effects"], price)
        if name == "own":
            return OwnControl()
        if name == "reset":
            return OutdoorReset(plant.actuators, plant.source.building.weather_station)
        air = [a for a in plant.actuators if a.name in self.actions]
        return FixedSetpoints({a.name: a.highest for a in air}, tuple(air))

    def make_models(self, work: Path) -> None:
        """Run the telemetries, calibrate and diagnose; keeps the models in `policies`."""
        self.policies.mkdir(parents=True, exist_ok=True)
        for season, office in SEASONS.items():
            (work / office.key).mkdir(parents=True, exist_ok=True)
            text = json.dumps(prepared(office, work / office.key), indent=1) + "\n"
            (self.policies / f"models_{season}.json").write_text(text, encoding="utf-8")


def season_of(plant: EnergyPlusPlant) -> str:
    """Find whose model is that of a week: that of the nearest test week of the year."""
    first = plant.scenario.grid.start.tz_convert(plant.source.building.location.timezone).tz_localize(None)
    return min(SEASONS, key=lambda season: abs(pd.Timestamp(SEASONS[season].controlled) - first))


@cache
def models() -> Mapping[str, Any]:
    """Read the models of the seasons: effects with their zones and parameters, before and after diagnosis."""
    return {
        s: json.loads((POLICIES / MediumOfficeSite.key / f"models_{s}.json").read_text(encoding="utf-8"))
        for s in SEASONS
    }


@cache
def known_model(season: str, world: World) -> ReducedModel:
    """Make the reduced model of a season, for a plant that has hot water in the place of electric reheat."""
    source, model = energyplus_building(_SUMMER.file), models()[season][world]
    return control_model(modelled_building(source), model["values"], effects=chosen(model["effects"]))
