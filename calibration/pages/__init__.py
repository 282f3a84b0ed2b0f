"""What reports of every package are made of: pages, pictures, and how numbers and times read."""

from mpc.reports.figures.style import (
    CELSIUS,
    INK,
    MEASURED,
    MUTED,
    SIMULATED,
    WARNING,
    Picture,
    day_numbers,
    picture,
    styled,
    time_axis,
)
from mpc.reports.page import clock, counted, duration, render, significant

__all__ = [
    "CELSIUS",
    "INK",
    "MEASURED",
    "MUTED",
    "SIMULATED",
    "WARNING",
    "Picture",
    "clock",
    "counted",
    "day_numbers",
    "duration",
    "picture",
    "render",
    "significant",
    "styled",
    "time_axis",
]
