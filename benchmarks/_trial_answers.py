"""Answers of the diagnosis to blind trials, one process a trial, and the tables of their scores."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from _code import code
from _table import markdown, publish, write
from _trial_scores import LEAST_GAP, Trial, gap_of, score, trial_of
from energyplus_trials.drawing import draw_spec, twins_of

NAME = "blind_trials"
CASES, SEALED, ANSWERS, GAPS = "cases", "sealed", "answers", "gaps"

#: What answers a trial, and what only measures its gap, a tenth of the work.
_ANSWER, _GAP = "plain(seek(case).to_dict())", '{"gap": {"mae": baseline_gap(case)}}'
#: The program of the process that answers one trial: it gets the case folder and a file to write to, and nothing else.
_PROGRAM = """
import json, sys
from pathlib import Path
from calibration.diagnosis.diagnosis import baseline_gap
from calibration.diagnosis.seek import seek
from calibration.results import plain
from thermal import load_case
case = load_case(sys.argv[1])
answer = %s | {"code": sys.argv[3]}
part = Path(sys.argv[2] + ".part")
part.write_text(json.dumps(answer), encoding="utf-8")
part.replace(sys.argv[2])
"""


def answer_all(out: Path, workers: int, most: int | None = None, *, showing: bool = False) -> list[str]:
    """Diagnose every trial that has no answer yet; returns the names of those that failed.

    Parameters
    ----------
    out : Path
        Folder of the trials.
    workers : int
        Processes at a time, one thread each.
    most : int, optional
        Most trials to answer now.
    showing : bool
        Only trials of several effects of which two or more show; their gaps must have been measured.
    """
    cases = sorted((out / CASES).iterdir())
    if showing:
        asked = _of_several_that_show(out)
        cases = [case for case in cases if case.name in asked]
    return answer_cases(cases, out / ANSWERS, workers, most)


def measure_gaps(out: Path, workers: int) -> list[str]:
    """Measure the gap of every trial that has neither gap nor answer; returns the names of those that failed.

    Parameters
    ----------
    out : Path
        Folder of the trials.
    workers : int
        Processes at a time, one thread each.
    """
    cases = [p for p in sorted((out / CASES).iterdir()) if not (out / ANSWERS / f"{p.name}.json").exists()]
    return answer_cases(cases, out / GAPS, workers, program=_GAP)


def answer_cases(
    cases: Sequence[Path], folder: Path, workers: int, most: int | None = None, *, program: str = _ANSWER
) -> list[str]:
    """Diagnose every case that has no answer yet, in a process of its own; returns the names of those that failed.

    Parameters
    ----------
    cases : sequence of Path
        Case folders.
    folder : Path
        Where the answers go, one file a case; made where it is not there.
    workers : int
        Processes at a time, one thread each.
    most : int, optional
        Most cases to answer now.
    program : str
        What is asked of a case.
    """
    folder.mkdir(exist_ok=True)
    waiting = [p for p in cases if not (folder / f"{p.name}.json").exists()][:most]
    failed, began = [], time.perf_counter()
    with ThreadPoolExecutor(workers) as pool:
        tasks = {pool.submit(_answer, case, folder / f"{case.name}.json", program): case.name for case in waiting}
        for number, task in enumerate(as_completed(tasks), 1):
            error = task.result()
            if error:
                failed.append(tasks[task])
            seconds = time.perf_counter() - began
            print(f"{number} of {len(waiting)} ({seconds:.0f} s): {tasks[task]}: {error or 'done'}", flush=True)
    return failed


def _answer(case: Path, answer: Path, program: str) -> str:
    """Run one process; returns the last line of what went wrong."""
    quiet = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    command = [sys.executable, "-c", _PROGRAM % program, str(case), str(answer), code()]
    done = subprocess.run(command, env={**os.environ, **quiet}, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else (done.stderr.strip().splitlines() or ["no message"])[-1]


def _read(folder: Path) -> dict[str, Any]:
    """Contents of the files of a folder by their names; none where it is not there."""
    return {p.stem: json.loads(p.read_text(encoding="utf-8")) for p in sorted(folder.glob("*.json"))}


def _gaps(out: Path) -> dict[str, float]:
    """Held-out error of the calibrated baseline in the last third of the telemetry by trial [K]."""
    return {name: gap_of(answer) for name, answer in (_read(out / GAPS) | _read(out / ANSWERS)).items()}


def _of_several_that_show(out: Path) -> set[str]:
    """Names of the trials of which two effects or more leave a gap."""
    gaps, found = _gaps(out), set()
    for name, label in _read(out / SEALED).items():
        twins = _twins(label) if label["kind"] == "pair" else []
        missing = [n for n in (name, *twins) if twins and n not in gaps]
        if missing:
            raise SystemExit(f"{out}: expected the gap of {missing[0]}, a trial of several effects or its twin, found "
                             "none; make the twins and run `gaps` first")  # fmt: skip
        if sum(gaps[name] - gaps[twin] > LEAST_GAP for twin in twins) > 1:
            found.add(name)
    return found


def read_trials(out: Path) -> list[Trial]:
    """Open the seals of the trials that are answered.

    Parameters
    ----------
    out : Path
        Folder of the trials.
    """
    answers, gaps = _read(out / ANSWERS), _gaps(out)
    labels = {name: json.loads((out / SEALED / f"{name}.json").read_text(encoding="utf-8")) for name in answers}
    return [
        trial_of(name, label, answers[name], [gaps.get(twin, float("nan")) for twin in _twins(label)])
        for name, label in labels.items()
        if label["kind"] != "without"
    ]


def _twins(label: Mapping[str, Any]) -> list[str]:
    """Names of the trials of the same seed without each of a trial's effects."""
    if "twins" in label:
        return list(label["twins"])
    # offices made before labels named them
    spec = draw_spec(label["seed"], label["kind"], confirmation=bool(label["stream"]), days=label["days"])
    return [twin.name for twin in twins_of(spec)]


