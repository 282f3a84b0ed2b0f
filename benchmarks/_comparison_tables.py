"""What is read off the runs of the comparison: lines, intervals, cost at equal comfort, table and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt
import numpy as np
from _site import Site
from _table import markdown

#: Prices of discomfort in optimal control over that of the comparison, for its front [-].
PRICES = (0.3, 1.0, 3.0)

NAMES = {
    "floor": "least action: warmest air, coolest water", "own": "the building's own control",
    "schedule": "schedule", "reset": "outdoor reset", "guideline36": "Guideline 36",
    "mpc_before": "MPC, model before diagnosis",
    "mpc_after": "MPC, model after diagnosis", "bound": "MPC that knows everything",
    "mpc_sampling": "MPC by sampling plans, model after diagnosis",
    "ppo_before": "PPO, trained in the model, moved to the plant", "ppo_plant": "PPO, trained on the plant",
    "sac_before": "SAC, trained in the model, moved to the plant", "sac_plant": "SAC, trained on the plant",
    "ppo_after": "PPO, trained in the diagnosed model, moved to the plant",
    "sac_after": "SAC, trained in the diagnosed model, moved to the plant",
}  # fmt: skip
REFERENCE = "mpc_after"
PEERS = {"mpc_after": "ours", "mpc_as_do_mpc": "ours, on do-mpc's problem", "do_mpc": "do-mpc"}
COLUMNS = (
    "controller", "seeds", "cost_tot, USD/m2", "tdis_tot, K h", "ener_tot, kWh/m2", "pele_tot, W/m2",
    "emis_tot, kg/m2", "stage cost of a week, USD", "over the reference, USD a week",
    "cost at its comfort: it, reference [USD]", "time_rat",
)  # fmt: skip
_RESAMPLES = 2000


def family(controller: str) -> str:
    """Tell which line of the table a controller belongs to: seeds of a policy are one line."""
    head, _, tail = controller.rpartition("_")
    return head if tail.isdigit() else controller


def lines(runs: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Sort the runs at the price of the comparison into lines, in the order of `NAMES`."""
    here = [r for r in runs if r["entry"]["price"] == 1.0]
    found = {name: [r for r in here if family(r["entry"]["controller"]) == name] for name in NAMES}
    return {name: rows for name, rows in found.items() if rows}


