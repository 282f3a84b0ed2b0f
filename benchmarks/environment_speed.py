"""Steps of the learning environment a second: an office on its reduced model, one by one and many at once, one core.

A step is 5 minutes of the plant under random actions of a seed, its measurements with noise, the forecast, the clock
and the reward. Beside it the plant alone, and the plant with its measurements read; a loop of single environments; the
vector environment, in single precision, as plain NumPy and compiled by numba (extra ``[fast]``), with one building for
all and with a building for each; with ``--peers`` also environments of others (`_peer_environments`), which have other
buildings, physics and steps, as they come. Noise is drawn as it is needed and counts. Times are CPU times of the
process on one thread, of a peer with all its threads, best of some stretches; the time that a compiled environment
takes to be made stands beside it.

Run: ``python benchmarks/environment_speed.py --out results/environment [--peers] [--publish]``; two minutes, with peers
ten, most of it to install them. Writes ``environment_speed.json`` and ``.md``.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from _peer_environments import peer_rates
from _table import markdown, write
from _threads import use_one_thread

from mpc.environment.environment import ControlEnvironment
from mpc.environment.office import Office, office_environment, office_plants
from mpc.environment.vector import VectorEnvironment
from mpc.loop.make import PlantSettings
from mpc.loop.noise import SensorNoise

EPISODES, STEPS, MEMBERS = 3, 1728, 512

#: Offices: 12 zones, and the size of the paper's pilot.
OFFICES = {12: Office(), 123: Office(zones=123, floors=3, floor_area=6200.0)}


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
            plant.reset(episode)
            begin = time.process_time()
            for k in range(steps):
                take(k)
            rates.append(steps / (time.process_time() - begin))
        found[name] = max(rates)
    return found


def loop_of(worlds: list[ControlEnvironment], steps: int) -> float:
    """Count the steps a second of single environments, one after the other."""
    rng = np.random.default_rng(0)
    for k, world in enumerate(worlds):
        world.reset(seed=k)
    begin = time.process_time()
    for _ in range(steps):
        for world in worlds:
            world.step(rng.uniform(-1.0, 1.0, len(world.actions)).astype(np.float32))
    return steps * len(worlds) / (time.process_time() - begin)


def many_at_once(world: VectorEnvironment, steps: int, stretches: int = EPISODES) -> float:
    """Count the steps a second of a vector environment: whole blocks of noise, from the first step on."""
    rng = np.random.default_rng(0)
    shape = world.action_space.shape
    actions = [rng.uniform(-1.0, 1.0, shape).astype(np.float32) for _ in range(16)]
    world.reset(seed=0)
    rates = []
    for _ in range(stretches):
        begin = time.process_time()
        for k in range(steps):
            world.step(actions[k % 16])
        rates.append(steps * world.num_envs / (time.process_time() - begin))
    return max(rates)


def compare(zones: int, steps: int, members: int, compiled: bool) -> dict[str, float]:
    """Measure one office in all ways."""
    settings = PlantSettings(dx=1.0, noise=SensorNoise())
    single = office_environment(office=OFFICES[zones], plant=settings)
    found = measure(single, steps=steps)
    few = [office_environment(office=OFFICES[zones], plant=settings) for _ in range(4)] if zones < 50 else [single]
    found[f"loop of {len(few)} environments"] = loop_of(few, max(steps // 4, 20))
    long = max(64 * (steps // 512), 64)
    found[f"{members} at once"] = many_at_once(VectorEnvironment(single, members), long)
    if compiled:
        begin = time.process_time()
        world = VectorEnvironment(single, members, compiled=True)
        found["making it, compiled [CPU s]"] = time.process_time() - begin
        found[f"{members} at once, compiled"] = many_at_once(world, long)
    values = [{"window_u_value": u} for u in (2.0, 3.0)]
    own = [p for v in values for p in office_plants(OFFICES[zones], PlantSettings(
        dx=1.0, noise=SensorNoise(), parameters=v), ("2023-01-09",), 7)]  # fmt: skip
    found[f"{members} at once, a building for each"] = many_at_once(
        VectorEnvironment(ControlEnvironment(own), members), 64, 1
    )
    return found


def main(arguments: list[str] | None = None) -> dict[str, dict[str, float]]:
    """Measure and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--steps", type=int, default=STEPS, help="of an episode")
    parser.add_argument("--members", type=int, default=MEMBERS, help="environments at once")
    parser.add_argument("--zones", type=int, nargs="*", default=list(OFFICES), choices=list(OFFICES), help="offices")
    parser.add_argument("--plain", action="store_true", help="leave out what numba compiles")
    parser.add_argument("--peers", action="store_true", help="install environments of others, and step them beside")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args(arguments)
    compiled = not options.plain and find_spec("numba") is not None
    found = {str(z): compare(z, options.steps, options.members, compiled) for z in options.zones}
    if options.peers:
        found |= peer_rates(options.out / "peers")
    rows = [[zones, name, f"{rate:,.0f}", "" if "CPU s" in name else f"{1e6 / rate:.2f}"]
            for zones, rates in found.items() for name, rate in rates.items()]  # fmt: skip
    note = f"Steps of 5 minutes where no other is told, one core; load average {os.getloadavg()[0]:.1f}.\n"
    text = markdown(("zones", "what", "steps a second", "µs a step"), rows) + "\n" + note
    write(options.out, "environment_speed", text, found, options.publish)
    print(text)
    return found


if __name__ == "__main__":
    main()
