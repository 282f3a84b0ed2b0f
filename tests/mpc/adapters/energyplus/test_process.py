"""The process of a run: it leaves with its parent, and says what went wrong."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from mpc.errors import EnergyPlusError

pytestmark = pytest.mark.energyplus
ABANDON = """
import os
from mpc.adapters.energyplus.input import CHICAGO, weather_path
from mpc.adapters.energyplus.process import EnergyPlusProcess, Job
process = EnergyPlusProcess(Job("Version,25.2;", "in.idf", weather_path(CHICAGO)))
print(process.folder, flush=True)
os._exit(9)  # as a parent that is killed: nothing is tidied up
"""


def test_a_parent_that_dies_leaves_neither_process_nor_folder():
    done = subprocess.run([sys.executable, "-c", ABANDON], capture_output=True, text=True)
    assert done.returncode == 9, done.stderr
    folder = Path(done.stdout.strip())
    deadline = time.monotonic() + 120.0
    while folder.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not folder.exists()


def test_a_broken_input_is_a_named_error_with_energyplus_own_words():
    from mpc.adapters.energyplus.input import CHICAGO, weather_path
    from mpc.adapters.energyplus.process import Job, run_energyplus

    job = Job("Version,25.2;\nZone,;\nNothing,1;\n", "in.idf", weather_path(CHICAGO), stepped=False)
    with pytest.raises(EnergyPlusError, match="Severe"):
        run_energyplus(job, [])


@pytest.mark.parametrize(
    ("said", "fine"),
    [
        ("EnergyPlus Completed Successfully-- 3 Warning; 0 Severe Errors; Elapsed Time=00hr 00min 1.00sec", True),
        ("EnergyPlus Completed Successfully-- 3 Warning; 2 Severe Errors; Elapsed Time=00hr 00min 1.00sec", False),
        ("EnergyPlus Terminated--Fatal Error Detected. 1 Warning; 1 Severe Errors; Elapsed Time=00hr", False),
        ("", False),
        (None, False),
    ],
)
def test_the_end_file_tells_whether_it_ended_well(said, fine, tmp_path):
    from mpc.adapters.energyplus.process import EnergyPlusProcess

    if said is not None:
        (tmp_path / "eplusout.end").write_text(said)
    failures = []
    EnergyPlusProcess.check(SimpleNamespace(output=tmp_path, _fail=failures.append))
    assert failures == ([] if fine else ["no end file" if said is None else said])
