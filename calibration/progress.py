"""Progress that only moves forward, of work in parts of which it is not known beforehand how many there will be."""

from collections.abc import Callable

#: Called with stage, done, total; done over total never falls.
Progress = Callable[[str, int, int], None]

#: Steps that the whole is counted in.
WHOLE = 1000

#: Iterations that a solve takes about, of those that end by themselves: halfway when as many are done.
USUAL_ITERATIONS = 8


class Forward:
    """Progress of the whole from that of its parts: each takes a share of what is left when it begins.

    Parameters
    ----------
    progress : callable or None
        Told of the whole: stage, done, total.

    Examples
    --------
    >>> told = []
    >>> whole = Forward(lambda stage, done, total: told.append((stage, done / total)))
    >>> whole.part(0.5, "first")("step 1", 1, 2)
    >>> whole.part(0.5)("second", 1, 1)
    >>> told
    [('first, step 1', 0.25), ('second', 0.75)]
    """

    def __init__(self, progress: Progress | None) -> None:
        self._tell = progress
        self._done = self._end = 0.0

    def part(self, share: float, name: str = "") -> Progress:
        """Begin the next part; the one before is over.

        Parameters
        ----------
        share : float
            Of what is left of the whole, 0 to 1 [-].
        name : str
            Stands before what the part says of itself.

        Returns
        -------
        callable
            Told of the part: stage, done, total.
        """
        begin = self._done = max(self._done, self._end)
        self._end = begin + min(1.0, max(0.0, share)) * (1.0 - begin)
        end = self._end

        def told(stage: str, done: int, total: int) -> None:
            within = min(1.0, max(0.0, done / total)) if total > 0 else 0.0
            self._done = max(self._done, begin + (end - begin) * within)
            if self._tell is not None:
                self._tell(", ".join(filter(None, (name, stage))), round(WHOLE * self._done), WHOLE)

        return told

    def say(self, stage: str) -> None:
        """Say what begins, which has no share of its own.

        Parameters
        ----------
        stage : str
            In words.
        """
        if self._tell is not None:
            self._tell(stage, round(WHOLE * max(self._done, self._end)), WHOLE)


def count_iterations(progress: Progress | None) -> Callable[[], None]:
    """Count iterations of which it is not known how many there will be: each takes a share of what is left.

    Parameters
    ----------
    progress : callable or None
        Told ``iteration N``, done, total.

    Returns
    -------
    callable
        To be called once an iteration.
    """
    count = 0

    def one() -> None:
        nonlocal count
        count += 1
        if progress is not None:
            progress(f"iteration {count}", count, count + USUAL_ITERATIONS)

    return one
