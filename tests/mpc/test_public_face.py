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
    from mpc.studies.optimal_control import make_controller

    assert mpc.make_controller is make_controller
    assert {"MpcController", "make_controller", "run_closed_loop", "compare_controllers"} <= set(mpc.__all__)


def test_every_name_is_looked_up_where_it_is_defined() -> None:
    import mpc

    assert sorted(mpc.__all__) == sorted(mpc._MODULES)
    for name, module in mpc._MODULES.items():
        assert getattr(mpc, name).__module__ == f"mpc.{module}", name
