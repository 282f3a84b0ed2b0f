"""What a plant to develop on is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models.periods import starts
from mpc.adapters.energyplus.input import weather_path

#: What EnergyPlus brings is American. Of its places this one is nearest to Brussels in winter: 2,590 degree-days below
#: 18 degC (Brussels-Uccle 2,700), October to April 6.2 degC in the mean (6.9); its sun is higher and its summer hotter.
TEMPERATE = "USA_VA_Sterling-Washington.Dulles.Intl.AP.724030_TMY3"


@dataclass(frozen=True)
class ForeignPlant:
    """A plant to develop on.

    Parameters
    ----------
    about : str
        In words.
    model : callable
        Makes EnergyPlus' input.
    description : callable
        Gives what ``plant.yaml`` says of zones, points and actuators.
    weather : str
        Of those that EnergyPlus brings.
    cooled : bool
        Whether it is looked at in summer.
    """

    about: str
    model: Callable[[], Objects]
    description: Callable[[], dict[str, Any]]
    weather: str = TEMPERATE
    cooled: bool = False

    @property
    def starts(self) -> dict[str, str]:
        """Begin of each of its periods."""
        return starts(weather_path(self.weather), self.cooled)

    @property
    def begin(self) -> str:
        """Begin of its hardest period."""
        return self.starts["hottest" if self.cooled else "coldest"]
