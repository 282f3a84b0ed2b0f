"""The closed loop as a Gymnasium environment, and learned policies as controllers (extra ``[rl]``)."""

from mpc.errors import MissingExtraError

try:
    import gymnasium as _gymnasium  # noqa: F401
except ImportError as _error:
    raise MissingExtraError(
        'learning environments need gymnasium, which the extra brings: pip install "buildingmpc[rl]"'
    ) from _error

from mpc.environment.actions import SUPPLY_SETPOINTS, ActionLayout
from mpc.environment.environment import ControlEnvironment, ScenarioPlant
from mpc.environment.features import LARGEST, OBSERVED_RANGES, Feature
from mpc.environment.observation import HISTOGRAM_EDGES, ObservationLayout
from mpc.environment.outlook import BLOCK_ENDS, CLOCK_FEATURES, Outlook, clock
from mpc.environment.policy import Activation, ActorNetwork, PolicyController
from mpc.environment.registration import ENVIRONMENT_ID, office_environment, register
from mpc.environment.reward import REWARDS, EconomicReward, PaperStepReward, Reward

register()

__all__ = [
    "BLOCK_ENDS",
    "CLOCK_FEATURES",
    "ENVIRONMENT_ID",
    "HISTOGRAM_EDGES",
    "LARGEST",
    "OBSERVED_RANGES",
    "REWARDS",
    "SUPPLY_SETPOINTS",
    "ActionLayout",
    "Activation",
    "ActorNetwork",
    "ControlEnvironment",
    "EconomicReward",
    "Feature",
    "ObservationLayout",
    "Outlook",
    "PaperStepReward",
    "PolicyController",
    "Reward",
    "ScenarioPlant",
    "clock",
    "office_environment",
    "register",
]
