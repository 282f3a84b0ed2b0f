"""Spoilt inputs: each is taken or refused by name; and the attack itself can tell the difference."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("fastapi", reason="needs the extra [pages]")
pytest.importorskip("httpx", reason="needs httpx, which the test extra has")


@pytest.fixture(scope="module")
def fuzz(script: Callable[[str], ModuleType]) -> ModuleType:
    script("_table")
    script("_fuzz_inputs")
    script("_fuzz_servers")
    script("_fuzz_controller")
    return script("fuzz")


@pytest.mark.long
def test_a_thousand_inputs_raise_nothing_but_named_errors(fuzz: ModuleType) -> None:
    outcomes = fuzz.attack(1000, first=1_000_000)
    assert sum(o.inputs for o in outcomes.values()) == 1000
    faults = [(name, fault) for name, o in outcomes.items() for fault in o.faults]
    assert not faults, "\n".join(f"{name}: {fault}" for name, fault in faults[:10])
    assert all(o.accepted and o.refused for o in outcomes.values()), outcomes  # neither all nor nothing gets through


def test_what_is_not_spoilt_is_accepted(fuzz: ModuleType, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fuzz._look(fuzz.write_case(tmp_path))
        fuzz._look(fuzz.write_case(tmp_path, fuzz.TABLE))
        fuzz._import(tmp_path, fuzz.telemetry().to_csv().encode(), "export.csv")


def test_an_error_that_is_not_the_librarys_is_a_fault(fuzz: ModuleType) -> None:
    def broken(rng: np.random.Generator, folder: Path) -> None:
        raise KeyError("spam")

    outcome = fuzz.Outcome()
    fuzz._try(broken, 3, 7, outcome)
    (fault,) = outcome.faults
    assert fault["seed"] == [3, 7] and fault["error"] == "KeyError: 'spam'" and "test_fuzz.py" in fault["place"]
    assert outcome.accepted == outcome.refused == 0
