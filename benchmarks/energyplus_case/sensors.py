"""From EnergyPlus's outputs to what the building's sensors report."""

import numpy as np
import pandas as pd
from energyplus_trials.frame import SITE_OUTPUTS

from energyplus_case import layout, model
from energyplus_case.run import EnergyPlusError

AIR_HEAT_CAPACITY = 1006.0  # [J/kg/K], of the case format
TEMPERATURE_NOISE = 0.03  # [K], standard deviation, zone air
TEMPERATURE_RESOLUTION = 0.02  # [K], zone air
DISCHARGE_NOISE = 0.05  # [K], standard deviation
FLOW_NOISE = 0.005  # [-], standard deviation, share of the flow
HEAT_TOLERANCE = 0.01  # [-], of a zone's mean absolute heat
UNITS = {
    "outside_air_temperature_sensor": "degC",
    "wind_speed_sensor": "m/s",
    "wind_direction_sensor": "deg",
    "horizontal_infrared_irradiance_sensor": "W/m^2",
    "direct_normal_irradiance_sensor": "W/m^2",
    "diffuse_horizontal_irradiance_sensor": "W/m^2",
    "zone_air_temperature_sensor": "degC",
    "supply_air_flowrate_sensor": "kg/s",
    "discharge_air_temperature_sensor": "degC",
}


def check_heat(results: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Compare the metered heat of each zone with EnergyPlus's own and return both means.

    Two figures of EnergyPlus's: the term of the zone's heat balance, which is the heat the air received, and the rate
    that the ideal-loads system reports, which takes the zone's temperature from before the step.

    Parameters
    ----------
    results : DataFrame, shape (n_time, n_output)
        As `run.simulate` returns it.

    Raises
    ------
    EnergyPlusError
        A zone's metered heat differs by more than `HEAT_TOLERANCE` from either.
    """
    report: dict[str, dict[str, float]] = {}
    for zone in layout.ZONES:
        outputs = results[zone]
        metered = outputs["flow"] * AIR_HEAT_CAPACITY * (outputs["discharge"] - outputs["zone_temperature"])
        scale = outputs["balance"].abs().mean()
        in_balance = (metered - outputs["balance"]).abs().mean() / scale
        reported = abs((metered - outputs["heating"] + outputs["cooling"]).mean()) / scale
        if not max(in_balance, reported) <= HEAT_TOLERANCE:
            raise EnergyPlusError(
                f"{zone}: metered heat is off by {in_balance:.2%} of the heat balance's term and {reported:.2%} of the "
                f"reported rate (mean {scale:.0f} W); at most {HEAT_TOLERANCE:.0%} is expected"
            )
        report[zone] = {
            "mean_heat_W": round(float(metered.mean()), 1),
            "deviation_from_heat_balance": round(float(in_balance), 6),
            "deviation_from_reported_rate": round(float(reported), 6),
        }
    return report


def telemetry(results: pd.DataFrame, weather: pd.DataFrame, timezone: str, seed: int) -> pd.DataFrame:
    """Return the telemetry, columns `ENTITY/POINT` in the case format, with sensor noise.

    Parameters
    ----------
    results : DataFrame, shape (n_time, n_output)
        Of the building, as `run.simulate` returns it.
    weather : DataFrame, shape (n_time, n_point)
        What the weather station sees, one column a point.
    timezone : str
        IANA name of the fixed offset.
    seed : int
        Of the noise, at least 0.
    """
    rng = np.random.default_rng([seed, 2])
    n = len(results)
    columns = {f"weather_station/{point}": weather[point].to_numpy() for point in SITE_OUTPUTS}
    for zone in layout.ZONES:
        outputs = {name: results[zone, name].to_numpy() for name in model.OUTPUTS_ZONE}
        measured = outputs["zone_temperature"] + rng.normal(0.0, TEMPERATURE_NOISE, n)
        flow = outputs["flow"] * (1.0 + rng.normal(0.0, FLOW_NOISE, n))
        discharge = np.where(outputs["flow"] > 0.0, outputs["discharge"], outputs["zone_temperature"])
        device = f"VAV_{zone}"
        rounded = np.round(measured / TEMPERATURE_RESOLUTION) * TEMPERATURE_RESOLUTION
        columns[f"{device}/zone_air_temperature_sensor"] = rounded
        columns[f"{device}/supply_air_flowrate_sensor"] = flow
        columns[f"{device}/discharge_air_temperature_sensor"] = discharge + rng.normal(0.0, DISCHARGE_NOISE, n)
    index = pd.DatetimeIndex(results.index).tz_localize(timezone)
    return pd.DataFrame(columns, index=index).astype(np.float32)
