"""Parameters: ranges, scales, priors."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pint
import pytest

from thermal.parameters import ENVELOPE_PARAMETERS, PARAMETERS, Parameter, Scope

UNITS = pint.UnitRegistry()


@pytest.mark.parametrize("name", PARAMETERS)
def test_estimation_scale_is_invertible_and_its_slope_a_derivative(name: str) -> None:
    p = PARAMETERS[name]
    for value in (p.lower, p.start, p.upper):
        z = p.transform(value)
        assert p.inverse(z) == pytest.approx(value, rel=1e-13)
        step = 1e-6
        difference = (p.inverse(z + step) - p.inverse(z - step)) / (2 * step)
        assert p.slope(value) == pytest.approx(difference, rel=1e-8)


@pytest.mark.parametrize("name", PARAMETERS)
def test_parameter_has_a_unit_a_range_and_a_source(name: str) -> None:
    p = PARAMETERS[name]
    assert p.name == name
    UNITS.parse_units(p.unit)
    assert len(p.source) > 5
    if p.scale == "linear":  # what may be absent or of either sign
        assert p.lower <= p.start < p.upper
        assert p.prior_deviation == max(p.start - p.lower, p.upper - p.start) / 2.0
        return
    assert 0 < p.lower < p.start < p.upper
    assert p.scale != "logit" or p.upper < 1
    # the range is the 95 % interval of the prior: four deviations on the estimation scale
    assert p.transform(p.upper) - p.transform(p.lower) == pytest.approx(4 * p.prior_deviation, rel=1e-13)


def test_prior_of_a_known_range() -> None:
    p = Parameter("film", "W/m^2/K", 2.0, 1.0, np.e**4, "made up")
    assert p.prior_deviation == pytest.approx(1.0)
    assert p.transform(1.0) == pytest.approx(0.0)
    q = Parameter("share", "1", 0.4, 0.25, 0.5, "made up", scale="logit")
    assert q.transform(0.25) == pytest.approx(-np.log(3.0))
    assert q.slope(0.25) == pytest.approx(0.1875)


def test_rescaled_range_keeps_the_prior() -> None:
    p = PARAMETERS["exterior_wall_conductivity"]
    half = p.rescaled(0.5)
    assert (half.start, half.lower, half.upper) == (0.5 * p.start, 0.5 * p.lower, 0.5 * p.upper)
    assert half.prior_deviation == pytest.approx(p.prior_deviation, rel=1e-13)
    assert half.name == p.name


def test_parameters_of_a_facade_and_of_a_zone_keep_base_and_prior() -> None:
    p = PARAMETERS["window_u_value"]
    south, zone = p.of("facade", "south"), p.of("zone", "room@2")
    assert (south.name, south.base, south.scope, south.member) == (
        "window_u_value@facade:south", "window_u_value", "facade", "south"
    )  # fmt: skip
    assert (zone.name, zone.base, zone.scope, zone.member) == (
        "window_u_value@room@2", "window_u_value", "zone", "room@2"
    )  # fmt: skip
    assert (p.base, p.scope, p.member) == (p.name, "global", None)
    for own in (south, zone):
        assert (own.start, own.lower, own.upper, own.unit, own.source) == (p.start, p.lower, p.upper, p.unit, p.source)


@pytest.mark.parametrize(("scope", "member"), [("global", "south"), ("facade", None), ("zone", None)])
def test_scope_and_member_that_contradict_each_other_are_refused(scope: Scope, member: str | None) -> None:
    with pytest.raises(ValueError, match=f"film: expected a member .* got scope '{scope}' with member {member!r}"):
        Parameter("film", "W/m^2/K", 2.0, 1.0, 4.0, "made up", scope=scope, member=member)


def test_envelope_parameters_are_parameters() -> None:
    assert set(ENVELOPE_PARAMETERS) < set(PARAMETERS)
    page = (Path(__file__).parents[2] / "docs" / "nomenclature.md").read_text(encoding="utf-8")
    (row,) = [line for line in page.splitlines() if line.startswith("| `facade` |")]
    assert re.findall(r"`(\w+)`", row.split("|")[4]) == list(ENVELOPE_PARAMETERS)


@pytest.mark.parametrize(
    ("start", "lower", "upper"), [(1.0, 0.0, 2.0), (3.0, 1.0, 2.0), (1.0, 1.0, 2.0), (0.5, -1.0, 2.0)]
)
def test_start_outside_of_the_range_is_refused(start: float, lower: float, upper: float) -> None:
    with pytest.raises(ValueError, match="film"):
        Parameter("film", "W/m^2/K", start, lower, upper, "made up")


def test_nomenclature_lists_every_parameter_with_its_unit() -> None:
    page = (Path(__file__).parents[2] / "docs" / "nomenclature.md").read_text(encoding="utf-8")
    rows = {
        cells[1].strip("` "): cells[3].strip("` ") for line in page.splitlines() if len(cells := line.split("|")) > 4
    }
    for name, p in PARAMETERS.items():
        assert rows.get(name) == p.unit, name


def test_a_strength_may_be_absent_or_of_either_sign() -> None:
    p = Parameter("bias", "K", 0.0, -1.5, 1.5, "made up", "linear", "sensor_bias")
    assert (p.transform(-0.3), p.inverse(-0.3), p.slope(-0.3)) == (-0.3, -0.3, 1.0)
    assert p.prior_deviation == 0.75  # the range is its 95 % interval
    half = Parameter("rate", "1/h", 0.0, 0.0, 1.0, "made up", "linear", "infiltration")
    assert half.prior_deviation == 0.5  # of the half of a normal distribution


def test_order_of_a_range() -> None:
    with pytest.raises(ValueError, match="expected lower <= start <= upper"):
        Parameter("bias", "K", 2.0, -1.5, 1.5, "made up", "linear")
    with pytest.raises(ValueError, match="expected 0 < lower < start < upper"):
        Parameter("bias", "K", 0.0, 0.0, 1.5, "made up")
