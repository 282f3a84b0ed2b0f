"""How well a closed loop did: BOPTEST's indicators, and the rewards of its steps."""

from mpc.kpi.kpis import PEAK_WINDOW, Kpis, ZoneComfort, measure_kpis
from mpc.kpi.record import PlantRecord
from mpc.kpi.rewards import DISCOMFORT_PRICE, PaperReward, RewardTerms, StageCost

__all__ = [
    "DISCOMFORT_PRICE",
    "PEAK_WINDOW",
    "Kpis",
    "PaperReward",
    "PlantRecord",
    "RewardTerms",
    "StageCost",
    "ZoneComfort",
    "measure_kpis",
]
