"""Blind trials of the diagnosis on measured buildings: as they are, and with a known fault put into their telemetry.

Nobody knows all that a measured building holds, so each is its own twin: effects that the diagnosis of the case as it
is accepts are the building's, as is the sun, and of the others what is put in must come first. A spoil counts where it
raises the held-out error, with the building's own in the model, by 0.05 K over that of the twin. Telemetry is spoilt in
these ways:

- ``sensor_bias``, ``sensor_lag``: one zone's sensor reads too much or too little, or follows slowly;
- ``clock_shift``: the weather station's clock is off, by an hour or by as many steps as can be seen;
- ``flow_gain``: the meter of one device reads too much or too little;
- ``swapped_sensors``: two zones' sensors are exchanged;
- ``unmetered_device``: one device is neither measured nor listed;
- ``no_irradiance``: nobody measures the sun;
- ``no_boundary``: a space beside the zones is not measured, and drawn as outdoor.

Run from the repository's root; an interrupted run goes on where it was::

    pip install -e .
    python benchmarks/spoilt_buildings.py --cases CASES --out results/spoilt --seeds 0-2 [--publish]
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _seeds import seed_range
from _table import markdown, publish, write
from _trial_answers import ANSWERS, CASES, SEALED, answer_all
from _trial_scores import Trial, gap_of, score

from thermal import load_case
from thermal.case.building import OUTDOOR, Building, ZoneTable
from thermal.case.case import Case
from thermal.case.save import save_case
from thermal.case.telemetry import Telemetry
from thermal.errors import ThermalError

NAME = "spoilt_buildings"

TEMPERATURE, POWER = "zone_air_temperature_sensor", "heating_power_sensor"

#: What every building with windows has, and no drawing holds.
DOCUMENTED = {"solar_gain"}

#: Spoilt building and telemetry, where, and how much.
Spoilt = tuple[Building, pd.DataFrame, tuple[str, ...], dict[str, Any]]

#: Spoils a case by random numbers; None where the case cannot be spoilt so.
Spoil = Callable[[Case, np.random.Generator], Spoilt | None]


def _zones(case: Case) -> list[str]:
    frame = case.telemetry.frame
    return [z for z in case.building.zone_names if f"{z}/{TEMPERATURE}" in frame]


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _bias(case: Case, rng: np.random.Generator) -> Spoilt | None:
    zone, kelvin = str(rng.choice(_zones(case))), round(_sign(rng) * rng.uniform(0.7, 1.5), 2)
    frame = case.telemetry.frame.copy()
    frame[f"{zone}/{TEMPERATURE}"] += kelvin
    return case.building, frame, (zone,), {"bias_K": {zone: kelvin}}


def _lag(case: Case, rng: np.random.Generator) -> Spoilt | None:
    zone, seconds = str(rng.choice(_zones(case))), round(max(rng.uniform(900.0, 1800.0), 0.6 * case.step))
    frame = case.telemetry.frame.copy()
    column = f"{zone}/{TEMPERATURE}"
    frame[column] = frame[column].ewm(alpha=1.0 - np.exp(-case.step / seconds), ignore_na=True).mean()
    return case.building, frame, (zone,), {"time_constant_s": seconds}


def _clock(case: Case, rng: np.random.Generator) -> Spoilt | None:
    steps = max(round(3600.0 / case.step), 2) * int(_sign(rng))
    frame = case.telemetry.frame.copy()
    weather = [c for c in frame if c.startswith(f"{case.building.weather_station}/")]
    frame[weather] = frame[weather].shift(steps).ffill().bfill()
    return case.building, frame, (), {"steps": steps}


def _meter(case: Case, rng: np.random.Generator) -> Spoilt | None:
    columns = [c for c in case.telemetry.frame if c.endswith(f"/{POWER}")]
    if not columns:
        return None
    column, share = str(rng.choice(columns)), round(_sign(rng) * rng.uniform(0.25, 0.45), 2)
    frame = case.telemetry.frame.copy()
    frame[column] *= 1.0 + share
    zone = next(d.zone for d in case.building.devices if d.name == column.partition("/")[0])
    return case.building, frame, (zone,) if zone else (), {"gain": share}


def _swap(case: Case, rng: np.random.Generator) -> Spoilt | None:
    zones = _zones(case)
    if len(zones) < 2:
        return None
    first, second = (str(z) for z in rng.choice(zones, 2, replace=False))
    frame, (a, b) = case.telemetry.frame.copy(), (f"{first}/{TEMPERATURE}", f"{second}/{TEMPERATURE}")
    frame[[a, b]] = frame[[b, a]].to_numpy()
    return case.building, frame, (first, second), {}


def _device(case: Case, rng: np.random.Generator) -> Spoilt | None:
    powers = case.telemetry.frame.filter(regex=f"/{POWER}$").mean()
    used = [str(c) for c in powers[powers > 0.1 * powers.sum()].index]
    if len(used) < 2:
        return None
    name = str(rng.choice(used)).partition("/")[0]
    zone = next(d.zone for d in case.building.devices if d.name == name)
    devices = tuple(d for d in case.building.devices if d.name != name)
    frame = case.telemetry.frame.drop(columns=case.telemetry.frame.filter(regex=f"^{name}/").columns)
    return replace(case.building, devices=devices), frame, (zone,) if zone else (), {"device": name}


def _no_sun(case: Case, rng: np.random.Generator) -> Spoilt | None:
    sun = case.telemetry.frame.filter(regex="irradiance").columns
    return (case.building, case.telemetry.frame.drop(columns=sun), (), {}) if len(sun) else None


def _no_boundary(case: Case, rng: np.random.Generator) -> Spoilt | None:
    building = case.building
    if not building.measured_boundaries or not isinstance(building.geometry, ZoneTable):
        return None
    lost = str(rng.choice(building.measured_boundaries))
    drawn = tuple(s.model_copy(update={"other": OUTDOOR}) if s.other == lost else s for s in building.geometry.surfaces)
    frame = case.telemetry.frame.drop(columns=f"{lost}/{TEMPERATURE}")
    geometry = replace(building.geometry, surfaces=drawn)
    return replace(building, geometry=geometry), frame, (), {"boundary": lost}


#: Ways to spoil a case, the names that are right beside their own, and whether "unexplained" is.
SPOILS: dict[str, tuple[Spoil, tuple[str, ...], bool]] = {
    "sensor_bias": (_bias, ("sensor_bias",), False),
    "sensor_lag": (_lag, ("sensor_lag",), False),
    "clock_shift": (_clock, ("clock_shift",), False),
    "flow_gain": (_meter, ("flow_gain",), False),
    "swapped_sensors": (_swap, ("swapped_sensors",), True),
    "unmetered_device": (_device, ("internal_gains", "valve_leak"), True),
    "no_irradiance": (_no_sun, ("solar_gain", "internal_gains"), True),
    "no_boundary": (_no_boundary, ("roof_exchange", "ground_exchange", "neighbour", "interfloor_exchange"), True),
}


def make(path: Path, out: Path, seeds: range) -> None:
    """Write a case as it is, and spoilt in every way by every seed; what is there already is left alone.

    Parameters
    ----------
    path : Path
        Case folder.
    out : Path
        Folder of the trials.
    seeds : range
        Of how much and where.
    """
    case = load_case(path)
    twin = _write(out, path.name, "null", 0, (case.building, case.telemetry.frame, (), {}), case, "")
    for kind, (spoil, _, _) in SPOILS.items():
        seen = set()
        for seed in seeds:
            rng = np.random.default_rng([seed, *path.name.encode(), *kind.encode()])
            spoilt = spoil(case, rng)
            if spoilt is None or (key := json.dumps(spoilt[2:])) in seen:
                continue
            seen.add(key)
            _write(out, path.name, kind, seed, spoilt, case, twin)


def _write(out: Path, source: str, kind: str, seed: int, spoilt: Spoilt, case: Case, twin: str) -> str:
    """Write one trial whose name tells nothing; returns its name."""
    building, frame, zones, numbers = spoilt
    name = f"trial_{hashlib.sha256(f'{source} {kind} {seed}'.encode()).hexdigest()[:10]}"
    folder = out / CASES / name
    if not folder.exists():
        telemetry = Telemetry(frame, case.step, case.telemetry.missing_rows)
        try:
            save_case(Case(replace(building, name=name), telemetry), folder)
        except ThermalError as error:
            print(f"{source}: {kind}: not made: {error}")
            return name
    label = {"source": source, "kind": kind, "seed": seed, "zones": zones, "numbers": numbers, "twin": twin}
    (out / SEALED).mkdir(exist_ok=True)
    (out / SEALED / f"{name}.json").write_text(json.dumps(label, indent=1), encoding="utf-8")
    return name


def read(out: Path) -> dict[str, tuple[dict[str, Any], Trial]]:
    """Open the seals of answered trials: labels and trials by name.

    Parameters
    ----------
    out : Path
        Folder of the trials.
    """
    answers = {p.stem: json.loads(p.read_text(encoding="utf-8")) for p in sorted((out / ANSWERS).glob("*.json"))}
    found = {}
    for name, answer in answers.items():
        label = json.loads((out / SEALED / f"{name}.json").read_text(encoding="utf-8"))
        null = label["kind"] == "null"
        _, right, unexplained = SPOILS.get(label["kind"], (None, (), False))
        as_is = answers.get(label["twin"])
        own = _effects_of(as_is) if as_is is not None else set()
        own = (own | DOCUMENTED) - ({label["kind"], *right} if not null else set())
        twin = float("nan") if as_is is None else _error_with(as_is, own)
        answer = {**answer, "which": [c for c in answer["which"] if c["effect"] not in own]}
        answer["gap"] = {**answer["gap"], "mae": _error_with(answer, own)}
        # that of the last third is without what is its own
        answer["intervals"] = {**answer.get("intervals", {}), "mae_of_last_third": None}
        if set() < _effects_of(answer) <= own and answer["verdict"] != "unexplained":
            # nothing but what the building is known to have, or more that has no name
            answer["verdict"] = "no_gap" if answer["gap"].get("outdone") is None else "unexplained"
        found[name] = label, Trial(
            name, "null" if null else "single", () if null else (frozenset(right),), () if null else (label["kind"],),
            1.0, frozenset(label["zones"]), unexplained, () if null else (twin,), answer, True, label["numbers"],
            "measured", label["source"],
        )  # fmt: skip
    return found


def _effects_of(answer: dict[str, Any]) -> set[str]:
    """Effects that an answer accepts."""
    return {effect for step in answer["how_far"] for effect in step["effects"]}


def _error_with(answer: dict[str, Any], own: set[str]) -> float:
    """Held-out error once what is the building's own is in the model [K]."""
    error = answer["gap"]["mae"]
    for step in answer["how_far"]:
        if not set(step["effects"]) <= own:
            break
        error = step["held_out_mae_after"]
    return float(error)


