"""Where the gap lies, as the page shows it: plans, zones, parts of the building and of the day."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pandas as pd

from calibration.diagnosis.decide.drift import drift_sentence
from calibration.diagnosis.decide.where import Share
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.refit.final import Replay
from calibration.diagnosis.screen.missing import Missing
from mpc.reports import figures
from mpc.reports.page import watts
from thermal.case.building import FloorPlans
from thermal.case.case import Case

#: Rows of a table of zones, and of parts of the day and the building.
_MOST_ZONES, _MOST_PARTS = 24, 10

#: Zones whose missing heat is drawn over time.
_MOST_DRAWN = 4

#: Missing heat that the darkest colour of a plan stands for at least [W/m2]: people, light and equipment of an office
#: give about 10, and a few tenths are not to look alarming.
_NOTABLE = 3.0


def where_content(result: Diagnosis, case: Case, before: Replay, after: Replay | None, found: str) -> dict[str, Any]:
    """Entries of the page: ``sentence``, ``maps``, ``missing``, ``zones``, ``parts``, ``hours`` and ``drift``.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    case : Case
        For the plans.
    before : Replay
        Of the baseline.
    after : Replay or None
        Of the final model.
    found : str
        What the final model is called.
    """
    where, geometry = result.where, case.building.geometry
    zones = list(before.missing.watts.columns)
    sizes = [r.missing.rms for r in (before, after) if r is not None]
    maps: list[figures.Picture] = []
    if isinstance(geometry, FloorPlans):
        top = max(float(np.nanmax(sizes[0], initial=1.0)), _NOTABLE * _typical_area(geometry))
        for heat, title in zip(sizes, ("calibrated model", found), strict=False):
            maps += figures.heat_maps(geometry, case.building.orientation, zones, heat, title, top)
    shares = {s.name: s for s in where.zones}
    means = before.missing.watts.mean()
    untouched = where.missing_at_start.rms
    worst = sorted(range(len(zones)), key=lambda i: -shares[zones[i]].share)
    rows = [
        {
            "zone": zones[i],
            "share": f"{shares[zones[i]].share:.0%}".replace("%", " %"),
            "width": f"{100 * shares[zones[i]].share:.1f}",
            "mean": _signed_watts(float(means.iloc[i])),
            "sizes": [watts(float(s[i])) for s in (untouched, *sizes)],
        }
        for i in worst[:_MOST_ZONES]
    ]
    curves = {"calibrated": (before.drift.seconds, before.drift.rms)}
    if after is not None:
        curves[found] = (after.drift.seconds, after.drift.rms)
    parts = [p for p in (*where.groups, *where.modes.values()) if p.share > p.predictions > 0.0]
    parts = sorted(parts, key=lambda p: p.predictions - p.share)[:_MOST_PARTS]
    return {
        "sentence": re.sub(r"(?<=\d)%", " %", where.sentence),
        "maps": maps,
        "missing": _courses(result, after, found),
        "zones": rows,
        "zone_count": len(zones),
        "parts": [_part(p) for p in parts],
        "hours": figures.hour_bars(where.hours),
        "drift_sentence": drift_sentence(before.drift, after.drift if after else None, found),
        "drift": figures.drift_lines(curves),
    }


def _part(p: Share) -> dict[str, str]:
    before = {"the": "in ", "flo": "on ", "in ": "", "wit": ""}.get(p.name[:3], "when ")
    return {
        "name": f"{before}{p.name}",
        "share": f"{100 * p.share:.0f} %",
        "width": f"{100 * p.share:.1f}",
        "predictions": f"{100 * p.predictions:.0f} %",
        "mark": f"{100 * p.predictions:.1f}",
        "interval": f"{100 * p.interval[0]:.0f} to {100 * p.interval[1]:.0f} %",
    }


def _typical_area(plans: FloorPlans) -> float:
    """Median floor area of the zones of a plan [m2]."""
    cells = [np.count_nonzero(floor.tokens == zone) for floor in plans.floors for zone in floor.zone_names]
    return float(np.median(cells)) * plans.cell_size**2


def _courses(result: Diagnosis, after: Replay | None, found: str) -> list[figures.Picture]:
    """Draw the zones in which the calibrated model lacks the most heat."""
    where = result.where
    models = {"uncalibrated": where.missing_at_start, "calibrated": where.missing}
    if after is not None:
        models[found] = after.missing
    known = {zone: size for zone, size in where.missing_watts.items() if size > 0.0}
    worst = sorted(known, key=lambda zone: -known[zone])[:_MOST_DRAWN]
    zones = {zone: {name: _course(m, zone) for name, m in models.items()} for zone in worst}
    return figures.missing_lines(zones, pd.DatetimeIndex(where.missing.watts.index)) if zones else []


def _course(missing: Missing, zone: str) -> figures.Course:
    low, high = missing.band(0.9)
    return figures.Course(*(table[zone].to_numpy() for table in (missing.watts, low, high)))


def _signed_watts(value: float) -> str:
    return ("+" if value > 0 else "") + watts(value) if np.isfinite(value) else "not known"
