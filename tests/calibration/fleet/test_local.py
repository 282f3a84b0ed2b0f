"""Processes of this machine: they stay, they are alone with their call, and they go."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from typing import Any

import pytest

from calibration.fleet.local import ONE_THREAD, LocalProcesses


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_local_processes(wait_until: Callable[[Callable[[], Any]], Any]) -> None:
    """They stay alive from call to call, have one thread each, survive what calls do, and go when told."""
    pool = LocalProcesses(1)
    first = pool.submit(os.getpid).result()
    assert {pool.submit(os.getenv, name).result() for name in ONE_THREAD} == {"1"}
    assert pool.submit(print, "does not get between the answers").result() is None
    with pytest.raises(ZeroDivisionError):
        pool.submit(divmod, 1, 0).result()
    with pytest.raises(SystemExit):
        pool.submit(sys.exit, 3).result()
    with pytest.raises(TypeError, match="cannot pickle"):
        pool.submit(open, os.devnull).result()
    with pytest.raises(RuntimeError, match="Stranger: of a class that only the worker knows"):
        pool.submit(
            exec, "class Stranger(Exception): ...\nraise Stranger('of a class that only the worker knows')"
        ).result()
    assert pool.submit(os.getpid).result() == first
    with pytest.raises(BrokenExecutor, match=f"worker process {first} left with exit code 7"):
        pool.submit(os._exit, 7).result()
    second = pool.submit(os.getpid).result()
    assert second != first
    sleep = pool.submit(time.sleep, 60.0)
    wait_until(sleep.running)
    pool.shutdown(wait=False, cancel_futures=True)
    assert not is_alive(second)
    with pytest.raises(BrokenExecutor, match="SIGKILL"):
        sleep.result()
