"""Errors of the generator of pilot cases."""

from __future__ import annotations

from thermal.errors import ThermalError


class LayoutError(ThermalError):
    """No office plan exists with the area, the zones and the cells that were asked for."""


class ClosedLoopError(ThermalError):
    """Plant, plan and weather of a closed loop do not fit each other."""


class TwinError(ThermalError):
    """No twin can be drawn from what was asked for."""
