"""Steps of the functional environment a second, and proximal policy optimisation in it: on one core, and on a GPU.

Steps are those of `environment_speed.py`, with the noise drawn by JAX: random actions, measurements, forecast, clock
and reward, many members at once. The training is that of `mpc.environment.ppo` with its own settings on the office of
12 zones, all of it in one compiled function. What is compiled beforehand is not in the times; it stands beside them.

``--export DIR`` writes the functions and what they read to files instead, and ``--run DIR`` runs such files where
nothing but JAX and NumPy is installed, on whatever device JAX finds there. Without either both are done here.

Run: ``python benchmarks/functional_speed.py --out results/functional --publish functional_cpu`` (extras ``[jax]``,
``[benchmarks]``); twelve minutes, most of them for 610 rounds of training, which are 20 million steps. Writes the
table's name as ``.json`` and ``.md``.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
from _table import markdown, write

if __name__ == "__main__" and "cpu" in os.environ.get("JAX_PLATFORMS", "cpu"):  # one core
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

STEPS, STRETCHES = 256, 4

#: Beginnings of episodes, and members at once, by zones.
SIZES = {12: (16, (512, 4096, 32768, 131072)), 123: (4, (512, 4096, 16384))}


def environment(zones: int, beginnings: int) -> Any:
    """Make the office of `environment_speed.py` as functions."""
    from environment_speed import OFFICES

    from mpc.environment.functional import FunctionalEnvironment
    from mpc.environment.office import office_environment
    from mpc.environment.vector import VectorEnvironment
    from mpc.loop.make import PlantSettings
    from mpc.loop.noise import SensorNoise

    single = office_environment(office=OFFICES[zones], plant=PlantSettings(dx=1.0, noise=SensorNoise()),
                                starts=("2023-01-09", "2023-04-17", "2023-07-10"))  # fmt: skip
    return FunctionalEnvironment(VectorEnvironment(single, beginnings))


def rolled(world: Any, members: int) -> Any:
    """Give the function of tables and a seed that makes `STEPS` steps under random actions."""
    import jax

    def run(seed: Any, *flat: Any) -> Any:
        here = world.with_tables(jax.tree.unflatten(jax.tree.structure(world.tables), flat))
        begin, rest = jax.random.split(jax.random.key(seed))

        def step(now: Any, key: Any) -> Any:
            acting, after = jax.random.split(key)
            action = jax.random.uniform(acting, (members, here.actions), minval=-1.0, maxval=1.0)
            state, seen, reward, *_ = here.step(now, action, after)
            return state, (seen.mean(), reward.mean())

        return jax.lax.scan(step, here.reset(begin, members)[0], jax.random.split(rest, STEPS))[1]

    return run


def learned(world: Any, rounds: int) -> Any:
    """Give the function of tables and a seed that learns."""
    import jax

    from mpc.environment.ppo import Ppo

    def run(seed: Any, *flat: Any) -> Any:
        here = world.with_tables(jax.tree.unflatten(jax.tree.structure(world.tables), flat))
        return jax.tree.leaves(Ppo(here).learn(jax.random.key(seed), rounds))

    return run


def export(folder: Path, zones: list[int], most: int, rounds: int) -> None:
    """Write functions and tables."""
    import jax

    from mpc.environment.ppo import PpoSettings

    folder.mkdir(parents=True, exist_ok=True)
    told = {}
    for count in zones:
        beginnings, sizes = SIZES[count]
        world = environment(count, beginnings)
        flat = jax.tree.leaves(world.tables)
        np.savez_compressed(folder / f"{count}.npz", *(np.asarray(v) for v in flat))
        made = {f"steps-{count}-{m}": (rolled(world, m), m * STEPS, m) for m in sizes if m <= most}
        if count == min(SIZES) and rounds:
            s = PpoSettings()
            made[f"learn-{count}-{s.members}"] = learned(world, rounds), rounds * s.samples, s.members
        for name, (function, steps, members) in made.items():
            whole = jax.export.export(jax.jit(function), platforms=("cpu", "cuda"))(np.int32(0), *flat)
            (folder / f"{name}.bin").write_bytes(whole.serialize())
            told[name] = {"zones": count, "members": members, "steps": steps}
    (folder / "functions.json").write_text(json.dumps(told, indent=1), encoding="utf-8")


def measure(folder: Path) -> dict[str, dict[str, Any]]:
    """Run what `export` has written."""
    import jax

    found = {}
    for name, told in json.loads((folder / "functions.json").read_text(encoding="utf-8")).items():
        with np.load(folder / f"{told['zones']}.npz") as kept:
            flat = [jax.device_put(kept[k]) for k in kept.files]
        function = jax.jit(jax.export.deserialize(bytearray((folder / f"{name}.bin").read_bytes())).call)
        begin = time.perf_counter()
        compiled = function.lower(np.int32(0), *flat).compile()
        told["compiled in [s]"] = time.perf_counter() - begin
        seconds, learns = [], name.startswith("learn")
        for seed in range(1 if learns else STRETCHES):
            clocks = time.process_time(), time.perf_counter()
            result = jax.block_until_ready(compiled(np.int32(seed), *flat))
            seconds.append((time.process_time() - clocks[0], time.perf_counter() - clocks[1]))
        told["CPU seconds"], told["wall seconds"] = (min(times) for times in zip(*seconds, strict=True))
        rewards = np.asarray(result[-1])
        told["rewards"] = [float(part.mean()) for part in np.array_split(rewards, 10)]
        told["device"] = jax.devices()[0].device_kind
        if not np.isfinite(rewards).all():
            raise SystemExit(f"{name}: rewards that are no numbers")
        found[name] = told
        print(name, told, flush=True)
    return found


def table(found: dict[str, dict[str, Any]]) -> str:
    """Lay out what was measured: CPU time on a processor, wall time on a GPU."""
    rows = []
    for name, told in found.items():
        cpu = told["device"] == "cpu"
        seconds = told["CPU seconds" if cpu else "wall seconds"]
        what = "PPO, 2 x 64 units" if name.startswith("learn") else "random actions"
        rows.append([told["zones"], what, f"{told['members']:,}", f"{told['steps']:,}", f"{seconds:.3g}",
                     f"{told['steps'] / seconds:,.0f}", f"{told['compiled in [s]']:.0f}"])  # fmt: skip
    device = next(iter(found.values()))["device"]
    load = f"One core, CPU time; load average {os.getloadavg()[0]:.1f}."
    where = load if device == "cpu" else f"{device}, wall time."
    columns = ("zones", "what", "members", "steps", "s", "steps a second", "compiled in [s]")
    return markdown(columns, rows) + f"\nSteps of 5 minutes, single precision. {where}\n"


def main(arguments: list[str] | None = None) -> dict[str, dict[str, Any]]:
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--zones", type=int, nargs="*", default=list(SIZES), choices=list(SIZES), help="offices")
    parser.add_argument("--most", type=int, default=4096, help="members at once")
    parser.add_argument("--rounds", type=int, default=610, help="of training; 0 leaves it out")
    parser.add_argument("--export", type=Path, help="folder to write functions to, and no more")
    parser.add_argument("--run", type=Path, help="folder of functions to run")
    parser.add_argument("--publish", choices=("functional_cpu", "functional_gpu"), help="table to replace in the docs")
    options = parser.parse_args(arguments)
    folder = options.run or options.export or options.out / "functions"
    if options.run is None:
        export(folder, options.zones, options.most, options.rounds)
    found = {} if options.export else measure(folder)
    if found:
        text = table(found)
        write(options.out, options.publish or "functional_speed", text, found, options.publish is not None)
        print(text)
    return found


if __name__ == "__main__":
    main()
