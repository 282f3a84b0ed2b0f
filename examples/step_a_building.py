"""Step a building under a night set-back: reset, step, and look at the zones."""

import numpy as np

from thermal import Simulator, load_bundled_case

OUTDOOR = 268.15  # K
SET_BACK, COMFORT = 289.15, 293.15  # K


def night(hours: float = 12.0) -> np.ndarray:
    """Heat through a night with a proportional thermostat; zone temperatures, shape (n_time, n_zone) [K]."""
    plant = Simulator(load_bundled_case().building, dx=1.0)
    outdoor = np.array([OUTDOOR])
    zones = plant.reset(np.full(len(plant.zone_names), COMFORT), outdoor)
    path = []
    for step in range(round(hours * 3600.0 / plant.step_seconds)):
        setpoint = SET_BACK if step * plant.step_seconds < 0.75 * hours * 3600.0 else COMFORT
        heat = np.clip(2000.0 * (setpoint - zones), 0.0, 6000.0)
        zones = plant.step(heat, outdoor)
        path.append(zones)
    return np.array(path)


if __name__ == "__main__":
    temperatures = night()
    print(f"coldest hour of the night: {temperatures.min() - 273.15:.1f} degC")
