"""Environment steps a CPU second of Sinergym on its office of five zones; runs in an environment of its own.

Sinergym's buildings are written for EnergyPlus 23.1 and run here in 25.2, the one that can be installed by name: one
word of the model, which EnergyPlus renamed since, is brought up to date. Design days are read by the newest input data
dictionary that eppy brings.

Usage: ``python sinergym_speed.py``; writes where it is begun, and prints one line of JSON.
"""

import json
import logging
import os
import shutil
from pathlib import Path

import eppy
import numpy as np

STEPS, STRETCHES = 2000, 3
BUILDING = "5ZoneAutoDXVAV.epJSON"


def prepare(folder: Path) -> Path:
    """Lay out what Sinergym looks for in an installation of EnergyPlus; give the building in its words of today."""
    dictionaries = (Path(eppy.__file__).parent / "resources" / "iddfiles").glob("Energy+V*.idd")
    newest = max(dictionaries, key=lambda path: [int(n) for n in path.stem.removeprefix("Energy+V").split("_")])
    shutil.copy(newest, folder / "Energy+.idd")
    os.environ["EPLUS_PATH"] = str(folder)
    import sinergym

    model = Path(sinergym.__file__).parent / "data" / "buildings" / BUILDING
    building = folder / BUILDING
    building.write_text(model.read_text(encoding="utf-8").replace('"ZoneAveraged"', '"EnclosureAveraged"'))
    return building


def main() -> None:
    """Step a year's beginning, and count."""
    building = prepare(Path.cwd())
    logging.disable(logging.ERROR)
    import gymnasium

    env = gymnasium.make("Eplus-5zone-mixed-continuous-v1", building_file=str(building))
    env.reset(seed=0)
    space = env.action_space
    actions = np.random.default_rng(0).uniform(space.low, space.high, (STEPS, *space.shape)).astype(np.float32)
    rates = []
    for _ in range(STRETCHES):
        before = os.times()
        for action in actions:
            seen, reward, ended, cut, _ = env.step(action)
            if ended or cut or not (np.isfinite(seen).all() and np.isfinite(reward)):
                raise RuntimeError(f"expected a year of finite steps, found ended={ended}, cut={cut}, reward={reward}")
        after = os.times()  # with the thread that runs EnergyPlus
        rates.append(STEPS / (after.user + after.system - before.user - before.system))
    print("\n" + json.dumps({"rate": max(rates)}), flush=True)
    os._exit(0)  # the rest of the year need not be simulated


if __name__ == "__main__":
    main()
