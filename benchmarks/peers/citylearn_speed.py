"""Environment steps a CPU second of CityLearn on one building, by random actions; runs in an environment of its own.

CityLearn downloads its data sets, so a synthetic year of hours is written here, in two variants. ``plain``: the
building's heat demand is given; decisions are a cold-water tank and a battery. ``lstm``: its temperature follows from
the heat pump and the battery by a network of the size of CityLearn's challenge of 2023, with random weights: fit for
timing only.

Usage: ``python citylearn_speed.py``; writes where it is begun, and prints one line of JSON.
"""

import json
import logging
import os
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from citylearn.citylearn import CityLearnEnv
from citylearn.dynamics import LSTMDynamics

HOURS, EPISODES = 8760, 3
SHARED = ["month", "day_type", "hour", "outdoor_dry_bulb_temperature",
          "outdoor_dry_bulb_temperature_predicted_1", "diffuse_solar_irradiance", "direct_solar_irradiance",
          "carbon_intensity", "electricity_pricing", "electricity_pricing_predicted_1"]
OWN = ["indoor_dry_bulb_temperature", "non_shiftable_load", "solar_generation", "electrical_storage_soc",
       "net_electricity_consumption", "cooling_demand", "heating_demand", "occupant_count",
       "indoor_dry_bulb_temperature_cooling_set_point", "indoor_dry_bulb_temperature_heating_set_point"]
LSTM_RANGES: dict[str, tuple[float, float]] = {  # input of the thermal model: (minimum, maximum)
    "direct_solar_irradiance": (0.0, 900.0), "diffuse_solar_irradiance": (0.0, 300.0),
    "outdoor_dry_bulb_temperature": (-10.0, 40.0), "occupant_count": (0.0, 3.0),
    "cooling_demand": (0.0, 10.0), "heating_demand": (0.0, 10.0), "month_sin": (-1.0, 1.0), "month_cos": (-1.0, 1.0),
    "hour_sin": (-1.0, 1.0), "hour_cos": (-1.0, 1.0), "day_type_sin": (-1.0, 1.0), "day_type_cos": (-1.0, 1.0),
    "indoor_dry_bulb_temperature": (12.0, 32.0)}


def write_series(folder: Path, rng: np.random.Generator) -> None:
    """Write files of weather, building, carbon and price: sinusoids of day and year plus noise."""
    t = np.arange(HOURS)
    hour, day = t % 24, t // 24
    date = pd.date_range("2023-01-01", periods=HOURS, freq="h")
    year = -np.cos(2 * np.pi * (day - 15) / 365)  # -1 in mid January, 1 in mid July
    sun = np.maximum(0.0, np.sin(np.pi * (hour - 6) / 12)) * (0.6 + 0.3 * year) * rng.uniform(0.5, 1.0, HOURS)
    outdoor = 13 + 11 * year - 5 * np.cos(2 * np.pi * (hour - 3) / 24) + rng.normal(0, 1, HOURS)
    values = {"outdoor_dry_bulb_temperature": outdoor,
              "outdoor_relative_humidity": np.clip(65 - outdoor + rng.normal(0, 3, HOURS), 10, 100),
              "diffuse_solar_irradiance": 250 * sun, "direct_solar_irradiance": 850 * sun}
    ahead = {f"{name}_predicted_{i}": np.roll(x, -6 * i) for name, x in values.items() for i in (1, 2, 3)}
    pd.DataFrame(values | ahead).to_csv(folder / "weather.csv", index=False)

    occupied = (hour < 8) | (hour >= 17) | (date.dayofweek >= 5)
    cool_set, heat_set = np.where(occupied, 25.0, 28.0), np.where(occupied, 20.0, 17.0)
    gain = 0.3 + 2.0 * sun  # kW of people, devices and windows; heat loss is 0.2 kW/K
    cooling = np.maximum(0.0, 0.2 * (outdoor - cool_set) + gain)
    heating = np.where(cooling > 0, 0.0, np.maximum(0.0, 0.2 * (heat_set - outdoor) - gain))
    pd.DataFrame({
        "month": date.month, "hour": hour + 1, "day_type": date.dayofweek + 1,
        "indoor_dry_bulb_temperature": np.clip(outdoor + gain / 0.2, heat_set, cool_set),
        "non_shiftable_load": 0.3 + 0.5 * occupied + rng.uniform(0, 0.3, HOURS), "dhw_demand": 0.0,
        "cooling_demand": cooling, "heating_demand": heating, "solar_generation": 800 * sun,
        "occupant_count": np.where(occupied, 3, 0), "hvac_mode": 3,  # 3: either heats or cools
        "indoor_dry_bulb_temperature_cooling_set_point": cool_set,
        "indoor_dry_bulb_temperature_heating_set_point": heat_set,
    }).to_csv(folder / "building.csv", index=False)
    carbon = 0.4 - 0.15 * sun + rng.uniform(0, 0.05, HOURS)
    pd.DataFrame({"carbon_intensity": carbon}).to_csv(folder / "carbon_intensity.csv", index=False)
    price = np.where((hour >= 16) & (hour < 21), 0.4, 0.2)
    names = ["electricity_pricing"] + [f"electricity_pricing_predicted_{i}" for i in (1, 2, 3)]
    pd.DataFrame({n: np.roll(price, -6 * i) for i, n in enumerate(names)}).to_csv(folder / "pricing.csv", index=False)


