"""The page that leads to the reports of the main job: each step in a sentence, and what matters in two pictures."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

from matplotlib.figure import Figure

from calibration.evaluation.n_step import Evaluation
from mpc.reports.diagnosis_words import called
from mpc.reports.figures.control import cost_bars
from mpc.reports.figures.style import INK, MEASURED, MUTED, SIMULATED, Picture, picture, styled
from mpc.reports.page import clock, render
from mpc.studies.compare import Comparison

#: What each step is, in the order in which they are done.
_STEPS = {
    "check": ("Check", "What the case holds, and how good its telemetry is."),
    "calibrate": (
        "Calibrate",
        "Parameters of the building from two thirds of its telemetry, judged on the rest.",
    ),
    "diagnose": ("Diagnose", "Where the calibrated model is still wrong, and which effect it lacks."),
    "evaluate": ("Evaluate", "The model with what was found, on days that it was not fitted to."),
    "compare": ("Control", "Rules and optimal control on this building for one day, on the same weather and people."),
}


def render_demo(
    case: str,
    verdicts: Mapping[str, str],
    links: Mapping[str, str],
    errors: Mapping[str, Evaluation],
    effects: Sequence[str],
    comparison: Comparison,
    fine: bool,
) -> str:
    """Fill the page that leads to the reports.

    Parameters
    ----------
    case : str
        Name of the case.
    verdicts, links : mapping of str to str
        What each step found, and where its report lies, by step.
    errors : mapping of str to Evaluation
        On held-out days, by name of the model, the first before calibration, the last with all that was found.
    effects : sequence of str
        That the diagnosis put into the model.
    comparison : Comparison
        Of controllers.
    fine : bool
        Whether every step ended well.

    Returns
    -------
    str
        HTML.
    """
    first, *_, last = errors.values()
    calibrated = list(errors.values())[1]
    mpc, best = comparison.of("mpc"), comparison.best_rule
    cards = [
        (f"{first.metrics.mae:.2f} K", "error six hours ahead, as it was drawn"),
        (f"{calibrated.metrics.mae:.2f} K", "calibrated"),
        (f"{last.metrics.mae:.2f} K", f"with {', '.join(map(called, effects))}" if effects else "nothing was found"),
    ]
    if mpc is not None and best is not None:
        cards.append(
            (f"{1.0 - mpc.cost / best.cost:.0%}".replace("-", "−"), "less spent on energy than by the best rule")
        )
    study = comparison.study
    steps: list[dict[str, Any]] = [
        {"title": title, "what": what, "verdict": verdicts[step], "link": links[step], "pictures": []}
        for step, (title, what) in _STEPS.items()
    ]
    steps[3]["pictures"] = _error_lines(errors)
    steps[4]["pictures"] = cost_bars(comparison.runs)
    content = {
        "case": case, "fine": fine, "cards": cards, "steps": steps,
        "verdict": f"{verdicts['diagnose']} {verdicts['compare']}",
        "subtitle": f"Controlled on a simulated plant, {clock(study.scenario.grid.start)} to {clock(study.stamps[-1])}",
        "reproduce": [
            ("version", f"buildingmpc {version('buildingmpc')}, Python {platform.python_version()}"),
            ("seed", str(study.settings.seed)),
        ],
    }  # fmt: skip
    return render("demo", content)


@styled
def _error_lines(errors: Mapping[str, Evaluation]) -> list[Picture]:
    """Draw the held-out error of models over the horizon."""
    figure = Figure(figsize=(10.0, 3.2))
    axes = figure.subplots()
    for (name, found), colour in zip(errors.items(), (MUTED, MEASURED, SIMULATED), strict=True):
        labels = list(found.by_horizon)
        axes.plot(labels, list(found.by_horizon.values()), color=colour, marker="o", label=name)
        axes.annotate(
            f"{found.metrics.mae:.2f}", ("6h", found.by_horizon["6h"]), (0, 6), textcoords="offset points",
            ha="center", color=INK, fontsize=8,
        )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("horizon")
    axes.set_ylabel("mean absolute error [K]")
    axes.set_title("Error on held-out days")
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return [picture(figure, "Error of the model on held-out days over the horizon: drawn, calibrated, with effects")]
