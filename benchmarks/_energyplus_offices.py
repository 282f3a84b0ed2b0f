"""The offices of `mpc_energyplus`: which, when, under which prices, and their telemetry with mild excitation."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from calibration.diagnosis.diagnosis import diagnose
from mpc.adapters.energyplus.make import EnergyPlusConditions, energyplus_plant
from mpc.adapters.energyplus.plant import EnergyPlusPlant, EnergyPlusSettings
from mpc.loop.noise import SensorNoise
from mpc.loop.plant import Measurements
from mpc.loop.run import run_closed_loop
from mpc.reports.diagnosis import write_diagnosis
from mpc.scenario.forecast import Forecast
from mpc.scenario.rates import ConstantRate
from mpc.scenario.tariff import Tariff
from thermal import Case, load_case, save_case

STEP, CONTROL_STEPS = 300.0, 6  # s; an action every half hour
TELEMETRY_DAYS, CONTROL_DAYS = 14, 7
HORIZON = 12 * 12 + 12  # steps of a forecast: the controller's half day, and an hour
#: Prices that stay the same, of the size of commercial averages in Illinois (assumed).
ELECTRICITY, GAS = 0.112, 0.038  # USD/kWh
HEATING, COOLING = 294.15, 297.15  # K, thermostats of the reference offices while they run
FIRST_HOUR, LAST_HOUR = 6, {5: 18, 6: 0}  # of these on weekdays, Saturdays and Sundays end earlier
DAY_ENDS = 22
OFFSETS, HOLD = (-1.0, -0.5, 0.0, 0.5, 1.0), 6  # K, and control steps: three hours
SUPPLY, SUPPLY_OFFSETS = 285.95, (0.0, 1.5, 3.0)  # K


@dataclass(frozen=True)
class Office:
    """A building and its season.

    Parameters
    ----------
    key, name, file : str
        For file names, for tables, and of EnergyPlus' reference building.
    season, start : str
        Name, and first day of the telemetry; the controlled week follows it.
    """

    key: str
    name: str
    file: str
    season: str
    start: str

    @property
    def controlled(self) -> str:
        """First day of the controlled week."""
        return (date.fromisoformat(self.start) + timedelta(days=TELEMETRY_DAYS)).isoformat()

    def plant(self, start: str, days: int, horizon: int | None = None, seed: int = 0) -> EnergyPlusPlant:
        """Make the plant, with sensor noise.

        Parameters
        ----------
        start : str
            First day.
        days : int
            Number of days.
        horizon : int, optional
            Steps of its forecasts.
        seed : int
            Of the noise.
        """
        tariff = Tariff(ConstantRate(ELECTRICITY), ConstantRate(GAS))
        return energyplus_plant(
            self.file, start, days, EnergyPlusSettings(CONTROL_STEPS, noise=SensorNoise()),
            EnergyPlusConditions(tariff), step_seconds=STEP, horizon=horizon,
        )  # fmt: skip


_MEDIUM, _LARGE = "RefBldgMediumOfficeNew2004_Chicago", "RefBldgLargeOfficeNew2004_Chicago"
OFFICES = {
    o.key: o
    for o in (
        Office("medium_winter", "Medium Office", _MEDIUM, "winter", "2023-01-09"),
        Office("medium_spring", "Medium Office", _MEDIUM, "spring", "2023-04-03"),
        Office("large_winter", "Large Office", _LARGE, "winter", "2023-01-09"),
        Office("large_spring", "Large Office", _LARGE, "spring", "2023-04-03"),
    )
}


class Excitation:
    """The building's own control, its thermostats moved by up to a kelvin and its supply air by up to three.

    Each zone and air handler has its own offsets, held for three hours; at night the building is left alone.

    Parameters
    ----------
    plant : EnergyPlusPlant
        Whose actuators.
    seed : int
        Of the offsets.
    """

    def __init__(self, plant: EnergyPlusPlant, seed: int = 0) -> None:
        self._names = [a.name for a in plant.actuators]
        self._rng, self._count, self._offset = np.random.default_rng(seed), 0, {}

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Choose the setpoints of the next control step.

        Parameters
        ----------
        measurements : Measurements
            Only their stamp counts.
        forecast : Forecast or None
            Without effect.
        """
        if self._count % HOLD == 0:
            zones = {name.rpartition("/")[0] for name in self._names if "zone_air" in name}
            self._offset = {zone: float(self._rng.choice(OFFSETS)) for zone in sorted(zones)}
            air = [n for n in self._names if n.endswith("supply_air_temperature_setpoint")]
            self._offset |= {n: float(self._rng.choice(SUPPLY_OFFSETS)) for n in air}
        self._count += 1
        stamp = measurements.stamp
        if not FIRST_HOUR <= stamp.hour < LAST_HOUR.get(stamp.weekday(), DAY_ENDS):
            return {}
        chosen = {n: SUPPLY + self._offset[n] for n in self._names if n in self._offset}
        for name in self._names:
            zone, _, point = name.rpartition("/")
            if point.startswith("zone_air_heating"):
                chosen[name] = HEATING + self._offset[zone]
            elif point.startswith("zone_air_cooling"):
                chosen[name] = COOLING + self._offset[zone]
        return chosen


def telemetry_case(office: Office, folder: Path) -> Case:
    """Run two weeks with excitation and save them as a case folder, or load what was saved.

    Parameters
    ----------
    office : Office
        Which.
    folder : Path
        Case folder.
    """
    if not (folder / "building.yaml").exists():
        plant = office.plant(office.start, TELEMETRY_DAYS)
        run_closed_loop(plant, Excitation(plant), seed=1)
        case = plant.case()
        save_case(replace(case, building=replace(case.building, name=office.key)), folder)
    return load_case(folder)


def prepared(office: Office, folder: Path) -> dict[str, Any]:
    """Make telemetry and diagnose it, which calibrates the baseline; what is there is kept.

    The models of both controllers are those of the diagnosis: the calibrated baseline, and that with all effects that
    it accepted.
    """
    done = folder / "models.json"
    if done.exists():
        return json.loads(done.read_text(encoding="utf-8"))
    case = telemetry_case(office, folder / "case")
    found = diagnose(case)
    write_diagnosis(found, case, folder / "diagnosis", force=True)
    fits = {"before": found.rounds[0].before, "after": found.final}
    models = {
        name: {
            "effects": {effect: list(zones) for effect, zones in fit.effects.items()},
            "values": {p.name: float(v) for p, v in zip(fit.built.network.parameters, fit.theta, strict=True)},
        }
        for name, fit in fits.items()
    }
    errors = {"before": found.gap, "after": found.steps[-1].after if found.steps else found.gap, "floor": found.floor}
    data = {**models, "held_out_mae": errors}
    done.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    return data
