"""Heat that people, light and equipment give to the zones."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mpc.errors import ScenarioError
from thermal._types import FloatArray

#: Shares of an office's gains that radiate [-]: people and equipment with fans by ASHRAE Fundamentals 2017, ch. 18,
#: table 14; lights as recessed luminaires without lens, the middle of 0.48 to 0.68 in its table 3.
RADIANT_SHARES: Mapping[str, float] = {"radiant_people": 0.60, "radiant_equipment": 0.10, "radiant_lights": 0.58}


@dataclass(frozen=True)
class InternalGains:
    """Internal gains in proportion to the people that are in.

    ``q = n q_p + A (e (s_e + (1 - s_e) n / N) + l (s_l + (1 - s_l) n / N))``, with n of the N people assigned. Both
    parts are linear in n, so that expected people give the expected gain. A zone without people has its idle share.

    Parameters
    ----------
    sensible, latent : float
        Heat of a person at moderately active office work [W]; defaults from ASHRAE Fundamentals 2017, ch. 18, table 1.
        The latent part is water vapour and no heat to the zone until it condenses.
    equipment, lights : float
        Power per floor area when everybody is in [W/m2]; defaults are the offices of the U.S. DOE's reference buildings
        (Deru et al. 2011, NREL/TP-5500-46861).
    idle_equipment, idle_lights : float
        Share of that while nobody is in, 0 to 1 [-]; defaults from the same buildings' nights.
    radiant_people, radiant_equipment, radiant_lights : float
        Share of the sensible heat that radiates to the surfaces, 0 to 1 [-]; by default all of it goes into the air.
        `RADIANT_SHARES` has an office's.

    Raises
    ------
    ScenarioError
        When a number is negative or a share above 1.

    Examples
    --------
    >>> InternalGains().heat([[0.0], [1.0]], people=[1.0], areas=[18.58]).round(1).tolist()
    [[90.0], [474.8]]
    """

    sensible: float = 75.0
    latent: float = 55.0
    equipment: float = 10.76
    lights: float = 10.76
    idle_equipment: float = 0.4
    idle_lights: float = 0.05
    radiant_people: float = 0.0
    radiant_equipment: float = 0.0
    radiant_lights: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            possible = np.isfinite(value) and 0 <= value <= (1.0 if name.startswith(("idle", "radiant")) else np.inf)
            ScenarioError.unless(possible, f"gains: {name}", "0 or more, shares up to 1", value)

    def heat(self, occupancy: ArrayLike, people: ArrayLike, areas: ArrayLike, *, radiant: bool = False) -> FloatArray:
        """Sensible heat given to each zone.

        Parameters
        ----------
        occupancy : array_like, shape (n_time, n_zone)
            People in each zone [-].
        people : array_like, shape (n_zone,)
            People assigned to each zone [-].
        areas : array_like, shape (n_zone,)
            Floor areas [m2].
        radiant : bool
            Whether only the part that radiates to the surfaces is counted.

        Returns
        -------
        ndarray, shape (n_time, n_zone)
            Positive into the zone [W].

        Examples
        --------
        >>> office = InternalGains(**RADIANT_SHARES)
        >>> office.heat([[1.0]], people=[1.0], areas=[18.58], radiant=True).round(1).tolist()
        [[180.9]]
        """
        count, all_in = np.asarray(occupancy, dtype=float), np.asarray(people, dtype=float)
        share = np.divide(count, all_in, out=np.zeros_like(count), where=all_in > 0)
        radiating = self.radiant_people, self.radiant_equipment, self.radiant_lights
        of_people, of_equipment, of_lights = radiating if radiant else (1.0, 1.0, 1.0)
        density = of_equipment * self.equipment * (self.idle_equipment + (1.0 - self.idle_equipment) * share)
        density += of_lights * self.lights * (self.idle_lights + (1.0 - self.idle_lights) * share)
        return np.asarray(of_people * count * self.sensible + density * np.asarray(areas, dtype=float))

    @property
    def radiates(self) -> bool:
        """Whether any of the heat radiates."""
        return any((self.radiant_people, self.radiant_equipment, self.radiant_lights))

    def moisture_heat(self, occupancy: ArrayLike) -> FloatArray:
        """Latent heat of the people in each zone.

        Parameters
        ----------
        occupancy : array_like, shape (n_time, n_zone)
            People in each zone [-].

        Returns
        -------
        ndarray, shape (n_time, n_zone)
            In water vapour [W].
        """
        return np.asarray(occupancy, dtype=float) * self.latent
