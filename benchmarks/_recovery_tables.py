"""Tables of the parameter recovery: coverage pooled, by parameter and by condition, and held-out errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from _coverage import CONFIDENCE, Coverage, normal_interval, pooled_coverage
from _table import markdown

BoolArray = npt.NDArray[np.bool_]

LEVELS = (0.5, 0.9, 0.95)
HEADLINE = 0.9  # the level that the study is judged by
POOLED = (
    "intervals", "level", "coverage", "band", "inside", "bootstrap", "intervals, twins", "design effect", "correlation",
)  # fmt: skip
BY_PARAMETER = (
    "parameter",
    "twins",
    "identifiable",
    "on a bound",
    "50 %",
    "90 %",
    "95 %",
    "width / prior",
    "RMS z",
    "mean z",
)
BY_CONDITION = ("twins with", "twins", "90 %", "identifiable only", "RMS z", "held-out MAE [K]", "at the truth [K]")


def report(lines: Sequence[dict[str, Any]]) -> tuple[str, str, str, dict[str, Any]]:
    """Make the verdict, the table of coverage, the whole page and the data of the lines of all seeds."""
    done = [line for line in lines if "failure" not in line]
    failed = {line["seed"]: line["failure"] for line in lines if "failure" in line}
    if not done:
        raise SystemExit(f"parameter recovery: expected at least one calibrated twin, found {failed or 'no seeds'}")
    frame = intervals(done)
    pooled = {name: [asdict(c) | {"inside": c.inside} for c in found] for name, found in _pooled(frame)}
    short, coverage = verdict(frame, len(done), failed), markdown(POOLED, list(_pooled_rows(frame)))
    twins = pd.DataFrame([_twin(line) for line in done])
    page = "\n".join(
        [
            f"{short}\n",
            coverage,
            f"{_remarks(done, twins)}\n",
            "By parameter; widths and z on the estimation scale, the prior's width that of its own 90 % interval:\n",
            markdown(BY_PARAMETER, list(_parameter_rows(frame))),
            "By what the twins are like, halves at the median:\n",
            markdown(BY_CONDITION, list(_condition_rows(frame, twins))),
        ]
    )
    data = {
        "pooled": pooled,
        "failed": failed,
        "twins": twins.to_dict("records"),
        "intervals": frame.to_dict("records"),
    }
    return short, coverage, page, data


def intervals(lines: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Collect one row a parameter and seed: z, width of the 90 % interval over the prior's, hits of every level."""
    frame = pd.DataFrame([{"seed": line["seed"], **p} for line in lines for p in line["parameters"]])
    truth, estimate, error = (frame[name].to_numpy(float) for name in ("truth", "estimate", "error"))
    lower, upper = (frame[name].to_numpy(float) for name in ("lower", "upper"))
    frame["z"] = (truth - estimate) / error
    for level in LEVELS:
        low, high = normal_interval(estimate, error, level)
        if level == HEADLINE:
            own = frame["own_interval90"].map(lambda ends: ends if isinstance(ends, list) else [np.nan, np.nan])
            ends = np.array(own.tolist(), dtype=float)
            low, high = (np.where(np.isfinite(e), e, n) for e, n in zip(ends.T, (low, high), strict=True))
            prior = normal_interval(np.zeros(len(frame)), frame["prior_deviation"].to_numpy(float), level)
            frame["width"] = (high - low) / (prior[1] - prior[0])
        frame[f"hit{level:g}"] = (low <= truth) & (truth <= high)
        low, high = normal_interval(estimate, error, level, lower, upper)
        frame[f"cut{level:g}"] = (low <= truth) & (truth <= high)
    return frame


def verdict(frame: pd.DataFrame, twins: int, failed: dict[int, str]) -> str:
    """Say in a sentence whether the study is passed."""
    found = _coverage(frame, f"hit{HEADLINE:g}", HEADLINE)
    where = "inside" if found.inside else "OUTSIDE"
    lost = f" **{len(failed)} twins failed:** {'; '.join(f'{s}: {why}' for s, why in failed.items())}" if failed else ""
    return (
        f"{HEADLINE:.0%} intervals of {found.intervals} parameters of {twins} twins hold the truth in "
        f"{found.coverage:.1%}, {where} the {CONFIDENCE:.0%} band {_span(found.band)}.{lost}"
    )


def _coverage(frame: pd.DataFrame, hits: str, level: float) -> Coverage:
    return pooled_coverage(frame[hits].to_numpy(bool), frame["seed"].to_numpy(int), level)


