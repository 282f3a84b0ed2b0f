"""What is left of the errors, does it come back? Heat by weather and clock, fitted on some days and judged on others.

A model's errors hold what it lacks and what nobody could know: people who come and go, doors. What it lacks answers to
something: the sun, the wind, the hour. Such heat is fitted to the errors of three quarters of the tuning days, the
model's own parameters following, and must lower the errors of the quarter that is left, for each quarter in turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.screen.gains import MATTERS
from calibration.diagnosis.screen.unknown_heat import DailyErrors, daily_errors
from calibration.results import Plain
from thermal._types import BoolArray, FloatArray, IntArray
from thermal.effects.unknown import ANSWERS_TO

#: Parts of the tuning days, each left out once.
_PARTS = 4

#: Standard errors over days that the best of eight choices of heat must reach [-]: 5 % over all of them.
_SURE = 2.5

#: Sizes that such heat may have over what is plausible [-]: the one that predicts best counts.
_TIGHTNESS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)

#: Heat that is looked for.
_KINDS = (
    "heat_always", "heat_by_hour", "heat_at_weekends", "heat_by_cold", "heat_by_sun", "heat_by_wind", "heat_by_sky",
)  # fmt: skip


@dataclass(frozen=True)
class Regular(Plain):
    """How much of the errors comes back on days that nothing was fitted to.

    Parameters
    ----------
    fall : float
        How far heat of the kind that does so most, or of all kinds, lowers the root mean square of their errors [K].
    sure : float
        Its standard errors over days [-].
    explains : float
        Mean squared error that it takes away [K²].
    shares : mapping of str to float
        Share of the squared error that heat of one kind takes away, by kind [-].
    """

    fall: float
    sure: float
    explains: float
    shares: dict[str, float]

    @property
    def counts(self) -> bool:
        """Whether it is beyond chance, as the best of several, and large enough to matter to a prediction."""
        return self.matters and self.sure > _SURE

    @property
    def matters(self) -> bool:
        """Whether it is large enough to matter to a prediction, by chance or not."""
        return self.fall > MATTERS


def regular(models: ModelComparison, fit: Fit) -> Regular:
    """Judge what is left of the errors of a fitted model.

    Parameters
    ----------
    models : ModelComparison
        The case.
    fit : Fit
        The model.
    """
    table = daily_errors(models, fit.effects, fit.values, kinds=_KINDS)
    own = table.own
    found = {kind: _left_out(table, table.of(kind)) for kind in table.kinds}
    shares = {
        ANSWERS_TO[kind]: max(0.0, float(gained.sum())) / float(before.sum())
        for kind, (before, gained) in found.items()
    }
    before, gained = max((*found.values(), _left_out(table, ~own)), key=lambda f: float(f[1].sum()))
    size, explains = (max(0.0, float(part.sum())) / float(table.size.sum()) for part in (before, gained))
    spread = float(gained.std(ddof=1) / np.sqrt(gained.size)) if gained.size > 1 else np.inf
    fall = float(np.sqrt(size) - np.sqrt(size - explains))
    return Regular(fall, float(gained.mean()) / max(spread, 1e-300), explains, shares)


def _left_out(table: DailyErrors, heat: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Squared error of each day that is left out, and how far heat of the best size lowers it [K²]."""
    days = table.days.size
    part = np.arange(days) * min(_PARTS, days) // days
    scale = table.count / float(table.squared.sum())
    own, both = np.flatnonzero(table.own), np.concatenate([np.flatnonzero(table.own), np.flatnonzero(heat)])
    precision = np.array([table.parameters[i].prior_deviation for i in both]) ** -2.0
    units = np.eye(len(table.parameters))

    def errors(some: IntArray, fitted: BoolArray, held: FloatArray) -> FloatArray:
        return table.after(units[:, some] @ table.solve(fitted, units[:, some], held, scale))

    before, after = np.zeros(days), np.zeros((len(_TIGHTNESS), days))
    for p in range(part.max() + 1):
        out = part == p
        before[out] = errors(own, ~out, precision[: own.size])[out]
        for k, tightness in enumerate(_TIGHTNESS):
            held = np.concatenate([precision[: own.size], precision[own.size :] / tightness**2])
            after[k, out] = errors(both, ~out, held)[out]
    gained = before - after
    return before, gained[int(np.argmax(gained.sum(axis=1)))]
