"""What a verification leaves behind: its words, its page and its files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpc.reports.figures.verification import saving_pictures, share_picture
from mpc.reports.means import Means
from mpc.reports.page import counted, listed, percent, significant, write_report
from mpc.verification.inference import Estimate
from mpc.verification.switchback import Switchback
from mpc.verification.validity import AT_CONFIDENCE, Check
from mpc.verification.verify import Saving, Verification

#: Joules of a kilowatt hour.
_KWH = 3.6e6

_PASSED: Mapping[bool | None, str] = {True: "passed", False: "in doubt", None: "not known"}


def write_verification(found: Verification, out: str | Path, *, force: bool = False) -> Path:
    """Write ``verification.json``, ``days.parquet`` and ``report.html``.

    Parameters
    ----------
    found : Verification
        From `verify`.
    out : str or Path
        Folder, made if need be.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.
    """
    level = found.settings.confidence
    content = {
        "source": found.source, "verdict": verification_verdict(found), "means": verification_means(found),
        "level": percent(level),
        "rows": saving_rows(found), "picture": share_picture(found),
        "designs": [{"saving": s, "pictures": saving_pictures(s), "model": model_rows(s),
                     "checks": check_rows(s.checks)} for s in found.savings],
        "compared": comparison_sentence(found),
    }  # fmt: skip
    files = {"verification.json": verification_summary(found), "days.parquet": found.days()}
    return write_report(out, "verification", content, files, force)


def verification_summary(found: Verification) -> dict[str, Any]:
    """Contents of ``verification.json``.

    Parameters
    ----------
    found : Verification
        From `verify`.
    """
    return {"sentence": verification_verdict(found), **found.to_dict()}


def verification_verdict(found: Verification) -> str:
    """Say in plain words what was saved.

    Parameters
    ----------
    found : Verification
        From `verify`.
    """
    told = []
    for saving in found.savings:
        low, high = saving.share.interval(found.settings.confidence)
        words = f"{100 * found.settings.confidence:.0f} % interval {percent(low)} to {percent(high)}"
        told.append(f"{saving.design}: {percent(saving.share.value)} ({words})")
    doubts = sorted({c.name for s in found.savings for c in s.doubts})
    text = f"Energy saved, {'; '.join(told)}."
    return f"{text} In doubt: {listed(doubts)}." if doubts else text


def comparison_sentence(found: Verification) -> str:
    """Hold what shadow operation expected against what was realised; empty where it said nothing.

    Parameters
    ----------
    found : Verification
        From `verify`.
    """
    if found.predicted is None or found.shortfall is None:
        return ""
    low, high = found.shortfall.interval(found.settings.confidence)
    differs = low > 0.0 or high < 0.0
    points = (
        f"{100.0 * found.shortfall.value:+.1f} points (interval {100.0 * low:+.1f} to {100.0 * high:+.1f})".replace(
            "-", "−"
        )
    )
    end = "the two differ" if differs else "within what chance can do"
    return f"Shadow operation expected {percent(found.predicted.value)}; realised less expected is {points}: {end}."


def verification_means(found: Verification) -> Means:
    """Say what a verification means.

    Parameters
    ----------
    found : Verification
        From `verify`.
    """
    last = found.savings[-1]
    low, high = last.share.interval(found.settings.confidence)
    if low > 0.0:
        saved, least = (f"{100 * share:.2g} %" for share in (last.share.value, low))
        answer = f"The new control saves {saved} of the energy, and {least} at the least."
    elif high < 0.0:
        answer = f"The new control takes {percent(-last.share.value)} more energy than the building's own."
    else:
        answer = "These days do not show whether the new control saves energy."
    doubts = last.doubts
    trust = f"Of {counted(len(last.checks), 'check')} {len(doubts) or 'none'} failed"
    trust += f": {listed(c.name for c in doubts)}." if doubts else "."
    unknown = [c.name for c in last.checks if c.passed is None]
    trust += f" Not known: {listed(unknown)}." if unknown else ""
    advice = next((c.advice for c in doubts if c.advice), "")
    then = f"{advice[:1].upper()}{advice[1:]}." if advice else "Go on, and verify again with each season."
    return Means(answer, trust, then)


def saving_rows(found: Verification) -> list[list[str]]:
    """Rows of the table of savings: design, days, share, interval, energy a day, test.

    Parameters
    ----------
    found : Verification
        From `verify`.
    """
    level, rows = found.settings.confidence, []
    for s in found.savings:
        by_chance = s.found.p_value if isinstance(s.found, Switchback) else s.share.p_value
        rows.append(
            [
                s.design,
                str(len(s.found.days)),
                *_spelt(s.share, level),
                _energy(s.daily_energy, level),
                _chance(by_chance),
            ]
        )
    if found.predicted is not None:
        rows.append(["expected in shadow", "–", *_spelt(found.predicted, level), "–", "–"])
    return rows


def _spelt(share: Estimate, level: float) -> tuple[str, str]:
    low, high = share.interval(level)
    return f"{100.0 * share.value:.1f} %".replace("-", "−"), f"{100.0 * low:.1f} to {100.0 * high:.1f} %".replace(
        "-", "−"
    )


def _energy(daily: Estimate, level: float) -> str:
    return f"{significant(daily.value / _KWH)} ± {significant(daily.half_width(level) / _KWH, 2)}"


def _chance(p: float) -> str:
    return "under 0.01" if p < 0.01 else f"{p:.2f}"


def model_rows(saving: Saving) -> list[list[str]]:
    """Rows that say how well the model of a saving describes its days.

    Parameters
    ----------
    saving : Saving
        By one design.
    """
    fit, model = saving.fitness, saving.found.model
    points = [f"{name} {'below' if name == 'heating' else 'above'} {value - 273.15:.1f} °C"
              for name, value in model.change_points.items()]  # fmt: skip
    rows = [
        ["model", f"{model.form}{': ' + ', '.join(points) if points else ''}"],
        ["days, parameters", f"{fit.days}, {fit.parameters}"],
        ["CV(RMSE), NMBE", f"{100 * fit.cv_rmse:.1f} %, {100 * fit.nmbe:+.2f} %"],
        ["the same on days held out", f"{100 * fit.held_out_cv_rmse:.1f} %, up to {100 * fit.held_out_nmbe:+.1f} %"],
        ["share of the variance", f"{100 * fit.r_squared:.0f} %"],
        ["correlation of residuals from day to day", f"{fit.autocorrelation:.2f}"],
    ]
    if isinstance(saving.found, Switchback):
        carried = saving.found.carried
        told = (
            "cannot be told: days strictly alternate"
            if carried is None
            else f"{significant(carried.value)} W, p {_chance(carried.p_value)}"
        )
        rows.append(["saved on the day after", told])
    else:
        rows.append(
            [
                f"fractional savings uncertainty, {100 * AT_CONFIDENCE:.0f} %",
                f"{100 * min(9.99, saving.found.fractional_uncertainty(AT_CONFIDENCE)):.0f} %",
            ]
        )
    return [[name, text.replace("-", "−")] for name, text in rows]


def check_rows(checks: tuple[Check, ...]) -> list[list[str]]:
    """Rows of the table of checks.

    Parameters
    ----------
    checks : tuple of Check
        Of a saving.
    """
    return [
        [
            c.name,
            _PASSED[c.passed],
            c.sentence.replace("-", "−") if c.name == "service" else c.sentence,
            c.advice or "–",
        ]
        for c in checks
    ]