def by_seed(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, dict[str, Any]]]:
    """Sort the runs of a line by controller and week."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for row in rows:
        found.setdefault(row["entry"]["controller"], {})[row["week"]] = row
    return found


def bootstrap(
    rows: Sequence[dict[str, Any]], reference: Sequence[dict[str, Any]] | None = None, seed: int = 0
) -> tuple[float, float, float]:
    """Mean stage cost of a week and its 95 % interval, or of the difference to a reference on the same days [currency].

    Days of each week and seeds are drawn again, with replacement; differences are paired by day.
    """
    seeds, rng = by_seed(rows), np.random.default_rng(seed)
    weeks = sorted(set.intersection(*(set(of) for of in seeds.values())))
    days = np.array([[of[week]["days"] for week in weeks] for of in seeds.values()], dtype=float)
    if reference is not None:
        same = {row["week"]: row["days"] for row in reference}
        days = days - np.array([same[week] for week in weeks], dtype=float)
    n_seed, n_week, n_day = days.shape
    means = np.empty(_RESAMPLES)
    for k in range(_RESAMPLES):
        drawn = days[rng.integers(n_seed, size=n_seed)]
        picked = [drawn[:, w, rng.integers(n_day, size=n_day)] for w in range(n_week)]
        means[k] = np.mean(picked)
    low, high = np.quantile(means, [0.025, 0.975])
    return n_day * float(days.mean()), n_day * float(low), n_day * float(high)


def front(runs: Sequence[dict[str, Any]], name: str) -> list[tuple[float, float]]:
    """Discomfort [K h] and cost [currency] of a week, means over the weeks, by the prices that a controller had."""
    prices = sorted({r["entry"]["price"] for r in runs if r["entry"]["controller"] == name})
    points = []
    for price in prices:
        rows = [r for r in runs if r["entry"]["controller"] == name and r["entry"]["price"] == price]
        points.append((float(np.mean([r["discomfort"] for r in rows])), float(np.mean([r["cost"] for r in rows]))))
    return sorted(points)


def cost_at(points: Sequence[tuple[float, float]], discomfort: float) -> float:
    """Cost of a front at a discomfort, on straight lines between its points; beyond them the nearest [currency]."""
    return float(np.interp(discomfort, [p[0] for p in points], [p[1] for p in points]))


def table(site: Site, runs: Sequence[dict[str, Any]]) -> str:
    """Lay all lines out."""
    found, rows = lines(runs), []
    for (name, of), (cost, _, same, whole) in zip(found.items(), beside(runs, found), strict=True):
        kpis = {key: np.mean([r["kpis"][key] or 0.0 for r in of]) for key in
                ("cost_tot", "tdis_tot", "ener_tot", "pele_tot", "emis_tot", "time_rat")}  # fmt: skip
        mean, low, high = bootstrap(of)
        seeds = len(by_seed(of)) if "trained" in NAMES[name] else ""
        rows.append([
            NAMES[name], seeds, f"{kpis['cost_tot']:.4f}", f"{kpis['tdis_tot']:.2f}", f"{kpis['ener_tot']:.3f}",
            f"{1e3 * kpis['pele_tot']:.1f}", f"{kpis['emis_tot']:.3f}", _interval(mean, low, high, sign=""), whole,
            f"{cost}, {same}" if same else "", f"{kpis['time_rat']:.1e}",
        ])  # fmt: skip
    weeks = sorted({r["week"] for r in runs})
    note = (
        f"{site.name}: means over {len(weeks)} weeks of {site.days} days ({', '.join(weeks)}); stage cost: energy, and "
        f"discomfort at {site.discomfort_price:.3g} USD a zone's kelvin hour; in brackets 95 % by bootstrap over days "
        f"and seeds, differences paired by day. Reference: {NAMES[REFERENCE]}, whose front over prices of discomfort "
        f"gives its cost at another's comfort.\n"
    )
    return "\n".join(part for part in (markdown(COLUMNS, rows), note, budgets(found), peers(runs)) if part)


def beside(runs: Sequence[dict[str, Any]], found: dict[str, list[dict[str, Any]]]) -> list[tuple[str, str, str, str]]:
    """Give for each line cost, discomfort, cost of the reference as comfortable, and stage cost over it, as text."""
    reference, points, cells = found.get(REFERENCE), front(runs, REFERENCE), []
    for name, of in found.items():
        cost, discomfort = (float(np.mean([r[key] for r in of])) for key in ("cost", "discomfort"))
        same = f"{cost_at(points, discomfort):.1f}" if points else ""
        over = "" if reference is None or name == REFERENCE else _interval(*bootstrap(of, reference))
        cells.append((f"{cost:.1f}", f"{discomfort:.2f}", same, over))
    return cells


def short(site: Site, runs: Sequence[dict[str, Any]]) -> str:
    """Lay out for the README what each line costs and how comfortable it is."""
    found = lines(runs)
    rows = [[NAMES[name], *cells] for name, cells in zip(found, beside(runs, found), strict=True)]
    same = f"cost of {NAMES[REFERENCE]}, as comfortable"
    columns = (f"a week, {site.name}", "energy cost, USD", "discomfort, K h", same, "cost with discomfort over it")
    return markdown(columns, rows)


def peers(runs: Sequence[dict[str, Any]]) -> str:
    """Lay do-mpc out beside ours, on the days that do-mpc was run; nothing where it was not."""
    here = [r for r in runs if r["entry"]["price"] == 1.0 and r["entry"]["controller"] in PEERS]
    days = {r["week"]: len(r["days"]) for r in here if r["entry"]["controller"] == "do_mpc"}
    if not days:
        return ""
    rows = []
    for name, said in PEERS.items():
        of = {r["week"]: r for r in here if r["entry"]["controller"] == name}
        if days.keys() <= of.keys():
            cost = [sum(of[week]["days"][:count]) for week, count in days.items()]
            median, largest = (max(of[week]["step_seconds"][key] for week in days) for key in ("median", "largest"))
            plans = sum(of[week]["sources"].get("optimal plan", 0) for week in days)
            asked = sum(sum(of[week]["sources"].values()) for week in days)
            rows.append([said, *(f"{c:.3f}" for c in cost), f"{median:.2f}", f"{largest:.2f}", f"{plans} of {asked}"])
    columns = ("solver", *(f"stage cost, {week}, USD" for week in days), "an action, median CPU s", "largest", "solved")
    return markdown(columns, rows)


def budgets(found: dict[str, list[dict[str, Any]]]) -> str:
    """Say what each learned line was trained with."""
    said = []
    for name, of in found.items():
        trained = [of_week["about"] for of_week in of if of_week["about"]]
        if trained:
            steps = sorted({a["steps"] for a in trained})
            years = np.mean([a["steps"] * a["hours_a_step"] / 8766.0 for a in trained])
            cpu = np.mean([a["cpu_seconds"] for a in trained])
            count = f"{len({a['seed'] for a in trained})} seeds, {' or '.join(f'{s:,}' for s in steps)} steps"
            said.append(f"{NAMES[name]}: {count} ({years:.1f} years), {cpu / 60.0:.0f} CPU minutes a seed.")
    return " ".join(said) + ("\n" if said else "")


def _interval(mean: float, low: float, high: float, sign: str = "+") -> str:
    return f"{mean:{sign}.1f} ({low:{sign}.1f} to {high:{sign}.1f})"


def draw_front(site: Site, runs: Sequence[dict[str, Any]], path: Path) -> None:
    """Draw cost over discomfort: fronts of optimal control as lines, everything else as points, a seed each."""
    figure, axes = plt.subplots(figsize=(8.0, 6.0), layout="constrained")
    for k, name in enumerate(lines(runs)):
        color = plt.get_cmap("tab20")((2 * k) % 20 + k // 10)
        points = front(runs, name)
        if len(points) > 1:
            axes.plot(*zip(*points, strict=True), "-o", color=color, label=NAMES[name])
            continue
        own = by_seed(lines(runs)[name])
        for m, of in enumerate(own.values()):
            cost, discomfort = (np.mean([row[key] for row in of.values()]) for key in ("cost", "discomfort"))
            marker = "^" if "trained on" in NAMES[name] else "v" if "moved" in NAMES[name] else "s"
            axes.plot(discomfort, cost, marker, color=color, label=NAMES[name] if m == 0 else None)
    axes.set_xscale("symlog", linthresh=0.1)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("discomfort of a week, tdis_tot [K h]")
    axes.set_ylabel("energy cost of a week [USD]")
    axes.set_title(site.name)
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    figure.savefig(path)
    plt.close(figure)


def draw_learning(site: Site, runs: Sequence[dict[str, Any]], path: Path) -> bool:
    """Draw the validation cost of each policy over its training; False where no policy has a curve."""
    curves = {r["entry"]["controller"]: r["about"] for r in runs if r["about"].get("curve")}
    if not curves:
        return False
    figure, axes = plt.subplots(figsize=(8.0, 4.0), layout="constrained")
    names = sorted({family(name) for name in curves})
    for name, about in sorted(curves.items()):
        steps, cost = zip(*about["curve"], strict=True)
        known = axes.get_legend_handles_labels()[1]
        label = NAMES[family(name)]
        axes.plot(np.array(steps) / 1e3, cost, "o-", ms=3, lw=1, color=f"C{names.index(family(name))}",
                  label=None if label in known else label)  # fmt: skip
    axes.set_yscale("log")
    for ticks in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        ticks(lambda value, _: f"{value:g}")
    axes.set_xlabel(f"thousand control steps of {60.0 * site.hours_a_step:g} minutes")
    axes.set_title(site.name)
    axes.set_ylabel("stage cost of a validation week,\nin the world of the training [USD]")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=8)
    figure.savefig(path)
    plt.close(figure)
    return True
