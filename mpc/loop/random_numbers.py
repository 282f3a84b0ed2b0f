"""Standard normal numbers by a counter: any of them is known from its seed, step and place, without those before it."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import MissingExtraError

_WORD, _HALF = np.uint64(32), np.uint64(16)  # bits
_LOW, _LOW_HALF = np.uint64(0xFFFFFFFF), np.uint64(0xFFFF)
_MULTIPLIER, _WEYL, _ROUNDS = np.uint64(0xD256D193), np.uint64(0x9E3779B9), 10

#: Numbers that a counter gives.
_OF_COUNTER = 4


@cache
def normal_quantiles() -> NDArray[np.float32]:
    """Give what a number may be: 65,536 equally likely quantiles of the normal distribution, of variance 1 [-]."""
    from scipy.special import ndtri

    found = ndtri((np.arange(65536) + 0.5) / 65536.0)
    return np.asarray(found / np.sqrt(np.mean(found**2)), dtype=np.float32)


def stream_key(seed: int, stream: int) -> np.uint64:
    """Give the key of a stream of numbers.

    Parameters
    ----------
    seed, stream : int
        0 or more; numbers of other seeds and of other streams are independent.
    """
    return np.uint64(np.random.SeedSequence([seed, stream]).generate_state(1, np.uint64)[0])


def philox(first: Any, second: Any, key: Any) -> tuple[Any, Any]:
    """Scramble a counter of two words of 32 bits: Philox-2x32-10 of Salmon et al. (2011, DOI 10.1145/2063384.2063405).

    Parameters
    ----------
    first, second, key : ndarray or number, uint64
        Words below 2^32.
    """
    for _ in range(_ROUNDS):
        product = first * _MULTIPLIER
        first, second = (product >> _WORD) ^ key ^ second, product & _LOW
        key = (key + _WEYL) & _LOW
    return first, second


def normal_numbers(keys: ArrayLike, steps: ArrayLike, width: int) -> NDArray[np.float32]:
    """Draw numbers, shape (width, n) [-].

    Parameters
    ----------
    keys : array_like of uint64, shape (n,)
        From `stream_key`.
    steps : array_like of int, shape (n,)
        From 0; each step has `width` numbers.
    width : int
        How many of a step.
    """
    key, step = np.asarray(keys, dtype=np.uint64), np.asarray(steps, dtype=np.uint64)
    counters = np.arange(-(-width // _OF_COUNTER), dtype=np.uint64)[:, None]
    words = philox(step & _LOW, ((key >> _WORD) + counters) & _LOW, key & _LOW)
    halves = np.stack([half for word in words for half in (word & _LOW_HALF, word >> _HALF)], axis=1)
    places = halves.reshape(_OF_COUNTER * len(counters), -1)[:width].astype(np.intp)
    return normal_quantiles()[places]


@cache
def compiled_filling(dtype: Any) -> Callable[[NDArray[np.uint64], NDArray[np.int64], NDArray[Any]], None]:
    """Compile a function that writes what `normal_numbers` gives: of keys and steps (n,), to an array (width, n).

    Parameters
    ----------
    dtype : numpy.dtype
        Of the array.

    Raises
    ------
    MissingExtraError
        When numba is not installed.
    """
    try:
        import numba
    except ImportError as error:
        advice = 'compiled noise needs numba, which the extra brings: pip install "buildingmpc[fast]"'
        raise MissingExtraError(advice) from error
    scrambled, table, of_counter = numba.njit(philox), normal_quantiles(), _OF_COUNTER
    word, half, low, low_half = _WORD, _HALF, _LOW, _LOW_HALF

    def fill(keys: Any, steps: Any, out: Any) -> None:
        width, n = out.shape
        words = np.empty((2, n), dtype=np.uint64)
        for counter in range(-(-width // of_counter)):
            for k in range(n):
                second = ((keys[k] >> word) + np.uint64(counter)) & low
                words[0, k], words[1, k] = scrambled(np.uint64(steps[k]) & low, second, keys[k] & low)
            for number in range(min(of_counter, width - of_counter * counter)):
                shift = half * np.uint64(number % 2)
                for k in range(n):
                    out[of_counter * counter + number, k] = table[(words[number // 2, k] >> shift) & low_half]

    kind = numba.from_dtype(np.dtype(dtype))
    made: Any = numba.njit(numba.void(numba.uint64[::1], numba.int64[::1], kind[:, ::1]))(fill)
    return made  # type: ignore[no-any-return]
