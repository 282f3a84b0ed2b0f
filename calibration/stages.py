"""Stages of long work, whose ends are kept, so that an attempt after one that was killed goes on from there."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Protocol, TypeVar, cast

import casadi as ca

T = TypeVar("T")


class Keeper(Protocol):
    """Where the ends of stages are kept."""

    def read(self, name: str) -> bytes:
        """Read what was kept under a name; any exception says that nothing was."""

    def write(self, name: str, content: bytes) -> None:
        """Keep contents under a name."""


class _Stages:
    """Stages of one piece of work, named by their order and that of those they are part of."""

    def __init__(self, keeper: Keeper, every: float) -> None:
        self.keeper, self.every, self.last = keeper, every, time.monotonic()
        self.begun = [0]  # stages so far, on each level

    def do(self, name: str, work: Callable[[], T]) -> T:
        self.begun[-1] += 1
        path = f"{'.'.join(str(n) for n in self.begun)} {name}"
        with suppress(Exception):  # what is not there, was cut off, or is of another time, is done
            return cast("T", _loaded(self.keeper.read(path)))
        self.begun.append(0)
        try:
            found = work()
        finally:
            self.begun.pop()
        if time.monotonic() - self.last >= self.every:
            with suppress(Exception):  # a full disk costs another attempt time, and this one nothing
                self.keeper.write(path, _dumped(found))
            self.last = time.monotonic()
        return found


#: Not an argument of all that has stages, for it would run through a dozen signatures that do not use it.
_CURRENT: ContextVar[_Stages | None] = ContextVar("stages", default=None)


@contextmanager
def stages_kept(keeper: Keeper, every: float) -> Iterator[None]:
    """Keep the ends of stages of the work inside; what an earlier attempt kept is not done again.

    The work must take the same way each time: its stages are known by their order.

    Parameters
    ----------
    keeper : Keeper
        Where they are kept. It is trusted: they are pickles.
    every : float
        Shortest time between two that are kept [s].
    """
    token = _CURRENT.set(_Stages(keeper, every))
    try:
        yield
    finally:
        _CURRENT.reset(token)


def stage(name: str, work: Callable[[], T]) -> T:
    """Do a stage of long work, or take over its end where an earlier attempt of `stages_kept` had come so far.

    Parameters
    ----------
    name : str
        For people who look at what is kept.
    work : callable
        Does it. What it gives must be all that later stages use of it, as objects that are taken over are copies.
    """
    current = _CURRENT.get()
    return work() if current is None else current.do(name, work)


def _dumped(found: object) -> bytes:
    with ca.global_pickle_context():
        return pickle.dumps(found, pickle.HIGHEST_PROTOCOL)


def _loaded(content: bytes) -> object:
    with ca.global_unpickle_context():
        return pickle.loads(content)
