"""The page that leads to the reports of the main job: each step in a sentence, and what matters in two pictures."""

from collections.abc import Mapping, Sequence

from calibration.evaluation.n_step import Evaluation
from mpc.reports.assumptions import assumption_rows
from mpc.reports.diagnosis_words import called
from mpc.reports.figures import style
from mpc.reports.figures.control import cost_bars
from mpc.reports.figures.style import Picture, panel, picture, styled
from mpc.reports.means_found import demo_means
from mpc.reports.page import percent, render
from mpc.studies.run import Comparison


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
    found = f"with {', '.join(map(called, effects))}" if effects else "nothing was found"
    meanings = ("error six hours ahead, as it was drawn", "calibrated", found)
    cards = [(f"{e.metrics.mae:.2f} K", told) for e, told in zip(errors.values(), meanings, strict=True)]
    mpc, best = comparison.of("mpc"), comparison.best_rule
    if mpc is not None and best is not None:
        saved = "less spent on energy than by the best rule, on one simulated day"
        cards.append((percent(1.0 - mpc.cost / best.cost), saved))
    content = {
        "case": case,
        "fine": fine,
        "cards": cards,
        "verdicts": verdicts,
        "links": links,
        "pictures": {"evaluate": _error_lines(errors), "compare": cost_bars(comparison.runs)},
        "study": comparison.study,
        "means": demo_means(errors, effects, comparison),
        "assumptions": assumption_rows(comparison.study),
    }
    return render("demo", content | {"verdict": f"{verdicts['diagnose']} {verdicts['compare']}"})


@styled
def _error_lines(errors: Mapping[str, Evaluation]) -> list[Picture]:
    """Draw the held-out error of models over the horizon."""
    figure, axes = panel(10.0, 3.2, title="Error on held-out days", xlabel="horizon", ylabel="mean absolute error [K]")
    for (name, found), colour in zip(errors.items(), (style.MUTED, style.MEASURED, style.SIMULATED), strict=True):
        axes.plot(list(found.by_horizon), list(found.by_horizon.values()), color=colour, marker="o", label=name)
        axes.annotate(
            f"{found.metrics.mae:.2f}", ("6h", found.by_horizon["6h"]), (0, 6), textcoords="offset points",
            ha="center", color=style.INK, fontsize=8,
        )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return [picture(figure, "Error of the model on held-out days over the horizon: drawn, calibrated, with effects")]
