"""The structure stays small: no circles of imports, few public names, short signatures, no class without a use."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import pytest

Check = Callable[[list[str]], None]

ROOT = Path(__file__).parents[2]
MOST_NAMES, MOST_NAMES_TOGETHER = 30, 90
MOST_PARAMETERS = 8

# Functions with more parameters than that, with the reason; at most eight.
LONG_SIGNATURES: dict[str, str] = {
    "mpc.loop.subsystem_replay.replay_subsystems": "what no telemetry says of a plant, each known on its own",
    "mpc.loop.simulated.SimulatedPlant.__init__": "every choice of a plant; PlantSettings has those of simulated_plant",
}

# Exceptions that no code of ours catches by name, with the reason.
NOT_CAUGHT: dict[str, str] = {
    "ThermalError": "family: users catch it, and the command tells bad input by it",
    "CalibrationError": "family: users catch it, and the command tells bad input by it",
    "MpcError": "family: users catch it, and the command tells bad input by it",
    "EffectError": "who tries effects on many buildings goes on with the next",
    "PlanError": "of a drawing or a list that others made: an importer of many goes on with the next",
    "MissingExtraError": "an ImportError: who can do without the extra catches it",
    "ResultsExistError": "who runs many studies skips those that are done",
    "ScenarioError": "family of what drives a closed loop",
    "ControlError": "family of control problems",
    "PlantActionError": "who writes a controller sees that its action was refused, and not the plant broken",
    "BoptestTimeoutError": "who drives a remote server asks again",
    "EnergyPlusError": "who runs many cases goes on with the next",
}

# Core dependencies that no module imports, with the reason.
NOT_IMPORTED = {"tzdata": "data of time zones, for zoneinfo"}


def test_imports_make_no_circles(project: Any, expect_none: Check) -> None:
    targets: dict[str, set[str]] = defaultdict(set)
    for name, _, source, imported in project.imports:
        module = next((m for m in (f"{source}.{imported}", source) if m in project.trees), None)
        if module is not None and module != name:
            targets[name].add(module)

    def reached(start: str) -> set[str]:
        found, todo = set[str](), [start]
        while todo:
            fresh = targets[todo.pop()] - found
            found |= fresh
            todo += fresh
        return found

    rings = {frozenset(n for n in near if name in reached(n)) for name in list(targets) if name in (near := reached(name))}
    expect_none([f"{' <-> '.join(sorted(ring))}: import each other; move what both need to a third" for ring in rings])


def test_the_public_face_is_small(project: Any, expect_none: Check) -> None:
    counts = {package: len(module.__all__) for package, module in project.packages.items()}
    problems = [f"{p}/__init__.py:1: hands on {n} names, over {MOST_NAMES}" for p, n in counts.items() if n > MOST_NAMES]
    if sum(counts.values()) > MOST_NAMES_TOGETHER:
        problems.append(f"{counts}: {sum(counts.values())} public names, over {MOST_NAMES_TOGETHER}")
    expect_none(problems)


def test_every_public_name_is_there_and_mpc_loads_when_it_is_used(project: Any) -> None:
    import mpc

    assert len(mpc.__all__) >= 15 and mpc.__all__ == sorted(mpc.__all__)
    for package, module in project.packages.items():
        assert all(hasattr(module, name) for name in module.__all__), package
    with pytest.raises(AttributeError, match="no attribute 'spam'"):
        mpc.spam  # noqa: B018


def signatures(project: Any) -> Iterator[tuple[str, str, int]]:
    """Name, place and number of parameters of every function; options of commands are for the command line."""
    for module, tree in project.trees.items():
        owners = {id(f): c.name for c in ast.walk(tree) if isinstance(c, ast.ClassDef) for f in c.body}
        for node in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)):
            arguments = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
            name = ".".join(filter(None, (module, owners.get(id(node)), node.name)))
            if not module.startswith("mpc.cli."):
                count = sum(a.arg not in ("self", "cls") for a in arguments)
                yield name, project.where(module, node.lineno), count


def test_signatures_are_short(project: Any, expect_none: Check) -> None:
    long = {name: (at, n) for name, at, n in signatures(project) if n > MOST_PARAMETERS}
    problems = [f"{at}: {name} has {n} parameters, over {MOST_PARAMETERS}; make an object of its settings"
                for name, (at, n) in long.items() if name not in LONG_SIGNATURES]  # fmt: skip
    problems += [f"LONG_SIGNATURES: {name} is short now; drop the entry" for name in LONG_SIGNATURES if name not in long]
    expect_none(problems)
    assert len(LONG_SIGNATURES) <= 8


def test_an_exception_class_is_one_that_somebody_catches(project: Any, expect_none: Check) -> None:
    classes, caught = {}, set(NOT_CAUGHT)
    for module, tree in project.trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and any(re.search("(Error|Exception)$", ast.unparse(b)) for b in node.bases):
                classes[node.name] = project.where(module, node.lineno)
        raised = {id(n) for r in ast.walk(tree) if isinstance(r, ast.Raise | ast.ClassDef)
                  for part in ([r.exc] if isinstance(r, ast.Raise) else r.bases) if part for n in ast.walk(part)}  # fmt: skip
        caught |= {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and id(n) not in raised}
    problems = [f"{at}: nobody catches {name}; raise its base, or give a reason in NOT_CAUGHT"
                for name, at in classes.items() if name not in caught]  # fmt: skip
    expect_none(problems + [f"NOT_CAUGHT: there is no {name}" for name in NOT_CAUGHT if name not in classes])


def test_the_core_imports_its_dependencies(project: Any, expect_none: Check) -> None:
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    wanted = [re.match(r"[A-Za-z0-9_.-]+", line)[0].lower() for line in listed]  # type: ignore[index]
    tops = packages_distributions()
    text = "\n".join(path.read_text(encoding="utf-8") for path in project.files.values())
    imported = {source.split(".")[0] for _, _, source, _ in project.imports}
    imported |= set(re.findall(r"import_module\(\"(\w+)", text))
    used = {d.lower().replace("_", "-") for top in imported for d in tops.get(top, ())}
    unused = [name for name in wanted if name not in NOT_IMPORTED and name not in used]
    expect_none([f"pyproject.toml:1: no module imports {name}; drop it from the core" for name in unused])


def test_array_types_have_one_name_and_one_home(project: Any, expect_none: Check) -> None:
    found: dict[str, list[str]] = defaultdict(list)
    for module, tree in project.trees.items():
        for node in tree.body:
            if isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("NDArray["):
                found[ast.unparse(node.targets[0])].append(project.where(module, node.lineno))
    expect_none([f"{', '.join(at)}: each defines {name}; import it" for name, at in found.items() if len(at) > 1])
