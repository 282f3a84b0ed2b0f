"""Packages that lie beside the scripts of the benchmarks."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

SCRIPTS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="session")
def package(script: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    """Load a module of a package that lies beside the scripts, such as `energyplus_trials.plan`."""

    def load(name: str) -> ModuleType:
        script("_sealed")  # the makers seal their labels by it
        top = name.partition(".")[0]
        if top not in sys.modules:
            places = [str(SCRIPTS / top)]
            spec = importlib.util.spec_from_file_location(
                top, SCRIPTS / top / "__init__.py", submodule_search_locations=places
            )
            assert spec is not None and spec.loader is not None
            sys.modules[top] = module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        return importlib.import_module(name)

    return load
