"""Proximal policy optimisation on the vector environment: steps a CPU second, and what 20 million would take.

Stable-Baselines3's PPO with nets of 64 x 64 units on 512 offices of 12 zones at once, in single precision, one thread.
``--steps 20000000`` is the whole run; the table says what it would take at the rate that was measured. What a policy is
worth is not measured here: `mpc_vs_rl.py` does that.

Run: ``python benchmarks/ppo_speed.py --out results/ppo --steps 1000000``. Writes ``ppo_speed.json`` and ``.md``.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

from _table import markdown, write
from _threads import use_one_thread
from gymnasium.vector import AutoresetMode

from mpc.environment.office import office_vector_environment
from mpc.environment.stable_baselines import StableBaselinesVector

WHOLE = 20_000_000
ROLLOUT, BATCH, EPOCHS = 64, 8192, 2


class Clocked(StableBaselinesVector):
    """The vector, with the CPU time that its steps take."""

    def __init__(self, world: Any) -> None:
        super().__init__(world)
        self.seconds = 0.0

    def step_wait(self) -> Any:
        """Step and note."""
        begin = time.process_time()
        result = super().step_wait()
        self.seconds += time.process_time() - begin
        return result


def train(steps: int, members: int, compiled: bool, seed: int = 0) -> dict[str, float]:
    """Train and measure."""
    import torch
    from stable_baselines3 import PPO

    torch.set_num_threads(1)
    world = office_vector_environment(
        members, starts=("2023-01-09", "2023-04-17", "2023-07-10"), autoreset_mode=AutoresetMode.SAME_STEP,
        compiled=compiled,
    )  # fmt: skip
    vector = Clocked(world)
    model = PPO(
        "MlpPolicy", vector, n_steps=ROLLOUT, batch_size=BATCH, n_epochs=EPOCHS, gamma=0.98, seed=seed, device="cpu",
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.5},
    )  # fmt: skip
    begin = time.process_time()
    model.learn(steps)
    seconds, done = time.process_time() - begin, model.num_timesteps
    return {
        "steps": done, "CPU seconds": seconds, "steps a CPU second": done / seconds,
        "share of the environment": vector.seconds / seconds,
        "CPU minutes for 20 million steps": WHOLE / (done / seconds) / 60.0,
    }  # fmt: skip


def main(arguments: list[str] | None = None) -> dict[str, float]:
    """Train and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--steps", type=int, default=1_000_000, help="of training")
    parser.add_argument("--members", type=int, default=512, help="environments at once")
    parser.add_argument("--compiled", action="store_true", help="have numba compile the plants (extra [fast])")
    options = parser.parse_args(arguments)
    found = train(options.steps, options.members, options.compiled)
    rows = [[name, f"{value:,.4g}"] for name, value in found.items()]
    text = markdown(("what", "value"), rows) + f"\nOne core; load average {os.getloadavg()[0]:.1f}.\n"
    write(options.out, "ppo_speed", text, found, False)
    print(text)
    return found


if __name__ == "__main__":
    main()
