"""One thread for linear algebra, so that a benchmark measures one core."""

from __future__ import annotations

import os
import sys


def use_one_thread() -> None:
    """Start again with one thread for linear algebra, which must be known before NumPy is loaded."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        os.environ["OMP_NUM_THREADS"] = "1"
        os.execv(sys.executable, sys.orig_argv)
