"""The building that EnergyPlus runs, and what a run gives."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _sealed import TrialError
from numpy.typing import NDArray

from ideal_air_trials import settings
from ideal_air_trials.fabric import Objects
from ideal_air_trials.operation import Setpoints
from ideal_air_trials.specification import Spec
from ideal_air_trials.terminals import ideal_air, setpoint_schedules
from ideal_air_trials.weather import Weather, write_weather
from mpc.adapters.energyplus.process import Job, run_energyplus
from mpc.errors import EnergyPlusError

Series = NDArray[np.float64]

_TEMPERATURE = "Zone Mean Air Temperature"
_HEATING = "Zone Ideal Loads Zone Sensible Heating Rate"
_COOLING = "Zone Ideal Loads Zone Sensible Cooling Rate"
_DELIVERED = "Zone Air Heat Balance System Air Transfer Rate"
_WANTED = "Zone Predicted Sensible Load to Setpoint Heat Transfer Rate"
#: Most that the transfer functions of a construction may make or lose where all temperatures are 22 degC, [W/m2] and
#: [degC]: less than a hundredth of what a wall conducts in winter.
MOST_HEAT_MADE, _WARM = 0.06, 22.0


@dataclass
class Plant:
    """A building, to which effects are added.

    Parameters
    ----------
    spec : Spec
        The trial.
    weather : Weather
        Of its site.
    setpoints : Setpoints
        Of its thermostats.
    objects : dict
        EnergyPlus' input by class and name; changed.
    sun : bool
        Whether the sun reaches the building.
    sky : float
        Share of the difference between air and sky that does [-].
    """

    spec: Spec
    weather: Weather
    setpoints: Setpoints
    objects: Objects
    sun: bool = False
    sky: float = 0.0

    @property
    def outdoor(self) -> Series:
        """Air temperature outdoors, lead included, shape (n_time,) [degC]."""
        starts = self.spec.starts
        return self.weather.at("outside_air_temperature_sensor", starts[0], len(starts))

    def add(self, kind: str, name: str, **fields: Any) -> None:
        """Add an object.

        Parameters
        ----------
        kind, name : str
            EnergyPlus class and name.
        **fields
            Of the object.
        """
        self.objects.setdefault(kind, {})[name] = fields

    def follow(self, name: str, values: Series) -> str:
        """Add a schedule that follows a series, and return its name.

        Parameters
        ----------
        name : str
            Of the schedule.
        values : ndarray, shape (n_time,)
            Its values, lead included.
        """
        self.objects.setdefault("Schedule:Compact", {})[name] = settings.schedule(values, self.spec.starts)
        return name


@dataclass(frozen=True)
class Run:
    """What a run gave, lead included.

    Parameters
    ----------
    temperature : DataFrame, shape (n_time, n_zone)
        Of the air [degC].
    heat : DataFrame, shape (n_time, n_zone)
        Sensible heat that ideal air says to give, negative where it cools [W].
    delivered : DataFrame, shape (n_time, n_zone)
        Heat that the zones' air gets of it by EnergyPlus' own account [W].
    wanted : DataFrame, shape (n_time, n_zone)
        Heat that would bring a zone to its set point [W].
    outputs : DataFrame, shape (n_time, n_output)
        All of EnergyPlus' outputs; columns (key in capitals, variable).
    heat_made : float
        By the transfer functions of the worst construction [W/m2].
    """

    temperature: pd.DataFrame
    heat: pd.DataFrame
    delivered: pd.DataFrame
    wanted: pd.DataFrame
    outputs: pd.DataFrame
    heat_made: float

    @property
    def heat_deviation(self) -> float:
        """Mean absolute difference of heat and what is delivered, as a share of the mean absolute of the latter [-].

        Where a temperature changes by more than 0.3 K in a step, EnergyPlus cuts the step, and ideal air counts its
        heat with the temperature at the beginning of each part.
        """
        given, told = self.delivered.to_numpy(), self.heat.to_numpy()
        return float(np.abs(told - given).mean() / np.abs(given).mean())


def simulate(plant: Plant, more: Sequence[str] = ()) -> Run:
    """Run EnergyPlus.

    Parameters
    ----------
    plant : Plant
        With effects.
    more : sequence of str
        Further output variables.

    Raises
    ------
    TrialError
        EnergyPlus broke off, or its transfer functions make heat.
    """
    spec = plant.spec
    for zone in spec.zone_names:
        for name, values in zip(setpoint_schedules(zone), plant.setpoints, strict=True):
            plant.follow(name, values[zone].to_numpy())
    for variable in (_TEMPERATURE, _HEATING, _COOLING, _DELIVERED, _WANTED, *more):
        plant.add("Output:Variable", variable, key_value="*", variable_name=variable, reporting_frequency="Timestep")
    with tempfile.TemporaryDirectory(prefix="energyplus_") as folder:
        path = Path(folder) / "site.epw"
        write_weather(path, plant.weather, sun=plant.sun, sky=plant.sky)
        job = Job(json.dumps(plant.objects), "in.epJSON", path, stepped=False)
        try:
            files = run_energyplus(job, ["eplusout.csv", "eplusout.eio"])
        except EnergyPlusError as error:
            raise TrialError(f"{spec.name}: {error}") from error
    made = heat_made(files["eplusout.eio"].decode("latin-1"))
    worst = max(made, key=lambda name: made[name])
    if made[worst] > MOST_HEAT_MADE:
        raise TrialError(f"{spec.name}: transfer functions of {worst!r} make or lose {made[worst]:.3f} W/m2; at most "
                         f"{MOST_HEAT_MADE} are expected")  # fmt: skip
    return _read(spec, files["eplusout.csv"], made[worst])


def _read(spec: Spec, table: bytes, made: float) -> Run:
    outputs = pd.read_csv(io.BytesIO(table)).iloc[:, 1:]
    named = (column.partition(" [")[0].partition(":") for column in outputs.columns)
    outputs.columns = pd.MultiIndex.from_tuples([(key.upper(), variable) for key, _, variable in named])
    if len(outputs) != len(spec.starts) or not np.isfinite(outputs.to_numpy()).all():
        raise TrialError(f"{spec.name}: expected {len(spec.starts)} steps with values, found {len(outputs)} rows, "
                         f"{int(outputs.isna().any(axis=1).sum())} of them without")  # fmt: skip
    outputs.index = spec.starts

    def of(variable: str, key: str = "{}") -> pd.DataFrame:
        keys = {zone: key.format(zone).upper() for zone in spec.zone_names}
        return pd.DataFrame({zone: outputs[key, variable] for zone, key in keys.items()})

    heat = of(_HEATING, ideal_air("{}")) - of(_COOLING, ideal_air("{}"))
    return Run(of(_TEMPERATURE), heat, of(_DELIVERED), of(_WANTED), outputs, made)


def heat_made(text: str) -> dict[str, float]:
    """Return what transfer functions make or lose where all temperatures are 22 degC [W/m2], by construction.

    A construction whose faces have one temperature conducts nothing: the sums of its functions outside, across and
    inside are equal (EnergyPlus Engineering Reference, "Conduction Transfer Function Module").

    Parameters
    ----------
    text : str
        EnergyPlus' ``eplusout.eio`` with its constructions.
    """
    sums, name = {}, ""
    for line in text.splitlines():
        fields = [field.strip() for field in line.split(",")]
        if fields[0] == "Construction CTF":
            name = fields[1]
            sums[name] = np.zeros(4)
        elif fields[0] == "CTF":
            terms = [float(field) for field in fields[2:6]]
            sums[name] += [*terms, 0.0][:4]  # the term of the present step has no flux
    return {
        name: float(_WARM * max(abs(outside - across), abs(inside - across)) / (1.0 - flux))
        for name, (outside, across, inside, flux) in sums.items()
    }
