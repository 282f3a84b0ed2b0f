"""Elementary functions in single precision are right to two units in the last place."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from thermal.batch.elementary import elementary, split_exponent

ENDS = np.array([0.0, 1.0, -1.0, 1e-3, np.inf, -np.inf, np.nan], dtype=np.float32)


def of_all(name: str, values: np.ndarray, *others: float) -> np.ndarray:
    """Carry a function out, compiled."""
    function, given = elementary()[name], tuple(np.float32(v) for v in others)
    return np.array([function(v, *given) for v in values.astype(np.float32)], dtype=np.float32)


def check(found: np.ndarray, exact: np.ndarray) -> None:
    unit = np.spacing(np.abs(exact).astype(np.float32)).astype(float)
    assert (np.abs(found - exact) / unit).max() < 2.2


@pytest.fixture(autouse=True)
def _numba() -> None:
    pytest.importorskip("numba", reason="needs the extra [fast]")


@pytest.mark.parametrize(
    ("name", "exact", "logarithms"),
    [("exp", np.exp, (-6.0, 1.9)), ("expm1", np.expm1, (-8.0, 1.9)), ("arctan", np.arctan, (-6.0, 5.0)), ("log", np.log, (-30.0, 30.0))],
)
def test_functions(name: str, exact: Any, logarithms: tuple[float, float]) -> None:
    sizes = (10.0 ** np.random.default_rng(0).uniform(*logarithms, 300)).astype(np.float32)
    values = sizes if name == "log" else np.concatenate([sizes, -sizes])
    check(of_all(name, values), exact(values.astype(float)))
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(of_all(name, ENDS), exact(ENDS.astype(float)), rtol=3e-7, atol=1e-38)


@pytest.mark.parametrize("exponent", [-0.8, 0.22, 1.3, -3.7])
def test_powers(exponent: float) -> None:
    values = (10.0 ** np.random.default_rng(0).uniform(-8.0, 8.0, 300)).astype(np.float32)
    ends = (0.0, np.inf) if exponent > 0.0 else (np.inf, 0.0)
    given = (*split_exponent(exponent), *ends)
    check(of_all("power", values, *given), np.power(values.astype(float), exponent))
    with np.errstate(all="ignore"):
        exact = np.power(ENDS.astype(float), exponent)
        exact[5] = np.nan  # of minus infinity
        np.testing.assert_allclose(of_all("power", ENDS, *given), exact, rtol=3e-7)
