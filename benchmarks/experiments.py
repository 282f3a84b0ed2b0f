"""Experiments that tell a group apart: how often one of it becomes the right name, and what that costs.

Simulated offices (our plant, five zones, 14 days at 10 minutes, sensors with noise) have one effect each that the
baseline lacks. Those whose diagnosis ends with a group, or with a first name that is under 90 % sure, get the designed
experiment of at most 48 hours and 0.5 K h a zone. It is carried out on the plant, and the diagnosis goes on from the
telemetry with it. Beside it the same hours under usual operation, so that it is seen what the experiment does and what
mere days do. Days of a diagnosis are those of the first two thirds, without the search about other structures, which
these plants do not have.

Run from the repository's root, in an environment with Python 3.11 or newer; an interrupted run goes on where it was::

    pip install -e .
    python benchmarks/experiments.py --seeds 0-5 --out results/experiments
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _experiment_sites import DX, STRENGTHS, Site, draw_site
from _seeds import seed_range
from _table import markdown, publish, write
from _trial_scores import Rate

from calibration.diagnosis.decide.verdict import Verdict, judge
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import held_out
from calibration.diagnosis.refit.search import search
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from calibration.experiment.design import DesignSettings, design_experiment
from calibration.experiment.library import office_comfort
from calibration.experiment.members import question_of
from calibration.experiment.outcome import narrowed, weigh_experiment
from calibration.experiment.schedule import Schedule
from calibration.results import plain
from mpc.loop.plant import Plant
from mpc.studies.experiment import carry_out
from thermal.case.case import Case
from thermal.effects.catalogue import CATALOGUE

NAME = "experiments"

#: Probability under which a first name is not enough.
SURE = 0.9


def seek(case: Case, tuned: list[Interval], judged: list[Interval]) -> tuple[Verdict, dict[str, Any]]:
    """Search for effects and judge; also as ``diagnosis.json`` has it.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tuned, judged : list of Interval
        First two thirds and last third where empty.
    """
    models = ModelComparison(case, ModelSettings(dx=DX), tuned, judged)
    untestable = models.untestable()
    baseline = models.fit({}, [{}])
    rounds = search(models, baseline, held_out(models, baseline), [e for e in CATALOGUE if e not in untestable])
    verdict = judge(rounds, untestable)
    return verdict, {
        "case": case.building.name, "verdict": verdict.name, "which": [c.to_dict() for c in verdict.candidates],
        "intervals": {"tuning": plain(models.tuned), "held_out": plain(models.judged)},
        "how_far": [{"effects": list(r.after.effects)} for r in rounds if r.accepted is not None],
    }  # fmt: skip


def trial(seed: int, effect: str) -> dict[str, Any]:
    """Make a site, diagnose it, and where that leaves a group, carry out an experiment and diagnose again.

    Parameters
    ----------
    seed : int
        Of the site.
    effect : str
        That it has.
    """
    began, site = time.process_time(), draw_site(seed, effect)
    end = pd.Timestamp(site.start) + pd.Timedelta(days=site.days)
    plant = site.plant(site.start, end.isoformat())
    plant.reset()
    actions = site.usual(plant)
    while not plant.finished:
        plant.step(actions)
    case = plant.case()
    verdict, content = seek(case, [], [])
    first = verdict.candidates[0]
    row: dict[str, Any] = {"seed": seed, "effect": effect, "verdict": verdict.name, "first": first.effect,
                           "group": list(first.group), "probability": first.probability}  # fmt: skip
    if verdict.name not in ("group", "named") or (verdict.name == "named" and first.probability >= SURE):
        return row | {"asked": False}
    likely = [c for c in content["which"] if c["probability"] >= 0.1]
    if verdict.name == "named" and len(likely) < 2:
        return row | {"asked": False}
    question = question_of(case, content)
    experiment = design_experiment(case, question, DesignSettings(), ModelSettings(dx=DX))
    row |= {"asked": True, "members": list(question.members), "design": experiment.to_dict()}
    runs = {"experiment": experiment.schedule, "usual": Schedule(experiment.start, experiment.schedule.hours)}
    for name, schedule in runs.items():
        row[name] = _after(case, site, schedule, question, effect)
    return row | {"cpu": time.process_time() - began}


def _after(case: Case, site: Site, schedule: Schedule, question: Any, effect: str) -> dict[str, Any]:
    """Carry out a schedule and diagnose again."""

    def made(case: Case, end: pd.Timestamp) -> tuple[Plant, Mapping[str, float]]:
        plant = site.plant(site.start, end.tz_localize(None).isoformat())
        return plant, site.usual(plant)

    longer = carry_out(case, schedule, made)
    interval = Interval(schedule.start, schedule.end)
    outcome = weigh_experiment(longer, question, interval, ModelSettings(dx=DX))
    found, _ = seek(longer, [*question.tuned, interval], list(question.judged))
    verdict = narrowed(found, outcome)
    first = verdict.candidates[0]
    rows = longer.stamps > schedule.start
    zone = longer.zone_temperatures().to_numpy()[rows]
    discomfort = office_comfort(longer.stamps[rows], longer.step).discomfort(zone, longer.step)
    heat = np.maximum(longer.zone_heat().to_numpy()[rows], 0.0).sum() * longer.step / 3.6e6
    return {
        "verdict": verdict.name, "first": first.effect, "group": list(first.group), "named": outcome.named,
        "by_search": [found.name, found.candidates[0].effect], "outcome": outcome.to_dict(),
        "right": verdict.name == "named" and first.effect == effect, "discomfort_kh": discomfort.tolist(),
        "heat_kwh": float(heat),
    }  # fmt: skip


def report(out: Path, published: bool) -> str:
    """Tabulate all trials that are done.

    Parameters
    ----------
    out : Path
        Folder of the results.
    published : bool
        Replace the table in the docs.
    """
    rows = [json.loads(p.read_text(encoding="utf-8")) for p in sorted((out / "trials").glob("*.json"))]
    asked = [r for r in rows if r.get("asked")]
    held = [r for r in asked if r["effect"] in r["members"]]
    lines = []
    for effect in [*dict.fromkeys(r["effect"] for r in asked), "all"]:
        mine = [r for r in asked if effect in (r["effect"], "all")]
        hits = sum(r["experiment"]["right"] for r in mine)
        null = sum(r["usual"]["right"] for r in mine)
        wrong = sum(r["experiment"]["verdict"] == "named" and not r["experiment"]["right"] for r in mine)
        hopeless = [r for r in mine if r["design"]["verdict"] == "hopeless"]
        extra = [max(0.0, max(_beyond(r))) for r in mine]
        lines.append([effect, len(mine), _shown(hits, len(mine)), _shown(null, len(mine)), wrong,
                      f"{len(hopeless)}, {sum(r['experiment']['right'] for r in hopeless)} of them right",
                      float(np.median([r["design"]["cost"] for r in mine])), f"{max(extra):.2f}"])  # fmt: skip
    head = (f"{len(rows)} sites, of which {len(asked)} end with a group or a name under 90 %; the effect is in the "
            f"group in {len(held)}.\n\n")  # fmt: skip
    columns = ["effect", "groups", "one right name after the experiment", "after as many usual hours", "wrong name",
               "said to be hopeless", "cost, median", "discomfort beyond usual, most [K h]"]  # fmt: skip
    told = [r for r in asked if r["design"]["verdict"] != "hopeless"]
    tail = ""
    if told:
        hits, null = (sum(r[k]["right"] for r in told) for k in ("experiment", "usual"))
        tail = (f"\nOf the {len(told)} where the design promised better than even odds, "
                f"{_shown(hits, len(told))} become one right "
                f"name, under usual operation {_shown(null, len(told))}.\n")  # fmt: skip
    failures = [r for r in asked if not r["experiment"]["right"]]
    listed = "".join(
        f"- {r['effect']} (seed {r['seed']}), asked of {', '.join(r['members'])}: {_reason(r)}\n" for r in failures
    )
    table = head + markdown(columns, lines) + tail + ("\nWithout one right name:\n\n" + listed if listed else "")
    write(out, NAME, table, rows, False)
    if published:
        publish(NAME, table)
    return table


def _shown(hits: int, of: int) -> str:
    """Spell a share with its 95 % interval (Wilson)."""
    low, high = Rate(hits, of).interval
    return f"{hits} of {of} ({low:.0%} to {high:.0%})"


def _beyond(row: Mapping[str, Any]) -> list[float]:
    """Discomfort of the experiment less that of the same hours under usual operation, by zone [K h]."""
    pairs = zip(row["experiment"]["discomfort_kh"], row["usual"]["discomfort_kh"], strict=True)
    return [a - b for a, b in pairs]


def _reason(row: Mapping[str, Any]) -> str:
    """Say in a few words why a trial has no right name."""
    after = row["experiment"]
    promised = f"promised {row['design']['chance']:.0%}, log odds {after['outcome']['log_odds']:.1f}"
    if row["effect"] not in row["members"]:
        return f"the effect is not in the group; {promised}, {after['verdict']} {after['first']}"
    if row["design"]["verdict"] == "hopeless":
        return f"said to be hopeless; {promised}, {after['verdict']} {after['first']}"
    return f"{promised}; {after['verdict']}, first {after['first']} of {', '.join(after['group'])}"


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--seeds", type=seed_range, required=True, help="first and last, such as 0-5")
    parser.add_argument("--effects", default=",".join(STRENGTHS), help="ids of the effects that sites have")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    for seed in options.seeds:
        for effect in options.effects.split(","):
            path = options.out / "trials" / f"{effect}_{seed:03d}.json"
            if path.exists():
                continue
            row = trial(seed, effect)
            path.parent.mkdir(parents=True, exist_ok=True)
            whole = path.with_suffix(".part")
            whole.write_text(json.dumps(row, default=float), encoding="utf-8")
            os.replace(whole, path)
            done = row.get("experiment", {})
            print(seed, effect, row["verdict"], row["group"], done.get("verdict"), done.get("first"), flush=True)
    print(report(options.out, options.publish))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
