"""What stays the same from step to step as long as its arguments do."""

from collections.abc import Callable
from typing import Any


class LastValue:
    """A function of floats that is worked out anew only when an argument has changed.

    Setpoints are held for many steps: what follows from them alone is not computed at each. One value is kept, with its
    arguments in one assignment, so that threads never see one without the other.

    Parameters
    ----------
    make : callable
        The function; a bound method, so that devices that have it can be pickled.

    Examples
    --------
    >>> square = LastValue(lambda x: x * x)
    >>> square(3.0), square(3.0), square(4.0)
    (9.0, 9.0, 16.0)
    """

    def __init__(self, make: Callable[..., Any]) -> None:
        self._make = make
        self._last: tuple[tuple[float, ...] | None, Any] = (None, None)

    def __call__(self, *arguments: float) -> Any:
        """Give the value at floats [any]."""
        last = self._last
        if last[0] != arguments:
            self._last = last = (arguments, self._make(*arguments))
        return last[1]
