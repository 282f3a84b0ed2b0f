"""Savings by alternate days or weeks: the new control acts in some and the building's own in the others."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.errors import VerificationError
from mpc.verification.baseline import BaselineModel, Fitness, fit_baseline, judge_baseline
from mpc.verification.inference import Estimate, coefficient_parts, sum_error
from thermal._types import FloatArray

#: Fewest days of each control [d].
FEWEST_EACH = 7

#: Shuffles of a permutation test.
_SHUFFLES = 999

#: Share of the variance of "acted yesterday" that the other columns must leave for its effect to be told [-]: below it
#: an interval is more than twice as wide as that of days in random order.
_TOLD = 0.2


@dataclass(frozen=True, eq=False)
class Switchback:
    """What alternate days say.

    Parameters
    ----------
    model : BaselineModel
        With the effect of the control among its columns.
    fitness : Fitness
        Of the model.
    saving : Estimate
        Mean power saved by permanent use, over the weather of all days [W].
    direct : Estimate
        The same without what the day before leaves behind [W].
    carried : Estimate or None
        Power saved on a day because the new control acted the day before [W]; None where days do not tell.
    own_power : float
        Mean power with the building's own control, over all days [W].
    p_value : float
        Of a permutation test of no saving at all: control shuffled over its runs of days [-].
    days : DataFrame, shape (n_day, n_column)
        That count: ``power``, ``baseline`` (own control) [W], ``outdoor`` [K], ``acts``.
    """

    model: BaselineModel
    fitness: Fitness
    saving: Estimate
    direct: Estimate
    carried: Estimate | None
    own_power: float
    p_value: float
    days: pd.DataFrame

    @property
    def share(self) -> Estimate:
        """Saving as a share of the energy with the building's own control [-]."""
        return self.saving.scaled(1.0 / self.own_power)

    def days_needed(self, confidence: float) -> int:
        """Days after which the interval's half would be half of the saving, if all goes on as it is.

        Parameters
        ----------
        confidence : float
            Level of the interval [-].
        """
        half = self.saving.half_width(confidence)
        if self.saving.value == 0.0:
            return 0
        return int(np.ceil(len(self.days) * min(1e3, (half / (0.5 * abs(self.saving.value))) ** 2)))


def switchback(days: pd.DataFrame, extra: tuple[str, ...] = (), seed: int = 0) -> Switchback:
    """Estimate a saving from days with the new control among days with the building's own.

    Parameters
    ----------
    days : DataFrame
        Every day of the span, as `Metered.days` has them; those with missing values do not count.
    extra : tuple of str
        Further columns that the energy is linear in, such as ``occupancy``.
    seed : int
        Of the permutation test.

    Returns
    -------
    Switchback
        Saving with its standard error.

    Raises
    ------
    VerificationError
        A control has too few days.

    Notes
    -----
    ``E_d = change-point model + s A_d + c A_(d-1)`` with ``A`` 1 where the new control acts. Permanent use saves
    ``-(s + c)``. Where days strictly alternate, ``A_(d-1)`` follows from ``A_d``: then only ``-(s - c)`` can be told
    and ``carried`` is None. The carried part is always in the model where it can be told; to test it first and drop it
    would make intervals too short (Freeman, Statistics in Medicine 8, 1989, 1421-1432).
    """
    table = days.assign(before=days["acts"].shift(1))
    table = table.dropna(subset=["power", "outdoor", "acts", "before", *extra])
    counts = [int((table["acts"] == mode).sum()) for mode in (0.0, 1.0)]
    few = f"at least {FEWEST_EACH} whole days of each control, each after a whole day"
    VerificationError.unless(min(counts) >= FEWEST_EACH, "alternate days", few, f"{counts[0]} and {counts[1]}")
    direct_model = fit_baseline(table, extra=("acts", *extra))
    told = _told(direct_model.design(table), table["before"].to_numpy())
    columns = ("acts", "before", *extra) if told else ("acts", *extra)
    model = fit_baseline(table, extra=columns) if told else direct_model
    fitness = judge_baseline(model, table, columns)
    wanted = ("acts", "before") if told else ("acts",)
    saving = _effect(model, table, wanted)
    counterfactual = model.predict(table.assign(acts=0.0, before=0.0))
    found = table[["power", "outdoor", "acts"]].assign(baseline=counterfactual).rename_axis("timestamp")
    return Switchback(
        model, fitness, saving, _effect(model, table, ("acts",)),
        _effect(model, table, ("before",)) if told else None, float(counterfactual.mean()),
        _permuted(direct_model, table, seed), found,
    )  # fmt: skip


def _told(design: FloatArray, before: FloatArray) -> bool:
    """Whether the effect of yesterday's control can be told from that of today's."""
    left = before - design @ np.linalg.lstsq(design, before, rcond=None)[0]
    return float(left @ left) > _TOLD * float(np.sum((before - before.mean()) ** 2))


def _effect(model: BaselineModel, table: pd.DataFrame, wanted: tuple[str, ...]) -> Estimate:
    """Power saved by the sum of some columns [W]."""
    contrast = -np.array([float(name in wanted) for name in model.names])
    towards = np.concatenate([contrast, np.zeros(len(model.change_points))])
    residual = table["power"].to_numpy() - model.predict(table)
    error, freedom = sum_error(coefficient_parts(model.gradient(table), residual, towards))
    return Estimate(float(contrast @ model.coefficients), error, freedom)


def runs_of(acts: FloatArray) -> FloatArray:
    """Give each day the number of its run of equal days, shape (n_day,).

    Parameters
    ----------
    acts : ndarray, shape (n_day,)
        0 or 1 [-].
    """
    return np.concatenate([[0], np.cumsum(np.diff(acts) != 0.0)])


def _permuted(model: BaselineModel, table: pd.DataFrame, seed: int) -> float:
    """Permutation test: control is dealt out anew to its runs of days, the rest of the model as it is."""
    rng = np.random.default_rng(seed)
    at = model.names.index("acts")
    design = np.delete(model.design(table), at, axis=1)
    basis = np.linalg.qr(design)[0]

    def left(values: FloatArray) -> FloatArray:
        return values - basis @ (basis.T @ values)

    acts, power = table["acts"].to_numpy(), left(table["power"].to_numpy())
    runs = runs_of(acts).astype(int)
    lengths = np.bincount(runs)
    of_run = np.zeros(len(lengths))
    of_run[runs] = acts

    def statistic(labels: FloatArray) -> float:
        free = left(labels)
        size = float(np.sqrt(free @ free))
        return abs(float(free @ power)) / size if size > 1e-9 else 0.0

    seen = statistic(acts)
    dealt = [statistic(np.repeat(rng.permutation(of_run), lengths)) for _ in range(_SHUFFLES)]
    return (1.0 + sum(value >= seen * (1.0 - 1e-12) for value in dealt)) / (1.0 + _SHUFFLES)
