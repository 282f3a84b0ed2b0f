"""The public face: names are there when they are used, and cost nothing before."""

from __future__ import annotations

import subprocess
import sys


def test_importing_mpc_alone_loads_nothing_heavy() -> None:
    code = "import mpc, sys\nprint([m for m in ('casadi', 'scipy', 'pandas', 'thermal') if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert answer.stdout.strip() == "[]"


def test_a_name_is_the_one_of_its_module() -> None:
    import mpc
    from mpc.studies.controller import make_controller

    assert mpc.make_controller is make_controller
    assert {"MpcController", "make_controller", "run_closed_loop", "compare_controllers"} <= set(mpc.__all__)
