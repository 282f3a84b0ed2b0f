"""What many calibrations or diagnoses leave behind: one row a building as a table, and a page that links to each."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.fleet.outcome import CaseOutcome
from calibration.results import Content
from mpc.reports.diagnosis_words import called
from mpc.reports.display import write_results
from mpc.reports.figures.style import MUTED, SIMULATED, Picture, keys_below, panel, picture, styled
from mpc.reports.means import Means
from mpc.reports.page import counted, kelvin, listed, render

#: Buildings that are drawn, those with the largest errors.
_DRAWN = 40

#: What errors are of: before and after.
_MODELS = {
    "calibrate": ("model as drawn", "calibrated model"),
    "diagnose": ("calibrated model", "model with what was found"),
}

#: Entries of an outcome with its errors.
_ERRORS = ("held_out_mae_before", "held_out_mae_after")



def write_fleet(outcomes: Sequence[CaseOutcome], out: str | Path, what: str, horizon: str) -> Path:
    """Write ``fleet.parquet`` and ``report.html`` beside the folders of the cases.

    Parameters
    ----------
    outcomes : sequence of CaseOutcome
        Of `calibrate_many` or `diagnose_many`.
    out : str or Path
        Folder of the results.
    what : {"calibrate", "diagnose"}
        What was done.
    horizon : str
        Of the errors.

    Returns
    -------
    Path
        The page.
    """
    page = render("fleet", _content(outcomes, what, horizon))
    files: dict[str, Content] = {"fleet.parquet": fleet_table(outcomes), "report.html": page}
    return write_results(out, files, force=True) / "report.html"


def fleet_table(outcomes: Sequence[CaseOutcome]) -> pd.DataFrame:
    """Contents of ``fleet.parquet``: one row a case.

    Parameters
    ----------
    outcomes : sequence of CaseOutcome
        Of all cases.

    Returns
    -------
    DataFrame, shape (n_case, 9)
        Index ``case``; errors [K], time [s], effects between commas.
    """
    rows = [
        {
            "case": o.case, "status": o.status, "held_out_mae_before": o.held_out_mae_before,
            "held_out_mae_after": o.held_out_mae_after, "seconds": o.seconds, "verdict": o.verdict,
            "effects": ",".join(o.effects), "has_windows": o.has_windows, "error": o.error, "message": o.message,
        }
        for o in outcomes
    ]  # fmt: skip
    kinds: dict[Any, Any] = dict.fromkeys(("held_out_mae_before", "held_out_mae_after", "seconds"), float)
    kinds["has_windows"] = "boolean"
    texts = dict.fromkeys(("case", "status", "verdict", "effects", "error", "message"), "string")
    table = pd.DataFrame(rows).astype({**kinds, **texts}).set_index("case")
    table.attrs["units"] = {"held_out_mae_before": "K", "held_out_mae_after": "K", "seconds": "s"}
    return table


def fleet_verdict(outcomes: Sequence[CaseOutcome], what: str, horizon: str) -> str:
    """Say in plain words how many buildings were done, and how the error falls.

    Parameters
    ----------
    outcomes : sequence of CaseOutcome
        Of all cases.
    what : {"calibrate", "diagnose"}
        What was done.
    horizon : str
        Of the errors.
    """
    done = _done(outcomes)
    text = f"{len(done)} of {counted(len(outcomes), 'building')} {'has' if len(done) == 1 else 'have'} a model."
    if not done:
        return text
    before, after = (float(np.median([getattr(o, name) for o in done])) for name in _ERRORS)
    first, last = _MODELS[what]
    text += f" In the median building the {first} misses zone temperatures {horizon} ahead by {kelvin(before)} K, the "
    text += f"{last} by {kelvin(after)} K, on days that it was not fitted to."
    found = Counter(e for o in done if o.verdict in ("named", "group") for e in o.effects)
    if found:
        told = [f"{called(effect)} ({counted(number, 'building')})" for effect, number in found.most_common()]
        text += f" Found: {listed(told)}."
    return text


def _done(outcomes: Sequence[CaseOutcome]) -> list[CaseOutcome]:
    """Choose the buildings with errors before and after."""
    return [o for o in outcomes if None not in (o.held_out_mae_before, o.held_out_mae_after)]


def _means(outcomes: Sequence[CaseOutcome], what: str) -> Means:
    done, failed = _done(outcomes), [o for o in outcomes if o.error is not None]
    blind = [o.case for o in done if o.has_windows is False]
    unsure = [o.case for o in done if o.status == "not_converged"]
    answer = f"{len(done)} of {counted(len(outcomes), 'building')} {'has' if len(done) == 1 else 'have'} a model."
    if done:
        after = [float(o.held_out_mae_after or 0.0) for o in done]
        answer += f" Their errors on days they had not seen are {kelvin(min(after))} to {kelvin(max(after))} degrees C."
    if what == "diagnose" and done:
        named, unknown = (sum(o.verdict in kinds for o in done) for kinds in (("named", "group"), ("unexplained",)))
        sound = len(done) - named - unknown
        answer += f" In {named} what is missing has a name, in {unknown} it is unknown, in {sound} nothing is missing "
        answer += "that these data can show."
    trust = "Each building's page says how far its model can be trusted, and against which simple forecasts."
    if unsure:
        trust += f" Not {listed(unsure, 'nor')}: the solver stopped early."
    if blind:
        trust += f" Without windows, and so without the sun: {listed(blind)}."
    if failed:
        then = f"Put right what the table says of {listed(o.case for o in failed)}, and run the same command again: "
        return Means(answer, trust, then + "what is done is kept.")
    if blind:
        return Means(answer, trust, f"Give {listed(blind)} windows, and run it again.")
    further = "look for what the models lack: buildingmpc diagnose, on the same folder." if what == "calibrate" else (
        "where several buildings lack the same, look there first.")  # fmt: skip
    return Means(answer, trust, f"Open the pages of the buildings with the largest errors; then {further}")


def _content(outcomes: Sequence[CaseOutcome], what: str, horizon: str) -> dict[str, Any]:
    order = sorted(outcomes, key=lambda o: -(o.held_out_mae_after or np.inf))
    return {
        "title": f"{counted(len(outcomes), 'building')} {'calibrated' if what == 'calibrate' else 'diagnosed'}",
        "subtitle": "One row a building; the largest error first", "what": what, "horizon": horizon,
        "verdict": fleet_verdict(outcomes, what, horizon), "means": _means(outcomes, what),
        "fine": all(o.error is None for o in outcomes), "models": _MODELS[what],
        "rows": [(o, o.error or o.status.replace("_", " "), ", ".join(map(called, o.effects))) for o in order],
        "failed": [(o.case, o.message or o.error) for o in outcomes if o.error is not None],
        "pictures": _bars([o for o in order if o in _done(outcomes)], what, horizon),
    }  # fmt: skip


@styled
def _bars(outcomes: Sequence[CaseOutcome], what: str, horizon: str) -> list[Picture]:
    """Draw the errors of each building, before and after."""
    shown = outcomes[:_DRAWN]
    if not shown:
        return []
    figure, axes = panel(8.0, 1.2 + 0.34 * len(shown), xlabel=f"mean absolute error {horizon} ahead, held out [K]")
    place = np.arange(len(shown))
    for shift, name, colour, label in zip((-0.2, 0.2), _ERRORS, (MUTED, SIMULATED), _MODELS[what], strict=True):
        axes.barh(place + shift, [getattr(o, name) for o in shown], height=0.36, color=colour, label=label)
    axes.set_yticks(place, [o.case for o in shown])
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    keys_below(figure, 2)
    return [picture(figure, "Errors of each building before and after")]
