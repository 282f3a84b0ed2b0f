"""Energy, its cost and discomfort of a run by local day."""

import numpy as np
import pandas as pd

from mpc.kpi.bought import costs_of, fuel_of
from mpc.kpi.record import PlantRecord, excess
from mpc.scenario.rates import KILOWATT_HOUR
from mpc.scenario.scenario import Scenario


def by_day(record: PlantRecord, scenario: Scenario, since: int = 0) -> pd.DataFrame:
    """Add up a run by local day.

    Parameters
    ----------
    record : PlantRecord
        Of the run.
    scenario : Scenario
        That it was run on, from its first step on.
    since : int
        Steps at the beginning that do not count [-].

    Returns
    -------
    DataFrame, shape (n_day, 3)
        Index: local midnights; ``cost`` [currency], ``energy`` bought [kWh], ``discomfort`` of all zones [K h].
    """
    done, step = record.n_steps, scenario.grid.step
    zone, lower, upper = record.zone_temperature, scenario.lower[:done], scenario.upper[:done]
    outside = excess(lower - zone[:-1], lower - zone[1:])[0] + excess(zone[:-1] - upper, zone[1:] - upper)[0]
    table = {
        "cost": np.sum(costs_of(record, scenario), axis=0),
        "energy": (record.electricity + fuel_of(record, scenario).power) * step / KILOWATT_HOUR,
        "discomfort": outside.sum(axis=1) * step / 3600.0,
    }  # fmt: skip
    begins = pd.DatetimeIndex(scenario.grid.stamps[:done]) - pd.Timedelta(seconds=step)
    return pd.DataFrame(table, index=begins).iloc[since:].resample("1D").sum()
