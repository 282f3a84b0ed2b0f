"""Means over steps: against quadrature, and means that are kept whatever the steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mpc.scenario.weather import means_by_shape, means_of_means, means_of_readings

VALUES = arrays(float, 12, elements=st.floats(0.0, 1000.0).map(lambda value: round(value, 6)))


@given(values=VALUES, width=st.floats(0.1, 3.0))
@settings(max_examples=40, deadline=None)
def test_readings_by_quadrature(values: np.ndarray, width: float) -> None:
    times = np.arange(12.0)
    edges = np.arange(0.0, 11.0, width)
    fine = np.linspace(edges[:-1], edges[1:], 2001)
    expected = np.trapezoid(np.interp(fine, times, values), fine, axis=0) / np.diff(edges)
    assert means_of_readings(times, values, edges) == pytest.approx(expected, abs=1e-2 + 1e-6 * values.max())


def test_readings_at_the_middle_of_steps_within_an_interval() -> None:
    edges = np.linspace(0.0, 3600.0, 13)
    found = means_of_readings(np.array([0.0, 3600.0]), np.array([10.0, 22.0]), edges)
    assert found == pytest.approx(10.0 + 12.0 * (np.arange(12) + 0.5) / 12.0)


@given(values=VALUES, per=st.integers(1, 15))
@settings(max_examples=60, deadline=None)
def test_means_are_kept_and_nothing_turns_negative(values: np.ndarray, per: int) -> None:
    source = 3600.0 * np.arange(13.0)
    fine = means_of_means(source, values, np.linspace(0.0, source[-1], 12 * per + 1))
    assert fine.reshape(12, per).mean(axis=1) == pytest.approx(values, abs=1e-8)
    assert fine.min() >= -1e-8
    if per == 1:
        assert np.array_equal(fine, values)


def test_coarser_steps_have_the_mean_of_the_intervals() -> None:
    values = np.array([1.0, 3.0, 5.0, 11.0])
    assert means_of_means(np.arange(5.0), values, np.array([0.0, 2.0, 4.0])) == pytest.approx([2.0, 8.0])


def test_a_straight_line_stays_straight() -> None:
    source = np.arange(11.0)
    fine = means_of_means(source, source[:-1] + 300.5, np.linspace(2.0, 8.0, 61))
    assert fine == pytest.approx(np.linspace(2.0, 8.0, 61)[:-1] + 300.05, abs=2e-3)  # slopes by harmonic means


@given(values=VALUES, shape=arrays(float, 48, elements=st.one_of(st.just(0.0), st.floats(0.01, 1.0))))
@settings(max_examples=60, deadline=None)
def test_a_shape_keeps_the_means(values: np.ndarray, shape: np.ndarray) -> None:
    fine = means_by_shape(np.arange(13.0), values, np.arange(0.0, 12.25, 0.25), shape)
    assert fine.reshape(12, 4).mean(axis=1) == pytest.approx(values, abs=1e-8)
    dark = shape.reshape(12, 4).sum(axis=1) == 0.0
    assert np.array_equal(fine.reshape(12, 4)[dark], np.repeat(values[dark, None], 4, axis=1))