def report(out: Path, published: bool, table: str = NAME) -> str:
    """Score what is answered, and write the tables.

    Parameters
    ----------
    out : Path
        Folder of the trials.
    published : bool
        Also replace the table between its marks.
    table : str
        Whose marks; those of another than the usual one hold the rates alone.
    """
    trials = read_trials(out)
    if not trials:
        raise SystemExit(f"{out}: expected answered trials, found none; run `diagnose` first")
    scored = score(trials)
    versions = sorted({str(t.answer.get("code")) for t in trials})
    seeds = "confirmation" if all(t.confirmation for t in trials) else "development"
    head = (
        f"{len(trials)} trials ({', '.join(f'{sum(t.kind == k for t in trials)} {k}' for k in _kinds(trials))}), "
        f"{seeds} seeds, method {', '.join(versions)}; "
        f"{sum(not t.counted for t in trials)} whose effects leave no gap over 0.05 K are not counted."
    )
    if len(versions) > 1:
        head += " **The answers come from several versions of the method; answer again before quoting.**"
    alone = sum(not np.isfinite(t.twins).all() for t in trials)
    if alone:
        head += f" **{alone} count whatever their gap, as their twin has no answer: answer the twins before quoting.**"
    short = f"{head}\n\n{_rates(scored)}\n{_summary(scored)}\n"
    detail = "\n".join(
        [
            "By effect:\n",
            _rows(scored["by_effect"]),
            "By strength:\n",
            _rows(scored["by_strength"]),
            "Reliability of the probabilities:\n",
            _reliability(scored["reliability"]),
        ]
    )
    page = f"{short}\n{detail}"
    plain = {**scored, "rates": {name: r.to_dict() for name, r in scored["rates"].items()}}
    write(out, NAME, page, plain, published=False)
    worlds = {t.world for t in trials}
    if published and worlds != {"office"}:
        raise SystemExit(f"{out}: expected offices, found trials of {', '.join(sorted(worlds))}; publish with `worlds`")
    if published and table != NAME:
        publish(table, short)
    elif published and len(_kinds(trials)) > 1:
        publish(NAME, short)
        publish(f"{NAME}_detail", detail)
    elif published:
        publish(f"{NAME}_{trials[0].kind}", short)
    return page


def _kinds(trials: Sequence[Trial]) -> list[str]:
    return sorted({t.kind for t in trials})


def _rates(scored: Mapping[str, Any]) -> str:
    rows = [
        [name, f"{r.share:.0%}", f"{r.interval[0]:.0%} to {r.interval[1]:.0%}", f"{r.hits} of {r.of}"]
        for name, r in scored["rates"].items()
        if r.of
    ]
    return markdown(("of trials", "share", "95 % interval", "number"), rows)


def _summary(scored: Mapping[str, Any]) -> str:
    hidden = ", ".join(f"{v} {n}" for v, n in scored["uncounted"].items() if n)
    said = []
    if scored["strength"]:
        low, middle, high = scored["strength"]
        said.append(
            f"Strength found over the true one, where both are one number: median {middle:.2f}, half of them between "
            f"{low:.2f} and {high:.2f}."
        )
    said += [f"Median share of the gap closed: {scored['closed']:.0%}.",
             f"Effects in a 90 % set: {scored['set_size']:.1f} on average.",
             f"Trials without a gap: {hidden or 'none'}.",
             f"Median time of a diagnosis: {scored['seconds']:.0f} s."]  # fmt: skip
    return " ".join(said)


def _rows(table: Mapping[str, Mapping[str, Any]]) -> str:
    columns = ("trials", "right first", "right group", "abstained", "wrong name")
    rows = [
        [name, *(row[c] if c == "trials" else f"{row[c]:.0%}" for c in columns)]
        for name, row in table.items()
        if row["trials"]
    ]
    return markdown(("", *columns), rows)


def _reliability(rows: Sequence[Mapping[str, float]]) -> str:
    shown = [
        [f"{r['from']:g} to {r['to']:g}", f"{r['stated']:.2f}", f"{r['present']:.2f}", int(r["count"])] for r in rows
    ]
    return markdown(("probability", "stated", "there", "effects"), shown)
