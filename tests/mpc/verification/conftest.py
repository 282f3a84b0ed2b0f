"""Days of metered energy whose saving is known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest


@pytest.fixture(scope="session")
def make_days(script: Callable[[str], Any]) -> Callable[..., pd.DataFrame]:
    """Make days of metered energy."""
    return script("_metered_days").metered_days  # type: ignore[no-any-return]


@pytest.fixture(scope="session")
def by_hour() -> Callable[..., pd.DataFrame]:
    """Make hours of days, as a table of meters has them, flat over the day."""

    def make(days: pd.DataFrame, **more: Any) -> pd.DataFrame:
        index = pd.date_range(days.index[0], periods=24 * len(days), freq="h") + pd.Timedelta(hours=1)
        columns = {
            "main [kW]": np.repeat(days["power"].to_numpy() / 1e3, 24),
            "outdoor": np.repeat(days["outdoor"].to_numpy() - 273.15, 24),
            "mode": np.repeat(days["acts"].to_numpy(), 24),
        }
        return pd.DataFrame(columns | more, index=index.rename("timestamp"))

    return make
