"""Days of metered energy whose saving is known."""

from __future__ import annotations

import numpy as np
import pandas as pd

MEAN = 35e3  # W, that savings are shares of


def pattern(kind: str, n: int, rng: np.random.Generator) -> np.ndarray:
    """Days on which the new control acts."""
    runs = {"alternate": 1, "pairs": 2, "weeks": 7}
    if kind in runs:
        return np.arange(n) // runs[kind] % 2 * 1.0
    return rng.permutation(np.arange(n) % 2 * 1.0)


def metered_days(
    seed: int, acts: str | np.ndarray, n: int = 42, saving: float = 0.1, carry: float = 0.0, rho: float = 0.5
) -> pd.DataFrame:
    """Heating below 15 degC, weekends, and noise of 8 % that remembers the day before; savings are shares of `MEAN`."""
    rng = np.random.default_rng(seed)
    index = pd.date_range("2026-01-05", periods=n, tz="Etc/GMT-1")
    shocks = rng.normal(size=(2, n))
    memory = np.tril(0.8 ** np.subtract.outer(np.arange(n), np.arange(n)).clip(0))
    outdoor = 278.0 + 2.4 * memory @ shocks[0]
    noise = np.tril(rho ** np.subtract.outer(np.arange(n), np.arange(n)).clip(0)) @ shocks[1] * np.sqrt(1.0 - rho**2)
    new = pattern(acts, n, rng) if isinstance(acts, str) else acts
    before = np.concatenate([new[:1], new[:-1]])
    weekend = (index.day_of_week >= 5).astype(float)
    power = 20e3 + 1500.0 * np.maximum(288.15 - outdoor, 0.0) - 6000.0 * weekend
    power = power - MEAN * (saving * new + carry * before) + 0.08 * MEAN * noise
    return pd.DataFrame({"power": power, "outdoor": outdoor, "weekend": weekend, "acts": new}, index=index)