def write_schema(folder: Path, lstm: bool) -> Path:
    """Write the schema of one variant, with the network's random weights where it has one."""
    pump = {"type": "citylearn.energy_model.HeatPump", "autosize": True,
            "attributes": {"efficiency": 0.25, "target_cooling_temperature": 8.0, "target_heating_temperature": 45.0}}
    building: dict[str, Any] = {
        "type": "citylearn.building.LSTMDynamicsBuilding" if lstm else "citylearn.building.Building",
        "include": True, "energy_simulation": "building.csv", "weather": "weather.csv",
        "carbon_intensity": "carbon_intensity.csv", "pricing": "pricing.csv",
        "cooling_device": pump, "heating_device": pump,
        "pv": {"type": "citylearn.energy_model.PV", "attributes": {"nominal_power": 3.0}},
        "electrical_storage": {"type": "citylearn.energy_model.Battery", "attributes": {
            "capacity": 6.0, "nominal_power": 3.0, "efficiency": 0.95, "loss_coefficient": 0.0001,
            "capacity_loss_coefficient": 1e-5, "depth_of_discharge": 0.8}}}
    if lstm:
        low, high = np.transpose(list(LSTM_RANGES.values())).tolist()
        model = {"input_observation_names": list(LSTM_RANGES), "input_normalization_minimum": low,
                 "input_normalization_maximum": high, "hidden_size": 16, "num_layers": 2, "lookback": 12}
        torch.manual_seed(0)
        state = LSTMDynamics(filepath=folder / "lstm.pth", **model).state_dict()
        state["l_linear.bias"].fill_(0.5)  # centres the prediction in the temperature range
        torch.save({"model_state_dict": state}, folder / "lstm.pth")
        building["dynamics"] = {"type": "citylearn.dynamics.LSTMDynamics",
                                "attributes": model | {"filename": "lstm.pth"}}
    else:
        building["cooling_storage"] = {"type": "citylearn.energy_model.StorageTank",
                                       "attributes": {"capacity": 3.0, "loss_coefficient": 0.005}}
    observations = {n: {"active": True, "shared_in_central_agent": n in SHARED} for n in SHARED + OWN}
    actions = ["cooling_or_heating_device" if lstm else "cooling_storage", "electrical_storage"]
    schema = {
        "random_seed": 0, "root_directory": str(folder), "central_agent": True, "seconds_per_time_step": 3600.0,
        "simulation_start_time_step": 0, "simulation_end_time_step": HOURS - 1, "episode_time_steps": None,
        "observations": observations, "actions": {n: {"active": True} for n in actions},
        "reward_function": {"type": "citylearn.reward_function.RewardFunction"}, "buildings": {"Building_1": building}}
    path = folder / f"schema_{'lstm' if lstm else 'plain'}.json"
    path.write_text(json.dumps(schema, indent=1))
    return path


def measure(schema: Path) -> float:
    """Count the steps a CPU second, best of some years."""
    env = CityLearnEnv(str(schema), central_agent=True)
    space, steps = env.action_space[0], HOURS - 1
    actions = np.random.default_rng(0).uniform(space.low, space.high, (steps, space.shape[0]))
    rates = []
    for _ in range(EPISODES):
        env.reset()
        before = os.times()
        for action in actions:
            seen, reward, ended, _, _ = env.step([action])
        after = os.times()
        rates.append(steps / (after.user + after.system - before.user - before.system))
        if not (ended and np.isfinite(seen[0]).all() and np.isfinite(reward).all()):
            raise RuntimeError(f"expected a year of finite steps, found ended={ended}, reward={reward}")
    return max(rates)


def main() -> None:
    """Step three years of each variant, and count."""
    logging.disable(logging.WARNING)
    torch.set_num_threads(1)
    folder = Path.cwd()
    write_series(folder, np.random.default_rng(0))
    print(json.dumps({name: measure(write_schema(folder, name == "lstm")) for name in ("plain", "lstm")}))


if __name__ == "__main__":
    main()
