"""The paper's randomized shuffling of air within zones, and the two terms of the model that equal its mean."""

from thermal.shuffle.equivalent import (
    choose_equivalent,
    effective_diffusivity,
    exchange_rate,
    mean_square_reach,
    mixing_factor,
    mixing_rate,
)
from thermal.shuffle.errors import ShuffleCellError, ShuffleError, ShuffleParameterError, ShuffleStateError
from thermal.shuffle.random import RandomShuffle
from thermal.shuffle.swaps import apply_swaps

__all__ = [
    "RandomShuffle",
    "ShuffleCellError",
    "ShuffleError",
    "ShuffleParameterError",
    "ShuffleStateError",
    "apply_swaps",
    "choose_equivalent",
    "effective_diffusivity",
    "exchange_rate",
    "mean_square_reach",
    "mixing_factor",
    "mixing_rate",
]