def report(out: Path, published: bool = False) -> str:
    """Score what is answered, trial by trial and in sum.

    Parameters
    ----------
    out : Path
        Folder of the trials.
    published : bool
        Also replace the table between its marks, with the trials that count and those as they are.
    """
    trials = read(out)
    scored = score([trial for _, trial in trials.values()])
    rows = []
    for label, trial in sorted(trials.values(), key=lambda t: (t[0]["source"], t[0]["kind"])):
        answer, first = trial.answer, trial.answer["which"][0]
        where = f" in {', '.join(first['zones'])}" if first["zones"] else ""
        twin = trial.twins[0] if trial.twins else float("nan")
        rows.append([
            label["source"], label["kind"], ", ".join(label["zones"]) or "-", json.dumps(label["numbers"]),
            f"{gap_of(answer):.3f}", f"{twin:.3f}", "yes" if trial.counted else "no", answer["verdict"],
            f"{first['effect']} ({first['probability']:.0%}){where}",
            "-" if not trial.twins else "yes" if _right(trial) else "no",
        ])  # fmt: skip
    rates = [[n, f"{r.share:.0%}", f"{r.interval[0]:.0%} to {r.interval[1]:.0%}", f"{r.hits} of {r.of}"]
             for n, r in scored["rates"].items() if r.of]  # fmt: skip
    head = ("case", "spoil", "zones", "how", "gap [K]", "of the twin [K]", "counts", "verdict", "first", "right")
    page = f"{markdown(('of trials', 'share', '95 % interval', 'number'), rates)}\n{markdown(head, rows)}"
    plain = {**scored, "rates": {name: r.to_dict() for name, r in scored["rates"].items()}}
    write(out, NAME, page, plain, published=False)
    if published:
        told = [row for row in rows if "yes" in (row[6], row[9]) or row[1] == "null"]
        rest = f"{len(rows) - len(told)} of {len(rows)} trials leave no gap and are left out.\n"
        publish(
            NAME,
            f"{markdown(('of trials', 'share', '95 % interval', 'number'), rates)}\n{markdown(head, told)}\n{rest}",
        )
    return page


def _right(trial: Trial) -> bool:
    """Whether the best guess, or that none is good, is right."""
    verdict = trial.answer["verdict"]
    return (trial.named and trial.right_first) or (verdict == "unexplained" and trial.unexplained_is_right)


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, nargs="+", required=True, help="folders of measured cases")
    parser.add_argument("--out", type=Path, default=Path("results/spoilt"), help="folder of trials and answers")
    parser.add_argument("--seeds", type=seed_range, default=range(1), help="first and last, such as 0-2")
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), help="processes at a time")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    for path in options.cases:
        make(path, options.out, options.seeds)
    failed = answer_all(options.out, options.workers)
    print(report(options.out, options.publish))
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
