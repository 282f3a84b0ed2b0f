"""Intervals of savings: how often they hold the saving that is known, how wide they are, and what our plant saves.

First table: synthetic days (`_metered_days.py`: heating, weekends, noise of 8 % with a memory), a saving of 10 % of the
mean power, a repeat a seed, intervals at 90 %. Alternate days in four patterns, without and with heat that a day leaves
to the next (3 %), and a baseline before and after, beside the uncertainty of ASHRAE Guideline 14. Second table: an
office of ours where supply air 1.5 K warmer acts on alternate days, beside two runs of all days with either control,
whose difference is the true saving.

Run: ``python benchmarks/verification.py --out results/verification --publish``; some four minutes of CPU.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _metered_days import MEAN, metered_days, pattern
from _seeds import seed_range
from _table import markdown, write

from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.run import run_closed_loop
from mpc.verification import before_after as periods
from mpc.verification import switchback as alternation
from mpc.verification.before_after import before_after
from mpc.verification.switchback import switchback
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system

#: Share saved, and level of the intervals [-].
SAVING, LEVEL = 0.1, 0.9

#: Days of our plant's run [d].
DAYS = 57


def alternate_days(seeds: range) -> Iterator[list[Any]]:
    """Rows of alternate days."""
    for kind in ("alternate", "pairs", "random", "weeks"):
        for n in (28, 56):
            for carry in (0.0, 0.03):
                found = [switchback(metered_days(seed, kind, n, SAVING, carry)) for seed in seeds]
                truth = MEAN * (SAVING + carry)
                inside = [low <= truth <= high for low, high in (f.saving.interval(LEVEL) for f in found)]
                width = float(np.median([f.saving.half_width(LEVEL) for f in found])) / truth
                told = "told" if found[-1].carried is not None else "not told"
                yield [kind, n, f"{carry:.0%}", f"{np.mean(inside):.0%}", f"{width:.0%}", told]


def baselines(seeds: range) -> Iterator[list[Any]]:
    """Rows of a baseline before and a reporting period after."""
    for n, m in ((60, 30), (120, 60), (365, 365)):
        inside, guideline, widths = [], [], []
        for seed in seeds:
            days = metered_days(seed, np.repeat([0.0, 1.0], [n, m]), n + m, SAVING)
            found = before_after(days[:n], days[n:])
            truth = MEAN * SAVING * 86400.0 * m
            low, high = found.saving.interval(LEVEL)
            inside.append(low <= truth <= high)
            widths.append(found.saving.half_width(LEVEL) / truth)
            half = found.fractional_uncertainty(LEVEL) * abs(found.saving.value)
            guideline.append(abs(found.saving.value - truth) <= half)
        yield [f"{n} before, {m} after", n + m, "-", f"{np.mean(inside):.0%}", f"{np.median(widths):.0%}",
               f"Guideline 14: {np.mean(guideline):.0%}"]  # fmt: skip


def our_plant(seeds: range) -> Iterator[list[Any]]:
    """Rows of our office, true saving beside those of alternate days."""
    building = pilot_building(1, floor_area=300.0, zones=6, name="office")
    start = pd.Timestamp("2023-01-09", tz=building.location.timezone)
    end = f"{start + pd.Timedelta(days=DAYS):%Y-%m-%d}"
    settings = PlantSettings(step_seconds=900.0, control_steps=4, dx=1.0, order=40, noise=SensorNoise(),
                             system=size_system(building))  # fmt: skip
    for seed in seeds:
        weather = pilot_weather(seed, "2023-01-09", float(DAYS), 900.0)
        plant = simulated_plant(building, weather, "2023-01-09", end, settings)
        outdoor = weather.frame["outside_air_temperature_sensor"].to_numpy().reshape(DAYS, -1).mean(axis=1)
        index = pd.date_range(start, periods=DAYS)
        weekend = (index.day_of_week >= 5).astype(float)
        whole = [_daily_power(plant, np.full(DAYS, acts), start) for acts in (0.0, 1.0)]
        truth = 1.0 - whole[1].sum() / whole[0].sum()
        for kind in ("alternate", "pairs", "random"):
            acts = pattern(kind, DAYS, np.random.default_rng(seed))
            power = _daily_power(plant, acts, start)
            table = {"power": power, "outdoor": outdoor, "weekend": weekend, "acts": acts}
            found = switchback(pd.DataFrame(table, index=index))
            low, high = found.share.interval(LEVEL)
            told = [f"{100.0 * x:.1f} %" for x in (truth, found.share.value, low, high)]
            yield [seed, kind, *told, "yes" if low <= truth <= high else "NO"]


def _daily_power(plant: Any, acts: np.ndarray, start: pd.Timestamp) -> np.ndarray:
    """Mean power by day [W] where supply air is warmer on some days."""
    own = dict(plant.default_actions)
    new = {name: value + 1.5 if "supply_air_temperature" in name else value for name, value in own.items()}

    class Alternating:
        def step(self, measurements: Any, forecast: Any) -> dict[str, float]:
            return new if acts[min((measurements.stamp - start).days, len(acts) - 1)] else own

    record = run_closed_loop(plant, Alternating()).record
    gas = 0.0 if record.gas is None else record.gas
    return (record.electricity + gas).reshape(len(acts), -1).mean(axis=1)


def main() -> None:
    """Make both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/verification"))
    parser.add_argument("--seeds", type=seed_range, default=seed_range("100-299"))
    parser.add_argument("--plants", type=seed_range, default=seed_range("1-4"))
    parser.add_argument("--publish", action="store_true")
    arguments = parser.parse_args()
    for module in (alternation, periods):  # intervals need no held-out fits and no permutations
        module.judge_baseline = functools.partial(module.judge_baseline, hold_out=False)
    alternation._SHUFFLES = 1
    first = [*alternate_days(arguments.seeds), *baselines(arguments.seeds)]
    second = list(our_plant(arguments.plants))
    heads = ["days with the new control", "days", "left to the next day", "90 % intervals that hold the saving",
             "half width over saving, median", "carry-over"]  # fmt: skip
    told = f"Seeds {arguments.seeds[0]} to {arguments.seeds[-1]}.\n\n{markdown(heads, first)}\n"
    told += markdown(["weather", "days", "true saving", "found", "from", "to", "inside"], second)
    data = {"synthetic": first, "plant": second, "seeds": [*arguments.seeds]}
    write(arguments.out, "verification", told, data, arguments.publish)
    print(told)


if __name__ == "__main__":
    main()
