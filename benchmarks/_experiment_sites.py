"""Simulated offices with one effect each, for experiments: our plant, with what its baseline lacks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.gains import InternalGains
from thermal.case.building import Building
from thermal.data import load_bundled_case
from thermal.effects.catalogue import CATALOGUE, chosen
from thermal.network.build import build_network
from thermal.pilot.weather import MOUNTAIN_VIEW

WATER = "supply_water_temperature_setpoint"

#: Distance between control volumes of plant and model [m].
DX = 1.0

#: Nobody's heat: what the plants have and the model lacks is the effect alone.
NO_GAINS = InternalGains(0.0, 0.0, 0.0, 0.0)

#: Months in which telemetry begins: winter, spring and summer, by the seed.
STARTS = ("2023-01-09", "2023-04-10", "2023-07-10")


#: Zones of the bundled office, and of each zone another one beside it.
_ZONES = ("F1_N", "F1_W", "F1_C", "F1_E", "F1_S")
_BESIDE = ("F1_C + F1_W", "F1_C + F1_N", "F1_C + F1_E", "F1_C + F1_S", "F1_N + F1_W")

#: Strengths that leave a gap in most seeds [parameter units], by parameter; a share of 0.75 to 1.25 is drawn.
STRENGTHS: dict[str, tuple[str, float]] = {
    "flow_gain": ("flow_gain", 0.22), "duct_loss": ("duct_ntu", 0.22), "sensor_bias": ("sensor_bias", 0.9),
    "valve_leak": ("valve_leak", 8.0), "hidden_mass": ("hidden_heat_capacity", 7e4),
    "zone_mixing": ("door_airflow", 0.15),
    "internal_gains": ("base_load", 4.0), "ground_exchange": ("ground_u_value", 0.5),
    "roof_exchange": ("roof_u_value", 0.5),
    "infiltration": ("infiltration_rate", 0.7), "thermal_bridge": ("thermal_bridge_u_value", 0.75),
}  # fmt: skip


def draw_site(seed: int, effect: str) -> "Site":
    """Draw a site with one effect.

    Parameters
    ----------
    seed : int
        Of everything.
    effect : str
        One of `STRENGTHS`.
    """
    name, size = STRENGTHS[effect]
    rng = np.random.default_rng([seed, 43])
    value = float(size * rng.uniform(0.75, 1.25))
    if effect == "zone_mixing":
        pair = _BESIDE[seed % len(_BESIDE)]
        return Site(seed, {effect: tuple(pair.split(" + "))}, {f"{name}@{pair}": value})
    if not CATALOGUE[effect].zonal:
        return Site(seed, {effect: ()}, {name: value})
    zones = tuple(_ZONES[(seed + k) % len(_ZONES)] for k in range(2 if effect in ("flow_gain", "duct_loss") else 1))
    return Site(seed, {effect: zones}, {f"{name}@{zone}": value for zone in zones})


@dataclass(frozen=True)
class Site:
    """A building with an effect.

    Parameters
    ----------
    seed : int
        Of building, weather, parameters and noise.
    effects : mapping of str to sequence of str
        With their zones.
    values : mapping of str to float
        Strengths by name [parameter units].
    days : int
        Of telemetry.
    """

    seed: int
    effects: Mapping[str, Sequence[str]]
    values: Mapping[str, float]
    days: int = 14

    @property
    def start(self) -> str:
        """First day."""
        return STARTS[self.seed % len(STARTS)]

    @property
    def building(self) -> Building:
        """The bundled office of five zones, where the weather is."""
        return replace(load_bundled_case().building, name=f"site_{self.seed}", location=MOUNTAIN_VIEW)

    def parameters(self) -> dict[str, float]:
        """Parameters of the baseline, half a prior deviation about their starts, and of the effects."""
        rng = np.random.default_rng([self.seed, 41])
        found = {}
        for p in build_network(self.building, dx=DX).parameters:
            z = p.transform(p.start) + 0.5 * p.prior_deviation * float(rng.normal())
            found[p.name] = float(np.clip(p.inverse(z), p.lower, p.upper))
        return found | dict(self.values)

    def plant(self, start: str, end: str) -> SimulatedPlant:
        """Make the plant; its run begins with the telemetry.

        Parameters
        ----------
        start, end : str
            Local times, ISO 8601.
        """
        weather = pilot_weather(self.seed, self.start, self.days + 14, 600.0)
        settings = PlantSettings(
            dx=DX, noise=SensorNoise(), gains=NO_GAINS, effects=chosen(self.effects), parameters=self.parameters(),
            seed=self.seed, step_seconds=600.0, pressures=True,
        )  # fmt: skip
        return simulated_plant(self.building, weather, start, end, settings)

    def usual(self, plant: SimulatedPlant) -> dict[str, float]:
        """Setpoints of usual operation: hot water that meets the load of an ordinary winter day.

        Parameters
        ----------
        plant : SimulatedPlant
            Of this site.
        """
        return {**plant.default_actions, **{a.name: a.highest for a in plant.actuators if a.name.endswith(WATER)}}
