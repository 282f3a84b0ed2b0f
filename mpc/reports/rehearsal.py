"""What a rehearsal leaves behind: its words, its page and its files."""

from pathlib import Path

import numpy as np
import pandas as pd

from mpc.live.rehearsal import Rehearsal
from mpc.reports.figures import style
from mpc.reports.figures.style import MUTED, SIMULATED, Picture, picture, styled
from mpc.reports.means import Means
from mpc.reports.page import percent, write_report

#: Share of its cost that a control must save for its saving to be spoken of [-].
_SOME = 0.005


def write_rehearsal(found: Rehearsal, out: str | Path, *, force: bool = False) -> Path:
    """Write ``rehearsal.json``, ``days.parquet`` and ``report.html``.

    Parameters
    ----------
    found : Rehearsal
        From `rehearse`.
    out : str or Path
        Folder, made if need be.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.
    """
    content = {
        "source": found.site, "verdict": rehearsal_verdict(found), "means": _means(found), "rows": day_rows(found),
        "picture": _days_picture(found), "lost": found.lost, "steps": found.steps, "currency": found.currency,
    }  # fmt: skip
    summary = {"sentence": rehearsal_verdict(found), **found.to_dict()}
    return write_report(out, "rehearsal", content, {"rehearsal.json": summary, "days.parquet": found.to_frame()}, force)


def rehearsal_verdict(found: Rehearsal) -> str:
    """Say in plain words what acting would have saved.

    Parameters
    ----------
    found : Rehearsal
        From `rehearse`.
    """
    days = len(found.days)
    over = f"Over the {days} days" if days > 1 else "On this day"
    if np.isnan(found.saving):
        return f"{over} the building's own control would have cost nothing."
    own, acted = (float(found.days[name].sum()) for name in ("own_discomfort", "discomfort"))
    verb = "saved" if found.saving >= 0.0 else "cost"
    share = f"{percent(abs(found.saving))}{'' if found.saving >= 0.0 else ' more'}"
    comfort = f"{acted:.3g} K h outside of the comfort bands in place of {own:.3g}"
    return f"{over} acting would have {verb} {share} of what the building's own control costs, by its model; {comfort}."


def day_rows(found: Rehearsal) -> list[list[str]]:
    """Lay out the days: day, cost of both controls, saving, discomfort of both, what plans had promised.

    Parameters
    ----------
    found : Rehearsal
        From `rehearse`.
    """
    table = found.to_frame()
    shares = {name: [_share(v) for v in table[name].to_numpy(dtype=float)] for name in ("saving", "promised")}
    columns = [
        [f"{day:%a %Y-%m-%d}" for day in pd.DatetimeIndex(table.index)],
        *([f"{v:.2f}" for v in table[name]] for name in ("own_cost", "cost")), shares["saving"],
        *([f"{v:.1f}" for v in table[name]] for name in ("own_discomfort", "discomfort")), shares["promised"],
    ]  # fmt: skip
    return [list(row) for row in zip(*columns, strict=True)]


def _share(value: float) -> str:
    return "–" if np.isnan(value) else percent(value)


def _means(found: Rehearsal) -> Means:
    if np.isnan(found.saving):
        answer = "Nothing can be saved on these days."
    elif abs(found.saving) < _SOME:
        answer = "Acting would have cost as much as the building's own control does."
    else:
        answer = f"Acting would have {'saved' if found.saving > 0.0 else 'added'} {percent(abs(found.saving))}."
    trust = (
        "Both controls were run by the model that plans are made with, with the heat that it was found to lack in "
        "these days. What walls held before the first day on record is a guess, which makes that day less sure; on it "
        "acting also takes what the building's own control had stored."
    )
    following = (
        "Rehearse a week of shadow or more; then act on alternate days, and verify them: buildingmpc verify holds "
        "these days (--rehearsed days.parquet) against what is metered."
    )
    return Means(answer, trust, following)


@styled
def _days_picture(found: Rehearsal) -> Picture:
    figure, axes = style.panel(10.0, 3.4, title="Cost by day, by the model", ylabel=found.currency or "cost")
    place = np.arange(len(found.days))
    axes.bar(place - 0.2, found.days["own_cost"], 0.4, color=MUTED, label="building's own control")
    axes.bar(place + 0.2, found.days["cost"], 0.4, color=SIMULATED, label="optimal control, acting")
    axes.set_xticks(place, [f"{day:%a %d %b}" for day in pd.DatetimeIndex(found.days.index)])
    style.keys_below(figure, 2)
    return picture(figure, "Cost by day with the building's own control and with optimal control")
