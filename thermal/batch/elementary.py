"""Elementary functions in single precision, to within two units in the last place, that compilers turn into vectors.

A compiler calls the system's functions number by number, and NumPy's are calls of their own. Here they are arithmetic:
arguments are brought into a short interval by exact steps, where the polynomials of Moshier's Cephes library
(*Methods and Programs for Mathematical Functions*, 1989) hold. Results below 1e-38 are rounded to what is there.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

#: Exponents of a power are split after so many binary digits: the first part times that of a number is exact.
_SPLIT = 2048.0


def split_exponent(exponent: float) -> tuple[float, float]:
    """Split an exponent into a part of few digits and the rest.

    Parameters
    ----------
    exponent : float
        Of a power [-].
    """
    first = round(exponent * _SPLIT) / _SPLIT
    return first, exponent - first


@cache
def elementary() -> Mapping[str, Callable[..., Any]]:
    """Make the functions by name, for numba: ``exp``, ``expm1``, ``log``, ``arctan``, and ``power``.

    A power takes its exponent in the two parts of `split_exponent`, and its value at zero and at infinity.
    """
    import numba
    from llvmlite import ir
    from numba import extending

    intrinsic: Any = extending.intrinsic

    number, whole, real = np.float32, ir.IntType(32), ir.FloatType()
    single = numba.types.float32
    half_root = 0x3F3504F3  # bits of the root of a half, from which the fraction of a number is counted

    @intrinsic
    def two_to(_: Any, power: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            biased = builder.add(builder.fptosi(given[0], whole), whole(127))
            return builder.bitcast(builder.shl(biased, whole(23)), real)

        return single(single), code

    @intrinsic
    def binary_exponent(_: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            counted = builder.sub(builder.bitcast(given[0], whole), whole(half_root))
            return builder.sitofp(builder.ashr(counted, whole(23)), real)

        return single(single), code

    @intrinsic
    def fraction(_: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            counted = builder.sub(builder.bitcast(given[0], whole), whole(half_root))
            kept = builder.and_(counted, whole(0x007FFFFF))
            return builder.bitcast(builder.add(kept, whole(half_root)), real)

        return single(single), code

    zero, half, one = number(0.0), number(0.5), number(1.0)
    infinity, nothing = number(np.inf), number(np.nan)
    log2_e, ln_2 = number(1.4426950408889634), number(0.6931471805599453)
    ln_2_first, ln_2_rest = number(0.693359375), number(-2.12194440e-4)
    e5, e4, e3, e2, e1, e0 = (number(v) for v in (
        1.9875691500e-4, 1.3981999507e-3, 8.3334519073e-3, 4.1665795894e-2, 1.6666665459e-1,
        5.0000001201e-1))  # fmt: skip
    l8, l7, l6, l5, l4, l3, l2, l1, l0 = (number(v) for v in (
        7.0376836292e-2, -1.1514610310e-1, 1.1676998740e-1, -1.2420140846e-1, 1.4249322787e-1, -1.6668057665e-1,
        2.0000714765e-1, -2.4999993993e-1, 3.3333331174e-1))  # fmt: skip
    a3, a2, a1, a0 = (number(v) for v in (8.05374449538e-2, -1.38776856032e-1, 1.99777106478e-1, -3.33329491539e-1))
    steep, flat = number(2.414213562373095), number(0.4142135623730950)
    right, diagonal = number(np.pi / 2.0), number(np.pi / 4.0)
    lowest, highest, largest = number(-88.0), number(89.0), number(254.0)

    @numba.njit(error_model="numpy")
    def rise(r: Any) -> Any:
        """e^r - 1 of a small number."""
        p = ((((e5 * r + e4) * r + e3) * r + e2) * r + e1) * r + e0
        return p * (r * r) + r

    @numba.njit(error_model="numpy")
    def reduced(x: Any) -> Any:
        n = np.rint(x * log2_e)
        return n, (x - n * ln_2_first) - n * ln_2_rest

    @numba.njit(error_model="numpy")
    def between(x: Any, low: Any, high: Any) -> Any:
        y = x if x < high else high
        return y if y > low else low

    @numba.njit(error_model="numpy")
    def exp(x: Any) -> Any:
        n, r = reduced(between(x, lowest, highest))
        h = np.rint(n * half)  # in two steps, as 2^n alone may be too large
        y = (rise(r) + one) * two_to(h) * two_to(n - h)
        return y if x == x else x

    @numba.njit(error_model="numpy")
    def expm1(x: Any) -> Any:
        n, r = reduced(between(x, lowest, highest))
        h = np.rint(n * half)
        s = two_to(h)
        y = (rise(r) * s + (s - two_to(h - n))) * two_to(n - h)
        return y if x == x else x

    @numba.njit(error_model="numpy")
    def log_of_fraction(m: Any) -> Any:
        x = m - one
        z = x * x
        y = (((((((l8 * x + l7) * x + l6) * x + l5) * x + l4) * x + l3) * x + l2) * x + l1) * x + l0
        return x, x * z * y - half * z

    @numba.njit(error_model="numpy")
    def log(x: Any) -> Any:
        n = binary_exponent(x)
        a, b = log_of_fraction(fraction(x))
        y = (b + n * ln_2_rest) + a + n * ln_2_first
        y = y if x > zero else nothing
        y = -infinity if x == zero else y
        return x if x == infinity else y

    @numba.njit(error_model="numpy")
    def power(x: Any, first: Any, rest: Any, at_zero: Any, at_infinity: Any) -> Any:
        n = binary_exponent(x)
        a, b = log_of_fraction(fraction(x))
        exact = n * first
        k = np.rint(exact)
        j, r = reduced(((exact - k) + n * rest) * ln_2 + (first + rest) * (a + b))
        k = between(k + j, -largest, largest)
        h = np.rint(k * half)
        y = (rise(r) + one) * two_to(h) * two_to(k - h)
        y = y if x > zero else nothing
        y = at_zero if x == zero else y
        return at_infinity if x == infinity else y

    @numba.njit(error_model="numpy")
    def arctan(x: Any) -> Any:
        a = abs(x)
        above = a - one if a > flat else a
        below = a + one if a > flat else one
        begin = diagonal if a > flat else zero
        above = -one if a > steep else above
        below = a if a > steep else below
        begin = right if a > steep else begin
        q = above / below
        z = q * q
        y = begin + ((((a3 * z + a2) * z + a1) * z + a0) * z * q + q)
        return -y if x < zero else y

    return {"exp": exp, "expm1": expm1, "log": log, "arctan": arctan, "power": power}
