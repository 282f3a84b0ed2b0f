"""Errors of the air shuffle."""

from thermal.errors import ThermalError


class ShuffleError(ThermalError):
    """Base of the errors of the air shuffle."""


class ShuffleParameterError(ShuffleError):
    """A probability, reach, step, extent or capacity outside its range."""


class ShuffleCellError(ShuffleError):
    """Cells of a zone that do not exist, belong to two zones, have no position, or arrays that do not match them."""


class ShuffleStateError(ShuffleError):
    """A saved state that the random generator cannot take."""
