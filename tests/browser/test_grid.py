"""The page's model of plans, tested by node without a browser."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest


def test_the_pages_model_of_plans() -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs node: run tests/browser/install.sh")
    file = Path(__file__).parent / "grid.test.mjs"
    done = subprocess.run([node, "--test", str(file)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
