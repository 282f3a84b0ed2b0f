"""Inch-pound units: hand-worked numbers, columns and rows of tables, and what stays as it is."""

from __future__ import annotations

import pytest

from mpc.reports.units import (
    converted_number,
    converted_page,
    converted_row,
    converted_text,
)
from thermal.display_units import inch_pound


@pytest.mark.parametrize(
    ("unit", "value", "expected"),
    [
        ("K", 1.0, 1.8), ("°C", 20.0, 68.0), ("°C", -40.0, -40.0), ("W", 1.0, 3.412142), ("m²", 1.0, 10.763910),
        ("m³", 1.0, 35.314667), ("m/s", 1.0, 2.236936), ("m³/s", 1.0, 2118.880), ("kg/s", 1.0, 132.27736),
        ("Pa", 248.84, 1.0), ("W/m²/K", 5.678263, 1.0), ("J/kg/K", 4186.8, 1.0), ("W/m/K", 1.730735, 1.0),
        ("kWh/m²", 10.763910, 1.0), ("K h", 1.0, 1.8),
    ],
)  # fmt: skip
def test_factors_are_those_of_handbooks(unit: str, value: float, expected: float) -> None:
    line = inch_pound(unit)
    assert line is not None and line(value) == pytest.approx(expected, rel=2e-6, abs=1e-9)


def test_what_is_no_unit_of_ours_stays() -> None:
    assert inch_pound("kWh") is None and inch_pound("%") is None
    for text in ("96 % of 12 kWh at 0.16 USD", "zone 5 Kitchen", "2023-10-16 21:00", "10 min, 5 minutes", "F1_W", "3 Km"):
        assert converted_text(text) == text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.46 K", "0.83 °F"), ("0.053 K", "0.095 °F"), ("−88 W", "−300 Btu/h"), ("± 0.25 K", "± 0.45 °F"),
        ("±0.25 K", "±0.45 °F"), ("21 to 24 °C", "70 to 75 °F"), ("0.46 degrees C", "0.83 degrees F"),
        ("1 200 W", "4 100 Btu/h"), ("0.00 K", "0 °F"), ("+0.120 K", "+0.216 °F"), ("2 K h", "3.6 °F h"),
        ("from 0.46 to 0.32 K in 384 m².", "from 0.83 to 0.58 °F in 4 130 ft²."), ("error [K]", "error [°F]"),
    ],
)  # fmt: skip
def test_sentences(text: str, expected: str) -> None:
    assert converted_text(text) == expected


def test_a_number_keeps_its_significant_digits() -> None:
    line = inch_pound("J/m²/K")
    assert line is not None
    assert converted_number("360 000", line) == "18" and converted_number("3.604e+05", line) == "1.763e+01"
    degrees = inch_pound("°C")
    assert degrees is not None and converted_number("−17.9", degrees) == "−0.2"
    assert converted_number("±1.0", degrees) == "±1.8" and converted_number("21", degrees) == "70"


def test_columns_go_by_their_heads() -> None:
    titles = ["controller", "discomfort [K h]", "saved [%]", "lasts"]
    assert converted_row(titles, ["rule 2", "1.33", "12", "3 days"]) == ["rule 2", "2.39", "12", "3 days"]
    assert converted_row(titles, ["a", "–", "–", "0.5 K"]) == ["a", "–", "–", "0.90 °F"]


def test_rows_go_by_their_unit() -> None:
    titles = ["point", "unit", "lowest", "90 % interval", "usable [%]", "told"]
    row = ["2", "degC", "20.0", "10 to 30", "99.0", "yes"]
    assert converted_row(titles, row) == ["2", "°F", "68.0", "50 to 86", "99.0", "yes"]
    assert converted_row(titles, ["n", "%", "20", "–", "99.0", "no"]) == ["n", "%", "20", "–", "99.0", "no"]


def test_pages_by_head_by_unit_cell_and_in_text() -> None:
    page = (
        "<p>It is 0.5 K &amp; more, see <code>0.5 K</code>.</p><table><thead><tr><th>zone</th><th>MAE [K]</th>"
        '<th>usable [%]</th></tr></thead><tbody><tr><td class="name">1 W</td><td class="n">0.50</td>'
        '<td class="n">99</td></tr></tbody></table>'
        '<table><thead><tr><th>parameter</th><th>unit</th><th>value</th><th>usable [%]</th></tr></thead><tbody><tr>'
        '<td class="name">U</td><td class="unit">W/m²/K</td><td class="n">0.50 to 2.0</td><td class="n">99</td>'
        '</tr></tbody></table><img alt="0.5 K"><script>"0.5 K"</script>'
    )
    found = converted_page(page)
    assert "It is 0.90 °F &amp; more, see <code>0.5 K</code>" in found and '<script>"0.5 K"</script>' in found
    assert '<th>MAE [°F]</th><th>usable [%]</th>' in found and '<td class="n">0.90</td><td class="n">99</td>' in found
    assert '<td class="unit">Btu/h/ft²/°F</td><td class="n">0.088 to 0.35</td><td class="n">99</td>' in found
    assert 'alt="0.90 °F"' in found