def _pooled(frame: pd.DataFrame) -> Iterator[tuple[str, list[Coverage]]]:
    """Coverage at every level of all parameters, of those called identifiable, and of the rest."""
    called = frame["identifiable"].to_numpy(bool)
    parts = {"all": frame, "identifiable": frame[called], "not identifiable": frame[~called]}
    for name, part in parts.items():
        for kind, label in (("hit", name), ("cut", f"{name}, cut to range")):
            if len(part):
                yield label, [_coverage(part, f"{kind}{level:g}", level) for level in LEVELS]


def _pooled_rows(frame: pd.DataFrame) -> Iterator[list[Any]]:
    for name, found in _pooled(frame):
        for c in found:
            yield [
                name, f"{c.level:.0%}", f"{c.coverage:.1%}", _span(c.band), "yes" if c.inside else "no",
                _span(c.bootstrap), f"{c.intervals}, {c.clusters}", f"{c.design_effect:.2f}", f"{c.correlation:.2f}",
            ]  # fmt: skip


def _parameter_rows(frame: pd.DataFrame) -> Iterator[list[Any]]:
    for name, part in [*frame.groupby("name", sort=False), ("all", frame)]:
        hits = [f"{part[f'hit{level:g}'].mean():.0%}" for level in LEVELS]
        yield [
            name, part["seed"].nunique(), f"{part['identifiable'].mean():.0%}", f"{part['at_bound'].mean():.0%}", *hits,
            f"{part['width'].mean():.2f}", f"{_rms(part['z']):.2f}", f"{part['z'].mean():+.2f}",
        ]  # fmt: skip


def _condition_rows(frame: pd.DataFrame, twins: pd.DataFrame) -> Iterator[list[Any]]:
    """Coverage of half of the twins each, so that a weakness shows where it is."""
    masks: dict[str, BoolArray] = {
        f"set-points: {e}": (twins["excitation"] == e).to_numpy() for e in ("schedule", "prbs")
    }
    for name, label, scale, unit in (
        ("disturbance_deviation", "unmeasured heat", 1.0, "W/m2"),
        ("disturbance_time", "its correlation time", 3600.0, "h"),
        ("noise", "sensor noise", 1.0, "K"),
    ):
        middle = float(twins[name].median())
        masks[f"{label} up to {middle / scale:.2g} {unit}"] = (twins[name] <= middle).to_numpy()
        masks[f"{label} over {middle / scale:.2g} {unit}"] = (twins[name] > middle).to_numpy()
    for label, mask in masks.items():
        part = frame[frame["seed"].isin(twins["seed"][mask])]
        if len(part):
            known, mae = part[part["identifiable"].to_numpy(bool)], twins[mask]
            hit = f"hit{HEADLINE:g}"
            yield [
                label, int(mask.sum()), f"{part[hit].mean():.1%}", f"{known[hit].mean():.1%}" if len(known) else "-",
                f"{_rms(part['z']):.2f}", f"{mae['after'].mean():.3f}", f"{mae['truth'].mean():.3f}",
            ]  # fmt: skip


def _twin(line: dict[str, Any]) -> dict[str, Any]:
    """Collect what is one number a seed."""
    return {
        "seed": line["seed"],
        **line["conditions"],
        **line["mae"],
        "status": line["solver"]["status"],
        "success": line["solver"]["success"],
        "twin_seconds": line["seconds"]["twin"],
        "seconds": line["seconds"]["calibrate"],
        "code": line["code"],
    }


def _remarks(lines: Sequence[dict[str, Any]], twins: pd.DataFrame) -> str:
    """Say what else belongs to the numbers."""
    study = lines[0]["study"]
    where = study["case"] or f"offices of {study['floor_area']:g} m2, {study['zones']} zones"
    unsolved = twins["seed"][~twins["success"]].tolist()
    versions = twins["code"].nunique()
    before, after, truth = (twins[name].mean() for name in ("before", "after", "truth"))
    ratio = twins["after"] / twins["truth"]
    sentences = [
        f"Twins of {where}, {study['days']:g} days, volumes {study['dx']:g} m apart, set-points by "
        f"{study['excitation']}, heat metered by {study['meter']}.",
        f"Held-out MAE at 6 h: {before:.3f} K before calibration, {after:.3f} K after, {truth:.3f} K at the true "
        f"parameters; the last two are as {ratio.mean():.3f} to 1 on average, as {ratio.max():.2f} to 1 at most.",
        f"{twins['seconds'].median():.1f} s a calibration (median; at most {twins['seconds'].max():.1f} s), "
        f"{twins['twin_seconds'].median():.1f} s a twin.",
        "All solves converged."
        if not unsolved
        else f"**Did not converge:** seeds {unsolved}, counted like the others.",
    ]
    if versions > 1:
        sentences.append(f"**The lines come from {versions} versions of the code; measure again before quoting.**")
    return " ".join(sentences)


def _rms(z: pd.Series) -> float:
    return float(np.sqrt(np.mean(np.square(z))))


def _span(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.1%}-{ends[1]:.1%}"
