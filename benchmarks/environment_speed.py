"""Steps of the learning environment a second: an office of 12 zones on its reduced model, one core.

A step is 5 minutes of the plant under random actions of a seed, its measurements with noise, the forecast, the clock
and the reward. Beside it the plant alone, and the plant with its measurements read. Times are CPU times of the process
on one thread; best of some episodes of six days.

Run: ``python benchmarks/environment_speed.py --out results/environment``; half a minute. Writes
``environment_speed.json`` and ``.md``.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from _table import markdown, write
from simulator_speed import use_one_thread

from mpc.environment.environment import ControlEnvironment
from mpc.environment.office import office_environment

EPISODES, STEPS = 5, 1728


def measure(world: ControlEnvironment, episodes: int = EPISODES, steps: int = STEPS) -> dict[str, float]:
    """Count the steps a second of the environment and of its parts."""
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (steps, len(world.actions))).astype(np.float32)
    setpoints = [world.actions.setpoints(action) for action in actions]
    plant = world.plants[0]
    ways: dict[str, Callable[[int], Any]] = {
        "environment": lambda k: world.step(actions[k]),
        "plant, measurements read": lambda k: plant.step(setpoints[k]).values_array,
        "plant": lambda k: plant.step(setpoints[k]),
    }
    found = {}
    for name, take in ways.items():
        rates = []
        for episode in range(episodes):
            world.reset(seed=episode, options={"plant": 0})
            begin = time.process_time()
            for k in range(steps):
                take(k)
            rates.append(steps / (time.process_time() - begin))
        found[name] = max(rates)
    return found


def main(arguments: list[str] | None = None) -> dict[str, float]:
    """Measure and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--steps", type=int, default=STEPS, help="of an episode")
    options = parser.parse_args(arguments)
    found = measure(office_environment(), steps=options.steps)
    rows = [[name, f"{rate:,.0f}", f"{1e6 / rate:.0f}"] for name, rate in found.items()]
    note = f"12 zones, steps of 5 minutes, one core; load average {os.getloadavg()[0]:.1f}.\n"
    text = markdown(("what", "steps a second", "µs a step"), rows) + "\n" + note
    write(options.out, "environment_speed", text, found, False)
    print(text)
    return found


if __name__ == "__main__":
    main()
