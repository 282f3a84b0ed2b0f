"""Whatever a user can reach is documented, with units, and refuses a keyword that it does not know."""

from __future__ import annotations

import doctest
import inspect
import re
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cached_property
from typing import Any

import pytest

Check = Callable[[list[str]], None]

# A bracket with a unit in it, such as [K], [W/m2/K], [-]; not an interval such as [0, 1], not the index of a type.
UNIT = re.compile(r"(?<!\w)\[([^,\]]*[^,\]\d\s.][^,\]]*)\]")
NUMERIC = re.compile(r"\b(float\d*|floating|FloatArray|ArrayLike)\b")
PARAMETERS = re.compile(r"^Parameters\n-+\n(.*?)(?=^\S[^\n]*\n-{3,}$|\Z)", re.MULTILINE | re.DOTALL)

# Public callables that take any keyword, with the reason.
ANY_KEYWORD: dict[str, str] = {
    "thermal.system.system.HvacSystem.actions": "points of its components; an unknown one is refused with the nearest",
    "thermal.system.system.HvacSystem.having": "names of its components; connections refuse others",
    "thermal.system.system.HvacSystem.with_component": "ports of the component; connections refuse others",
    "thermal.system.system.HvacSystem.start": "states of its components; an unknown one is refused with the nearest",
    "mpc.environment.office.office_vector_environment": "options of office_environment, which refuses others",
    "thermal.system.plant.HvacPlant.start": "states of its components; an unknown one is refused with the nearest",
    **{
        f"thermal.components.{name}.sized": "refuses all: the class has no `sized` of its own"
        for name in (
            "air_handler.AirHandler",
            "cooling_coil.CoolingCoil",
            "fan.Fan",
            "heater.Heater",
            "machine_map.Defrost",
            "machine_map.MachineMap",
            "pump.Pump",
            "thermostat.Thermostat",
            "water_loop.WaterLoop",
            "zone_units.ZoneUnits",
        )
    },
}


def docstring(p: Any) -> str:
    """Docstring of a name: a class's own, not that of its base or the signature that a dataclass puts there."""
    if inspect.isclass(p.value):
        own = vars(p.value).get("__doc__") or ""
        return "" if own.startswith(f"{p.value.__name__}(") else own
    return inspect.getdoc(p.function or p.value) or ""


def documented(doc: str) -> dict[str, tuple[str, str]]:
    """Type and text of each parameter in a numpydoc docstring."""
    section = PARAMETERS.search(inspect.cleandoc(doc) + "\n")
    entries: dict[str, tuple[str, str]] = {}
    names: list[str] = []
    for line in section[1].splitlines() if section else []:
        if line and not line[0].isspace():
            header, _, kind = line.partition(" : ")
            names = [name.strip().lstrip("*") for name in header.split(",")]
            entries |= dict.fromkeys(names, (kind, ""))
        else:
            entries |= {name: (entries[name][0], f"{entries[name][1]} {line.strip()}") for name in names}
    return entries


def inherited(p: Any) -> dict[str, tuple[str, str]]:
    """What the bases of a dataclass document: its own docstring need not repeat them."""
    bases = p.value.__mro__[:0:-1] if inspect.isclass(p.value) and is_dataclass(p.value) else ()
    return {name: entry for base in bases for name, entry in documented(base.__doc__ or "").items()}


def is_numeric(annotation: Any, kind: str) -> bool:
    """Whether a parameter is a physical number: its annotation or its documented type names floats."""
    text = (annotation if isinstance(annotation, str) else repr(annotation)).removeprefix("collections.abc.")
    return not text.startswith(("Callable", "type[")) and bool(NUMERIC.search(text) or re.search(r"\bfloat\b", kind))


def test_every_module_can_be_imported(project: Any, expect_none: Check) -> None:
    expect_none(project.broken)


def test_every_package_says_what_it_hands_on(project: Any, expect_none: Check) -> None:
    problems = []
    for name, module in project.packages.items():
        listed = getattr(module, "__all__", None)
        if listed is None:
            problems.append(f"{project.where(name)}: {name} has no __all__; list what it hands on ([] when nothing)")
        for missing in [n for n in listed or () if not hasattr(module, n)]:
            problems.append(f"{project.where(name)}: __all__ lists {missing!r}, which {name} does not have; import it")
    expect_none(problems)


def test_every_public_name_has_a_docstring(project: Any, expect_none: Check) -> None:
    problems = []
    for p in project.public:
        if inspect.isclass(p.value) or p.function or isinstance(p.value, property | cached_property):
            if not docstring(p):
                problems.append(f"{p.where}: {p.name} has no docstring; say in one sentence what it is")
        else:
            at, explained = project.definition(p.name.rpartition(".")[2])
            if not explained:
                problems.append(f"{at}: {p.name} is not explained; write '#: what it is [unit]' above it")
    expect_none(problems)


def test_every_parameter_is_documented_with_its_unit(project: Any, expect_none: Check) -> None:
    problems = []
    for p in (p for p in project.public if p.parameters is not None):
        at, own = f"{p.where}: {p.name}", documented(docstring(p))
        entries = inherited(p) | own
        for name, parameter in p.parameters.items():
            if name not in entries:
                problems.append(f"{at}: parameter {name!r} is not documented; add it under Parameters")
            elif is_numeric(parameter.annotation, entries[name][0]) and not UNIT.search(" ".join(entries[name])):
                problems.append(f"{at}: parameter {name!r} has no unit; write it in brackets, such as [K] or [-]")
        for name in sorted(set(own) - set(p.parameters)):
            problems.append(f"{at}: documents {name!r}, which is no parameter; rename or drop it")
    expect_none(problems)


def test_an_unknown_keyword_is_refused(project: Any, expect_none: Check) -> None:
    problems = []
    for p in (p for p in project.public if p.parameters is not None and p.name not in ANY_KEYWORD):
        if any(x.kind is x.VAR_KEYWORD for x in p.parameters.values()):
            problems.append(f"{p.where}: {p.name} takes any keyword; name its options, or give a reason in ANY_KEYWORD")
        elif inspect.isclass(p.value) or "." not in p.function.__qualname__:
            try:
                p.value(spam=1)
            except (TypeError, ValueError) as error:  # pydantic's models raise a ValueError
                if "spam" in str(error):
                    continue
            problems.append(f"{p.where}: {p.name}(spam=1) does not fail on its unknown keyword; refuse it by name")
    expect_none(problems)


@pytest.mark.long
def test_examples_in_docstrings_run(project: Any, expect_none: Check) -> None:
    problems = []
    for name, module in project.modules.items():
        failed, tried = doctest.testmod(module)
        if failed:
            problems.append(f"{project.where(name)}: {failed} of {tried} examples fail, see the captured output")
    expect_none(problems)
