"""The page's modules, tested by node without a browser."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest


@pytest.mark.parametrize("file", sorted(Path(__file__).parent.glob("*.test.mjs")), ids=lambda file: file.stem)
def test_the_pages_modules(file: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs node: run tests/browser/install.sh")
    done = subprocess.run([node, "--test", str(file)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
