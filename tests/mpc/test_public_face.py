"""The public face: names are there when they are used, and cost nothing before."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

PACKAGES = ("thermal", "calibration", "mpc")


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_a_package_alone_loads_nothing_heavy(package: str) -> None:
    heavy = ("casadi", "scipy", "pandas", "numpy", *(p for p in PACKAGES if p != package))
    code = f"import {package}, sys\nprint([m for m in {heavy!r} if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert answer.stdout.strip() == "[]"


def test_a_name_is_the_one_of_its_module() -> None:
    import mpc
    from mpc.studies.optimal_control import make_controller

    assert mpc.make_controller is make_controller
    assert {"MpcController", "make_controller", "run_closed_loop", "compare_controllers"} <= set(mpc.__all__)


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_is_looked_up_where_it_is_defined(package: str) -> None:
    module = import_module(package)
    assert sorted(module.__all__) == sorted(module._MODULES)
    for name, home in module._MODULES.items():
        value = getattr(module, name)
        assert getattr(value, "__module__", f"{package}.{home}") == f"{package}.{home}", name
    with pytest.raises(AttributeError, match="no_such_name"):
        module.__getattr__("no_such_name")
